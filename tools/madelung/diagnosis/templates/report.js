"use strict";
// Draws the figures that the page holds packed; links the zoom of time and loops.
(() => {
  const CONFIG = { displaylogo: false, modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
  const PRINTED = { whole: 690, half: 340, height: 470 }; // px that A4 leaves
  const POINTS = 4000; // of a line: more than a screen has columns
  const LINKS = [["yaxis", "yaxis"], ["yaxis2", "yaxis2"], ["yaxis3", "xaxis"]]; // time, loops
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const find = (id) => document.getElementById(id);
  let page, records, shown, printing = false, linking = false;

  const bytes = (text) => {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out;
  };
  const unpack = (id) => {
    const packed = new Blob([bytes(find(id).textContent)]).stream();
    return new Response(packed.pipeThrough(new DecompressionStream("gzip"))).text();
  };

  // A record's channels, and the rows whose time lies within the zoomed part.
  const channels = (record) => {
    const ints = new Int32Array(bytes(record.row).buffer);
    const reals = (name) => new Float32Array(bytes(record[name]).buffer);
    const [y, baseline, augmented] = ["y", "baseline", "augmented"].map(reals);
    return {
      u: reals("u"), y, baseline, augmented,
      t: Float64Array.from(ints, (row) => record.start_s + row * record.step_s),
      before: y.map((v, i) => v - baseline[i]),
      after: y.map((v, i) => v - augmented[i]),
    };
  };
  const within = (t, range) => {
    if (!range) return [0, t.length];
    const from = t.findIndex((v) => v >= range[0]);
    const to = t.findLastIndex((v) => v <= range[1]);
    return from < 0 || to < from ? [0, 0] : [from, to + 1];
  };

  // About POINTS rows of a part that keep the extremes of every channel.
  const thinned = ([from, to], all) => {
    const rows = [], step = Math.ceil(2 * all.length * (to - from) / POINTS);
    if (step <= 2 * all.length) return Array.from({ length: to - from }, (_, i) => from + i);
    for (let a = from; a < to; a += step) {
      const b = Math.min(a + step, to), kept = new Set();
      for (const values of all) {
        let low = a, high = a;
        for (let i = a + 1; i < b; i++) {
          if (values[i] < values[low]) low = i;
          if (values[i] > values[high]) high = i;
        }
        kept.add(low).add(high);
      }
      rows.push(...[...kept].sort((x, y) => x - y));
    }
    return rows;
  };

  const painted = (value) => {
    if (typeof value === "string") return (dark.matches && !printing && page.dark[value]) || value;
    if (Array.isArray(value) || ArrayBuffer.isView(value) || value === null) return value;
    if (typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([k, v]) =>
      [k, k === "data" || k === "shapes" ? v.map(painted) : painted(v)]));
  };
  const draw = (id) => {
    const figure = painted(page.figures[id]), place = find(id), time = find("time")?.layout;
    const zoomed = time?.uirevision === page.shown && time.xaxis.autorange === false;
    const data = figure.data.map((trace) => {
      if (!trace.meta) return trace;
      const [x, y] = [shown[trace.meta.x], shown[trace.meta.y]];
      const part = within(shown.t, zoomed && time.xaxis.range);
      const rows = thinned(part, id === "time" ? [y] : [x, y]);
      return { ...trace, x: rows.map((i) => x[i]), y: rows.map((i) => y[i]) };
    });
    const width = printing ? PRINTED[place.dataset.print] : place.clientWidth;
    const before = place.layout || {};
    const layout = { ...figure.layout, width, uirevision: page.shown };
    if (printing) layout.height = Math.min(layout.height, PRINTED.height);
    for (const axis of ["xaxis", "yaxis", "yaxis2", "yaxis3"]) { // keeps the zoom
      if (!layout[axis]) continue;
      layout[axis] = { ...layout[axis] };
      if (before.uirevision === page.shown && before[axis]?.autorange === false) {
        layout[axis].range = before[axis].range;
        layout[axis].autorange = false;
      }
    }
    return Plotly.react(place, data, layout, CONFIG);
  };
  const drawAll = () => Promise.all(Object.keys(page.figures).map(draw));

  // Zooming one of time and loops zooms the other; loops show what time shows.
  const link = (from, to, pairs) => find(from).on("plotly_relayout", async (event) => {
    const keys = Object.keys(event);
    const touched = (axis) => keys.some((k) => k.startsWith(axis + ".range") || k === axis + ".autorange");
    if (linking || printing) return;
    linking = true;
    const update = {};
    for (const [a, b] of pairs) {
      if (!touched(a)) continue;
      const { autorange, range } = find(from).layout[a];
      if (autorange) update[b + ".autorange"] = true;
      else update[b + ".range"] = [...range];
    }
    if (from === "time" && touched("xaxis")) {
      await draw("time");
      await draw("loops");
    }
    if (Object.keys(update).length) await Plotly.relayout(to, update);
    linking = false;
  });
  const zoom = (range) => Plotly.relayout("time", range
    ? { "xaxis.range": range, "yaxis.autorange": true, "yaxis2.autorange": true, "yaxis3.autorange": true }
    : { "xaxis.autorange": true, "yaxis.autorange": true, "yaxis2.autorange": true, "yaxis3.autorange": true });
  const choose = async (index) => {
    page.shown = index;
    shown = channels(records[index]);
    await draw("time");
    await draw("loops");
  };
  const steer = (event) => {
    const [a, b] = find("time").layout.xaxis.range, span = b - a;
    const to = {
      ArrowLeft: [a - span / 5, b - span / 5], ArrowRight: [a + span / 5, b + span / 5],
      "+": [a + span / 4, b - span / 4], "-": [a - span / 2, b + span / 2], Home: null,
    }[event.key];
    if (to === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    zoom(to);
  };
  const control = () => {
    const select = find("record");
    records.forEach((r, i) => select.add(new Option(`${r.name} (${r.role}, ${r.size} rows)`, i)));
    select.addEventListener("change", () => choose(Number(select.value)));
    find("whole").addEventListener("click", () => zoom(null));
    find("worst").addEventListener("click", () => zoom(records[page.shown].worst_s));
    for (const id of ["time", "loops"]) find(id).addEventListener("keydown", steer);
    link("time", "loops", LINKS);
    link("loops", "time", LINKS.map(([a, b]) => [b, a]));
    find("controls").hidden = false;
  };

  const start = async () => {
    const [code, data] = await Promise.all([unpack("plotly"), unpack("data")]);
    const script = document.createElement("script");
    script.textContent = code;
    document.head.append(script);
    page = JSON.parse(data);
    records = page.records;
    page.shown = 0;
    if (records.length) shown = channels(records[0]);
    await drawAll();
    if (records.length) control();
    dark.addEventListener("change", drawAll);
    addEventListener("beforeprint", () => { printing = true; drawAll(); });
    addEventListener("afterprint", () => { printing = false; drawAll(); });
    let waiting;
    new ResizeObserver(() => {
      clearTimeout(waiting);
      waiting = setTimeout(() => printing || drawAll(), 100);
    }).observe(document.body);
    document.documentElement.dataset.drawn = Math.round(performance.now());
  };
  start().catch((error) => {
    find("failed").hidden = false;
    console.error(error);
  });
})();

"""The results of Cao & Li 2019 (Sensors 19, 352) beside what this program gives, row by row.

Everything under "ours" is computed here: by the C core, by the identification, by the simulated
stage, and, for the computation time, from a capture of an emulated pin. What the paper leaves out
(noise of Example 1, signals of Example 2, peaks of Fig. 12) is chosen here and said.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from madelung import __version__
from madelung.core import Precision, Predictor
from madelung.errors import InputError
from madelung.files import read_json, write_atomically
from madelung.identify import Identification, identify, stroke_of
from madelung.model import Model
from madelung.predict import Prediction, predict
from madelung.records import make_record
from madelung.stage import Hysteresis, Stage, load_library, measure, simulate
from madelung.waveforms import Command, Waveform

Floats = NDArray[np.float64]

CITATION = "Cao & Li, Sensors 2019, 19, 352"

EXAMPLE_1 = (0.0002, -0.0008, 1.0005)
"""f0 that the paper identifies in Example 1, ascending powers."""
EXAMPLE_1_NOISE = 0.01
"""Not given in the paper; rms of the noise on an output of 0 to 1."""
WEIGHT = np.array([0.0789, 0.2268, 0.1928, 0.2019, 0.1995, 0.2001, 0.2, 0.2, 0.1999, 0.2005])
THRESHOLD = np.arange(10) / 10.0
"""Table 1."""
EQ_20 = Model("madelung", 0.0, 40.0, f0=(5.8517e-1, 8.6444e-2, 1.1949e-3, -6.1876e-6))
MAX_ERROR_UM = 0.12
LINE_US = (0.57, 0.19)
"""Fig. 8: computation time in us over the number of comparisons p, as a line in p."""
MCT_US, FIG_14_US = 2.80, 1.23
"""Computation time in us that the text gives for p = 12 and p = 4."""
TABLE_2 = {12: (2, "16 KB"), 16: (2, "256 KB"), 18: (3, "1.5 MB"), 24: (3, "96 MB")}
"""Bits to bytes per entry and the memory that the paper gives."""

PEAKS = 7
ZERO_S, TURNAROUND_S = 3.0, 13.4
RATE_HZ = 200.0
STAGE_SEED = 2019

SIGNALS = (
    Waveform.TRIANGLE,
    Waveform.SINE,
    Waveform.DECAYING,
    Waveform.SINES,
    Waveform.MULTISINE,
    Waveform.STAIRCASE,
    Waveform.STEPS,
    Waveform.CODES,
)
"""Of Example 2."""

BITS_MAX = 16
"""Limit of MDL_N_U, mdl_config.h: 2^16 codes."""

FIGURES = ("fig06", "fig07", "fig08", "fig11", "fig12", "fig13", "fig14")


@dataclass(frozen=True)
class Row:
    """One result of the paper.

    Attributes
    ----------
    where, what
        Place in the paper, and the quantity.
    paper, ours
        Both results, with units.
    agrees
        Whether ours confirms the paper's; None: it cannot be compared, and the note says why.
    note
        What was chosen or differs; may be empty.
    """

    where: str
    what: str
    paper: str
    ours: str
    agrees: bool | None
    note: str = ""


@dataclass(frozen=True)
class Comparison:
    """Ours against play operators on one signal, shape (n,) each.

    ``ours`` is the float build's; ``off`` maps a precision to the largest difference.
    """

    name: str
    t_s: Floats
    x: Floats
    play: Floats
    ours: NDArray[np.floating[Any]]
    off: dict[Precision, float]
    within: bool


@dataclass(frozen=True)
class Cost:
    """How long the timing pin was high in a capture that `madelung timing` has read.

    Attributes
    ----------
    name
        Of the capture, without its suffix.
    p, mean_us, most_us
        Comparisons of Fig. 2's search; mean and largest time of the steps that need so many there.
    """

    name: str
    p: Floats
    mean_us: Floats
    most_us: Floats

    @property
    def line_us(self) -> tuple[float, float]:
        """Least-squares line through `most_us`: us at p = 0, and per comparison."""
        slope, start = np.polyfit(self.p, self.most_us, 1)
        return float(start), float(slope)


@dataclass(frozen=True)
class Reproduction:
    """All that was computed; the pictures are drawn from it."""

    rows: tuple[Row, ...]
    example_1: Identification
    example_2: tuple[Comparison, ...]
    fitted: Identification
    predicted: Prediction
    turning_points: NDArray[np.uint32]
    costs: tuple[Cost, ...]


def reproduce(costs: tuple[Cost, ...] = ()) -> Reproduction:
    """Compute every result of the paper that can be computed without its actuator.

    Parameters
    ----------
    costs
        Of captures, as `load_cost` reads them; without them Fig. 8 is the paper's alone.
    """
    example_1, rows_1 = _example_1()
    example_2, rows_2 = _example_2()
    t, u = fig_12_signal()
    turning_points, rows_14 = _fig_14(t, u)
    fitted, predicted, rows_stage = _stage(t, u)
    rows = [
        *rows_1,
        *rows_2,
        *rows_stage,
        *rows_14,
        *_comparisons(int(turning_points.max())),
        *_fig_8(costs),
        _parameters(),
        *_memory(),
    ]
    return Reproduction(tuple(rows), example_1, example_2, fitted, predicted, turning_points, costs)


# -- Examples 1 and 2 -------------------------------------------------------------------------


def _example_1() -> tuple[Identification, list[Row]]:
    """f0 = x^2 on [0, 1] from a noisy loop under a sine."""
    command = Command(Waveform.SINE, seconds=5.0, rate_hz=400.0, u_min_V=0.0, u_max_V=1.0, hz=1.0)
    true = Model("madelung", 0.0, 1.0, f0=(0.0, 0.0, 1.0))
    u = command.at(command.time_s)
    noise = np.random.default_rng(1).normal(0.0, EXAMPLE_1_NOISE, u.size)
    y = Predictor(true, "float64").run(u) + noise
    record = make_record("Example 1", {"t_s": command.time_s, "u_V": u, "y_um": y})
    found = identify([record], degree=2)
    sigma = np.sqrt(np.diag(found.model.extra["covariance"]))
    off = np.array(found.model.f0) - true.f0
    row = Row(
        "Example 1",
        "f0 of x^2 on [0, 1], descending powers",
        _listed(EXAMPLE_1[::-1]),
        _listed(found.model.f0[::-1]),
        bool((np.abs(off) <= 3.0 * sigma).all()),
        f"standard errors {_listed(sigma[::-1])}; the paper's noise is not given, here "
        f"{EXAMPLE_1_NOISE:g} rms on {u.size} rows",
    )
    return found, [row]


def play(x: Floats, weight: Floats, threshold: Floats) -> Floats:
    """A Prandtl-Ishlinskii model of one-side play operators, eqs. (15) to (17).

    Each is a backlash of the simulated stage, which shares nothing with the core: a pusher at
    x - r with a gap of r above it, H(t) = max(x - r, min(x, H(t - 1))), starting at H = 0. As
    printed, eq. (15) recurses on the sum y_PI.

    Parameters
    ----------
    x
        Input, shape (n,).
    weight, threshold
        w_i and r_i, shape (m,).
    """
    ffi, lib = load_library()
    total = np.zeros(x.size)
    for w, r in zip(weight, threshold, strict=True):
        h = np.concatenate(([0.0], x - r))
        lib.path_backlash(ffi.from_buffer("double[]", h), h.size, r)
        total += w * h[1:]
    return total


def play_model() -> Model:
    """The trajectory's model of Table 1: f0 = f_PI, eqs. (16) and (17)."""
    x = np.append(THRESHOLD, 1.0)
    y = np.maximum(0.0, x[:, None] - THRESHOLD) @ WEIGHT
    return Model("major_curve", 0.0, 1.0, breakpoints=tuple(zip(x, y, strict=True)))


def _example_2() -> tuple[tuple[Comparison, ...], list[Row]]:
    """The trajectory with f_PI against the play operators of Table 1, on every signal."""
    compared = tuple(_compare(waveform) for waveform in SIGNALS)
    names = ", ".join(c.name for c in compared)
    rows = [
        Row(
            "Example 2, Fig. 7",
            f"trajectory less ten play operators, largest, {called}",
            "0 (the same curves)",
            f"{max(c.off[build] for c in compared):.2g} of an output of 1 "
            f"({max(c.off[build] for c in compared) / np.finfo(build).eps:.1f} eps)",
            all(c.within for c in compared),
            f"on {len(compared)} signals: {names}; rounding grows with the turning points held",
        )
        for build, called in _BUILDS.items()
    ]
    return compared, rows


_BUILDS: dict[Precision, str] = {"float32": "float as flashed", "float64": "double"}


def _compare(waveform: Waveform) -> Comparison:
    command = Command(
        waveform, seconds=20.0, rate_hz=100.0, u_min_V=0.0, u_max_V=1.0, hz=0.375, seed=7
    )
    t = command.time_s
    x = command.at(t).astype(np.float32).astype(np.float64)  # what both builds can hold
    reference = play(x, WEIGHT, THRESHOLD)
    off: dict[Precision, float] = {}
    within, float_y = True, np.empty(0, np.float32)
    for build in _BUILDS:
        y, _, count = Predictor(play_model(), build).run_with_status(x)
        difference = np.abs(y - reference)
        off[build] = float(difference.max())
        # A dozen roundings per turning point whose curve the present one starts from.
        within &= bool((difference <= 6.0 * np.finfo(build).eps * (count + 1.0)).all())
        float_y = y if build == "float32" else float_y
    return Comparison(waveform.value, t, x, reference, float_y, off, within)


# -- the experiment ---------------------------------------------------------------------------


def fig_12_signal() -> tuple[Floats, Floats]:
    """The command of Fig. 12: times in s and volts, shape (n,).

    The text gives 40 V, 0 V at 3 s, the turnaround at 13.4 s and 7 left and 7 right turning points.
    At the constant slope of 40 V in 1.5 s, thirteen swings that shrink by equal steps reach the
    turnaround at 13.4 s when the step is 40 V / 15. The way back mirrors the way there.
    """
    slope = 2.0 * EQ_20.range_V / ZERO_S
    shrinking = np.arange(1, 2 * PEAKS)
    travelled = slope * (TURNAROUND_S - ZERO_S)
    step = (shrinking.size * EQ_20.range_V - travelled) / shrinking.sum()
    swings = EQ_20.range_V - step * shrinking
    nested = np.cumsum(swings * np.where(shrinking % 2, 1.0, -1.0))
    volts = np.concatenate(([0.0, EQ_20.range_V, 0.0], nested, nested[-2::-1], [0.0]))
    corners = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(volts))) / slope))
    t = np.arange(round(corners[-1] * RATE_HZ) + 1) / RATE_HZ
    codes = np.rint(np.interp(t, corners, volts) / EQ_20.range_V * 4095.0)
    return t, np.asarray(codes * (EQ_20.range_V / 4095.0))


def _fig_14(t: Floats, u: Floats) -> tuple[NDArray[np.uint32], list[Row]]:
    """Turning points that eq. (20)'s model holds on the test signal."""
    y, _, count = Predictor(EQ_20).run_with_status(u)
    double = Predictor(EQ_20, "float64").run(u)
    held = count.astype(int)
    zero, turn = (int(np.searchsorted(t, s)) for s in (ZERO_S, TURNAROUND_S))
    nesting = held[zero : turn + 1]
    most = int(held.max())
    steps = sorted({int(s) for s in np.diff(held)} - {0})
    points = {
        "at the start": (1, int(held[0])),
        "at 3 s, 0 V": (0, int(held[zero])),
        "at the end, 0 V": (0, int(held[-1])),
    }
    rows = [
        Row("Fig. 14", f"turning points {when}", str(paper), str(ours), paper == ours)
        for when, (paper, ours) in points.items()
    ]
    rows.insert(
        2,
        Row(
            "Fig. 14",
            "most turning points",
            "14 = 7 left + 7 right",
            f"{most} = {most - most // 2} left + {most // 2} right",
            most == 2 * PEAKS,
            "Fig. 12's peaks are not given: equal steps of 40 V / 15 are what turns at 13.4 s",
        ),
    )
    rows += [
        Row(
            "Fig. 14",
            "number from 3 to 13.4 s",
            "never falls",
            "never falls" if (np.diff(nesting) >= 0).all() else "falls",
            bool((np.diff(nesting) >= 0).all()),
        ),
        Row(
            "Fig. 14",
            "steps of the number",
            "+1, -2",
            ", ".join(f"{s:+d}" for s in reversed(steps)),
            steps == [-2, 1],
        ),
        Row(
            "eq. (20)",
            "displacement on Fig. 12's signal, float less double",
            "not given",
            f"{np.abs(y - double).max():.2g} um at most, of {np.ptp(double):.4g} um",
            None,
            "the paper gives no values of the prediction to compare with",
        ),
    ]
    return count, rows


def _stage(t: Floats, u: Floats) -> tuple[Identification, Prediction, list[Row]]:
    """Section 3.2's procedure on the simulated stage, with the stroke and loop of eq. (20)."""
    f0 = Polynomial(EQ_20.f0)
    stroke = stroke_of(EQ_20)
    width = f0(0.0) + f0(EQ_20.range_V) - 2.0 * f0(EQ_20.range_V / 2.0)
    stage = Stage(stroke_um=stroke, hysteresis_share=width / stroke, y_min_um=float(f0(0.0)))
    loop = Command(seconds=12.0, rate_hz=RATE_HZ, hz=1.0 / ZERO_S)
    fitted = identify([simulate(stage, loop, STAGE_SEED)], degree=3)
    measured = measure(stage, t, u, Hysteresis(stage).run(u), STAGE_SEED + 1)
    predicted = predict(fitted.model, measured)
    most = float(np.abs(predicted.error).max())
    actuator = "needs the paper's actuator; ours is the simulated stage"
    rows = [
        Row(
            "eq. (20), Fig. 11",
            "f0 of degree 3, descending powers, um / V^k",
            _listed(EQ_20.f0[::-1], ".5g"),
            _listed(fitted.model.f0[::-1], ".5g"),
            None,
            f"{actuator}, of eq. (20)'s stroke ({stroke:.4g} um) and loop width "
            f"({100.0 * width / stroke:.3g} % of it)",
        ),
        Row(
            "Fig. 13",
            "largest error of the prediction",
            f"{MAX_ERROR_UM:g} um ({100.0 * MAX_ERROR_UM / stroke:.2g} % of eq. (20)'s stroke)",
            f"{most:.2g} um ({100.0 * most / stroke:.2g} %)",
            None,
            f"not reproducible: {actuator}, with {stage.noise_um:g} um rms of sensor noise",
        ),
    ]
    return fitted, predicted, rows


# -- cost -------------------------------------------------------------------------------------


def comparisons(m: NDArray[np.intp], place: NDArray[np.intp]) -> NDArray[np.intp]:
    """Comparisons that the binary search of Fig. 2 makes, by running it; shape (n,).

    Parameters
    ----------
    m
        Turning points among which it searches, shape (n,).
    place
        How many of them, the outermost, the input has not surpassed, shape (n,).
    """
    left, right, made = np.zeros_like(m), m.copy(), np.zeros_like(m)
    while (searching := left < right).any():
        mid = (left + right) // 2
        inside = mid < place
        left = np.where(searching & inside, mid + 1, left)
        right = np.where(searching & ~inside, mid, right)
        made += searching
    return made


def search_comparisons(m: int) -> int:
    """Most comparisons of the binary search of Fig. 2 among m turning points."""
    place = np.arange(m + 1)
    return int(comparisons(np.full_like(place, m), place).max())


def searched(x: Floats, count: NDArray[np.intp]) -> NDArray[np.intp]:
    """Comparisons of Fig. 2's search at every sample of a record that starts at rest at 0.

    Parameters
    ----------
    x
        Input, shape (n,).
    count
        Left and right turning points held after each sample, shape (n,).
    """
    rises = np.sign(np.diff(x, prepend=0.0)).astype(np.intp)
    moved = np.flatnonzero(rises)
    turned = np.zeros_like(rises)
    turned[moved[1:]] = np.diff(rises[moved]) != 0
    before = np.concatenate(([1], count[:-1]))
    return np.where(rises != 0, comparisons((before + turned) // 2, count // 2), 0)


def _eq_18(m: int) -> int:
    return int(np.ceil(np.log2(m) + 1.0))


def nested_codes(codes: int) -> NDArray[np.int64]:
    """Every code but 0 once, each between the two before it: 4095, 1, 4094, 2, ..."""
    k = np.arange(1, codes)
    return np.where(k % 2 == 1, codes - (k + 1) // 2, k // 2)


def _comparisons(most_of_fig_14: int) -> list[Row]:
    """Eqs. (18) and (19) by running the worst case on a 12-bit converter.

    The last code becomes a turning point in the step that wipes all of them out; half a code
    before shows that the memory then holds it too.
    """
    nested = nested_codes(4096)
    codes = np.append(nested, [nested[-1] - 0.5, 0.0])
    count = Predictor(EQ_20).run_with_status(codes * (EQ_20.range_V / 4095.0))[2]
    m = int(count.max()) // 2
    ran, few = search_comparisons(m), search_comparisons(most_of_fig_14 // 2)
    fig_14 = _eq_18(most_of_fig_14 // 2)
    return [
        Row("section 2.2", "most left (right) turning points, 12 bits", "2048", str(m), m == 2048),
        Row(
            "eqs. (18), (19)",
            "comparisons, 12 bits, worst case",
            "12",
            f"{ran} counted, {_eq_18(m)} by eq. (18)",
            ran == _eq_18(m) == 12,
            f"all {nested.size} codes above 0 nested; the jump to 0 V leaves {int(count[-1])} of "
            f"{int(count.max())} turning points",
        ),
        Row(
            "Fig. 14, eq. (18)",
            "comparisons, at most",
            "4",
            f"{few} counted, {fig_14} by eq. (18)",
            few <= fig_14 == 4,
            "at m = 7 eq. (18) is one above what the search needs",
        ),
    ]


def load_cost(path: Path) -> Cost:
    """What `madelung timing CAPTURE --record INPUTS -o path` has written, where p > 0.

    Raises
    ------
    InputError
        The file cannot be read, or holds something else.
    """
    told = read_json(path)
    try:
        rows = [row for row in told["by_p"] if row["p"] > 0]
        columns = (np.array([float(row[key]) for row in rows]) for key in _COLUMNS)
        p, mean_s, most_s = columns
        cost = Cost(Path(str(told["capture"])).stem, p, 1e6 * mean_s, 1e6 * most_s)
    except (TypeError, KeyError, AttributeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: {_NO_COST}") from error
    values = np.concatenate((p, mean_s, most_s))
    if np.unique(p).size < 2 or not (np.abs(values) < 1e12).all():
        raise InputError(f"{path}: {_NO_COST}")
    return cost


_COLUMNS = ("p", "mean_s", "max_s")
_NO_COST = (
    "holds no times by p; `madelung timing CAPTURE --record INPUTS -o FILE` writes such files"
)


def _fig_8(costs: tuple[Cost, ...]) -> list[Row]:
    start, slope = LINE_US
    where = "Fig. 8"
    rows = [
        Row(
            where,
            f"computation time at p = {p}, text against the paper's own line",
            f"{us:.2f} us",
            f"{start + slope * p:.2f} us",
            bool(np.isclose(us, start + slope * p, atol=5e-3)),
            "the paper's text and its line differ",
        )
        for p, us in ((12, MCT_US), (4, FIG_14_US))
    ]
    paper = f"{start:g} + {slope:g} p us"
    rows += [
        Row(
            where,
            f"time of a step, capture {c.name}",
            f"{paper} (F28335, 150 MHz)",
            f"{c.line_us[0]:.2f} {'-' if c.line_us[1] < 0 else '+'} {abs(c.line_us[1]):.3f} p us "
            f"at most; mean {c.mean_us.min():.2f} to {c.mean_us.max():.2f} us",
            None,
            "another processor, or an emulated one; the emulated board counts 10 ns an instruction",
        )
        for c in costs
    ]
    if not costs:
        note = "`make reproduce` captures an emulated board's pin; no F28335 was measured"
        rows.append(Row(where, "time of a step", paper, "not measured", None, note))
    return rows


def _parameters() -> Row:
    ours, operators = len(EQ_20.f0), WEIGHT.size + THRESHOLD.size
    return Row(
        "section 3.3",
        "parameters: f0 of degree 3, ten play operators",
        "4, 20",
        f"{ours}, {operators}",
        (ours, operators) == (4, 20),
    )


def _memory() -> list[Row]:
    """Table 2: four arrays of N_u / 2 entries."""
    real = np.dtype(np.float32).itemsize
    return [
        Row(
            "Table 2",
            f"memory for turning points, {bits} bits",
            f"{paper} ({entry} bytes an entry)",
            f"{_bytes(2 * 2**bits * real)} ({real} bytes an entry)",
            real == entry,
            f"the paper's entries give {_bytes(2 * 2**bits * entry)}; ours are reals of 32 bits"
            + ("" if bits <= BITS_MAX else f", and the core is not built beyond {BITS_MAX} bits"),
        )
        for bits, (entry, paper) in TABLE_2.items()
    ]


def _bytes(size: int) -> str:
    unit, per = ("MB", 2**20) if size >= 2**20 else ("KB", 2**10)
    return f"{size / per:g} {unit}"


# -- writing ----------------------------------------------------------------------------------


def _listed(values: Any, form: str = ".4f") -> str:
    return ", ".join(f"{v:{form}}" for v in values)


def verdict(row: Row) -> str:
    """One word or two for `Row.agrees`."""
    return {True: "agrees", False: "differs", None: "not comparable"}[row.agrees]


def markdown(citation: str, rows: tuple[Row, ...]) -> str:
    """The rows as a Markdown table."""
    lines = [
        f"# {citation}: the paper's results beside ours",
        "",
        "| where | what | paper | ours | | note |",
        "|---|---|---|---|---|---|",
    ]
    for r in rows:
        cells = (r.where, r.what, r.paper, r.ours, verdict(r), r.note)
        lines.append("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |")
    return "\n".join(lines) + "\n"


def make_folder(out: Path) -> None:
    """Make a folder, if need be.

    Raises
    ------
    InputError
        It cannot be made.
    """
    try:
        out.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{out}: cannot be written: {error.strerror}") from error


def write_table(out: Path, citation: str, rows: tuple[Row, ...]) -> None:
    """Write table.md and table.json into a folder."""
    told = {
        "paper": citation,
        "version": __version__,
        "rows": [{**asdict(row), "verdict": verdict(row)} for row in rows],
    }
    write_atomically(out / "table.json", json.dumps(told, indent=1, ensure_ascii=False) + "\n")
    write_atomically(out / "table.md", markdown(citation, rows))


def write(out: Path, found: Reproduction) -> None:
    """Write table.md, table.json and the pictures into a folder, which is made if need be.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """
    from madelung.reproduce_pictures import draw

    make_folder(out)
    draw(out, found)
    write_table(out, CITATION, found.rows)

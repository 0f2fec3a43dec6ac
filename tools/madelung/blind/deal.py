"""Cases of a trial: a simulated stage, its records, and what acts, all drawn from one seed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from madelung.blind.excitations import ROWS_MAX, draw_commands, log_uniform
from madelung.blind.laws import Draw, draw_law
from madelung.campaigns import Commands
from madelung.files import read_json, write_atomically
from madelung.sim_effects import OUTSIDE, VOCABULARY, Parameters, Scene
from madelung.stage import Stage, make_case, make_scene

SIZES = {1.0: 0.4, 0.25: 0.25, 0.1: 0.2, 0.03: 0.15}
"""Size of an effect, 1: ordinary, to its share of the cases with one effect."""
KINDS = {"single": 0.55, "pair": 0.15, "none": 0.20, "outside": 0.10}
"""What acts in a case, to its share."""
_BOUC_WEN_SHARE = 0.3
"""Of the ordinary non-Masing cases, those whose whole loop is Bouc-Wen's."""
_MONITOR_SHARE = 0.07
_STREAM = 0xB11D
"""Keeps these draws apart from all others of the same seed."""


def deal_case(
    folder: Path, seed: int, left_out: bool = False, rows_max: int = ROWS_MAX
) -> dict[str, Any]:
    """Write a case for `madelung diagnose` (contract: diagnose.md) and give its label.

    Parameters
    ----------
    folder
        The case; it must not exist yet.
    seed
        Decides everything, 0 or above.
    left_out
        One effect acts, and case.json takes it out of the diagnosis's library.
    rows_max
        Most rows of all train records together, `ROWS_MIN` or more.

    Returns
    -------
    The label, plain enough for JSON: ``kind`` (of `KINDS`, or ``left_out``), ``effects`` and
    ``outside`` (names), ``size`` (effect to size), ``law`` (effect to its law's name),
    ``parameters`` (effect to parameters, keys of the contract and of
    `madelung.sim_effects.Effects`), ``rms_um`` (effect to record to the rms by which it changes
    the noiseless reading; ``train`` and ``holdout``: over all their rows), ``noise``, ``base``,
    ``records``, ``where`` (the true region of the gap, or None), ``monitor``, ``seed``.

    Raises
    ------
    InputError
        The folder exists or cannot be written.
    """
    rng = np.random.default_rng([seed, _STREAM])
    stage = _draw_stage(rng)
    every = draw_commands(rng, stage.u_min_V, stage.u_max_V, rows_max)
    kind = "left_out" if left_out else str(rng.choice(list(KINDS), p=list(KINDS.values())))
    sizes = _draw_sizes(kind, rng)
    scene = make_scene(stage, every)
    seconds = float(np.median([c.seconds for k, c in every.items() if k.startswith("train/")]))
    laws: dict[str, str] = {}
    wanted: dict[str, float | Parameters] = {}
    for name, size in sizes.items():
        laws[name], wanted[name] = draw_law(name, Draw(rng, size, scene, seconds))
    if sizes.get("non_masing") == 1.0 and rng.uniform() < _BOUC_WEN_SHARE:
        laws["non_masing"] = "all Bouc-Wen"
        wanted["non_masing"] = {"bouc_wen": 1.0, "bouc_wen_power": rng.uniform(1.0, 2.0)}
    monitor = bool(rng.uniform() < _MONITOR_SHARE)
    told = make_case(folder, wanted, seed, stage=stage, every=every, monitor=monitor, apart=True)
    if left_out:
        _exclude(folder, list(sizes))
    return {
        "kind": kind,
        "effects": [] if left_out else told["effects"],
        "outside": told["effects"] if left_out else told["outside"],
        "size": sizes,
        "law": laws,
        "parameters": told["parameters"],
        "rms_um": {name: _pooled(records, every) for name, records in told["apart_um"].items()},
        "noise": _noise(stage) | {"in_um": _pooled(told["noise_in_um"], every)},
        "base": _base(stage),
        "records": {
            name: {"waveform": str(c.waveform), "rate_hz": c.rate_hz, "rows": c.samples}
            for name, c in every.items()
        },
        "where": _where(told["parameters"], scene),
        "monitor": monitor,
        "seed": seed,
    }


def _draw_stage(rng: np.random.Generator) -> Stage:
    width_V = log_uniform(rng, 8.0, 800.0)
    u_min_V = 0.0 - width_V * float(rng.choice([0.0, 0.0, 1 / 7, 1 / 4, 1 / 2]))
    stroke_um = log_uniform(rng, 5.0, 200.0)
    shapes: list[dict[str, Any]] = [
        {"loop_decay": rng.uniform(0.0, 3.0)},
        {"loop_decay": rng.uniform(0.0, 1.0), "loop_heap": rng.uniform(0.3, 2.0)},
        {"loop_dead_zone": rng.uniform(0.03, 0.2)},
    ]
    shape = shapes[int(rng.choice(3, p=[0.6, 0.2, 0.2]))]
    colours: list[dict[str, Any]] = [
        {},
        {"noise_ar": rng.uniform(0.5, 0.98)},
        {"noise_pink": True},
    ]
    colour = colours[int(rng.choice(3, p=[0.4, 0.35, 0.25]))]
    stage = Stage(
        round(u_min_V, 2),
        round(u_min_V + width_V, 2),
        stroke_um,
        rng.uniform(0.06, 0.15),
        y_min_um=rng.uniform(-0.2, 0.2) * stroke_um,
        physics="relays" if rng.uniform() < 0.5 else "slides",
        dac_bits=int(rng.choice([12, 12, 16])),
        adc_bits=int(rng.choice([12, 12, 16])),
        noise_um=log_uniform(rng, 1e-4, 1e-3) * stroke_um,
        headroom_share=0.6,
    )
    return replace(stage, **shape, **colour)


def _draw_sizes(kind: str, rng: np.random.Generator) -> dict[str, float]:
    """Effects that act, to their size."""
    count = {"single": 1, "left_out": 1, "pair": 2}.get(kind, 0)
    names = [str(n) for n in rng.choice(list(VOCABULARY), count, replace=False)]
    if kind == "single":
        return {names[0]: float(rng.choice(list(SIZES), p=list(SIZES.values())))}
    if kind == "outside":
        names = [str(rng.choice(list(OUTSIDE)))]
    return {name: float(rng.choice([1.0, 0.25])) for name in names}


def _exclude(folder: Path, effects: list[str]) -> None:
    path = folder / "case.json"
    head = read_json(path) | {"exclude": effects}
    write_atomically(path, json.dumps(head, indent=1) + "\n")


def _pooled(records_um: Mapping[str, float], every: Commands) -> dict[str, float]:
    """Rms by record, and over all records of a place."""
    pooled = dict(records_um)
    for place in ("train", "holdout"):
        own = [name for name in records_um if name.startswith(f"{place}/")]
        square = [records_um[name] ** 2 for name in own]
        pooled[place] = float(np.sqrt(np.average(square, weights=[every[n].samples for n in own])))
    return pooled


def _noise(stage: Stage) -> dict[str, Any]:
    """The sensor's noise; floor_um: with what its converter adds."""
    colour = "pink" if stage.noise_pink else "AR" if stage.noise_ar else "white"
    rounding_um = stage.adc_step_um / np.sqrt(12.0)
    return {
        "colour": colour,
        "ar": stage.noise_ar,
        "rms_um": stage.noise_um,
        "floor_um": float(np.hypot(stage.noise_um, rounding_um)),
    }


def _base(stage: Stage) -> dict[str, Any]:
    return {
        "physics": stage.physics,
        "stroke_um": stage.stroke_um,
        "u_min_V": stage.u_min_V,
        "u_max_V": stage.u_max_V,
        "hysteresis_share": stage.hysteresis_share,
        "decay": stage.loop_decay,
        "heap": stage.loop_heap,
        "dead_zone": stage.loop_dead_zone,
    }


def _where(parameters: Mapping[str, Parameters], scene: Scene) -> dict[str, Any] | None:
    """The true region of the gap, of one effect for which it is clear."""
    if len(parameters) != 1:
        return None
    name, p = next(iter(parameters.items()))
    regions: dict[str, tuple[str, float, float]] = {}
    if name == "saturation" and "low_V" not in p:
        regions[name] = ("input", p["high_V"] - p.get("knee_V", 0.0), scene.u_max_V)
    if name == "saturation" and "high_V" not in p:
        regions[name] = ("input", scene.u_min_V, p["low_V"] + p.get("knee_V", 0.0))
    if name == "slew_limit":
        regions[name] = ("rate", p["slew_V_per_s"], scene.highest_V_per_s)
    if name in ("delay", "amplifier_lag"):
        regions[name] = ("rate", 0.5 * scene.fast_V_per_s, scene.highest_V_per_s)
    if name == "periodic_disturbance":
        regions[name] = ("frequency", p["freq_hz"], p["freq_hz"])
    if name not in regions:
        return None
    axis, low, high = regions[name]
    return {"axis": axis, "low": low, "high": high}

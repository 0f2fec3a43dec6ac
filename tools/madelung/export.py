"""A model as constant C data for the firmware: mdl_params.h and mdl_params.c."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from madelung.blocks import Block
from madelung.core import Chain, Predictor
from madelung.errors import InputError
from madelung.files import replacing
from madelung.model import MARGIN_SHARE, Model
from madelung.path import discretise, path_of
from madelung.yang2015 import FILTER_VALUES, PI_VALUES, YangParams

CODE_MAX = 4095
RATE_HZ = 10_000
"""Of the firmware, where no other is asked for; the records' rate does not matter."""
RATE_HZ_MAX = 200_000
DELAY_WHOLE_MAX = 60
CREEP_MODES_MAX = 12
MODES_MAX = 2
"""What a firmware with the defaults of mdl_config.h has memory for."""
_TINY = float(np.finfo(np.float32).tiny)

_HEADER = """\
/**
 * @file mdl_params.h
 * @brief The parameters of the firmware. Written by `madelung export`; do not edit.
 */
#ifndef MDL_PARAMS_H
#define MDL_PARAMS_H

#include "mdl_app.h"

extern const mdl_app_params mdl_params;

#endif
"""


@dataclass(frozen=True)
class Scaling:
    """What the firmware needs beside the model.

    Attributes
    ----------
    rate_Hz
        Sample rate, 1 to 200000 Hz.
    input_V
        Drive voltage at ADC code 0 and at code 4095, V, ascending.
    output_um
        Displacement at DAC code 0 and at code 4095, um, ascending.
    """

    rate_Hz: int
    input_V: tuple[float, float]
    output_um: tuple[float, float]


def default_scaling(model: Model, rate_Hz: int = RATE_HZ) -> Scaling:
    """The converters span the identified range and the displacements that belong to it at rest."""
    x = np.linspace(0.0, model.range_V, CODE_MAX + 1)
    if model.kind == "major_curve":
        y = np.array([p[1] for p in model.breakpoints])
    elif model.yang is not None:
        y = Predictor(model, "float64").run(model.u_min_V + np.append(x, x[::-1]))
    else:
        y = np.polynomial.polynomial.polyval(x, model.f0)
    path = path_of(model)
    y = y[0] + (y - y[0]) * (1.0 + sum(m.gain for m in path.creep)) * path.gain + path.offset_um
    return Scaling(rate_Hz, (model.u_min_V, model.u_max_V), (float(y.min()), float(y.max())))


def write_params(model: Model, scaling: Scaling, folder: Path) -> None:
    """Write ``mdl_params.h`` and ``mdl_params.c`` into ``folder``, both or none.

    The same model gives the same bytes. Every value is a decimal literal that names one float32.

    Raises
    ------
    InputError
        A value cannot be a float of the DSP, a range is empty, or the folder cannot be written.
    """
    source = params_source(model, scaling)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from error
    with replacing(folder / "mdl_params.h") as header, replacing(folder / "mdl_params.c") as code:
        header.write_text(_HEADER, encoding="utf-8")
        code.write_text(source, encoding="utf-8")


def params_source(model: Model, scaling: Scaling) -> str:
    """The text of ``mdl_params.c``; fields that are not named are 0, which leaves them unused."""
    if not 1 <= scaling.rate_Hz <= RATE_HZ_MAX:
        raise InputError(f"the sample rate ({scaling.rate_Hz} Hz) must be 1 to {RATE_HZ_MAX} Hz")
    _check_ascending(scaling.input_V, "input", "V")
    y_low, y_high = _check_ascending(scaling.output_um, "output", "um")
    model, notes = fitting(model, scaling.rate_Hz)
    chain = discretise(path_of(model), 1.0 / scaling.rate_Hz)
    lines = [
        "/* clang-format off */",
        "/* Written by `madelung export`; do not edit. Reals are floats, exact in nine digits.",
        f" * For {scaling.rate_Hz} samples a second, whatever the rate of the records was;",
        " * for another rate: `madelung export model.json --rate HZ -o FOLDER`",
        *(f" * {_commented(line)}" for line in _about(model, notes)),
        " */",
        '#include "mdl_params.h"',
        "",
        "#ifdef __TMS320C28XX__",
        '#pragma DATA_SECTION(mdl_params, "mdl_params") /* the F28335 copies it to RAM */',
        "#endif",
        "",
        *_shape(model, chain),
        *_yang(chain.yang),
        "const mdl_app_params mdl_params = {",
        "    .chain = {",
        *(f"        {line}" for line in _members(_chain(model, chain))),
        "    },",
        f"    .rate_hz = {scaling.rate_Hz}u,",
        f"    .u_zero_volts = {literal(scaling.input_V[0], 'the input range')},",
        f"    .volts_per_code = {literal(volts_per_code(model, scaling.input_V), 'V per code')},",
        f"    .y_zero_um = {literal(y_low, 'the output range')},",
        f"    .codes_per_um = {literal(CODE_MAX / (y_high - y_low), 'codes per um')}",
        "};",
    ]
    return "\n".join(lines) + "\n"


def fitting(model: Model, rate_Hz: int) -> tuple[Model, list[str]]:
    """The model with the blocks that the firmware can run, and a line on every other one."""
    step_s = 1.0 / rate_Hz
    kept, notes = [], []
    for block in model.blocks:
        why = _too_large(block, step_s)
        if why and block.effect == "delay":  # in whole samples, where fine ones do not fit
            block = replace(block, parameters=block.parameters | {"substeps_min": 1})
            why = _too_large(block, step_s)
        if block.effect == "initial_state":
            why = "drive there once before the first sample"
        if why:
            notes.append(f"{block.told()}: {why}")
        else:
            kept.append(block)
    notes += [f"{b.told()}: no open-loop predictor can run it" for b in model.not_in_firmware]
    return replace(model, blocks=tuple(kept)), notes


def _too_large(block: Block, step_s: float) -> str | None:
    one = discretise(path_of(Model("augmented", 0.0, 1.0, f0=(0.0,), blocks=(block,))), step_s)
    for size, limit, what in (
        (one.delay[0] if one.delay else 0, DELAY_WHOLE_MAX, "samples"),
        (len(one.creep), CREEP_MODES_MAX, "modes"),
        (len(one.modes), MODES_MAX, "modes"),
    ):
        if size > limit:
            return f"{size} {what}, the firmware has memory for {limit}: see mdl_config.h"
    return None


def _about(model: Model, notes: list[str]) -> Iterator[str]:
    head = {"kind": model.kind, "u_min_V": model.u_min_V, "u_max_V": model.u_max_V}
    yield "model: " + json.dumps({**head, "source": model.extra.get("source")})
    for title, told in (
        ("in this firmware:", [b.told() for b in model.blocks]),
        ("not in this firmware:", notes),
    ):
        if told:
            yield title
            yield from (f"- {line}" for line in told)


def _commented(line: str) -> str:
    return line.replace("/*", "/ *").replace("*/", "* /").replace("\n", " ")


def volts_per_code(model: Model, input_V: tuple[float, float]) -> float:
    """Volts per ADC code as a float32, so that code 4095 does not leave the identified range.

    Rounded to nearest, the top code can come out one unit in the last place above ``u_max_V``: the
    core would count every full-scale sample as extrapolated. Such a factor is rounded down.
    """
    low, u_min = np.float32(input_V[0]), np.float32(model.u_min_V)
    factor = np.float32((input_V[1] - input_V[0]) / CODE_MAX)
    if input_V[1] <= model.u_max_V:
        while (low + np.float32(CODE_MAX) * factor) - u_min > model.range_as(np.float32):
            factor = np.nextafter(factor, np.float32(0.0))
    return float(factor)


def literal(value: float, what: str) -> str:
    """The C literal of the float32 nearest to ``value``.

    Raises
    ------
    InputError
        The float32 is infinite, or denormal: the DSP takes denormals for zero.
    """
    with np.errstate(over="ignore"):
        single = float(np.float32(value))
    if not math.isfinite(single) or (value != 0.0 and abs(single) < _TINY):
        raise InputError(f"{what} = {value:g} is outside the range of the DSP's float")
    text = f"{single:.9g}"
    return f"{text}f" if "." in text or "e" in text else f"{text}.0f"


def _check_ascending(limits: tuple[float, float], what: str, unit: str) -> tuple[float, float]:
    low, high = limits
    if not (math.isfinite(low) and math.isfinite(high) and high > low):
        raise InputError(f"the {what} range must ascend, found {low:g} to {high:g} {unit}")
    return limits


Tree = dict[str, "str | Tree"]
"""Members of a struct: C text, or a struct."""


def _members(tree: Tree) -> list[str]:
    """Designated initialisers, a member a line."""
    lines: list[str] = []
    for name, value in tree.items():
        if isinstance(value, str):
            lines.append(f".{name} = {value},")
        else:
            lines += [f".{name} = {{", *(f"    {line}" for line in _members(value)), "},"]
    if lines:
        lines[-1] = lines[-1].removesuffix(",")
    return lines


def _chain(model: Model, chain: Chain) -> Tree:
    margin = literal(MARGIN_SHARE * model.range_V, "the margin")
    blocks = _blocks(chain)
    if chain.yang is not None:
        blocks["YANG"] = {"yang": "&yang"}
    tree: Tree = {
        "u_min_volts": literal(model.u_min_V, "u_min_V"),
        "margin_volts": margin,
        "major": _major(model, chain),
    }
    if not blocks:
        return tree
    bits = " | ".join(f"MDL_BLOCK_{name}" for name in blocks)
    tree |= {
        "blocks": bits,
        "substeps": f"{chain.substeps}u",
        "smooth": literal(chain.smooth, "smooth"),
    }
    for members in blocks.values():
        tree |= members
    return tree


def _blocks(chain: Chain) -> dict[str, Tree]:
    """By block that acts, the name of its bit: its members of mdl_chain_params."""
    found: dict[str, Tree] = {}
    for bit, member, names, values in (
        ("SLEW", "slew", _SLEW, chain.slew),
        ("BEHIND", "behind", _LAG, chain.behind),
        ("ENVELOPE", "envelope", _ENVELOPE, chain.envelope),
        ("BOUC", "bouc", _BOUC, chain.bouc),
    ):
        if values is not None:
            found[bit] = {member: _struct(member, names, values)}
    if chain.saturation is not None:
        found["SATURATION"] = {
            "saturation": {
                **_struct("saturation", _SATURATION, chain.saturation),
                "parabolic": f"{int(chain.saturation[4])}u",
            },
            "rest_free": f"{int(chain.saturation[5])}u",
        }
    if chain.lag is not None:
        found["LAG"] = {"lag": _struct("lag", _LAG, chain.lag)}
        if chain.lag[2]:
            found["LAG"]["load_lean"] = literal(chain.lag[2], "lag")
            found["LAG"]["load_slope"] = _struct("lag", _LAG, chain.lag[3:])
            found["LAG"]["load_bend"] = _struct("lag", _LAG, chain.lag[5:])
    if chain.rate is not None:
        found["RATE"] = {"rate": _rate(chain.rate)}
    if chain.backlash is not None:
        found["BACKLASH"] = _struct(
            "backlash", ("dead_band_um", "spread", "spring_share"), chain.backlash
        )
    if chain.gain is not None:
        found["GAIN"] = _struct("gain_offset", ("gain", "offset_um"), chain.gain)
    return found | _lists(chain)


def _lists(chain: Chain) -> dict[str, Tree]:
    """Of the blocks that have arrays."""
    found: dict[str, Tree] = {}
    if chain.creep:
        found["CREEP"] = {
            "creep_count": f"{len(chain.creep)}u",
            "creep": _array([_creep(m) for m in chain.creep]),
        }
    if chain.modes:
        found["MODES"] = {
            "mode_count": f"{len(chain.modes)}u",
            "mode": _array([_mode(m) for m in chain.modes]),
        }
    if chain.delay is not None:
        whole, weights = chain.delay
        found["DELAY"] = {
            "delay": {"whole": f"{whole}u", "weight": f"{{{_list(weights, 'weight')}}}"}
        }
    return found


def _rate(values: tuple[float, ...]) -> Tree:
    return {
        "filter": _struct("rate", _LAG, values),
        **_struct("rate", _RATE, values[2:]),
        "of_speed": f"{int(values[11])}u",
        "relax": _struct("relax", _RELAX, values[12:]),
    }


_LAG = ("decay", "ramp")
_RATE = (
    "v_scale",
    "power",
    "v_knee",
    "at_knee",
    "damping_um",
    "widening",
    "threshold_volts",
    "swelling",
    "lean",
)
_ENVELOPE = ("per_volt", "rise_volts", "rise_skew", "fall_volts", "fall_skew", "follow")
_BOUC = ("size_um", "per_volt", "power", "gamma")
_RELAX = ("decay", "early", "pull")
_SATURATION = ("high_volts", "low_volts", "knee_volts", "knee_power")
_SLEW = ("rise_volts", "fall_volts", "knee_volts", "decay", "early")


def _struct(what: str, names: Iterable[str], values: Iterable[float]) -> Tree:
    """One real per name; further values are left to others."""
    return {n: literal(v, f"{what}.{n}") for n, v in zip(names, values, strict=False)}


def _creep(mode: tuple[float, ...]) -> str:
    decay, ramp, gain = (literal(v, "creep") for v in mode)
    return f"{{{{{decay}, {ramp}}}, {gain}}}"


def _mode(mode: tuple[float, ...]) -> str:
    a, b, c, d, e, f, share = (literal(v, "mode") for v in mode)
    return f"{{{{{{{a}, {b}}}, {{{c}, {d}}}}}, {{{e}, {f}}}, {share}}}"


def _array(rows: list[str]) -> str:
    return "{\n" + ",\n".join(" " * 12 + row for row in rows) + "\n        }"


def _shape(model: Model, chain: Chain) -> list[str]:
    """The terms of asymmetry and non-Masing, which the major curve points to."""
    if chain.shape is None:
        return []
    per_range = float(np.float32(1.0) / np.float32(model.range_as(np.float32)))
    rows = [f"{{{_list(row, f'g[{k}]')}}}" for k, row in enumerate(chain.shape)]
    return [
        "#ifdef __TMS320C28XX__",
        '#pragma DATA_SECTION(shape, "mdl_params")',
        "#endif",
        "static const mdl_shape shape = {",
        f"    .per_range = {literal(per_range, '1 / range')},",
        "    .g = {",
        ",\n".join(f"        {row}" for row in rows),
        "    },",
        f"    .loop = {{{_list(chain.loop, 'loop')}}}",
        "};",
        "",
    ]


def _yang(yang: YangParams | None) -> list[str]:
    """The model of Yang et al., which the chain points to."""
    if yang is None:
        return []
    numbers = {name: literal(value, name) for name, value in yang.values.items()}
    arrays = {
        name: f"{{{_list(getattr(yang, name), name)}}}"
        for name in ("threshold_volts", "weight", "k", "c_um", "m", "lambda_")
    }
    pi: Tree = {
        "count": f"{len(yang.weight)}u",
        "two_side": f"{int(yang.two_side)}u",
        "threshold_volts": arrays.pop("threshold_volts"),
        "weight": arrays.pop("weight"),
    }
    tree: Tree = {
        "pi": pi | {name: numbers.pop(name) for name in PI_VALUES},
        "harmonics": f"{len(yang.lambda_)}u",
        "lambda": arrays.pop("lambda_"),
        "filter": {name: numbers.pop(name) for name in FILTER_VALUES},
    }
    return [
        "#ifdef __TMS320C28XX__",
        '#pragma DATA_SECTION(yang, "mdl_params")',
        "#endif",
        "static const mdl_yang_params yang = {",
        *(f"    {line}" for line in _members(tree | arrays | numbers)),
        "};",
        "",
    ]


def _major(model: Model, chain: Chain) -> Tree:
    if model.kind == "major_curve":
        x, y = (np.array(v, np.float32) for v in zip(*model.breakpoints, strict=True))
        x[-1] = model.range_as(np.float32)
        slope = np.diff(y) / np.diff(x)  # in float32, as mdl_major_init_breakpoints does
        head: Tree = {"kind": "MDL_PIECEWISE_LINEAR", "count": f"{x.size}u"}
        y_zero = float(y[0])
        arrays = {"x_volts": x, "y_um": y, "slope": np.append(slope, slope[-1])}
    else:
        head = {"kind": "MDL_POLYNOMIAL", "degree": f"{len(model.f0) - 1}u"}
        y_zero = model.f0[0]
        arrays = {"c": np.array(model.f0)}
    tree = head | {
        "range_volts": literal(model.range_as(np.float32), "the range"),
        "at_zero_um": literal(y_zero, "f0(0)"),
    }
    if chain.shape is not None:
        tree["shape"] = "&shape"
    return tree | {name: f"{{{_list(v, name)}}}" for name, v in arrays.items()}


def _list(values: Iterable[float], name: str) -> str:
    items = [literal(float(v), f"{name}[{i}]") for i, v in enumerate(values)]
    rows = [", ".join(items[i : i + 6]) for i in range(0, len(items), 6)]
    return (",\n" + " " * 16).join(rows)

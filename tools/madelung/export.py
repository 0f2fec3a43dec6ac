"""A model as constant C data for the firmware: mdl_params.h and mdl_params.c."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from madelung.errors import InputError
from madelung.files import replacing
from madelung.model import MARGIN_SHARE, Model

CODE_MAX = 4095
RATE_HZ_MAX = 200_000
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


def default_scaling(model: Model, rate_Hz: int = 10_000) -> Scaling:
    """The converters span the identified range and the displacements that belong to it."""
    x = np.linspace(0.0, model.range_V, CODE_MAX + 1)
    if model.kind == "madelung":
        y = np.polynomial.polynomial.polyval(x, model.f0)
    else:
        y = np.array([p[1] for p in model.breakpoints])
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
    share = json.dumps(
        {
            "kind": model.kind,
            "u_min_V": model.u_min_V,
            "u_max_V": model.u_max_V,
            "source": model.extra.get("source"),
        }
    )
    lines = [
        "/* clang-format off */",
        "/* Written by `madelung export`; do not edit. Reals are floats, exact in nine digits.",
        f" * model: {share.replace('/*', '/ *').replace('*/', '* /')}",
        " */",
        '#include "mdl_params.h"',
        "",
        "#ifdef __TMS320C28XX__",
        '#pragma DATA_SECTION(mdl_params, "mdl_params") /* the F28335 copies it to RAM */',
        "#endif",
        "",
        "const mdl_app_params mdl_params = {",
        "    .chain = {",
        f"        .u_min_volts = {literal(model.u_min_V, 'u_min_V')},",
        f"        .margin_volts = {literal(MARGIN_SHARE * model.range_V, 'the margin')},",
        *_major(model),
        "    },",
        f"    .rate_hz = {scaling.rate_Hz}u,",
        f"    .u_zero_volts = {literal(scaling.input_V[0], 'the input range')},",
        f"    .volts_per_code = {literal(volts_per_code(model, scaling.input_V), 'V per code')},",
        f"    .y_zero_um = {literal(y_low, 'the output range')},",
        f"    .codes_per_um = {literal(CODE_MAX / (y_high - y_low), 'codes per um')}",
        "};",
    ]
    return "\n".join(lines) + "\n"


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


def _major(model: Model) -> list[str]:
    if model.kind == "madelung":
        head = {"kind": "MDL_POLYNOMIAL", "degree": f"{len(model.f0) - 1}u"}
        y_zero = model.f0[0]
        arrays: dict[str, Iterable[float]] = {"c": model.f0}
    elif model.kind == "major_curve":
        x, y = (np.array(v, np.float32) for v in zip(*model.breakpoints, strict=True))
        x[-1] = model.range_as(np.float32)
        slope = np.diff(y) / np.diff(x)  # in float32, as mdl_major_init_breakpoints does
        head = {"kind": "MDL_PIECEWISE_LINEAR", "count": f"{x.size}u"}
        y_zero = float(y[0])
        arrays = {"x_volts": x, "y_um": y, "slope": np.append(slope, slope[-1])}
    else:
        raise InputError(f"a model of kind {model.kind!r} cannot be exported")
    scalars = {
        **head,
        "range_volts": literal(model.range_as(np.float32), "the range"),
        "at_zero_um": literal(y_zero, "f0(0)"),
    }
    members = [f"            .{name} = {value}" for name, value in scalars.items()]
    members += [f"            .{name} = {{{_list(v, name)}}}" for name, v in arrays.items()]
    return ["        .major = {", ",\n".join(members), "        }"]


def _list(values: Iterable[float], name: str) -> str:
    items = [literal(float(v), f"{name}[{i}]") for i, v in enumerate(values)]
    rows = [", ".join(items[i : i + 6]) for i in range(0, len(items), 6)]
    return (",\n" + " " * 16).join(rows)

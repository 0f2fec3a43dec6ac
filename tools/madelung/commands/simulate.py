"""``madelung simulate``: records of a simulated actuator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from madelung.errors import InputError
from madelung.waveforms import Command, Waveform

_COMMAND = "What the actuator is told"
_STAGE = "What the actuator and its sensor are like"


def simulate(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The record to write, CSV: t_s,u_V,y_um.")
    ],
    waveform: Annotated[
        Waveform,
        typer.Option(
            help="triangle, sine: up and back, again and again. decaying: nested triangles of "
            "falling, then growing peaks. sines: a sum (--lines). multisine: every multiple of "
            "--hz in --band, random phases. staircase: equal steps. steps: random levels. "
            "codes: a random level every sample.",
            rich_help_panel=_COMMAND,
        ),
    ] = Waveform.TRIANGLE,
    seconds: Annotated[float, typer.Option(help="Length, s.", rich_help_panel=_COMMAND)] = 20.0,
    rate: Annotated[float, typer.Option(help="Samples per s.", rich_help_panel=_COMMAND)] = 200.0,
    u_min: Annotated[
        float | None,
        typer.Option(help="Lowest command, V (default: the stage's, 0).", rich_help_panel=_COMMAND),
    ] = None,
    u_max: Annotated[
        float | None,
        typer.Option(
            help="Highest command, V (default: the stage's, 40).", rich_help_panel=_COMMAND
        ),
    ] = None,
    hz: Annotated[
        float,
        typer.Option(
            help="Cycles per s: of triangle, sine and multisine, and of the first swing of "
            "decaying (the paper: 0.333).",
            rich_help_panel=_COMMAND,
        ),
    ] = 0.1,
    band: Annotated[
        tuple[float, float],
        typer.Option(help="Band of multisine, Hz.", rich_help_panel=_COMMAND),
    ] = (0.5, 20.0),
    line: Annotated[
        list[float] | None,
        typer.Option(
            help="A frequency of sines, Hz; may be given again (default: 0.3 0.7 1.9).",
            rich_help_panel=_COMMAND,
        ),
    ] = None,
    dwell: Annotated[
        float,
        typer.Option(help="Rest at a level of a staircase or steps, s.", rich_help_panel=_COMMAND),
    ] = 0.5,
    rise: Annotated[
        float, typer.Option(help="Time from level to level, s.", rich_help_panel=_COMMAND)
    ] = 0.0,
    turns: Annotated[
        int,
        typer.Option(help="Peaks of decaying, levels of a staircase.", rich_help_panel=_COMMAND),
    ] = 7,
    stage: Annotated[
        Path | None,
        typer.Option(
            help="JSON file with attributes of madelung.stage.Stage; the options below, where "
            "given, go before it.",
            rich_help_panel=_STAGE,
        ),
    ] = None,
    stroke_um: Annotated[
        float | None, typer.Option(help="Stroke, um (default: 30).", rich_help_panel=_STAGE)
    ] = None,
    noise_um: Annotated[
        float | None,
        typer.Option(help="Rms of the sensor's noise, um (default: 0.01).", rich_help_panel=_STAGE),
    ] = None,
    noise_ar: Annotated[
        float | None,
        typer.Option(
            help="Colour of the noise: correlation over 5 ms, 0 (white) to below 1 (default: 0).",
            rich_help_panel=_STAGE,
        ),
    ] = None,
    offset_um: Annotated[
        float | None, typer.Option(help="Sensor's offset, um (default: 0).", rich_help_panel=_STAGE)
    ] = None,
    dac_bits: Annotated[
        int | None,
        typer.Option(
            help="Bits of the drive's converter, 0: none (default: 12).", rich_help_panel=_STAGE
        ),
    ] = None,
    adc_bits: Annotated[
        int | None,
        typer.Option(
            help="Bits of the sensor's converter, 0: none (default: 12).", rich_help_panel=_STAGE
        ),
    ] = None,
    adc_max_um: Annotated[
        float | None,
        typer.Option(
            help="Where the sensor saturates, um (default: a quarter above the stroke).",
            rich_help_panel=_STAGE,
        ),
    ] = None,
    drop_share: Annotated[
        float | None,
        typer.Option(help="Share of rows that are missing (default: 0).", rich_help_panel=_STAGE),
    ] = None,
    stuck_share: Annotated[
        float | None,
        typer.Option(
            help="Share of rows with a stuck reading (default: 0).", rich_help_panel=_STAGE
        ),
    ] = None,
    physics: Annotated[
        str | None,
        typer.Option(
            help="Hysteresis: relays (Preisach) or slides (Maxwell) (default: relays).",
            rich_help_panel=_STAGE,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all that is random.")] = 0,
) -> None:
    """Simulate an actuator that follows a command, and write the record.

    Unless told otherwise: a piezo stage of 0 to 40 V and 30 um, hysteresis 13 % of the stroke,

    converters of 12 bits, sensor noise of 10 nm rms, at rest at the first voltage.

    A slow loop to identify a model from, always the same for the same seed:

    madelung simulate --seconds 40 --seed 1 -o loop.csv
    """
    from dataclasses import replace

    from madelung.records import write_record
    from madelung.stage import Stage, load_stage
    from madelung.stage import simulate as run

    if seed < 0:
        raise InputError(f"--seed is {seed}: it must be 0 or more")
    told: dict[str, Any] = {
        "stroke_um": stroke_um,
        "noise_um": noise_um,
        "noise_ar": noise_ar,
        "offset_um": offset_um,
        "dac_bits": dac_bits,
        "adc_bits": adc_bits,
        "adc_max_um": adc_max_um,
        "drop_share": drop_share,
        "stuck_share": stuck_share,
        "physics": physics,
    }
    if stage is None:
        told |= {"u_min_V": u_min, "u_max_V": u_max}
    base = Stage() if stage is None else load_stage(stage)
    actuator = replace(base, **{k: v for k, v in told.items() if v is not None})
    command = Command(
        waveform=waveform,
        seconds=seconds,
        rate_hz=rate,
        u_min_V=actuator.u_min_V if u_min is None else u_min,
        u_max_V=actuator.u_max_V if u_max is None else u_max,
        hz=hz,
        band_hz=band,
        lines_hz=tuple(line) if line else Command.lines_hz,
        dwell_s=dwell,
        rise_s=rise,
        turns=turns,
        seed=seed,
    )
    record = run(actuator, command, seed)
    write_record(output, record)
    typer.echo(f"{output}: {record.t_s.size} rows")

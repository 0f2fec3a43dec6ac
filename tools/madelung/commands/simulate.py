"""``madelung simulate``: records and cases of a simulated actuator; ``madelung unseal``."""

from __future__ import annotations

import json
import secrets
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from madelung.campaigns import Campaign
from madelung.errors import InputError
from madelung.files import read_json, write_atomically
from madelung.waveforms import Command, Waveform, planned

if TYPE_CHECKING:
    from madelung.sim_effects import Parameters
    from madelung.stage import Stage

_COMMAND = "What the actuator is told"
_STAGE = "What the actuator and its sensor are like"
_CASE = "A whole case for madelung diagnose, and what makes it hard to predict"


def simulate(
    context: typer.Context,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The record to write, CSV: t_s,u_V,y_um."),
    ] = None,
    waveform: Annotated[
        Waveform,
        typer.Option(
            help="triangle, sine: up and back, again and again. decaying: nested triangles of "
            "falling, then growing peaks. sines: a sum (--lines). multisine: every multiple of "
            "--hz in --band, random phases. staircase: equal steps. steps: random levels. "
            "codes: a random level every sample. rounded: decaying sines. chirp: a sine that runs "
            "through --band. noise: low-passed at the end of --band. walk: random steps.",
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
    case: Annotated[
        Path | None,
        typer.Option(
            help="Write a case into this new folder: a record to identify from, records to train "
            "on, records to check. The labels go beside it, into <folder>.labels.json.",
            rich_help_panel=_CASE,
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="What the baseline does not know: delay, creep, resonance, ... (a wrong name "
            "lists them), random, or none; may be given again.",
            rich_help_panel=_CASE,
        ),
    ] = None,
    strength: Annotated[
        float,
        typer.Option(help="Size of the effects; 1: ordinary, 0.1: a tenth.", rich_help_panel=_CASE),
    ] = 1.0,
    campaign: Annotated[
        Campaign,
        typer.Option(
            help="rich: 100 000 rows of everything. short: a quarter of it. slow: nothing above "
            "2 Hz. sine: a single sine.",
            rich_help_panel=_CASE,
        ),
    ] = Campaign.RICH,
    seal: Annotated[
        bool,
        typer.Option(
            "--seal",
            help="Encrypt the labels into <folder>.sealed.json; `madelung unseal` opens them with "
            "the key that is printed, once.",
            rich_help_panel=_CASE,
        ),
    ] = False,
    from_diagnosis: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="diagnosis.json: write the command that its next experiment wants, t_s,u_V.",
            rich_help_panel=_COMMAND,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Of all that is random (default: 0; sealed: drawn)."),
    ] = None,
) -> None:
    """Simulate an actuator that follows a command, and write the record; or a whole case.

    Unless told otherwise: a piezo stage of 0 to 40 V and 30 um, hysteresis 13 % of the stroke,

    converters of 12 bits, sensor noise of 10 nm rms, at rest at the first voltage.

    A slow loop to identify a model from, always the same for the same seed:

    madelung simulate --seconds 40 --seed 1 -o loop.csv

    A case with a cause that nobody knows (its stage is drawn, too):

    madelung simulate --case trial --effect random --seal
    """
    from madelung.stage import Stage, random_stage

    if (output is None) == (case is None):
        raise InputError("give either -o RECORD.csv or --case FOLDER")
    if case is None and seal:
        raise InputError("--seal belongs to --case: a record has no labels")
    if from_diagnosis is not None:
        if output is None:
            raise InputError("--from writes a record, not a case: give -o RECORD.csv")
        _write_command(from_diagnosis, output)
        return
    told = {
        "u_min_V": u_min if stage is None else None,
        "u_max_V": u_max if stage is None else None,
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
    if case is not None:
        _refuse_command_options(context)
        if seed is None:
            seed = secrets.randbits(32) if seal else 0
        _write_case(
            case,
            effect or [],
            strength,
            campaign,
            _stage(stage, told, random_stage(seed)),
            seed,
            seal,
        )
        return
    assert output is not None
    actuator = _stage(stage, told, Stage())
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
        seed=seed or 0,
    )
    _write_record(output, actuator, command, effect or [], strength, seed or 0)


def unseal(
    sealed: Annotated[Path, typer.Argument(help="<folder>.sealed.json of `simulate --seal`.")],
    key: Annotated[str, typer.Argument(help="The key that was printed.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Write the labels here, JSON, and print the causes."),
    ] = None,
    diagnosis: Annotated[
        Path | None,
        typer.Option(help="Folder of a diagnosis of the case: say whether its verdict is right."),
    ] = None,
) -> None:
    """Print the labels of a sealed case, after checking that nobody has changed them."""
    from madelung import sealing
    from madelung.commands.common import keep_inputs

    labels = sealing.unseal(sealed, key)
    text = json.dumps(labels, indent=1)
    if output is None and diagnosis is None:
        typer.echo(text)
        return
    from madelung.blind.unsealed import compared

    read = [sealed, *([] if diagnosis is None else [diagnosis / "diagnosis.json"])]
    keep_inputs(read, output)
    said = compared(labels, None if diagnosis is None else read_json(read[1]))
    if output is not None:
        write_atomically(output, text + "\n")
    typer.echo(said)


def _stage(path: Path | None, told: dict[str, Any], otherwise: Stage) -> Stage:
    """The stage of a file, or another, but with what the options say."""
    from madelung.stage import load_stage

    base = otherwise if path is None else load_stage(path)
    return replace(base, **{k: v for k, v in told.items() if v is not None})


def _refuse_command_options(context: typer.Context) -> None:
    """A case chooses its own commands: say so instead of ignoring what was asked for."""
    names = {"waveform", "seconds", "rate", "hz", "band", "line", "dwell", "rise", "turns"}
    for name in sorted(names):
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            raise InputError(f"--{name} belongs to a record: a case's commands follow --campaign")


def _wanted(names: list[str], strength: float, seed: int) -> dict[str, float | Parameters]:
    """Effects to their strength, with those drawn that were asked for as ``random``."""
    import numpy as np

    from madelung.sim_effects import VOCABULARY

    named = [n for n in names if n not in ("random", "none")]
    if len(set(named)) < len(named) or ("none" in names and len(names) > 1):
        raise InputError("--effect: name every effect once, and none alone")
    left = [n for n in VOCABULARY if n not in named]
    drawn = np.random.default_rng([seed, 14]).permutation(left)[: names.count("random")]
    return {str(n): strength for n in [*named, *drawn]}


def _write_record(
    output: Path, stage: Stage, command: Command, effect: list[str], strength: float, seed: int
) -> None:
    from madelung.records import write_record
    from madelung.stage import make_effects, simulate

    wanted = _wanted(effect, strength, seed)
    acting, drawn = make_effects(stage, {"train/record": command}, wanted, seed)
    record = simulate(stage, command, seed, acting if drawn else None)
    write_record(output, record)
    typer.echo(f"{output}: {record.t_s.size} rows")
    for name, parameters in drawn.items():
        typer.echo(f"{name}: " + ", ".join(f"{k} {v:.4g}" for k, v in parameters.items()))


def _write_case(
    case: Path,
    effect: list[str],
    strength: float,
    campaign: Campaign,
    stage: Stage,
    seed: int,
    sealed: bool,
) -> None:
    from madelung.sealing import seal
    from madelung.stage import make_case

    labels_path = case.parent / f"{case.name}.{'sealed' if sealed else 'labels'}.json"
    if labels_path.exists():
        raise InputError(f"{labels_path}: exists already; name a new folder")
    labels = make_case(case, _wanted(effect, strength, seed), seed, campaign, stage)
    typer.echo(f"{case}: {len(labels['deviation_um'])} records")
    if not sealed:
        write_atomically(labels_path, json.dumps(labels, indent=1) + "\n")
        typer.echo(f"{labels_path}: the labels")
        return
    key, commitment = seal(labels, labels_path)
    typer.echo(f"{labels_path}: the labels, sealed")
    typer.echo(f"SHA-256 of labels and salt: {commitment}")
    typer.echo(f"key, kept nowhere else: {key}")


def _write_command(diagnosis: Path, output: Path) -> None:
    """Write the command of a diagnosis's next experiment: t_s,u_V."""
    from madelung.records import Record, write_record

    told = read_json(diagnosis)
    try:
        command = planned(told.get("next_experiment") if isinstance(told, dict) else None)
    except InputError as error:
        raise InputError(f"{diagnosis}: {error}") from error
    t = command.time_s
    write_record(output, Record(str(output), t.round(6), command.at(t).round(6)))
    typer.echo(f"{output}: {t.size} rows")

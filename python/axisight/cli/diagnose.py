"""The command ``axisight diagnose``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import (
    AtRests,
    Columns,
    CutoffHz,
    Despite,
    Force,
    From,
    MaxBytes,
    Model,
    Moving,
    Simulated,
    To,
    Untrusted,
    Validation,
    bars,
    errors,
    write_each,
)
from axisight.cli.experiment import asked_experiment
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.outputs import Outputs
from axisight.cli.robot import GivenEffects, load_simulator, parse_effects
from axisight.cli.screen import OUT, is_output
from axisight.cli.show import show_account, show_diagnosis
from axisight.errors import InputError
from axisight.fitting import robot_parameters
from axisight.gap import Settings, diagnose
from axisight.gap.facts.result import VerdictKind
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.intake.inputs import read_inputs
from axisight.gap.prepare.used_part import Used
from axisight.gap.simulator.own_parameters import gain_names, gain_quantities
from axisight.gap.simulator.tolerances import with_tolerances
from axisight.robot import Robot

EXIT_CODES: dict[VerdictKind, int] = {
    "none": 0,
    "explained": 10,
    "unknown": 11,
    "undecidable": 12,
}
"""Exit status by verdict, with ``--exit-code``: apart from those of errors, which are 1 and 2."""


def _tolerances(given: list[str], robot: Robot) -> dict[str, float]:
    """Return the tolerances given by quantity or name; raises InputError naming the option."""
    quantities = [*DEFAULT_TOLERANCES, *gain_quantities(robot)]
    known = [*robot_parameters(robot), *gain_names(robot)]
    own = [n for n in known if n.rsplit(".", 1)[1] in quantities]
    changed = {}
    for item in given:
        name, _, value = item.partition("=")
        try:
            changed[name] = float(value)
        except ValueError:
            raise InputError(f"--tolerance: expected NAME=VALUE, got {item!r}") from None
        if name not in quantities and name not in own:
            raise InputError(
                f"--tolerance: expected one of {', '.join(quantities)}, or one of a joint "
                f"({own[0]}), got {name!r}"
            )
        if not 0 < changed[name] < 1:
            raise InputError(f"--tolerance {name}: expected between 0 and 1, got {value}")
    return changed


def diagnose_command(
    case_or_logs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A case folder, or logs to fit and choose on; the simulator may stand first."
        ),
    ] = None,
    model: Model = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    validation: Validation = None,
    columns: Columns = None,
    json: Annotated[
        Path | None,
        typer.Option(
            help="Write the verdict here; - is standard output, and all else goes to standard error."
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write the HTML report here.")] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            help="Relative tolerance of a simulator parameter, e.g. mass=0.02, instead of that of "
            "the robot file or the default; of gains of a controller of targets too, e.g. kp=0.5."
        ),
    ] = None,
    cutoff_hz: CutoffHz = None,
    despite: Despite = None,
    max_causes: Annotated[
        int, typer.Option(min=0, help="Stop after so many causes.")
    ] = Settings.max_causes,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Candidates tried at a time. Default: all cores.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Rules every random choice.")] = 0,
    effect: GivenEffects = None,
    simulated: Simulated = None,
    next_experiment: Annotated[
        Path | None,
        typer.Option(
            help="Design the experiment that tells the causes apart which stay open, and write its "
            "references into this folder: of logs in closed loop with velocity references, no others.",
        ),
    ] = None,
    to_show: Annotated[
        str | None,
        typer.Option(
            metavar="EFFECT@AXIS PARAM=VALUE",
            help="The experiment is to show this effect, of this size, if the machine has it.",
        ),
    ] = None,
    velocity_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            help="Of each motor or all (rad/s) in the experiment. Default: what the logs show.",
        ),
    ] = None,
    travel_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            help="How far each motor or all may turn in the experiment, either way (rad). Default: what the logs show.",
        ),
    ] = None,
    torque_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            help="Of each motor or all (Nm) in the experiment. Default: what the logs show.",
        ),
    ] = None,
    write_model: Annotated[
        Path | None,
        typer.Option(
            help="Write the simulator with its causes, and with gains of targets that were re-fitted, here: a "
            "robot file (.toml), or a URDF or MJCF as the "
            "one that was diagnosed."
        ),
    ] = None,
    signals: Annotated[
        Path | None,
        typer.Option(
            help="Write measured and simulated torques of all logs, before and after, here: .parquet or .mcap."
        ),
    ] = None,
    explain: Annotated[
        bool,
        typer.Option(
            "--explain",
            help="Say how the verdict came about: what was compared, what each rule added, why rivals lost, "
            "what each move did.",
        ),
    ] = False,
    force: Force = False,
    exit_code: Annotated[
        bool,
        typer.Option(
            "--exit-code",
            help="Exit with the verdict: 0 none, 10 explained, 11 unknown, 12 undecidable. Without it 0.",
        ),
    ] = False,
    untrusted: Untrusted = False,
    max_bytes: MaxBytes = None,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
    cut_at_rests: AtRests = False,
    fleet: Annotated[
        Path | None,
        typer.Option(help="Diagnose every case below this folder, into --out, case by case."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for a fleet's verdicts, table and page.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes of a fleet here. Default: all processors.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler whose workers diagnose a fleet.")
    ] = None,
) -> None:
    """Say where a simulator disagrees with measured logs, which effect causes it, and how far it shrinks."""
    if fleet is not None:
        for_one = {
            "a case or logs": case_or_logs,
            "--model": model,
            "--base": base,
            "--tip": tip,
            "--payload": payload,
            "--validation": validation,
            "--columns": columns,
            "--json": json,
            "--report": report,
            "--tolerance": tolerance,
            "--threads": threads,
            "--despite": despite,
            "--effect": effect,
            "--next-experiment": next_experiment,
            "--to-show": to_show,
            "--velocity-limit": velocity_limit,
            "--travel-limit": travel_limit,
            "--torque-limit": torque_limit,
            "--write-model": write_model,
            "--signals": signals,
            "--simulated": simulated,
            "--explain": explain,
            "--force": force,
            "--exit-code": exit_code,
            "--untrusted": untrusted,
            "--max-bytes": max_bytes,
            "--from": start_s,
            "--to": stop_s,
            "--moving": moving,
            "--cut-at-rests": cut_at_rests,
        }
        settings = Settings(seed=seed, cutoff_hz=cutoff_hz, max_causes=max_causes)
        # Brings what tables and schedulers need: only for those who have a fleet.
        run_fleet = import_module("axisight.cli.fleet").run_fleet
        run_fleet(fleet, out, settings, workers, scheduler, [k for k, v in for_one.items() if v])
        return
    if is_output(json):
        OUT.leave_output()
    with errors():
        if not case_or_logs:
            raise InputError("expected a case folder or logs, or --fleet FOLDER, got nothing")
        if out or workers or scheduler:
            raise InputError("--out, --workers, --scheduler: expected with --fleet only")
        asked = asked_experiment(
            next_experiment, to_show, velocity_limit, travel_limit, torque_limit
        )
        options = ModelOptions(base, tip, payload)
        load = partial(load_simulator, given=parse_effects(effect), options=options)
        inputs = read_inputs(
            case_or_logs,
            model,
            validation or [],
            columns,
            load,
            Used(start_s, stop_s, moving, cut_at_rests),
            simulated or [],
            bare=options.load,
            untrusted=untrusted,
            max_bytes=max_bytes,
        )
        outputs = Outputs(
            json, report, write_model, signals, next_experiment, to_show is not None, force
        )
        outputs.check(inputs, [*inputs.files(), *_described(case_or_logs, columns)])
        settings = Settings(
            seed=seed,
            cutoff_hz=cutoff_hz,
            max_causes=max_causes,
            despite=tuple(despite or ()),
            threads=threads or os.cpu_count() or 1,
        )
        given = _tolerances(tolerance or [], inputs.robot)
        settings = with_tolerances(settings, inputs.robot, inputs.robot_source, given)
        with bars() as progress:
            found = diagnose(
                name=inputs.name,
                robot=inputs.robot,
                estimation=inputs.estimation,
                validation=inputs.validation,
                settings=settings,
                progress=progress,
                separate=asked is not None,
                to_show=None if asked is None else asked.to_show,
                within=None if asked is None else asked.within,
                signals=signals is not None,
                simulated=inputs.simulated,
            )
        show_diagnosis(found)
        if explain:
            show_account(found)
        write_each(outputs.writes(found, inputs, options))
        if exit_code:
            raise typer.Exit(EXIT_CODES[found.verdict])


def _described(given: Sequence[Path], columns: Path | None) -> list[Path]:
    """Return the files that say what is read, beside those that hold it."""
    return [p / "case.toml" for p in given if p.is_dir()] + [p for p in (columns,) if p]

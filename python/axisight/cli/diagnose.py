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
from axisight.cli.panels import ADVANCED, EXPERIMENT, FLEET, OUTPUT, SIMULATOR
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
    "explained_in_part": 13,
}
"""Exit status by verdict, with ``--exit-code``; 1 and 2 are reserved for errors."""


def _tolerances(given: list[str], robot: Robot) -> dict[str, float]:
    """Return the tolerances [1] of ``--tolerance`` by quantity or parameter; raise InputError naming it."""
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
            raise InputError(
                f"--tolerance {name}: expected a share between 0 and 1 (0.02 for 2 %), got {value}"
            )
    return changed


def diagnose_command(
    case_or_logs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="CASE|LOG",
            help="A case folder, or estimation logs. The simulator may stand first.",
        ),
    ] = None,
    model: Model = None,
    validation: Validation = None,
    columns: Columns = None,
    report: Annotated[
        Path | None, typer.Option(metavar="HTML", help="Write the report here.")
    ] = None,
    json: Annotated[
        Path | None,
        typer.Option(
            help="Write the verdict here as JSON. With - it goes to standard output, all else to "
            "standard error."
        ),
    ] = None,
    write_model: Annotated[
        Path | None,
        typer.Option(
            help="Write the simulator with its causes here: robot file (.toml), or URDF, MJCF or USD where "
            "that was diagnosed. With --with-remainder, a robot file also has the modelled remainder."
        ),
    ] = None,
    play_joints: Annotated[
        bool,
        typer.Option(
            "--play-joints",
            rich_help_panel=OUTPUT,
            help="Write backlash into an MJCF as a joint of its own with a range. Needs --write-model.",
        ),
    ] = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", "-v", help="Print all tables: pooled gap, re-fit, ranking, limits."
        ),
    ] = False,
    explain: Annotated[
        bool,
        typer.Option(
            "--explain",
            rich_help_panel=OUTPUT,
            help="Also print how the verdict came about: comparisons, rules, rivals, moves.",
        ),
    ] = False,
    signals: Annotated[
        Path | None,
        typer.Option(
            rich_help_panel=OUTPUT,
            help="Write measured and simulated torques and positions of all logs, before and after: .parquet, "
            ".mcap with a layout for Foxglove, or .rrd for Rerun.",
        ),
    ] = None,
    posterior: Annotated[
        Path | None,
        typer.Option(
            metavar="NC",
            rich_help_panel=OUTPUT,
            help="Write the joint posterior of all parameters here, as a NetCDF file (.nc) for ArviZ and "
            "'axisight randomize'.",
        ),
    ] = None,
    with_remainder: Annotated[
        bool,
        typer.Option(
            "--with-remainder",
            help="Also model what the causes leave: smooth functions of speed, load and other variables, judged on "
            "the validation logs.",
        ),
    ] = False,
    remainder_table: Annotated[
        Path | None,
        typer.Option(
            metavar="TOML",
            rich_help_panel=OUTPUT,
            help="Write the modelled remainder here as a table, for a simulator. Needs --with-remainder.",
        ),
    ] = None,
    exit_code: Annotated[
        bool,
        typer.Option(
            "--exit-code",
            rich_help_panel=OUTPUT,
            help="Exit with the verdict: 0 none, 10 explained, 11 unknown, 12 undecidable, 13 explained in part. "
            "Without it 0.",
        ),
    ] = False,
    force: Force = False,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
    cut_at_rests: AtRests = False,
    cutoff_hz: CutoffHz = None,
    despite: Despite = None,
    effect: GivenEffects = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SHARE",
            rich_help_panel=SIMULATOR,
            help="Tolerance of an own parameter, as mass=0.02, or of a gain, as kp=0.5 (repeatable). "
            "Default: that of the robot file.",
        ),
    ] = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    simulated: Simulated = None,
    next_experiment: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            rich_help_panel=EXPERIMENT,
            help="Design the next experiment, and write its motion here: references, joint positions (CSV), "
            "ROS JointTrajectory. It tells open causes apart, or shows more of what stays unknown.",
        ),
    ] = None,
    to_show: Annotated[
        str | None,
        typer.Option(
            metavar="EFFECT|limits",
            rich_help_panel=EXPERIMENT,
            help="The motion shall show this effect, of this size, if the machine has it. With 'limits': a record "
            "that lowers all detection limits.",
        ),
    ] = None,
    velocity_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=EXPERIMENT,
            help="Velocity limit of each motor, or of all (rad/s). Default: the robot's model, else what the logs "
            "reach.",
        ),
    ] = None,
    travel_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=EXPERIMENT,
            help="Travel of each motor, or of all, either way (rad). Default: the robot's model, else what the logs "
            "reach.",
        ),
    ] = None,
    torque_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=EXPERIMENT,
            help="Torque limit of each motor, or of all (Nm). Default: the robot's model, else what the logs reach.",
        ),
    ] = None,
    acceleration_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=EXPERIMENT,
            help="Acceleration limit of each motor, or of all (rad/s^2). Default: the robot's model, else what the "
            "logs reach; none under velocity references.",
        ),
    ] = None,
    room: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z,X,Y,Z",
            rich_help_panel=EXPERIMENT,
            help="Box in which the origin of the last link stays, in the base frame (m): lowest x, y, z, "
            "highest x, y, z.",
        ),
    ] = None,
    fleet: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", rich_help_panel=FLEET, help="Diagnose every case below this folder."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            rich_help_panel=FLEET,
            help="Folder for the verdicts, the table and the page.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, rich_help_panel=FLEET, help="Processes on this machine. Default: all cores."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=FLEET,
            help="Dask scheduler, as tcp://10.0.0.1:8786, whose workers diagnose.",
        ),
    ] = None,
    max_causes: Annotated[
        int, typer.Option(min=0, rich_help_panel=ADVANCED, help="Stop after this many causes.")
    ] = Settings.max_causes,
    seed: Annotated[
        int, typer.Option(min=0, rich_help_panel=ADVANCED, help="Seed of every random choice.")
    ] = 0,
    threads: Annotated[
        int | None,
        typer.Option(
            min=1,
            rich_help_panel=ADVANCED,
            help="Hypotheses that are tried at a time. Default: all cores.",
        ),
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            rich_help_panel=ADVANCED,
            help="Stop the search after this time and report what was found by then. inf: no limit.",
        ),
    ] = Settings.time_limit_s,
    untrusted: Untrusted = False,
    max_bytes: MaxBytes = None,
) -> None:
    """Find why the simulator differs from the logs: which causes, of what size, how sure.

    A case: `axisight diagnose CASE --report report.html`

    Own logs: `axisight diagnose LOG LOG --model robot.urdf --columns map.toml`
    """
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
            "--acceleration-limit": acceleration_limit,
            "--room": room,
            "--write-model": write_model,
            "--play-joints": play_joints,
            "--signals": signals,
            "--posterior": posterior,
            "--simulated": simulated,
            "--explain": explain,
            "--with-remainder": with_remainder,
            "--remainder-table": remainder_table,
            "--verbose": verbose,
            "--force": force,
            "--exit-code": exit_code,
            "--untrusted": untrusted,
            "--max-bytes": max_bytes,
            "--from": start_s,
            "--to": stop_s,
            "--moving": moving,
            "--cut-at-rests": cut_at_rests,
        }
        settings = Settings(
            seed=seed, cutoff_hz=cutoff_hz, max_causes=max_causes, time_limit_s=time_limit
        )
        # Imported here, because only fleets need the libraries for tables and schedulers.
        run_fleet = import_module("axisight.cli.fleet").run_fleet
        run_fleet(fleet, out, settings, workers, scheduler, [k for k, v in for_one.items() if v])
        return
    if is_output(json):
        OUT.leave_output()
    with errors():
        if not case_or_logs:
            raise InputError(
                "CASE or LOG...: expected a case folder or logs, or --fleet FOLDER, got nothing; "
                "'axisight demo' makes a case"
            )
        if out or workers or scheduler:
            raise InputError(
                "--out, --workers, --scheduler: expected --fleet FOLDER beside them, got none; files of "
                "one diagnosis go to --report and --json"
            )
        experiment_on = asked_experiment(
            next_experiment,
            to_show,
            velocity_limit,
            travel_limit,
            torque_limit,
            acceleration_limit,
            room,
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
        asked = None if experiment_on is None else experiment_on(inputs.robot)
        if remainder_table is not None and not with_remainder:
            raise InputError("--remainder-table: expected --with-remainder beside it, got none")
        if play_joints and write_model is None:
            raise InputError("--play-joints: expected --write-model beside it, got none")
        outputs = Outputs(
            json,
            report,
            write_model,
            signals,
            posterior,
            remainder_table,
            next_experiment,
            to_show is not None,
            force,
            play_joints,
        )
        outputs.check(inputs, [*inputs.files(), *_described(case_or_logs, columns)])
        settings = Settings(
            seed=seed,
            cutoff_hz=cutoff_hz,
            max_causes=max_causes,
            despite=tuple(despite or ()),
            time_limit_s=time_limit,
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
                posterior=posterior is not None,
                simulated=inputs.simulated,
                remainder=with_remainder,
            )
        show_diagnosis(found, verbose=verbose, given=outputs.given())
        if explain:
            show_account(found)
        write_each(outputs.writes(found, inputs, options))
        if exit_code:
            raise typer.Exit(EXIT_CODES[found.verdict])


def _described(given: Sequence[Path], columns: Path | None) -> list[Path]:
    """Return the files that describe the logs: ``case.toml`` of case folders, and the column map."""
    return [p / "case.toml" for p in given if p.is_dir()] + [p for p in (columns,) if p]

"""The command ``axisight excite``."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Annotated, Any

import typer

from axisight.arguments import counted
from axisight.cli.common import complain, errors, numbers, one_or_each, say
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.panels import LIMITS, SIGNAL
from axisight.cli.robot import (
    GivenEffects,
    effects_on,
    parse_effects,
    say_effects,
    say_import,
    with_given,
)
from axisight.cli.screen import OUT
from axisight.errors import InputError
from axisight.excitation import (
    Excited,
    OptimalSpectrum,
    excite,
    load_design,
    read_design,
    write_references,
)
from axisight.excitation.design import ZIPPERED
from axisight.excitation.files import reference_files
from axisight.excitation.plots import plot_references, plot_signal
from axisight.robot_import import is_model_file
from axisight.storage import check_targets, write_bytes


def excite_command(
    design: Annotated[
        Path | None, typer.Argument(help="Design (TOML). Options replace what it says.")
    ] = None,
    out: Annotated[
        Path, typer.Option(help="File to write: .csv (with .design.json), .mat or .parquet.")
    ] = Path("excitation.parquet"),
    robot: Annotated[
        str | None, typer.Option(help="robot.toml, URDF, MJCF, DH table or a preset.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    kind: Annotated[
        str | None,
        typer.Option(
            help="multisine, chirp, stepped_sine, triangle, prbs or discrete_interval_binary."
        ),
    ] = None,
    period_s: Annotated[float | None, typer.Option(help="Length of a period (s).")] = None,
    band_hz: Annotated[
        str | None, typer.Option(metavar="LOW,HIGH", help="Lowest and highest frequency (Hz).")
    ] = None,
    peak_rad_s: Annotated[float | None, typer.Option(help="Peak motor velocity (rad/s).")] = None,
    grid: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIGNAL, help="Lines that are excited: full, odd, odd_odd or odd_random."
        ),
    ] = None,
    phases: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIGNAL, help="Phases of the lines: optimized, random or schroeder."
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(rich_help_panel=SIGNAL, help="Seed of every random choice.")
    ] = None,
    starts: Annotated[
        int | None, typer.Option(rich_help_panel=SIGNAL, help="Starts of the search for phases.")
    ] = None,
    time_s: Annotated[
        float | None,
        typer.Option(rich_help_panel=SIGNAL, help="Time limit of the search for phases (s)."),
    ] = None,
    directions: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIGNAL,
            help="Directions of the axes by experiment: t1, t2, hadamard, dft or zippered.",
        ),
    ] = None,
    zippered: Annotated[
        bool,
        typer.Option(
            "--zippered",
            rich_help_panel=SIGNAL,
            help="One experiment in which each axis has its own lines; the same as --directions "
            "zippered. Estimate with local_joint_input_output.",
        ),
    ] = False,
    optimal_for: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUESTION",
            rich_help_panel=SIGNAL,
            help="Put the power where it answers a question best: a parameter such as "
            "axis1.stiffness, by name or with wildcards (repeatable), all, relative_response or "
            "absolute_response.",
        ),
    ] = None,
    limited: Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIGNAL,
            help="Power that the optimal spectrum shares out: torque, velocity, reference or both "
            "(torque and velocity, the default).",
        ),
    ] = None,
    uncertainty: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=SIGNAL,
            help="Relative standard deviation of the parameters of the model that the optimal "
            "spectrum has to bear, e.g. 0.2.",
        ),
    ] = None,
    realizations: Annotated[
        int | None,
        typer.Option(
            rich_help_panel=SIGNAL,
            help="Sets of experiments, each with phases of its own at the same lines: they show distortion.",
        ),
    ] = None,
    square: Annotated[
        str | None,
        typer.Option(
            metavar="AMPLITUDE,PERIOD",
            rich_help_panel=SIGNAL,
            help="Add a square wave (rad/s, s) to all axes.",
        ),
    ] = None,
    dc_level_rad_s: Annotated[
        float | None, typer.Option(rich_help_panel=SIGNAL, help="Mean velocity (rad/s).")
    ] = None,
    velocity_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Velocity limit of each motor, or of all (rad/s).",
        ),
    ] = None,
    acceleration_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Acceleration limit of each motor, or of all (rad/s^2).",
        ),
    ] = None,
    torque_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Torque limit of each motor, or of all (Nm).",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE,...",
            rich_help_panel=LIMITS,
            help="Driven joint angles at which the check starts (rad). Default: the operating point.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the signal here, and the references in NAME-references (.png, .pdf or .svg)."
        ),
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", rich_help_panel=LIMITS, help="Write although a limit is exceeded."),
    ] = False,
    effect: GivenEffects = None,
) -> None:
    """Make references for a robot, check them against its limits in simulation, and write them."""
    with errors():
        targets = {f"--out, {path.name}": path for path in reference_files(out)}
        targets |= {f"--plot, {path.name}": path for path in _figures(plot)}
        check_targets(targets, inputs=[Path(x) for x in (design, robot) if x is not None])
        data = {} if design is None else load_design(design)
        _replace(
            data, "signal", kind=kind, period_s=period_s, band_hz=_numbers("--band-hz", band_hz)
        )
        _replace(data, "signal", peak_rad_s=peak_rad_s, grid=grid, phases=phases)
        _replace(data, "signal", seed=seed, starts=starts, time_s=time_s)
        optimal = {"optimal_for": optimal_for or None, "limited": limited}
        _replace(data, "optimal", **optimal, relative_uncertainty=uncertainty)
        if zippered and directions not in (None, ZIPPERED):
            raise InputError(f"--zippered, --directions: expected one of them, got {directions}")
        wave = _numbers("--square", square)
        if wave is not None:
            if len(wave) != 2:
                raise InputError(f"--square: expected AMPLITUDE,PERIOD, got {square}")
            _replace(data, "square", amplitude_rad_s=wave[0], period_s=wave[1])
        limits = {
            "velocity_rad_s": one_or_each("--velocity-limit", velocity_limit),
            "acceleration_rad_s2": one_or_each("--acceleration-limit", acceleration_limit),
            "torque_nm": one_or_each("--torque-limit", torque_limit),
            "start_rad": _numbers("--start", start),
        }
        _replace(data, "limits", **limits)
        top = {
            "robot": robot,
            "directions": ZIPPERED if zippered else directions,
            "realizations": realizations,
            "dc_level_rad_s": dc_level_rad_s,
        }
        data |= {name: value for name, value in top.items() if value is not None}
        checked = read_design(data, "options" if design is None else str(design))
        texts = parse_effects(effect)
        machine = ModelOptions(base, tip, payload).load(checked.robot)
        given = effects_on(machine, texts)
        if is_model_file(checked.robot):
            say_import(machine)
        # Otherwise nothing is simulated, so the effects do not matter.
        if checked.limits is not None and machine.controller_kind != "none":
            say_effects(machine, checked.robot, given)
        made = excite(checked, with_given(machine, given))
        _show(made)
        if made.report is not None and not made.report.ok and not force:
            complain(
                "nothing was written: a limit is exceeded (see above); --force writes all the same"
            )
            raise typer.Exit(1)
        for path in write_references(made.references, out):
            say(f"written: {path}")
        if plot is not None:
            for path in _draw(made, plot):
                say(f"written: {path}")


def _show(made: Excited) -> None:
    for number, signal in enumerate(made.signals, 1):
        axis = f"axis {number}: " if len(made.signals) > 1 else ""
        OUT.print(
            f"{axis}crest factor {signal.crest_factor:.4f}, peak {signal.peak:.4g} rad/s, "
            f"{len(signal.lines)} lines, period {signal.period_s:g} s, "
            f"{counted(made.references.n_experiments, 'experiment')}"
        )
    for found in made.searches:
        OUT.print(
            f"best of {counted(len(found.crest_factors), 'start')}: number {found.start}, seed {found.seed} "
            f"({found.status})"
        )
    if made.optimal is not None:
        _show_optimal(made.optimal)
    if made.report is not None:
        say(str(made.report))


def _show_optimal(found: OptimalSpectrum) -> None:
    limits = "torque and velocity" if found.limited == "both" else found.limited
    what = {
        "variance": "variance of what you asked for",
        "determinant": "mean variance of all parameters",
    }.get(found.criterion, "largest variance of the response")
    OUT.print(
        f"optimal spectrum: {what} {1 / found.gain:.3g} times that of a flat spectrum with the same "
        f"power of the {limits} ({found.status})"
    )
    if found.left_out:
        OUT.print(f"left out of the design, no linear model: {', '.join(found.left_out)}")


def _draw(made: Excited, path: Path) -> list[Path]:
    figures = (plot_signal(made.signal), plot_references(made.references))
    for name, figure in zip(_figures(path), figures, strict=True):
        drawn = io.BytesIO()
        try:
            figure.savefig(drawn, dpi=200, format=name.suffix.removeprefix(".") or None)
        except ValueError as error:
            raise InputError(f"--plot: {name} cannot be drawn: {error}") from None
        write_bytes(name, drawn.getvalue())
    return _figures(path)


def _figures(path: Path | None) -> list[Path]:
    """Return the two files of ``--plot``, [] without it."""
    return [] if path is None else [path, path.with_name(f"{path.stem}-references{path.suffix}")]


def _replace(data: dict[str, Any], part: str, **values: Any) -> None:
    given = {name: value for name, value in values.items() if value is not None}
    if given:
        data[part] = {**data.get(part, {}), **given}


def _numbers(option: str, text: str | None) -> list[float] | None:
    return None if text is None else numbers(option, text)

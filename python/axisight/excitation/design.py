"""The design of an excitation in TOML, which ``axisight excite`` carries out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import instance, path_of, shown
from axisight.display.summary import summarized
from axisight.documents import parse_toml, read_text
from axisight.errors import InputError
from axisight.excitation.crest import CrestSearch, optimize_crest_factor
from axisight.excitation.limits import LimitReport, Limits, check_limits
from axisight.excitation.lines import Grid
from axisight.excitation.multisine import Multisine, multisine
from axisight.excitation.references import References, references
from axisight.excitation.signals import (
    PeriodicSignal,
    chirp,
    discrete_interval_binary,
    prbs,
    square,
    stepped_sine,
    triangle,
)
from axisight.robot import Robot, load_robot
from axisight.robot.presets import PRESETS

Positive = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0, lt=2**64)]
PerAxis = Positive | list[Positive]
T = TypeVar("T")


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class SignalDesign(_Part):
    """The broadband signal; ``peak_rad_s`` is its largest absolute value, motor side.

    ``kind`` decides which other fields apply:

    - multisine: ``period_s``, ``band_hz`` with ``grid`` (or ``lines``), ``phases``, ``seed``, ``run``.
      ``"optimized"`` phases are the best of ``starts``, or of the starts within ``time_s``.
    - chirp, stepped sine, discrete-interval binary: ``period_s`` and ``band_hz``
    - triangle: ``period_s``
    - PRBS: ``bits`` and ``hold``
    """

    kind: Literal[
        "multisine", "chirp", "stepped_sine", "triangle", "prbs", "discrete_interval_binary"
    ] = "multisine"
    peak_rad_s: Positive
    period_s: Positive | None = None
    band_hz: tuple[Positive, Positive] | None = None
    lines: list[Count] | None = None
    grid: Grid = "full"
    group: Annotated[int, Field(ge=2)] = 4
    phases: Literal["optimized", "random", "schroeder"] = "optimized"
    seed: Seed = 0
    run: Seed = 0
    starts: Count = 16
    time_s: Positive | None = None
    snow_lines: list[Count] = []
    bits: Annotated[int, Field(ge=2, le=24)] = 12
    hold: Count = 1


class SquareDesign(_Part):
    """The smoothed square wave on all axes, Wernholt (2004), (7.3)."""

    amplitude_rad_s: Positive
    period_s: Positive
    smoothing_samples: Annotated[int, Field(ge=0)] = 40


class LimitDesign(_Part):
    """Limits of the motors, one number or one per axis, and the number of periods to simulate.

    ``start_rad`` are the driven joint angles [rad] at which the simulation starts; None is the operating point
    of the robot.
    """

    velocity_rad_s: PerAxis | None = None
    acceleration_rad_s2: PerAxis | None = None
    torque_nm: PerAxis | None = None
    periods: Count = 2
    model: Literal["linear", "nonlinear"] = "nonlinear"
    start_rad: list[float] | None = None


class ExcitationDesign(_Part):
    """The design of references for a robot (file or preset).

    ``directions`` is ``"t1"``, ``"t2"``, ``"hadamard"``, ``"dft"`` or a matrix with one row per axis
    and one column per experiment. ``realizations`` is the number of sets of these experiments; each has phases
    of its own, at the same lines. Without ``limits`` there is no simulation.
    """

    schema_: Annotated[Literal["axisight.excite/1"], Field(alias="schema")] = "axisight.excite/1"
    robot: str
    signal: SignalDesign
    directions: Literal["t1", "identity", "t2", "hadamard", "dft"] | list[list[float]] = "t1"
    realizations: Count = 1
    square: SquareDesign | None = None
    dc_level_rad_s: float | list[float] = 0.0
    limits: LimitDesign | None = None


@summarized
@dataclass(frozen=True, eq=False)
class Excited:
    """The result of a design: references, signal, and the phase search and limit check if it has them."""

    references: References
    signal: Multisine | PeriodicSignal
    search: CrestSearch | None
    report: LimitReport | None


def read_design(data: dict[str, Any], where: str = "design") -> ExcitationDesign:
    """Return the checked design in ``data``, the content of a TOML file.

    Raises InputError naming every wrong field; the message begins with ``where``.
    """
    instance("data", data, dict)
    unnamed = [key for key in data if not isinstance(key, str)]
    if unnamed:
        raise InputError(f"{where}: expected names of fields, got {shown(unnamed[0])}")
    try:
        return ExcitationDesign(**data)
    except ValidationError as error:
        faults = [
            f"{'.'.join(str(p) for p in f['loc'])}: {f['msg'].lower()}, got {f['input']!r}"
            for f in error.errors()
        ]
        raise InputError(f"{where}: {'; '.join(faults)}") from None


def load_design(path: Path | str) -> dict[str, Any]:
    """Return the unchecked design in a TOML file.

    A robot file is found relative to the design file. Raises InputError for a file that cannot be
    read or is not TOML.
    """
    source = path_of("path", path)
    try:
        data = parse_toml(read_text(source))
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: expected a design in TOML: {error}") from None
    robot = data.get("robot")
    if isinstance(robot, str) and robot not in PRESETS:
        data["robot"] = str((source.parent / robot).resolve())
    return data


def excite(design: ExcitationDesign, robot: Robot | None = None) -> Excited:
    """Carry out a design and return its references; raises InputError naming the field.

    ``robot`` replaces the one that the design names, for example by one with effects.
    """
    instance("design", design, ExcitationDesign)
    robot = load_robot(design.robot) if robot is None else instance("robot", robot, Robot)
    if design.realizations > 1 and (
        design.signal.kind != "multisine" or design.signal.phases == "schroeder"
    ):
        raise InputError(
            "realizations: expected 1, or a multisine with optimized or random phases, got "
            f"{design.realizations} of {design.signal.kind}, phases {design.signal.phases}"
        )
    signals = [_signal(design.signal, robot.sample_time_s, design.signal.seed)]
    for part, seed in _further_phases(design.signal, signals[0][0], design.realizations):
        signals.append(_signal(part, robot.sample_time_s, seed))
    sets = [
        _experiments(design, robot, signal, realization)
        for realization, (signal, _) in enumerate(signals)
    ]
    made = replace(sets[0], period=np.concatenate([part.period for part in sets]))
    made.design["excite"] = design.model_dump(by_alias=True, mode="json")
    if len(sets) > 1:
        made.design["broadband_of_realizations"] = [part.design["broadband"] for part in sets]
    signal, search = signals[0]
    return Excited(made, signal, search, _report(design, made, robot))


def _further_phases(
    design: SignalDesign, first: Multisine | PeriodicSignal, realizations: int
) -> list[tuple[SignalDesign, int]]:
    """Return the signals after the first, and the seeds of their phases; all have the lines of the first.

    Random phases take the next run, optimized ones the next seed, since a search uses several runs.
    """
    same = {"lines": first.lines.tolist(), "band_hz": None, "grid": "full"}
    return [
        (design.model_copy(update={**same, "run": design.run + m}), design.seed + m)
        for m in range(1, realizations)
    ]


def _experiments(
    design: ExcitationDesign,
    robot: Robot,
    signal: Multisine | PeriodicSignal,
    realization: int,
) -> References:
    """Return the references of one realization."""
    wave = design.square
    return references(
        signal,
        robot.n_axes,
        directions=design.directions,
        square=None
        if wave is None
        else square(
            wave.period_s,
            robot.sample_time_s,
            amplitude=wave.amplitude_rad_s,
            smoothing_samples=wave.smoothing_samples,
        ),
        dc_level=design.dc_level_rad_s,
        seed=design.signal.seed,
        run=design.signal.run + realization,
    )


def _report(design: ExcitationDesign, made: References, robot: Robot) -> LimitReport | None:
    if design.limits is None:
        return None
    wanted = design.limits
    limits = Limits(wanted.velocity_rad_s, wanted.acceleration_rad_s2, wanted.torque_nm)
    return check_limits(
        made,
        robot,
        limits,
        periods=wanted.periods,
        model=wanted.model,
        start_rad=wanted.start_rad,
    )


def _signal(
    s: SignalDesign, sample_time_s: float, seed_of_phases: int
) -> tuple[Multisine | PeriodicSignal, CrestSearch | None]:
    if s.kind == "multisine":
        made, search = _multisine(s, sample_time_s, seed_of_phases)
        return made.scaled(peak=s.peak_rad_s), search
    if s.kind == "prbs":
        return prbs(sample_time_s, bits=s.bits, amplitude=s.peak_rad_s, hold=s.hold), None
    period = _given("period_s", s.period_s)
    if s.kind == "triangle":
        return triangle(period, sample_time_s, amplitude=s.peak_rad_s), None
    band = _given("band_hz", s.band_hz)
    if s.kind == "chirp":
        return chirp(period, sample_time_s, band_hz=band, amplitude=s.peak_rad_s), None
    lines = multisine(period, sample_time_s, band_hz=band, grid=s.grid, seed=s.seed).lines
    if s.kind == "stepped_sine":
        frequencies = lines / period
        return stepped_sine(
            period, sample_time_s, frequency_hz=frequencies, amplitude=s.peak_rad_s
        ).signal, None
    return (
        discrete_interval_binary(
            period,
            sample_time_s,
            lines=lines,
            amplitude=s.peak_rad_s,
            hold=s.hold,
            starts=s.starts,
            seed=s.seed,
        ),
        None,
    )


def _multisine(
    s: SignalDesign, sample_time_s: float, seed_of_phases: int
) -> tuple[Multisine, CrestSearch | None]:
    made = multisine(
        _given("period_s", s.period_s),
        sample_time_s,
        band_hz=s.band_hz,
        grid=s.grid,
        lines=s.lines,
        phases="random" if s.phases == "optimized" else s.phases,
        seed=s.seed,
        run=s.run,
        group=s.group,
    )
    if s.phases != "optimized":
        return made, None
    search = optimize_crest_factor(
        made, starts=s.starts, time_s=s.time_s, seed=seed_of_phases, snow_lines=s.snow_lines
    )
    return search.signal, search


def _given(field: str, value: T | None) -> T:
    if value is None:
        raise InputError(f"signal.{field}: expected a value, got none")
    return value

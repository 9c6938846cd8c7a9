"""The design of an excitation in TOML, which ``axisight excite`` carries out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, cast

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import instance, path_of, shown
from axisight.display.summary import summarized
from axisight.documents import parse_toml, read_text
from axisight.errors import InputError
from axisight.excitation.crest import CrestSearch, optimize_crest_factor
from axisight.excitation.limits import LimitReport, Limits, check_limits
from axisight.excitation.lines import Grid
from axisight.excitation.multisine import Multisine, multisine, schroeder_phases
from axisight.excitation.optimal import ALL, OptimalSpectrum, optimal_spectrum
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
from axisight.excitation.zippered import simultaneous_references, zippered
from axisight.robot import Robot, load_robot
from axisight.robot.presets import PRESETS

Positive = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0, lt=2**64)]
PerAxis = Positive | list[Positive]
T = TypeVar("T")
Signals = tuple[Multisine | PeriodicSignal, ...]
ZIPPERED = "zippered"


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


class OptimalDesign(_Part):
    """The optimal power of the lines of a multisine; the fields are those of `optimal_spectrum`.

    The signal then has the peak ``peak_rad_s`` again, so give limits to check torque and velocity.
    """

    optimal_for: str | list[str] = ALL
    parameters: list[str] | None = None
    limited: Literal["torque", "velocity", "reference", "both"] = "both"
    noise_std_rad: Positive | None = None
    flat_share: Annotated[float, Field(ge=0, lt=1)] = 0.1
    relative_uncertainty: Annotated[float, Field(ge=0)] = 0.0
    models: Count = 32


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

    ``directions`` is ``"t1"``, ``"t2"``, ``"hadamard"``, ``"dft"``, a matrix with one row per axis and one
    column per experiment, or ``"zippered"`` for a single experiment in which each axis has its own
    lines. ``realizations`` is the number of sets of these experiments; each has phases of its own, at the
    same lines. Without ``limits`` there is no simulation.
    """

    schema_: Annotated[Literal["axisight.excite/1"], Field(alias="schema")] = "axisight.excite/1"
    robot: str
    signal: SignalDesign
    directions: (
        Literal["t1", "identity", "t2", "hadamard", "dft", "zippered"] | list[list[float]]
    ) = "t1"
    realizations: Count = 1
    optimal: OptimalDesign | None = None
    square: SquareDesign | None = None
    dc_level_rad_s: float | list[float] = 0.0
    limits: LimitDesign | None = None


@summarized
@dataclass(frozen=True, eq=False)
class Excited:
    """The result of a design: references, signals, and what the design has besides.

    ``signals`` are one for all axes, or one per axis (``"zippered"``); ``searches`` those for their
    phases. ``optimal`` is the optimal spectrum, and ``report`` the check of the limits.
    """

    references: References
    signals: tuple[Multisine | PeriodicSignal, ...]
    searches: tuple[CrestSearch, ...]
    report: LimitReport | None
    optimal: OptimalSpectrum | None = None

    @property
    def signal(self) -> Multisine | PeriodicSignal:
        """The first signal."""
        return self.signals[0]

    @property
    def search(self) -> CrestSearch | None:
        """The search for the phases of the first signal."""
        return self.searches[0] if self.searches else None


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
    signals, searches, optimal = _signals(design, robot)
    sets = [_experiments(design, robot, signals)]
    for m, further in _further_phases(design, signals):
        sets.append(_experiments(further, robot, _signals(further, robot, m)[0]))
    made = replace(sets[0], period=np.concatenate([part.period for part in sets]))
    made.design["excite"] = design.model_dump(by_alias=True, mode="json")
    if len(sets) > 1:
        made.design["broadband_of_realizations"] = [part.design["broadband"] for part in sets]
    return Excited(made, signals, searches, _report(design, made, robot), optimal)


def _further_phases(
    design: ExcitationDesign, first: Signals
) -> Iterator[tuple[int, ExcitationDesign]]:
    """Yield the number and the design of each realization after the first; all have the lines of the first.

    Random phases take the next run.
    """
    lines = sorted({int(line) for signal in first for line in signal.lines})
    for m in range(1, design.realizations):
        changes = {"lines": lines, "band_hz": None, "grid": "full", "run": design.signal.run + m}
        yield m, design.model_copy(update={"signal": design.signal.model_copy(update=changes)})


def _experiments(design: ExcitationDesign, robot: Robot, signals: Signals) -> References:
    """Return the references of one realization."""
    wave = design.square
    added = None
    if wave is not None:
        added = square(
            wave.period_s,
            robot.sample_time_s,
            amplitude=wave.amplitude_rad_s,
            smoothing_samples=wave.smoothing_samples,
        )
    if design.directions == ZIPPERED:
        return simultaneous_references(
            cast(tuple[Multisine, ...], signals), square=added, dc_level=design.dc_level_rad_s
        )
    return references(
        signals[0],
        robot.n_axes,
        directions=design.directions,
        square=added,
        dc_level=design.dc_level_rad_s,
        seed=design.signal.seed,
        run=design.signal.run,
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


def _signals(
    design: ExcitationDesign, robot: Robot, realization: int = 0
) -> tuple[Signals, tuple[CrestSearch, ...], OptimalSpectrum | None]:
    """Return the signals at their peak, the searches for their phases, and the optimal spectrum.

    Optimized phases take the next seed in each realization, since a search uses several runs.
    """
    s, zipped = design.signal, design.directions == ZIPPERED
    if s.kind != "multisine":
        if zipped or design.optimal is not None:
            field = "directions" if zipped else "optimal"
            raise InputError(f"{field}: expected the signal kind multisine, got {s.kind}")
        return (_other(s, robot.sample_time_s),), (), None
    if zipped and design.optimal is not None:
        raise InputError(
            "optimal, directions: expected at most one of an optimal spectrum and zippered: between "
            "few strong lines no response can be interpolated"
        )
    if zipped and s.snow_lines:
        raise InputError(
            "signal.snow_lines: expected none with zippered, where lines belong to axes"
        )
    made, optimal = _multisine(s, robot.sample_time_s), None
    if design.optimal is not None:
        optimal = _optimal(design, robot, made.scaled(peak=s.peak_rad_s))
        made = optimal.signal
    parts = zippered(made, robot.n_axes) if zipped else (made,)
    if s.phases == "schroeder":
        parts = tuple(replace(x, phase_rad=schroeder_phases(x.amplitude)) for x in parts)
    searches: tuple[CrestSearch, ...] = ()
    if s.phases == "optimized":
        searches = tuple(
            optimize_crest_factor(
                part,
                starts=s.starts,
                time_s=s.time_s,
                seed=s.seed + realization,
                snow_lines=s.snow_lines,
            )
            for part in parts
        )
        parts = tuple(found.signal for found in searches)
    return tuple(part.scaled(peak=s.peak_rad_s) for part in parts), searches, optimal


def _optimal(design: ExcitationDesign, robot: Robot, flat: Multisine) -> OptimalSpectrum:
    wanted = design.optimal or OptimalDesign()
    directions = design.directions
    return optimal_spectrum(
        robot,
        flat,
        wanted.optimal_for,
        parameters=wanted.parameters,
        # Orthogonal experiments of equal amplitude bring the information of one input at a time.
        directions="t1" if isinstance(directions, str) and directions == "dft" else directions,
        limited=wanted.limited,
        noise_std_rad=wanted.noise_std_rad,
        flat_share=wanted.flat_share,
        relative_uncertainty=wanted.relative_uncertainty,
        models=wanted.models,
        seed=design.signal.seed,
    )


def _other(s: SignalDesign, sample_time_s: float) -> PeriodicSignal:
    """Return a signal that is no multisine, at its peak."""
    if s.kind == "prbs":
        return prbs(sample_time_s, bits=s.bits, amplitude=s.peak_rad_s, hold=s.hold)
    period = _given("period_s", s.period_s)
    if s.kind == "triangle":
        return triangle(period, sample_time_s, amplitude=s.peak_rad_s)
    band = _given("band_hz", s.band_hz)
    if s.kind == "chirp":
        return chirp(period, sample_time_s, band_hz=band, amplitude=s.peak_rad_s)
    lines = multisine(period, sample_time_s, band_hz=band, grid=s.grid, seed=s.seed).lines
    if s.kind == "stepped_sine":
        frequencies = lines / period
        return stepped_sine(
            period, sample_time_s, frequency_hz=frequencies, amplitude=s.peak_rad_s
        ).signal
    return discrete_interval_binary(
        period,
        sample_time_s,
        lines=lines,
        amplitude=s.peak_rad_s,
        hold=s.hold,
        starts=s.starts,
        seed=s.seed,
    )


def _multisine(s: SignalDesign, sample_time_s: float) -> Multisine:
    return multisine(
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


def _given(field: str, value: T | None) -> T:
    if value is None:
        raise InputError(f"signal.{field}: expected a value, got none")
    return value

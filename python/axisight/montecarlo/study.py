"""The settings of a study, in Python and in TOML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.display import html
from axisight.documents import parse_toml, read_text
from axisight.errors import StudyError
from axisight.robot.presets import PRESETS
from axisight.simulation import Method

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# The range of numbers of the core, which itself checks the total length.
Count = Annotated[int, Field(ge=0, le=10**9)]
AtLeastOne = Annotated[int, Field(ge=1, le=10**9)]
JointName = Annotated[str, Field(min_length=1, max_length=200)]
Runs = Annotated[int, Field(ge=1, le=10**8)]
Seed = Annotated[int, Field(ge=0, lt=2**64)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=False)

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise StudyError(_message(error)) from None


class Plant(_Model):
    """The simulated plant.

    ``model`` is ``"linear"`` (linearized about the start, propagated exactly, with ``substeps``
    per sample for the ripple) or ``"nonlinear"`` (``method``, ``tolerance``, ``substeps``
    as in :func:`axisight.simulate`). ``start_rad`` (n_axes,) are the driven joint angles
    at rest; default the operating point of the robot.
    """

    model: Literal["linear", "nonlinear"] = "linear"
    method: Method = "dopri5"
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-7
    substeps: AtLeastOne = 1
    start_rad: list[float] | None = None


class Multisine(_Model):
    """Random-phase multisine, Wernholt (2004), (7.5): flat spectrum over ``band_hz``.

    ``grid`` selects all multiples of ``1 / period_s`` in the band, or the odd ones. Every run has its
    own phases, and a scale that makes its largest sample ``peak_rad_s`` (motor side).
    ``clipping_iterations`` of Algorithm 5.1 lower the crest factor of every run: 100 take it from 3.6 to
    1.55 for some hundred lines. Zero keeps random phases.
    """

    period_s: Positive
    band_hz: tuple[Positive, Positive]
    peak_rad_s: Positive
    grid: Literal["all", "odd"] = "all"
    clipping_iterations: Annotated[int, Field(ge=0, le=100_000)] = 0


class Square(_Model):
    """Square wave on all axes, smoothed by a triangular window, Wernholt (2004), (7.3)."""

    amplitude_rad_s: NotNegative
    period_s: Positive
    smoothing_samples: Count = 40


class Excitation(_Model):
    """Velocity references ``T r_ms(t) + r_sq(t)``, one experiment per axis.

    ``directions`` is T: ``"identity"`` (T1), ``"t2"``, ``"hadamard"``, or a matrix with one row per
    axis and one column per experiment.
    """

    multisine: Multisine
    square: Square | None = None
    directions: Literal["identity", "t2", "hadamard"] | list[list[float]] = "identity"


class Measurement(_Model):
    """The measurement: waiting periods, averaged periods, sensor noise, and the response.

    The noise is white, or of first order with corner ``noise_cutoff_hz``. The position sensor has steps
    of ``position_resolution_rad`` (motor side), none for zero. The response is from commanded torque
    to motor ``output``.
    """

    waiting_periods: Count = 1
    periods: AtLeastOne = 1
    noise: bool = True
    noise_cutoff_hz: Positive | None = None
    position_resolution_rad: NotNegative = 0.0
    output: Literal["position", "velocity", "acceleration"] = "acceleration"


class EffectEntry(_Model):
    """An active effect, like :class:`axisight.Effect`, with its axis as a number from 1 or a joint name."""

    name: str
    axis: AtLeastOne | JointName | None = None
    axes: tuple[AtLeastOne | JointName, AtLeastOne | JointName] | None = None
    parameters: dict[str, float] = {}


class Spread(_Model):
    """A parameter that varies from run to run: ``value (1 + relative z) + absolute z``.

    ``parameter`` names one of the robot (``axis2.stiffness``), or one of an effect of study or robot
    (``payload.mass_kg``, ``torque_ripple@1.cosine_1_nm``). ``z`` is standard normal, or uniform
    between -1 and 1. A run with an impossible draw (a negative stiffness) counts as failed.
    """

    parameter: str
    distribution: Literal["normal", "uniform"] = "normal"
    relative: NotNegative = 0.0
    absolute: NotNegative = 0.0


class Statistics(_Model):
    """The statistics of a study.

    ``quantiles`` of the magnitude have the error ``relative_accuracy``. ``keep_responses`` stores
    every response too.
    """

    quantiles: list[Fraction] = [0.05, 0.25, 0.5, 0.75, 0.95]
    relative_accuracy: Annotated[float, Field(ge=1e-5, le=0.5)] = 0.01
    keep_responses: bool = False


class Study(_Model):
    """A Monte Carlo study.

    Parameters
    ----------
    robot : file in the format ``axisight.robot/1`` or ``/2``, or preset.
    robot_parameters : values that replace those of the robot, e.g. ``{"axis1.damping": 2e3}``.
    seed : determines phases, noise and spread, together with the number of the run.
    runs : number of realizations, at most 10^8.
    block_runs : number of runs accumulated together. It is part of the design, because it sets the
        order of additions. An interruption loses only blocks in progress.
    effect, spread : lists, in TOML ``[[effect]]`` and ``[[spread]]``. An effect replaces one of the
        robot with the same name and axis.

    Raises StudyError naming the field, also for unknown keys.

    """

    schema_: Annotated[Literal["axisight.montecarlo/1"], Field(alias="schema")] = (
        "axisight.montecarlo/1"
    )
    name: str = "study"
    robot: str
    seed: Seed = 0
    runs: Runs = 250
    block_runs: AtLeastOne = 32
    robot_parameters: dict[str, float] = {}
    plant: Plant = Plant()
    excitation: Excitation
    measurement: Measurement = Measurement()
    statistics: Statistics = Statistics()
    effect: list[EffectEntry] = []
    spread: list[Spread] = []

    def _repr_html_(self) -> str:
        """Return the settings of the study, for notebooks."""
        effects = "; ".join(_listed(e.model_dump(exclude_none=True)) for e in self.effect)
        fields = ("plant", "excitation", "measurement", "statistics")
        rows = [
            (name, _listed(getattr(self, name).model_dump(exclude_none=True))) for name in fields
        ]
        rows += [("effects", effects)] if effects else []
        spread = "; ".join(_listed(s.model_dump(exclude_none=True)) for s in self.spread)
        rows += [("spread", spread)] if spread else []
        return html.page(
            f"{self.name}: {self.runs} runs of {self.robot}, seed {self.seed}",
            html.table(("part", "settings"), rows, "Settings of the study"),
        )

    def changed(self, **changes: Any) -> Study:
        """Return the study with changed fields; raises StudyError naming an invalid one."""
        return Study(**{**self.model_dump(by_alias=True), **changes}) if changes else self

    def to_toml(self) -> str:
        """Return the study as TOML; :func:`read_study` gives the same study back."""
        return tomli_w.dumps(self.model_dump(by_alias=True, exclude_none=True, mode="json"))


def _listed(values: dict[str, Any]) -> str:
    texts = (f"({_listed(x)})" if isinstance(x, dict) else str(x) for x in values.values())
    return ", ".join(f"{name} {text}" for name, text in zip(values, texts, strict=True))


def read_study(source: Path | str) -> Study:
    """Return the study in a TOML file.

    The path of a robot file is relative to the study file. Raises StudyError naming file and
    field.
    """
    path = Path(source)
    try:
        data = parse_toml(read_text(path))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: expected a study in TOML: {error}") from None
    robot = data.get("robot")
    if isinstance(robot, str) and robot not in PRESETS:
        data["robot"] = str((path.parent / robot).resolve())
    try:
        return Study(**data)
    except StudyError as error:
        raise StudyError(f"{path}: {error}") from None


def _message(error: ValidationError) -> str:
    lines = []
    for fault in error.errors():
        where = ".".join(str(part) for part in fault["loc"])
        inner = fault.get("ctx", {}).get("error")
        if isinstance(inner, StudyError):
            # A nested model reports its own faults, whose names need this prefix.
            lines += [f"{where}.{line}" for line in str(inner).split("; ")]
            continue
        if fault["type"] == "extra_forbidden":
            lines.append(f"{where}: unknown key")
        elif fault["type"] == "missing":
            lines.append(f"{where}: expected a value, got none")
        else:
            lines.append(f"{where}: {fault['msg'].lower()}, got {fault['input']!r}")
    return "; ".join(lines)

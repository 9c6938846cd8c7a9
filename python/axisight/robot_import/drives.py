"""Drive data: a TOML file with gear ratios, rotors, controller and sample time, which model files lack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from axisight.documents import parse_toml, read_text
from axisight.errors import RobotError


def _not_zero(value: float) -> float:
    if value == 0:
        raise ValueError("expected a ratio other than zero")
    return value


_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Finite = Annotated[float, Field(allow_inf_nan=False)]


RobotClass = Literal["cobot", "industrial", "desktop"]


class _Strict(BaseModel):
    """A model that refuses unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class JointDrive(_Strict):
    """Drive of one joint; a value that is None comes from the model file.

    ``gear_ratio`` r is joint angle per motor angle [1, or m/rad]. ``motor_inertia`` [kg m^2],
    ``viscous_friction`` [Nm s/rad] and ``coulomb_friction`` [Nm] are motor-side. ``stiffness`` [Nm/rad] and
    ``damping`` [Nm s/rad] of the gear are joint-side; state both or neither. ``torque_constant`` [Nm/A],
    motor-side, converts currents in logs to torques.
    """

    gear_ratio: Annotated[_Finite, AfterValidator(_not_zero)] | None = None
    motor_inertia: _NotNegative | None = None
    viscous_friction: _NotNegative | None = None
    coulomb_friction: _NotNegative | None = None
    stiffness: _Positive | None = None
    damping: _NotNegative | None = None
    torque_constant: _Positive | None = None


class Payload(_Strict):
    """A load on the last link: mass [kg], and centre of mass (3,) [m] in the frame of that link."""

    mass: _Positive
    com: tuple[_Finite, _Finite, _Finite] = (0.0, 0.0, 0.0)


class DriveData(_Strict):
    """The content of the file; every key is optional.

    ``robot_class`` (key ``class``) selects typical rotors for joints without one. ``base`` and ``tip`` are
    the first and last link of the chain; several last links are those of branches. ``whole_tree`` takes all
    branches. ``sample_time`` is in s, ``position_noise_std`` in rad, motor-side.
    ``operating_point`` (n_axes,) [rad or m] are the angles of the driven joints. ``controller`` and
    ``tolerances`` are as in a robot file. ``joint`` holds the drives by joint name.
    """

    robot_class: RobotClass | None = Field(default=None, alias="class")
    base: str | None = None
    tip: str | list[str] | None = None
    whole_tree: bool = False
    sample_time: _Positive | None = None
    position_noise_std: _NotNegative | None = None
    operating_point: list[_Finite] | None = None
    controller: dict[str, Any] | None = None
    tolerances: dict[str, _Positive] | None = None
    joint: dict[str, JointDrive] = Field(default_factory=dict)
    payload: Payload | None = None


def read_drives(path: Path) -> DriveData:
    """Return the drive data in a TOML file; raise RobotError naming file and key."""
    try:
        content = parse_toml(read_text(path))
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path}: expected a readable file of drive data: {error}") from error
    except ValueError as error:
        raise RobotError(f"{path}: expected TOML, got {error}") from None
    try:
        return DriveData.model_validate(content)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in fault["loc"]) or "file"
        raise RobotError(f"{path}: {where}: {fault['msg']}") from None

"""What model files lack of drives: gear ratios, rotors, controller, sample time, from a TOML file."""

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
    """Unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class JointDrive(_Strict):
    """Drive of one joint; what is left out is as the model file has it.

    ``gear_ratio`` r: joint angle per motor angle [1, m/rad]; ``motor_inertia`` [kg m^2],
    ``viscous_friction`` [Nm s/rad] and ``coulomb_friction`` [Nm] on the motor side; ``stiffness``
    [Nm/rad] and ``damping`` [Nm s/rad] of the gear, on the joint side, both or neither;
    ``torque_constant`` [Nm/A], motor side, by which currents in logs are torques.
    """

    gear_ratio: Annotated[_Finite, AfterValidator(_not_zero)] | None = None
    motor_inertia: _NotNegative | None = None
    viscous_friction: _NotNegative | None = None
    coulomb_friction: _NotNegative | None = None
    stiffness: _Positive | None = None
    damping: _NotNegative | None = None
    torque_constant: _Positive | None = None


class Payload(_Strict):
    """A load mounted by hand: mass [kg] and centre of mass [m] in the frame of the last link."""

    mass: _Positive
    com: tuple[_Finite, _Finite, _Finite] = (0.0, 0.0, 0.0)


class DriveData(_Strict):
    """The file: all of it may be left out.

    ``robot_class``, ``class`` in the file, says which typical rotors stand for those that nothing says;
    ``base``, ``tip``: links between which the chain runs; ``sample_time`` [s]; ``position_noise_std``
    [rad], motor side; ``operating_point`` [rad or m] of the driven joints; ``controller`` and
    ``tolerances`` as in a robot file; ``joint`` by name.
    """

    robot_class: RobotClass | None = Field(default=None, alias="class")
    base: str | None = None
    tip: str | None = None
    sample_time: _Positive | None = None
    position_noise_std: _NotNegative | None = None
    operating_point: list[_Finite] | None = None
    controller: dict[str, Any] | None = None
    tolerances: dict[str, _Positive] | None = None
    joint: dict[str, JointDrive] = Field(default_factory=dict)
    payload: Payload | None = None


def read_drives(path: Path) -> DriveData:
    """Return the drive data of a TOML file; raises RobotError naming file and key."""
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

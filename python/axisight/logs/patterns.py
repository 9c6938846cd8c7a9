"""Column maps for any number of axes: names with a placeholder for the axis, and alternatives."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from axisight.arguments import short
from axisight.errors import LogError
from axisight.logs.columns import (
    Accelerometers,
    Address,
    ColumnMap,
    CsvOptions,
    PositionColumn,
    Positive,
    TemperatureColumn,
    Text,
    TimeColumn,
    TorqueColumn,
    VelocityColumn,
)

if TYPE_CHECKING:
    from axisight.robot import Robot

_PLACE = re.compile(r"\{(0|1|joint)\}")
# Unit of a revolute axis -> unit on a prismatic axis, for makers that use SI for both kinds.
_SLIDING = {"rad": "m", "rad/s": "m/s", "Nm": "N"}
_SHOWN = 12


def _listed(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else (value,)


def _placed(signals: tuple[Any, ...]) -> tuple[Any, ...]:
    for signal in signals:
        if len(_PLACE.findall(signal.name)) != 1:
            raise ValueError(
                f"expected {{0}}, {{1}} or {{joint}} once in the name, got {signal.name!r}"
            )
    return signals


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class AxisPattern(_Strict):
    """The signals of every driven axis: one address each, or several alternatives.

    In a name `{0}` stands for the number of the axis from 0, `{1}` for the number from 1, and `{joint}` for
    the name of its joint: from the robot, or without a robot from the file. Each name has one of them.
    """

    position: Annotated[tuple[PositionColumn, ...], BeforeValidator(_listed), Field(min_length=1)]
    torque: Annotated[tuple[TorqueColumn, ...], BeforeValidator(_listed)] = ()
    position_ref: Annotated[tuple[PositionColumn, ...], BeforeValidator(_listed)] = ()
    velocity_ref: Annotated[tuple[VelocityColumn, ...], BeforeValidator(_listed)] = ()
    velocity: Annotated[tuple[VelocityColumn, ...], BeforeValidator(_listed)] = ()
    joint_position: Annotated[tuple[PositionColumn, ...], BeforeValidator(_listed)] = ()
    temperature: Annotated[tuple[TemperatureColumn, ...], BeforeValidator(_listed)] = ()

    @model_validator(mode="after")
    def _places(self) -> AxisPattern:
        for field in type(self).model_fields:
            _placed(getattr(self, field))
        return self


class ColumnPattern(_Strict):
    """A column map with one `[every_axis]` in place of its `[[axis]]`.

    `axes` is the number of axes; by default the number of position columns in the file.
    Everything else is as in `ColumnMap`.
    """

    schema_: Literal["axisight.columns/1"] = Field(default="axisight.columns/1", alias="schema")
    sample_rate_hz: Positive | Text | None = None
    side: Literal["motor", "joint"] = "motor"
    axes: Annotated[int, Field(ge=1, le=1000)] | None = None
    time: Annotated[tuple[TimeColumn, ...], BeforeValidator(_listed)] = ()
    every_axis: AxisPattern
    accelerometer: Accelerometers = ()
    csv: CsvOptions = CsvOptions()

    @model_validator(mode="after")
    def _rate_known(self) -> ColumnPattern:
        if not self.time and self.sample_rate_hz is None:
            raise ValueError("give sample_rate_hz, [time], or both")
        return self

    def for_file(self, arrays: Iterable[str], robot: Robot | None, where: Path) -> ColumnMap:
        """Return the column map for a file with the names ``arrays``.

        The first alternative that the file has counts; signals that the file lacks are left out.
        ``robot`` gives names and kinds of joints. Raises LogError, naming the file ``where``, the names
        looked for and the names found, if the file has no position or lacks one between two axes.
        """
        names = list(arrays)
        joints = self._joints(names, robot, where)
        if joints is None:
            listed = ", ".join(map(short, names[:_SHOWN])) or "nothing"
            raise LogError(
                f"{where}: position: expected columns like {self.looked_for('position', robot)}, got "
                f"{listed}{' ...' if len(names) > _SHOWN else ''}"
            )
        count = len(joints) if self.axes is None else self.axes
        joints = [*joints, *[""] * count][:count]
        slides = [False] * count if robot is None else robot.axis_is_prismatic
        axes: list[dict[str, Any]] = [{} for _ in range(count)]
        for field in type(self.every_axis).model_fields:
            signal = _first(getattr(self.every_axis, field), names, joints)
            for k in range(count if signal is not None else 0):
                axes[k][field] = _at(signal, k, joints, sliding=k < len(slides) and slides[k])
        times = [time for time in self.time if time.name in names] or list(self.time)
        return ColumnMap.model_validate(
            {
                "sample_rate_hz": self.sample_rate_hz,
                "side": self.side,
                "time": times[0] if times else None,
                "axis": axes,
                "accelerometer": self.accelerometer,
                "csv": self.csv,
            }
        )

    def looked_for(self, field: str, robot: Robot | None = None) -> str:
        """Return the names of a ``field`` for the first axis, for messages; "" if the map lacks the field.

        ``robot`` gives the name of the first joint; without a robot it is JOINT.
        """
        joint = robot.axis_names[0] if robot is not None else "JOINT"
        return " or ".join(_filled(s.name, 0, [joint]) for s in getattr(self.every_axis, field))

    def _joints(self, names: Sequence[str], robot: Robot | None, where: Path) -> list[str] | None:
        """Return one joint name per axis, "" for unknown ones; None if the file has no position.

        Raises LogError if the numbers of the axes have a gap.
        """
        own = [""] * 0 if robot is None else list(robot.axis_names)
        for signal in self.every_axis.position:
            before, place, after = _split(signal.name)
            middle = r"([0-9]+)" if place != "joint" else "([^/]+)"
            pattern = re.compile(f"{re.escape(before)}{middle}{re.escape(after)}")
            found = [match[1] for name in names if (match := pattern.fullmatch(name))]
            if place == "joint":
                if found and (not own or set(own) & set(found)):
                    return own or found
                continue
            # Nine digits exceed the axes of any file, and keep huge numbers in names from costing time.
            numbers = {int(number[:9]) + 1 - int(place) for number in found} - {0}
            highest = max(numbers, default=0)
            if highest > len(numbers):
                missing = next(k for k in range(1, highest) if k not in numbers) - 1 + int(place)
                raise LogError(
                    f"{where}: position: expected a column named {before + str(missing) + after!r}, as "
                    f"axes go on beyond it, got {len(numbers)} columns of others"
                )
            if highest:
                return [*own, *[""] * highest][:highest]
        return None


def _split(name: str) -> tuple[str, str, str]:
    match = _PLACE.search(name)
    assert match is not None  # checked when the pattern was made
    return name[: match.start()], match[1], name[match.end() :]


def _filled(name: str, axis: int, joints: Sequence[str]) -> str:
    before, place, after = _split(name)
    middle = joints[axis] if place == "joint" else str(axis + int(place))
    return f"{before}{middle}{after}"


def _first(
    signals: Sequence[Address], names: Sequence[str], joints: Sequence[str]
) -> Address | None:
    """Return the first alternative that a file has for any axis."""
    present = set(names)
    for signal in signals:
        if any(_filled(signal.name, k, joints) in present for k in range(len(joints))):
            return signal
    return None


def _at(signal: Any, axis: int, joints: Sequence[str], *, sliding: bool) -> Mapping[str, Any]:
    made: dict[str, Any] = signal.model_dump()
    made["name"] = _filled(signal.name, axis, joints)
    if sliding:
        made["unit"] = _SLIDING.get(made["unit"], made["unit"])
    return made

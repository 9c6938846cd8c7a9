"""Column maps for any number of axes: names with the place of the axis in them, and alternatives."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from axisight.arguments import short
from axisight.errors import LogError
from axisight.logs.columns import (
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
# What makers who write SI for either kind of joint mean on one that slides.
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
    """The signals of every driven axis: one address each, or alternatives of which a file has one.

    In a name `{0}` is the number of the axis counted from 0, `{1}` that counted from 1, and
    `{joint}` the name of its joint: that of the robot, or as it comes in the file without one.
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

    `axes` is the number of axes; without it, as many as the file has columns of the position for.
    Everything else is as in `ColumnMap`.
    """

    schema_: Literal["axisight.columns/1"] = Field(default="axisight.columns/1", alias="schema")
    sample_rate_hz: Positive | Text | None = None
    side: Literal["motor", "joint"] = "motor"
    axes: Annotated[int, Field(ge=1, le=1000)] | None = None
    time: Annotated[tuple[TimeColumn, ...], BeforeValidator(_listed)] = ()
    every_axis: AxisPattern
    csv: CsvOptions = CsvOptions()

    @model_validator(mode="after")
    def _rate_known(self) -> ColumnPattern:
        if not self.time and self.sample_rate_hz is None:
            raise ValueError("give sample_rate_hz, [time], or both")
        return self

    def for_file(self, arrays: Iterable[str], robot: Robot | None, where: Path) -> ColumnMap:
        """Return the map of the file that has the names ``arrays``.

        Of alternatives it takes the first that the file has; signals that it has not are left out.
        ``robot``: names and kinds of joints. Raises LogError naming the file, ``where``, what was
        looked for and what is there, when no position is.
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
                "csv": self.csv,
            }
        )

    def looked_for(self, field: str, robot: Robot | None = None) -> str:
        """Return the names of a ``field`` of the first axis, as messages show them; "" without any."""
        joint = robot.axis_names[0] if robot is not None else "JOINT"
        return " or ".join(_filled(s.name, 0, [joint]) for s in getattr(self.every_axis, field))

    def _joints(self, names: Sequence[str], robot: Robot | None, where: Path) -> list[str] | None:
        """Return one name per axis, those of joints where they are known; None without a position.

        Raises LogError where axes have numbers beyond those that follow each other.
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
            # Nine digits are enough to be more than any file has, and few enough to count with.
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

"""What a guess has found so far: the signals of every field, why they, and what is open."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from axisight.errors import LogError
from axisight.logs.columns import CsvOptions
from axisight.logs.guessing.families import Axis, Family
from axisight.logs.guessing.series import Series
from axisight.robot import Robot

_SHOWN = 60


@dataclass
class Draft:
    """A map in the making.

    ``fields`` holds one (signal, unit) per axis, ``torques`` those of which a person has to choose one, or
    to state its scale (``scaled``: even of a torque), ``targets`` those that a person may know for targets of
    positions. ``why`` gives the reason of a field, ``unused`` that
    of a name that was left out. ``doubts`` are choices that others might be right for. ``by_numbers``: no
    name said which columns are positions.
    """

    path: Path
    csv: CsvOptions
    names: list[str]
    families: list[Family]
    robot: Robot | None = None
    axes: list[Axis] = field(default_factory=list)
    slides: list[bool] = field(default_factory=list)
    side: str = "motor"
    time: Series | None = None
    time_unit: str = "s"
    resample: bool = False
    rate_name: str | None = None
    sample_time_s: float = 0.0
    fields: dict[str, list[tuple[Series, str]]] = field(default_factory=dict)
    torques: list[list[tuple[Series, str]]] = field(default_factory=list)
    scaled: bool = False
    targets: list[list[tuple[Series, str]]] = field(default_factory=list)
    by_numbers: bool = False
    why: dict[str, str] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)
    doubts: list[str] = field(default_factory=list)

    def refusal(self, message: str) -> LogError:
        """Return the error that says ``message`` and lists the columns of the file."""
        listed = ", ".join(self.names[:_SHOWN]) or "none"
        more = f" and {len(self.names) - _SHOWN} more" if len(self.names) > _SHOWN else ""
        return LogError(f"{self.path}: {message}; columns: {listed}{more}")

    def leave(self, families: Iterable[Family], reason: str) -> None:
        """Note why families are not used; a reason that is known stays."""
        for family in families:
            self.unused.setdefault(family.label, reason)

    def on_this_side(self, families: Iterable[Family]) -> list[Family]:
        """Return families with a signal of every axis that are not of the other side."""
        families = list(families)
        other = {"motor": "joint", "joint": "motor"}[self.side]
        self.leave([f for f in families if f.of(self.axes) is None], "not of all axes")
        self.leave([f for f in families if f.meaning.side == other], f"of the {other}s")
        whole = [f for f in families if f.of(self.axes) is not None]
        return [f for f in whole if f.meaning.side != other]

    def signals(self, name: str) -> list[Series]:
        """Return the signals of a field, by axis; none where it is not there."""
        return [series for series, _ in self.fields.get(name, [])]

    def take(self, name: str, signals: list[Series], units: list[str], why: str) -> None:
        """Take the signals of all axes as a field."""
        self.fields[name] = list(zip(signals, units, strict=True))
        self.why[name] = why

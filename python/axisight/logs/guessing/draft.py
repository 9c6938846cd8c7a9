"""The state of a guess: the signals of every field, the reasons for them, and the open choices."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from axisight.errors import LogError
from axisight.logs.columns import CsvOptions
from axisight.logs.guessing.families import Axis, Family
from axisight.logs.guessing.series import TEXTS, Series
from axisight.robot import Robot

_SHOWN = 60


@dataclass
class Draft:
    """A column map in progress.

    ``fields`` holds the chosen signals of each field, one (signal, unit) per axis. ``torques`` holds the
    candidates among which the user must choose, or whose scale the user must state; ``scaled``: a scale is
    needed even if the unit is Nm. ``targets`` holds candidates for position targets, which the user may
    confirm. ``why`` gives the reason for a field, ``unused`` the reason for leaving out a name. ``doubts``
    lists choices that may be wrong. ``bridge_hz`` is the rate [Hz] that bridges holes of the stamps.
    ``by_numbers``: no name said which columns are positions.
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
    bridge_hz: float | None = None
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
        """Return a LogError with ``message``, the columns of the file, and those that hold texts instead of numbers."""
        listed = ", ".join(self.names[:_SHOWN]) or "none"
        more = f" and {len(self.names) - _SHOWN} more" if len(self.names) > _SHOWN else ""
        texts = [f"{k} ({why})" for k, why in self.unused.items() if why.startswith(TEXTS)]
        said = f"; texts are no signals: {', '.join(texts[:_SHOWN])}" if texts else ""
        remedy = ". Leave out rows of units, and write one number into each cell" if texts else ""
        return LogError(f"{self.path}: {message}; columns: {listed}{more}{said}{remedy}")

    def leave(self, families: Iterable[Family], reason: str) -> None:
        """Note why families are not used; an earlier reason stays."""
        for family in families:
            self.unused.setdefault(family.label, reason)

    def on_this_side(self, families: Iterable[Family]) -> list[Family]:
        """Return the families that cover every axis and are not of the other side."""
        families = list(families)
        other = {"motor": "joint", "joint": "motor"}[self.side]
        self.leave([f for f in families if f.of(self.axes) is None], "not of all axes")
        self.leave([f for f in families if f.meaning.side == other], f"of the {other}s")
        whole = [f for f in families if f.of(self.axes) is not None]
        return [f for f in whole if f.meaning.side != other]

    def signals(self, name: str) -> list[Series]:
        """Return the signals of a field in the order of the axes; [] if the draft lacks the field."""
        return [series for series, _ in self.fields.get(name, [])]

    def take(self, name: str, signals: list[Series], units: list[str], why: str) -> None:
        """Set a field to these signals and units, one per axis, for the reason ``why``."""
        self.fields[name] = list(zip(signals, units, strict=True))
        self.why[name] = why

"""The user's choices on the page: log, axis, causes and their values, pins. They survive a reload."""

from __future__ import annotations

from dataclasses import dataclass, field

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.explore.background import Background
from axisight.explore.choices import at_place, with_effect
from axisight.explore.said import Said, said
from axisight.explore.session import Session, Version

PINS = ("A", "B")


@dataclass
class State:
    """The user's choices; ``log`` and ``axis`` count from 0.

    - ``chosen``: causes at work, including those of the robot file.
    - ``refitted``: whether the simulator has the re-fitted parameters of the diagnosis.
    - ``pins``: versions kept for comparison.
    """

    session: Session
    background: Background
    said: Said | None = None
    log: int = 0
    axis: int = 0
    refitted: bool = False
    chosen: tuple[Effect, ...] = ()
    pins: dict[str, Version] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Start with the causes of the robot file."""
        if not self.chosen:
            self.chosen = tuple(e for e in self.session.robot.effects if e.acts)
        if self.said is not None:
            self.hear(self.said.document)

    def title(self) -> str:
        """Return the title: robot and verdict."""
        robot = self.session.robot.name or self.session.name
        return f"{robot}: {'no verdict yet' if self.said is None else self.said.verdict}"

    def version(self) -> Version:
        """Return the chosen version of the simulator."""
        labels = {e.label for e in self.chosen}
        # Own causes that the user removed are set to neutral.
        out = [
            at_place(e.name, e.place, {})
            for e in self.session.robot.effects
            if e.acts and e.label not in labels
        ]
        values = {}
        if self.refitted and self.said is not None:
            values = self.session.known_parameters(self.said.refit)
        return Version.of([*self.chosen, *out], values)

    def said_of(self, version: Version) -> str:
        """Return a version in one line."""
        parts = []
        for effect in version.effects:
            values = (f"{name} {value:.4g}" for name, value in (effect.parameters or {}).items())
            parts.append(f"{effect.label} ({', '.join(values)})" if effect.acts else "")
        parts.append("re-fitted parameters" if version.robot_values else "")
        return "; ".join(filter(None, parts)) or "as given"

    def add(self, effect: Effect) -> None:
        """Add a cause, replacing one of its name and axis; raises InputError if the robot cannot have it."""
        self.session.check(Version.of([effect]))
        self.chosen = with_effect(self.chosen, effect)

    def take_out(self, label: str) -> None:
        """Remove a cause by its label."""
        self.chosen = tuple(e for e in self.chosen if e.label != label)

    def set_value(self, label: str, parameter: str, value: float) -> None:
        """Set a parameter of a cause."""
        self.chosen = tuple(
            e.with_values({parameter: value}) if e.label == label else e for e in self.chosen
        )

    def hear(self, document: object, source: str = "verdict") -> None:
        """Take over a verdict; raises InputError for a verdict of another robot."""
        new = said(document, source)
        try:
            self.session.check(Version.of([c.effect for c in new.causes]))
            self.session.known_parameters(new.refit)
        except InputError as error:
            raise InputError(f"{source}: not of this robot: {error}") from error
        if not len(new.before) == len(new.after) == len(new.floor) == self.session.n_axes:
            raise InputError(f"{source}: gap: expected {self.session.n_axes} axes")
        self.said = new

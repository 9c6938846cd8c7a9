"""What is chosen on the page: log, axis, causes and their values, pins. It outlives a reload."""

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
    """The choices of the one who looks; ``log`` and ``axis`` are numbers from 0.

    ``chosen``: causes at work, those that the robot's file states among them; ``refitted``: whether the
    simulator has the parameters that the diagnosis re-fitted; ``pins``: versions kept to compare.
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
        """Begin with what the robot file states."""
        if not self.chosen:
            self.chosen = tuple(e for e in self.session.robot.effects if e.acts)
        if self.said is not None:
            self.hear(self.said.document)

    def title(self) -> str:
        """Return robot and verdict."""
        robot = self.session.robot.name or self.session.name
        return f"{robot}: {'no verdict yet' if self.said is None else self.said.verdict}"

    def version(self) -> Version:
        """Return the simulator as it is chosen."""
        labels = {e.label for e in self.chosen}
        # Its own causes that were taken out stand at nothing.
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
        """Return a version in a line."""
        parts = []
        for effect in version.effects:
            values = (f"{name} {value:.4g}" for name, value in (effect.parameters or {}).items())
            parts.append(f"{effect.label} ({', '.join(values)})" if effect.acts else "")
        parts.append("re-fitted parameters" if version.robot_values else "")
        return "; ".join(filter(None, parts)) or "as given"

    def add(self, effect: Effect) -> None:
        """Put a cause in, in place of one of its name and axis; raises InputError if it cannot be there."""
        self.session.check(Version.of([effect]))
        self.chosen = with_effect(self.chosen, effect)

    def take_out(self, label: str) -> None:
        """Take a cause out, by its label."""
        self.chosen = tuple(e for e in self.chosen if e.label != label)

    def set_value(self, label: str, parameter: str, value: float) -> None:
        """Give a parameter of a cause another value."""
        self.chosen = tuple(
            e.with_values({parameter: value}) if e.label == label else e for e in self.chosen
        )

    def hear(self, document: object, source: str = "verdict") -> None:
        """Take what a verdict says; raises InputError for one that is not of this robot."""
        new = said(document, source)
        try:
            self.session.check(Version.of([c.effect for c in new.causes]))
            self.session.known_parameters(new.refit)
        except InputError as error:
            raise InputError(f"{source}: not of this robot: {error}") from error
        if not len(new.before) == len(new.after) == len(new.floor) == self.session.n_axes:
            raise InputError(f"{source}: gap: expected {self.session.n_axes} axes")
        self.said = new

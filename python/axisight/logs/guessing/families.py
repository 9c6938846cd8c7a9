"""Group signals into families: signals of one kind, one per axis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from axisight.logs.guessing.names import Meaning, meaning_of
from axisight.logs.guessing.series import Series

Axis = int | str


@dataclass(frozen=True, eq=False)
class Family:
    """Signals whose names differ only in the axis, by axis; ``meaning`` is that of the first."""

    meaning: Meaning
    signals: dict[Axis, Series] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The name of the first signal and the number of the others, for messages."""
        first = next(iter(self.signals.values())).label
        return first if len(self.signals) == 1 else f"{first} and {len(self.signals) - 1} like it"

    def of(self, axes: Sequence[Axis]) -> list[Series] | None:
        """Return the signals of these axes, in order; None unless every axis has one."""
        return [self.signals[a] for a in axes] if set(axes) <= set(self.signals) else None


def families_of(series: Iterable[Series], joints: Sequence[str] = ()) -> list[Family]:
    """Return the families of signals; ``joints`` are the joint names of the robot.

    Names without a number form a family only if another family has the same axes. So `theta_a, theta_b` alone
    are two sensors of one axis; beside `tau_a, tau_b` they are two axes.
    """
    found: dict[tuple[str, bool | None, str | None, str], Family] = {}
    for one in series:
        meaning = meaning_of(one, joints)
        key = (meaning.quantity, meaning.wanted, meaning.side, meaning.stem)
        family = found.setdefault(key, Family(meaning))
        family.signals.setdefault(meaning.axis, one)
    out: list[Family] = []
    for family in found.values():
        named = [a for a in family.signals if isinstance(a, str) and a not in joints]
        alone = not any(
            other is not family and set(other.signals) == set(family.signals)
            for other in found.values()
        )
        if len(named) == 1 or (named and alone):
            out += [Family(meaning_of(s, joints), {"": s}) for s in family.signals.values()]
        else:
            out.append(family)
    return out


def of_quantity(
    families: Iterable[Family], quantity: str, *, wanted: bool | None = False
) -> list[Family]:
    """Return the families of a quantity: those named as measured, or if there are none, the unmarked ones.

    ``wanted=True`` returns targets instead. More than one family means that the names leave a choice open.
    """
    named = [f for f in families if f.meaning.quantity == quantity]
    if wanted:
        return [f for f in named if f.meaning.wanted]
    measured = [f for f in named if f.meaning.wanted is False]
    return measured or [f for f in named if f.meaning.wanted is None]

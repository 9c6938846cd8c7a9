"""How effects are akin, and by how much formulas of one differ: columns of the table of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

FormulaKind = Literal["lag", "friction", "exact"]
FORMULA_KINDS: tuple[FormulaKind, ...] = get_args(FormulaKind)


@dataclass(frozen=True)
class Formula:
    """What two formulas of an effect may differ by, whoever writes them.

    ``error``: share of what it explains [1]; effects of one ``kind`` are held apart by that, ``held`` says
    where: always, where one of the kind leaves hardly more than noise, or next to nothing. ``white``: what is
    left of the right one is white. ``value_error``: standard deviation of a parameter, of its size [1];
    ``of_each``: it is that for each number that is fitted.
    """

    kind: FormulaKind | None
    error: float
    held: Literal["always", "near_noise", "next_to_nothing"]
    white: bool
    value_error: float
    of_each: bool

    @property
    def exact(self) -> bool:
        """Whether it is the same in all books."""
        return self.kind == "exact"

    def spread(self, free: int) -> float:
        """Return the standard deviation of a parameter between formulas, of its size [1], with so many fitted."""
        return self.value_error * free if self.of_each else self.value_error


@dataclass(frozen=True)
class Plainer:
    """The ``law`` that an effect is where nothing of the parameters that it ``adds`` shows.

    It is ``likelier`` then, so many times. ``shown``: by the standard errors of these, or by how much larger
    friction is at some speed than at high speed.
    """

    law: str
    adds: tuple[str, ...]
    likelier: float
    shown: Literal["sizes", "rise"]

    @property
    def by_rise(self) -> bool:
        """Whether it shows in how friction falls with speed, and not in standard errors."""
        return self.shown == "rise"


@dataclass(frozen=True)
class Resembles:
    """An effect ``law``, of one parameter, that another one is like with the parameters ``shape``.

    That parameter is ``ratio`` times ``size``. Of machines that both describe as well, so many times as many
    have that effect: this one is ``rarer``.
    """

    law: str
    size: str
    ratio: float
    shape: Mapping[str, float]
    rarer: float

    def values(self, of_law: float) -> dict[str, float]:
        """Return the parameters with which an effect is like the ``law`` with that parameter."""
        return {self.size: of_law / self.ratio, **self.shape}


@dataclass(frozen=True)
class BegunFrom:
    """A ``law`` that a fit may begin from as it ended, and which parameters take which values of it."""

    law: str
    takes: Mapping[str, str]


@dataclass(frozen=True)
class Later:
    """Numbers of a law that are looked for where its fit without them ended.

    Its ``amplitude`` begins at ``begin`` and is ``most`` at most; its ``shape`` as that of the effect ``as_of``.
    """

    amplitude: str
    begin: float
    most: float
    shape: str
    as_of: str


@dataclass(frozen=True)
class SpringChange:
    """How a law makes a gear another spring.

    ``sums``: parameters whose sums are the changes of its stiffness [1], that of its middle first;
    ``without_middle``: the law of a gear whose middle has lost it.
    """

    sums: tuple[tuple[str, ...], ...]
    without_middle: str

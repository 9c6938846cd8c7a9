"""Relations between effects, and how much formulas of one effect differ: columns of the table of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

FormulaKind = Literal["lag", "friction", "exact"]
FORMULA_KINDS: tuple[FormulaKind, ...] = get_args(FormulaKind)


@dataclass(frozen=True)
class Formula:
    """How much two accepted formulas of an effect differ.

    - ``kind``: effects of one kind are compared with the same ``error``.
    - ``error``: difference as a share of what the effect explains [1].
    - ``held``: when the error applies: always, or if an effect of the kind leaves little more than noise, or
      almost nothing.
    - ``white``: whether the true effect leaves a white residual.
    - ``value_error``: standard deviation of a parameter between formulas, relative to its size [1].
    - ``of_each``: whether ``value_error`` grows with the number of fitted parameters.
    """

    kind: FormulaKind | None
    error: float
    held: Literal["always", "near_noise", "next_to_nothing"]
    white: bool
    value_error: float
    of_each: bool

    @property
    def exact(self) -> bool:
        """Whether there is only one accepted formula."""
        return self.kind == "exact"

    def spread(self, free: int) -> float:
        """Return the relative standard deviation of a parameter between formulas [1].

        ``free`` is the number of fitted parameters.
        """
        return self.value_error * free if self.of_each else self.value_error


@dataclass(frozen=True)
class Plainer:
    """The plainer ``law`` that an effect contains, and the parameters that the effect ``adds`` to that law.

    If the logs do not show the added parameters, the plainer law is ``likelier`` by this factor. ``shown``
    says how the logs show them: by the standard errors of all, or of at least one (``"either"``, two sides of one
    wave), or by friction that rises at low speed.
    """

    law: str
    adds: tuple[str, ...]
    likelier: float
    shown: Literal["sizes", "either", "rise"]

    @property
    def by_rise(self) -> bool:
        """Whether the addition shows in the rise of friction at low speed, not in standard errors."""
        return self.shown == "rise"


@dataclass(frozen=True)
class Resembles:
    """An effect ``law`` with one parameter, which a second effect equals at the values ``shape``.

    The parameter of ``law`` is ``ratio`` times the parameter ``size`` of the second effect. If both describe
    a machine equally well, the second effect is ``rarer`` by this factor.
    """

    law: str
    size: str
    ratio: float
    shape: Mapping[str, float]
    rarer: float

    def values(self, of_law: float) -> dict[str, float]:
        """Return the parameters at which the second effect equals ``law`` with the parameter ``of_law``."""
        return {self.size: of_law / self.ratio, **self.shape}


@dataclass(frozen=True)
class BegunFrom:
    """A ``law`` whose fit starts this effect's fit; ``takes`` maps parameters to those of the law."""

    law: str
    takes: Mapping[str, str]


@dataclass(frozen=True)
class Later:
    """Parameters of a law that are fitted in a second step, after the fit without them.

    The ``amplitude`` starts at ``begin``, with ``most`` as its upper bound. The ``shape`` starts like that of
    the effect ``as_of``.
    """

    amplitude: str
    begin: float
    most: float
    shape: str
    as_of: str


@dataclass(frozen=True)
class SpringChange:
    """How a law changes the spring of a gear.

    ``sums``: parameters whose sums are the relative changes of stiffness [1], from the middle outwards.
    ``without_middle``: name of the law for a gear without stiffness in its middle.
    """

    sums: tuple[tuple[str, ...], ...]
    without_middle: str

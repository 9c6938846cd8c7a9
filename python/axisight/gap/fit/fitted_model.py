"""Hypotheses, and the normal equations and fits of models with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, effect_info

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hypothesis:
    """An effect that is tried: its start values, free parameters, priors and bounds.

    - ``priors``: mean and standard deviation by parameter; ``bounds``: smallest and largest value.
    - ``starts``: further start values, since a fit may end in a local minimum.
    - ``stated``: values of the effect that the simulator already has.
    - ``deflections_rad``: range in which the torques of the logs turn a linear gear, for gear laws.
    - ``largest``: size by amplitude from which it is far-fetched on this robot.
    - ``sure``: interval by parameter that holds for any bodies of the arm. It leaves out what the simulator has, and
      the fit stays in it.
    """

    effect: Effect
    free: tuple[str, ...]
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    starts: tuple[Mapping[str, float], ...] = ()
    stated: Mapping[str, float] = field(default_factory=dict)
    deflections_rad: tuple[float, float] | None = None
    largest: Mapping[str, float] = field(default_factory=dict)
    sure: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def at(self, values: Mapping[str, float]) -> Hypothesis:
        """Return the hypothesis with other start values."""
        return replace(self, effect=self.effect.with_values(values))

    def limits(self, name: str) -> tuple[float, float]:
        """Return the smallest and the largest value of a parameter, always within the bounds of the effect."""
        table = next(p for p in effect_info(self.effect.name).parameters if p.name == name)
        least, most = self.sure.get(name, self.bounds.get(name, (table.lower, table.upper)))
        return max(least, table.lower), min(most, table.upper)


# Compared by identity, so that results can be cached by object.
@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of a model at given parameters, by data block (see `FittedModel`).

    - ``matrix`` (n_blocks, p, p), ``gradient`` (n_blocks, p), ``loss`` (n_blocks,).
    - ``prior_matrix`` (p, p), ``prior_gradient`` (p,).
    - ``parameters``: names of the p columns: (None, robot parameter) or (position of the effect, parameter).
    - ``at_bound``: the parameters at a bound.
    - ``jacobian``: the p columns of a model that was evaluated and not fitted.
    - ``room``: how far down and up effect parameters may move from their values, if known.
    """

    parameters: tuple[tuple[int | None, str], ...]
    at_bound: tuple[tuple[int | None, str], ...]
    matrix: Array
    gradient: Array
    loss: Array
    prior_matrix: Array
    prior_gradient: Array
    jacobian: tuple[_core.Column, ...] = field(default=(), kw_only=True)
    room: Mapping[tuple[int | None, str], tuple[float, float]] = field(
        default_factory=dict, kw_only=True
    )

    @property
    def total(self) -> float:
        """Loss of the estimation logs."""
        return float(self.loss.sum())

    def without(self, kept: int, *, among: range, fixed: set[str]) -> NormalEquations:
        """Return the normal equations with only one effect, number ``kept``, of the effects at the positions ``among``.

        It moves to the first of these positions. ``fixed``: robot parameters that are no longer free.
        """
        wanted = [
            i
            for i, (place, name) in enumerate(self.parameters)
            if (name not in fixed if place is None else place == kept or place not in among)
        ]

        def renamed(key: tuple[int | None, str]) -> tuple[int | None, str]:
            return (among.start if key[0] == kept else key[0], key[1])

        names = [self.parameters[i] for i in wanted]
        pick = np.ix_(wanted, wanted)
        return NormalEquations(
            parameters=tuple(renamed(n) for n in names),
            at_bound=tuple(renamed(n) for n in self.at_bound if n in names),
            matrix=self.matrix[:, wanted][:, :, wanted],
            gradient=self.gradient[:, wanted],
            loss=self.loss,
            prior_matrix=self.prior_matrix[pick],
            prior_gradient=self.prior_gradient[wanted],
            jacobian=tuple(self.jacobian[i] for i in wanted) if self.jacobian else (),
            room={renamed(n): self.room[n] for n in names if n in self.room},
        )


@dataclass(frozen=True, eq=False)
class FittedModel(NormalEquations):
    """A fitted model with its normal equations and residuals.

    - ``effects``: with fitted values; ``free``: the hypotheses that they come from; ``robot_values``: own parameters.
    - ``std``: standard deviation by parameter; ``condition``: condition number of the normal equations.
    - ``log``, ``axis``, ``start``, ``size`` (n_blocks,): log, axis, first residual and length of each block.
    - ``samples`` (n_blocks,): total weight of the residuals of a block, less than ``size`` if some weigh less.
    - ``residual`` (n_residuals,) and ``columns``, its derivatives by (effect label or None, parameter).
    - ``renewed``: all sensitivities were computed for this model; ``up_to_date``: at the values where the fit ended.
    - ``balanced``: parameters at a bound in a balanced fit, if the values come from one; all else is from this fit.
    """

    effects: tuple[Effect, ...]
    free: tuple[Hypothesis, ...]
    robot_values: dict[str, float]
    std: dict[tuple[int | None, str], float]
    status: str
    renewed: bool
    condition: float
    log: NDArray[np.int64]
    axis: NDArray[np.int64]
    start: NDArray[np.int64]
    size: NDArray[np.int64]
    samples: Array
    residual: Array
    columns: dict[tuple[str | None, str], _core.Column]
    up_to_date: bool = False
    balanced: tuple[tuple[int | None, str], ...] | None = None

    @property
    def ended_at_bound(self) -> tuple[tuple[int | None, str], ...]:
        """The parameters whose values are at a bound."""
        return self.at_bound if self.balanced is None else self.balanced

    def part(self, logs: Sequence[int]) -> FittedModel:
        """Return the model with the data of some logs (numbers) only; fitted values stay."""
        kept = np.isin(self.log, logs)
        first, size = self.start[kept], self.size[kept]
        rows = list(zip(first.tolist(), (first + size).tolist(), strict=True))
        return replace(
            self,
            matrix=self.matrix[kept],
            gradient=self.gradient[kept],
            loss=self.loss[kept],
            log=self.log[kept],
            axis=self.axis[kept],
            start=np.cumsum(size) - size,
            size=size,
            samples=self.samples[kept],
            residual=np.concatenate([self.residual[a:b] for a, b in rows]),
            columns={key: column.part(rows) for key, column in self.columns.items()},
        )

    def ending_with(self, last: Hypothesis) -> FittedModel:
        """Return the model with one of its effects moved to the end, where the hypothesis under test stands."""
        at = next(i for i, f in enumerate(self.free) if f.effect.label == last.effect.label)
        order = [i for i in range(len(self.free)) if i != at] + [at]
        place = {old: new for new, old in enumerate(order)}

        def renamed(key: tuple[int | None, str]) -> tuple[int | None, str]:
            return None if key[0] is None else place[key[0]], key[1]

        balanced = self.balanced
        return replace(
            self,
            effects=tuple(self.effects[i] for i in order),
            free=tuple(self.free[i] for i in order),
            parameters=tuple(map(renamed, self.parameters)),
            at_bound=tuple(map(renamed, self.at_bound)),
            balanced=None if balanced is None else tuple(map(renamed, balanced)),
            std={renamed(key): value for key, value in self.std.items()},
            room={renamed(key): value for key, value in self.room.items()},
        )

    @property
    def converged(self) -> bool:
        """Whether the fit ended where no step lowers the loss further."""
        return self.status in ("loss_converged", "step_converged", "exact")

    @property
    def stuck(self) -> bool:
        """Whether the fit stalled although its sensitivities are up to date: a further fit would end here, too."""
        return self.status == "stalled" and self.up_to_date

"""Effects under trial, and what the data say of a model with them."""

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
    """An effect under trial: start values, the parameters to fit, priors and bounds of some.

    ``starts`` are further start values worth trying, of one parameter, for effects whose fit may
    end in the wrong valley. ``stated`` are the values of an effect that the simulator has itself.
    ``deflections_rad``: from where to where the torques of the logs turn a linear gear, for laws of gears.
    """

    effect: Effect
    free: tuple[str, ...]
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    starts: tuple[Mapping[str, float], ...] = ()
    stated: Mapping[str, float] = field(default_factory=dict)
    deflections_rad: tuple[float, float] | None = None

    def at(self, values: Mapping[str, float]) -> Hypothesis:
        """Return the same with other start values."""
        return replace(self, effect=self.effect.with_values(values))

    def limits(self, name: str) -> tuple[float, float]:
        """Return the least and the largest value of a parameter: beyond those of the effect there is no model."""
        table = next(p for p in effect_info(self.effect.name).parameters if p.name == name)
        least, most = self.bounds.get(name, (table.lower, table.upper))
        return max(least, table.lower), min(most, table.upper)


# One of them is itself alone: what is computed of it is kept by it.
@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of a model at given parameters.

    By block (see `Fitted`): ``matrix`` (n_blocks, p, p), ``gradient`` (n_blocks, p),
    ``loss`` (n_blocks,); ``prior_matrix`` (p, p), ``prior_gradient`` (p,). ``parameters``
    names the p columns: (None, robot parameter) or (effect position, parameter); ``jacobian`` has
    them, of a model that was not fitted. ``room``: how far down and up those of effects may go
    from where they are, as far as that is known.
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
        """Return the same with one effect of those at the places ``among``, which comes first there.

        ``fixed``: the robot's parameters that are no longer free.
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
    """A fitted model and what the data say of it.

    ``robot_values``: the simulator's re-fitted parameters; ``effects`` with
    fitted values and ``std`` per effect parameter; ``log``, ``axis``, ``start``,
    ``size`` (n_blocks,) of the blocks, ``samples`` (n_blocks,) what their residuals count for in
    all: fewer where some are weighed down. ``renewed``: the sensitivities are the model's own,
    none is another's; ``up_to_date``: all of them were computed where the fit ended. ``balanced``:
    parameters at a bound where the values are those of a balanced fit, and the rest is of this one.
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
        """Return the same of some logs, by their numbers; what was fitted stays."""
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
        """Return the same with one of its effects last: what is under trial stands there."""
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
        """Whether no step lowers the loss, whatever its sensitivities promise: another fit ends here too."""
        return self.status == "stalled" and self.up_to_date

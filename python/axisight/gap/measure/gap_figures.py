"""Computes how far the gap shrinks, on the validation logs only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.result import Gap, Interval, Overlay, Pooled
from axisight.gap.facts.simulator_variant import combine, relative_squares
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """Squared relative errors of one simulator, as block means (n_blocks, n_axes) of each log.

    ``pooled``: sqrt(sum e^2 / sum u^2) over all samples, axes and logs, as in `Pooled` [1]. ``silent``: axes (from 0)
    that are not judged; they are NaN.
    """

    blocks: tuple[Array, ...]
    pooled: float
    silent: tuple[int, ...] = ()

    def per_log(self) -> list[Array]:
        """Return the mean square (n_axes,) of each log."""
        return [b.mean(axis=0) for b in self.blocks]

    def judged(self) -> list[Array]:
        """Return the block means (n_blocks, n_judged) of each log on the axes that are judged."""
        return [np.delete(b, self.silent, axis=1) for b in self.blocks]

    def by_log(self) -> Array:
        """Return the mean square of each log on the axes that are judged, (n_logs,)."""
        return np.array([b.mean() for b in self.judged()])

    def mean(self) -> float:
        """Return the mean square over logs and judged axes."""
        return float(self.by_log().mean())

    def resampled(self, picks: Sequence[NDArray[np.int64]]) -> Array:
        """Return the mean square of resampled blocks (n_draws,).

        ``picks``: for each log, the numbers (n_draws, n_blocks) of the drawn blocks.
        """
        return np.asarray(
            np.mean(
                [b.mean(axis=1)[p].mean(axis=1) for b, p in zip(self.judged(), picks, strict=True)],
                axis=0,
            )
        )


def stage(
    logs: Sequence[Log],
    errors: Sequence[Array],
    block_s: float,
    measured: Sequence[Array] | None = None,
    silent: tuple[int, ...] = (),
) -> Stage:
    """Return the stage of a simulator from its torque errors (n, n_axes) [Nm] on each log.

    ``measured``: torques (n, n_axes) [Nm] that the errors refer to, by default those of the logs. ``silent``: axes
    (from 0) that are not judged.
    """
    blocks = []
    torques = [log.torque_nm for log in logs] if measured is None else measured
    for log, error in zip(logs, errors, strict=True):
        squares = relative_squares(log, error)
        squares[:, list(silent)] = np.nan
        length = max(1, int(block_s / log.sample_time_s))
        count = max(1, len(squares) // length)
        parts = np.array_split(squares, count)
        blocks.append(np.array([p.mean(axis=0) for p in parts]))
    torque, left = (
        sum(float(np.sum(np.delete(x, silent, axis=1) ** 2)) for x in of)
        for of in (torques, errors)
    )
    return Stage(tuple(blocks), float(np.sqrt(left / max(torque, 1e-300))), silent)


@dataclass(frozen=True)
class Stages:
    """Errors of the simulator as given, re-fitted and with the causes, and of a perfect one (``floor``).

    ``open``: further error that a perfect simulator may leave if torques cannot be known; None if they are.
    """

    given: Stage
    refitted: Stage
    after: Stage
    floor: Stage
    open: Stage | None = None
    compared: Compared = "torques"


def gap_figures(stages: Stages, *, one_unit: bool = True) -> Gap:
    """Return the gap as given, re-fitted and with the causes, and the floor.

    ``one_unit``: whether all axes are driven by torques, or all by forces. With both, pooled figures have no meaning
    and are left out.
    """
    every = (stages.given, stages.refitted, stages.after, stages.floor)
    (before, before_axes), (refit, refit_axes), (left, left_axes), (noise, noise_axes) = (
        (float(np.sqrt(s.mean())), combine(s.per_log())) for s in every
    )
    pooled = Pooled(*(s.pooled for s in every)) if one_unit else None
    return Gap(
        before,
        refit,
        left,
        noise,
        before_axes,
        refit_axes,
        left_axes,
        noise_axes,
        pooled,
        stages.compared,
    )


def gap_reduction(
    earlier: Stage, later: Stage, given: Stage, floor: Stage, *, draws: int, seed: int
) -> Interval:
    """Return the share of the explainable gap removed from ``earlier`` to ``later``.

    (earlier^2 - later^2) / (given^2 - floor^2), clipped to [0, 1], with a 95 % interval from resampling blocks of the
    logs with replacement (block bootstrap; Künsch 1989, Annals of Statistics 17(3)).
    """
    rng = np.random.default_rng([seed, 0x676170])
    picks = [rng.integers(0, len(b), (draws, len(b))) for b in given.blocks]

    def ratio(of: Callable[[Stage], Array | float]) -> Array:
        explainable = np.asarray(of(given) - of(floor))
        removed = np.asarray(of(earlier) - of(later))
        share = removed / np.where(explainable > 0, explainable, np.inf)
        return np.clip(share, 0.0, 1.0)

    low, high = np.quantile(ratio(lambda s: s.resampled(picks)), [0.025, 0.975])
    value = float(ratio(Stage.mean))
    return Interval(value, float(min(low, value)), float(max(high, value)))


# Points of an overlay. A figure draws the smallest and the largest value of each pixel.
_OVERLAY_POINTS = 10_000


def overlays(
    view: View,
    logs: Sequence[Log],
    simulated: tuple[Sequence[Array], Sequence[Array]],
    stages: tuple[Stage, Stage],
) -> tuple[Overlay, ...]:
    """Return measured and simulated torque of every log and axis as compared, thinned for plotting.

    ``simulated``: torques of each log (n, n_axes) [Nm] before and after; ``stages``: their errors.
    """
    out = []
    squares = zip(*(s.per_log() for s in stages), strict=True)
    for log, before, after, (given, left) in zip(logs, *simulated, squares, strict=True):
        step = max(1, log.n_samples // _OVERLAY_POINTS)
        # Both sides of the comparison pass the same filter, so the figure shows the filtered torque, not the
        # raw log.
        measured, counted = view.measured(log), view.counted(log)
        std = np.std(log.torque_nm, axis=0)
        out += [
            Overlay(
                log.name,
                i + 1,
                log.time_s[::step],
                measured[::step, i],
                before[::step, i],
                after[::step, i],
                counted[::step, 0],
                float(np.sqrt(given[i])),
                float(np.sqrt(left[i])),
                float(std[i]),
                view.lowpass_hz,
            )
            for i in range(log.n_axes)
        ]
    return tuple(out)

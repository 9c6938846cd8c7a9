"""Fits of candidates to part of the data, looked at on all of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.screening.screening import Screening, ScreeningModel, Start

# Steps of the fit of a candidate; leaders go on from there.
_STEPS = 8


@dataclass(frozen=True)
class Begun:
    """A candidate where the fit to part of the data left it.

    ``beside``: the other effects of the model, as it left them; None where it was not fitted.
    """

    start: Start
    option: Hypothesis
    robot_values: Mapping[str, float]
    beside: Sequence[Hypothesis] | None = None


class TrialFit:
    """Fits of candidates to the data of a bench, begun on what a screen has of it."""

    def __init__(self, bench: ScreeningModel, screen: Screening) -> None:
        self.bench, self.screen = bench, screen

    def bends(self, start: Start) -> bool:
        """Whether a candidate bends the simulator, and has sensitivities of its own."""
        return start.robot_values is not self.bench.model.robot_values

    def begun(self, start: Start) -> Begun:
        """Return a candidate fitted to the data of the screen, where that is part of the whole."""
        as_it_is = Begun(start, start.option, start.robot_values)
        part = self.screen.bench
        if part is self.bench:
            return as_it_is
        found = self._fit(part, as_it_is, _STEPS)
        if found is None:
            return as_it_is
        *others, option = found.free
        beside = [self._moved(f, option) for f in others]
        return Begun(start, option, found.robot_values, beside)

    def _moved(self, other: Hypothesis, option: Hypothesis) -> Hypothesis:
        """Return an effect beside a candidate as the fit left it, or as the model has it.

        Those of other axes hardly move: as they are, their sensitivities need not be renewed.
        """
        here, there = option.effect.axis, other.effect.axis
        if None in (here, there) or here == there:
            return other
        label = other.effect.label
        return next(f for f in self.bench.model.free if f.effect.label == label)

    def ended(self, begun: Begun) -> FittedHypothesis | None:
        """Return a candidate as all data have it; None where it cannot be simulated.

        One that was fitted to part of them is looked at where that left it: what a step from there
        would gain is part of its score.
        """
        found = self._fit(self.bench, begun, _STEPS if begun.beside is None else 0)
        return None if found is None else trial(begun.start.option, found, self.bench.model)

    def _fit(self, bench: ScreeningModel, begun: Begun, steps: int) -> FittedModel | None:
        lazy = not self.bends(begun.start)
        solve = partial(bench.fitter.fit, lazy=lazy, max_iterations=steps)
        return bench.attempt(
            solve, begun.option, begun.robot_values, beside=begun.beside, close=lazy
        )

"""Fits candidates to part of the data, then evaluates them on all of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis, trial
from axisight.gap.screening.screening import Screening, ScreeningModel, Start

# Largest number of steps in the fit of a candidate; only leaders get more.
_STEPS = 8


@dataclass(frozen=True)
class Begun:
    """A candidate after its fit to part of the data.

    ``beside``: the other effects of the model after that fit; None if the candidate was not fitted.
    """

    start: Start
    option: Hypothesis
    robot_values: Mapping[str, float]
    beside: Sequence[Hypothesis] | None = None


class TrialFit:
    """Fits candidates to the data of ``bench``, starting from fits to the data of ``screen``."""

    def __init__(self, bench: ScreeningModel, screen: Screening) -> None:
        self.bench, self.screen = bench, screen

    def bends(self, start: Start) -> bool:
        """Whether a candidate needs sensitivities of its own: it starts at other own parameters than the model's."""
        return start.robot_values is not self.bench.model.robot_values

    def begun(self, start: Start) -> Begun:
        """Return a candidate fitted to the data of the screen; unfitted if the screen has all data or the fit fails."""
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
        """Return another effect as the fit left it, or as the model has it if both act on different single axes.

        Effects on other axes hardly change. With unchanged values, their sensitivities stay valid.
        """
        here, there = option.effect.axis, other.effect.axis
        if None in (here, there) or here == there:
            return other
        label = other.effect.label
        return next(f for f in self.bench.model.free if f.effect.label == label)

    def ended(self, begun: Begun) -> FittedHypothesis | None:
        """Return a candidate evaluated on all data; None if it cannot be simulated.

        A candidate that was fitted to part of the data is not fitted again here. Its score includes the gain of one
        further linear step.
        """
        found = self._fit(self.bench, begun, _STEPS if begun.beside is None else 0)
        return None if found is None else trial(begun.start.option, found, self.bench.model)

    def _fit(self, bench: ScreeningModel, begun: Begun, steps: int) -> FittedModel | None:
        lazy = not self.bends(begun.start)
        solve = partial(bench.fitter.fit, lazy=lazy, max_iterations=steps)
        return bench.attempt(
            solve, begun.option, begun.robot_values, beside=begun.beside, close=lazy
        )

"""The question whether a machine has an effect of a size that its logs would not show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.experiment import NAMED, Plan, ShowingExperiment
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.measure.detection_limits import loss_that_shows
from axisight.gap.ranking.fitted_hypothesis import numbers
from axisight.gap.search.state import SearchState
from axisight.gap.separate.question import Seen, Turn
from axisight.gap.views.view import View

Array = NDArray[np.float64]

# Share of the loss that one linear step of a simpler law may leave, although a full fit would remove it.
_ONE_STEP = 0.05


@dataclass(frozen=True, eq=False)
class Sought:
    """The question whether an effect of a given size is there, although the logs at hand do not show it.

    The machine has the effect, and its simulated run along a motion is fitted without it. The loss that this leaves
    must reach the detection limit of all logs together. What the old logs would show of the effect does not count.

    - ``asked``: the effect as asked for; ``effect``: the same with all parameters.
    - ``without``: the fitted model with all causes.
    - ``plainer``: the part of the effect that a simpler law has, which may compensate for it.
    - ``cost``: number of fitted parameters of the effect.
    """

    asked: Effect
    effect: Effect
    without: FittedModel
    plainer: tuple[Hypothesis, ...]
    cost: float
    found: SearchState
    settings: Settings

    @property
    def turns(self) -> tuple[Turn]:
        """The machine with the effect, and the model found so far that is fitted to it."""
        machine = replace(self.without, effects=(*self.without.effects, self.effect))
        free = (*self.without.free, *self.plainer)
        return (Turn(machine, self.without, free, self.without.free),)

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes (from 1) that the effect acts on; empty for the whole arm."""
        if self.effect.axes is not None:
            return self.effect.axes
        return () if self.effect.axis is None else (self.effect.axis,)

    @property
    def enough(self) -> float:
        """The worth from which the effect is also named: a multiple of the smallest size that shows."""
        return NAMED

    def worth(self, seen: Sequence[Seen], repeats: int = 1) -> float:
        """Return the size of the effect relative to the smallest that would show, on the axis that shows most."""
        (one,) = seen
        new = repeats * one.samples
        more = 1.0 + new / self.found.layout.samples()
        shows = loss_that_shows(self.found, self.settings, self.cost, more)
        left = np.maximum(one.left - _ONE_STEP * one.there, 0.0)
        return float(np.sqrt(np.max(new * left / shows)))

    def narrowed(self, seen: Sequence[Sequence[Seen]], repeats: int) -> Sought:
        """Return the same question: it has one part."""
        del seen, repeats
        return self

    def answered(self, plan: Plan, worth: float) -> ShowingExperiment:
        """Return a planned experiment with its worth."""
        return ShowingExperiment(plan, self.asked, worth)


def sought(found: SearchState, view: View, effect: Effect) -> Sought | str:
    """Return the question whether a machine has an effect, or the reason in words why it cannot be asked.

    Shape parameters that are not given are those of a candidate of the diagnosis.
    """
    if effect.label in {e.label for e in found.model.effects}:
        return "these logs show one already"
    axes = None if effect.axis is None else (effect.axis,)
    options = view.candidates(found.model, axes=axes or view.robot.axis_numbers())
    option = next((o for o in options if o.effect.label == effect.label), None)
    if option is None:
        return "a diagnosis of these logs does not look for it there"
    amplitudes, plain = _numbers(effect.name)
    shape = {k: v for k, v in (option.effect.parameters or {}).items() if k not in amplitudes}
    full = effect.with_values({**shape, **(effect.parameters or {})})
    given = {n for n, value in (effect.parameters or {}).items() if value}
    shared = tuple(n for n in option.free if n in plain) if given & (amplitudes - plain) else ()
    bare = replace(
        full, parameters={k: v for k, v in (full.parameters or {}).items() if k not in amplitudes}
    )
    plainer = (Hypothesis(bare, shared),) if shared else ()
    return Sought(effect, full, found.model, plainer, numbers(option), found, view.settings)


def _numbers(name: str) -> tuple[set[str], set[str]]:
    """Return the amplitudes of an effect, and those of them that a simpler law has."""
    info = effect_info(name)
    amplitudes = {p.name for p in info.parameters if p.role == "amplitude"}
    return amplitudes, amplitudes & {
        p.name for law in info.contains for p in effect_info(law).parameters
    }

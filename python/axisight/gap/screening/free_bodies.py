"""Judges effects by a regression that leaves the bodies of the arm free.

Where a model file says nothing of friction, its masses are hardly those of the machine. One effect then passes for
another, and for the sum of many small errors of the bodies. Least squares with all bodies free show what is needed
whatever they are (Gautier and Khalil 1990).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

import numpy as np

from axisight.effects import effect_info, of_rigid_bodies
from axisight.fitting.divergence import Diverged
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.joint_regression import JointRegression
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.ordinary_first import lacks

AS_MUCH = 0.9
"""Share of the gain of others from which an effect explains as much, with the formula error on both sides."""


@dataclass(frozen=True)
class FreeBodies:
    """The bodies of an arm as hypotheses of which nothing is known; empty where the simulator's are trusted."""

    fitter: ModelFitter
    layout: Layout
    settings: Settings
    bodies: tuple[Hypothesis, ...] = ()
    _known: WeakKeyDictionary[FittedModel, bool] = field(default_factory=WeakKeyDictionary)
    _regressions: WeakKeyDictionary[FittedModel, JointRegression | None] = field(
        default_factory=WeakKeyDictionary
    )

    @staticmethod
    def among(offered: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
        """Return the bodies among hypotheses: they may be anywhere in the range of their effects."""
        return tuple(replace(h, bounds={}) for h in offered if of_rigid_bodies(h.effect.name))

    def beside(
        self, model: FittedModel, tried: Sequence[Hypothesis] = ()
    ) -> tuple[NormalEquations, JointRegression] | None:
        """Return the normal equations and the regression of a model, further effects and the bodies, in this order.

        None where they cannot be evaluated.
        """
        present = {h.effect.label for h in model.free}
        bodies = [h for h in self.bodies if h.effect.label not in present]
        free = [*model.free, *map(by_amplitude, tried), *bodies]
        at = self.fitter.evaluate(free, model)
        if isinstance(at, Diverged):
            return None
        first = len(free) - len(bodies)
        loose = np.array([p is not None and p >= first for p, _ in at.parameters])
        return at, JointRegression(at, self.layout, loose)

    def allow(self, one: FittedHypothesis, model: FittedModel) -> bool:
        """Whether an effect beside a model may be a cause, whatever the bodies of the arm.

        Beside free bodies, it explains enough of what is left on its axis. An effect of the arm, a constant torque, or
        what every machine has may stand in the place of the bodies: it explains as much as they do together. A load
        does, and one link of several that are off does not.
        """
        if not self.bodies:
            return True
        if one.fitted not in self._known:
            self._known[one.fitted] = self._allow(one, model)
        return self._known[one.fitted]

    def _allow(self, one: FittedHypothesis, model: FittedModel) -> bool:
        without, found = self._regression(model), self._regression(one.fitted)
        if without is None or found is None:
            return False
        effect = one.hypothesis.effect
        of_arm = effect_info(effect.name).acts == "arm"
        axis = None if of_arm or effect.axis is None else effect.axis - 1
        if of_arm or of_rigid_bodies(effect.name) or lacks(self.fitter, effect):
            losses = held_out_loss(model), one.held_out, found.held_out()
            before, after, least = (found.weighed(x, axis) for x in losses)
            if before - after >= AS_MUCH * (before - least):
                return True
        before, after = (found.weighed(x.held_out(), axis) for x in (without, found))
        return not of_arm and after < (1 - self.settings.explained_share) * before

    def _regression(self, model: FittedModel) -> JointRegression | None:
        if model not in self._regressions:
            found = self.beside(model)
            self._regressions[model] = None if found is None else found[1]
        return self._regressions[model]


def by_amplitude(one: Hypothesis) -> Hypothesis:
    """Return a hypothesis with its amplitudes free only, in which the torque is linear."""
    amplitudes = {p.name for p in effect_info(one.effect.name).parameters if p.role == "amplitude"}
    return replace(one, free=tuple(name for name in one.free if name in amplitudes))

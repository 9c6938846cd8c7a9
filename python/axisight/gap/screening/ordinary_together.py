"""Finds what every machine has on all axes at once, whatever the bodies of the arm.

A model file often says nothing of friction and rotors, and its masses are not those of the machine. One at a time, the
effects of an axis hide one another, and wrong masses hide them all. By inverse dynamics the torque is linear in all of
them, so that one regression tells which are there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.joint_regression import JointRegression
from axisight.gap.fit.settling import settled
from axisight.gap.ranking.fitted_hypothesis import trial
from axisight.gap.ranking.judgement import stand
from axisight.gap.ranking.ordinary_first import unsaid
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.free_bodies import FreeBodies, by_amplitude
from axisight.gap.simulator.stated_amplitude import own_parameter, stated_amplitude
from axisight.gap.simulator.told_from_bodies import told_from_bodies

Array = NDArray[np.float64]

Found = tuple[RankedHypothesis, AxisPosterior]


@dataclass(frozen=True)
class OrdinaryTogether:
    """What every machine has, beside one model: ``floor`` (n_blocks,) is the loss of noise alone."""

    model: FittedModel
    floor: Array
    free: FreeBodies

    def found(self, offered: Sequence[Hypothesis]) -> list[Found]:
        """Return the offered hypotheses that are sure, whatever the bodies of the arm, each with its posterior.

        Only effects of which the simulator says nothing, or the same of every axis.
        """
        fitter, names = self.free.fitter, unsaid(self.free.fitter)
        tried = [h for h in offered if h.effect.name in names]
        found = self.free.beside(self.model, tried) if tried else None
        if found is None:
            return []
        at, regression = found
        places = [place for place, _ in at.parameters]
        column = {h.effect.label: i for h, i in self._columns(tried, places)}
        sure = [
            _within(h, regression, column[h.effect.label])
            for h in self._told(tried)
            if h.effect.label in column
            and self._is_sure(h, regression, column[h.effect.label], len(tried))
        ]
        fitted = settled(fitter, [*self.model.free, *sure], self.model) if sure else None
        if fitted is None or isinstance(fitted, Diverged):
            return []
        effects = [*(h.effect for h in self.model.free), *(h.effect for h in tried)]
        ordinary = np.array(
            [
                effects[p].axis or 0
                if p is not None and p < len(effects) and effects[p].name in names
                else 0
                for p in places
            ]
        )
        new = fitted.free[len(self.model.free) :]
        return [
            member
            for axis in sorted({h.effect.axis or 0 for h in new})
            for member in self._members(
                fitted, [h for h in new if h.effect.axis == axis], regression, ordinary == axis
            )
        ]

    def _columns(
        self, tried: Sequence[Hypothesis], places: Sequence[int | None]
    ) -> list[tuple[Hypothesis, int]]:
        first = len(self.model.free)
        return [(h, places.index(i)) for i, h in enumerate(tried, first) if i in places]

    def _told(self, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the hypotheses that least squares can tell from the bodies of the arm."""
        robot = self.free.fitter.robot
        owns = [own_parameter(robot, h.effect) for h in tried]
        told = told_from_bodies(robot, frozenset(name for name in owns if name is not None))
        return [h for h, own in zip(tried, owns, strict=True) if own is None or own in told]

    def _is_sure(
        self, one: Hypothesis, regression: JointRegression, column: int, tried: int
    ) -> bool:
        """Whether a hypothesis is no false alarm among all ``tried``, and worth naming.

        A number that the simulator states for every axis is given up where it is off by most of its size.
        """
        settings, axis = self.free.settings, (one.effect.axis or 1) - 1
        stated = stated_amplitude(one.effect, self.free.fitter.robot)
        return (
            regression.is_sure(column, settings.false_alarms / tried)
            and abs(regression.step[column]) > settings.explained_share * abs(stated)
            and regression.rise(column, axis) > settings.smallest_gain
        )

    def _members(
        self,
        fitted: FittedModel,
        mine: Sequence[Hypothesis],
        regression: JointRegression,
        ordinary: NDArray[np.bool_],
    ) -> list[Found]:
        """Return the sure hypotheses of one axis with their posterior: they are judged as one set.

        ``ordinary`` (p,): the parameters of the axis that are judged, those in the model included.
        """
        each = [trial(h, fitted.ending_with(h)) for h in mine]
        together = replace(
            each[-1],
            held_out=regression.held_out(),
            also=tuple(mine[:-1]),
            idle=sum(t.idle for t in each),
        )
        standing = stand(
            [together],
            regression.held_out(ordinary),
            self.floor,
            self.free.layout,
            (mine[0].effect.axis or 1) - 1,
            without=self.model,
            explained_share=self.free.settings.explained_share,
        )
        if standing is None or standing.best.probability <= standing.p_none:
            return []
        members = (standing.of_member(t) for t in each)
        return [(s.best, s) for s in members]


def _within(one: Hypothesis, regression: JointRegression, column: int) -> Hypothesis:
    """Return a hypothesis at its value in the regression, which keeps within the interval there."""
    (name,) = by_amplitude(one).free
    begin, (least, most) = (one.effect.parameters or {})[name], one.limits(name)
    low, high = (begin + x for x in regression.interval(column, level=0.95))
    at = one.at({name: begin + float(regression.step[column])})
    return replace(at, sure={name: (max(low, least), min(high, most))})

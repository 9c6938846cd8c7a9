"""Causes of the estimation logs, measured on the validation logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from axisight.gap.facts.settings import Settings
from axisight.gap.measure.by_axis import OwnAxes, led, without_axis
from axisight.gap.measure.reach import Reach, reach_of, refitted_errors
from axisight.gap.measure.where import ErrorLog, stands_out
from axisight.gap.ranking.intervals import with_own_scatter
from axisight.gap.search.balanced_values import with_balanced_values
from axisight.gap.search.state import SearchState
from axisight.gap.verdict.conclusion import Conclusion, conclude
from axisight.gap.verdict.unknown_torque_constants import open_with_constants
from axisight.gap.views.view import View
from axisight.logs import Log


@dataclass(frozen=True)
class Validated:
    """The conclusion of the estimation logs, and its effect on the validation logs.

    ``errors``: of the re-fitted simulator on the estimation logs; ``own``: how causes fare on their
    axes, where errors of axes add up.
    """

    found: SearchState
    errors: list[ErrorLog]
    conclusion: Conclusion
    reach: Reach
    own: OwnAxes | None


def validated(
    view: View,
    held_logs: Sequence[Log],
    found: SearchState,
    unknown_constants: Sequence[int],
    settings: Settings,
) -> Validated:
    """Measure on the validation logs what the search found.

    Where errors of axes add up, each axis is judged alone: an axis whose causes do not carry over loses
    them, and the other axes keep theirs. ``unknown_constants``: axes (from 1) of currents whose torque constant
    nobody knows.
    """
    errors = refitted_errors(view, found)
    clear = stands_out(errors)
    lost: dict[int, str] = {}
    while True:
        concluded = conclude(found, settings=settings, stands_out=clear, shown=view.shown)
        conclusion = open_with_constants(concluded, unknown_constants, view.robot)
        causes = with_own_scatter(conclusion.causes, view.fitter.tolerated)
        conclusion = replace(conclusion, causes=causes)
        reach = reach_of(view, held_logs, found, conclusion.effects, settings)
        own = _axes_alone(view, conclusion, found, reach)
        axis = None if own is None else own.not_carried()
        if own is None or axis is None or axis in lost or len(own.axes) < 2:
            return Validated(found, errors, conclusion.with_checks([*lost.values()]), reach, own)
        lost[axis] = (
            f"The causes found on axis {axis + 1} are left out: what explains the estimation logs there does not "
            "carry over to the validation logs."
        )
        found = with_balanced_values(without_axis(found, view.fitter, axis), view.fitter)


def _axes_alone(
    view: View, conclusion: Conclusion, found: SearchState, reach: Reach
) -> OwnAxes | None:
    """Return how causes fare on their axes, where errors of axes add up."""
    arm = any(c.axis is None for c in conclusion.causes)
    if not view.fitter.adds_up or not conclusion.causes or arm:
        return None
    leads = {cause.effect.label: axis for cause, axis in led(found)}
    axes: dict[int, tuple[str, ...]] = {}
    for c in conclusion.causes:
        axis = leads.get(c.label, (c.axis or 1) - 1)
        axes[axis] = (*axes.get(axis, ()), c.label)
    return OwnAxes(axes, reach.stages.given, reach.stages.after, reach.change)

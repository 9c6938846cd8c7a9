"""Adds the experiment that the user asks for to a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.gap.facts.axis_names import placed
from axisight.gap.facts.experiment import Experiment
from axisight.gap.facts.result import Diagnosis
from axisight.gap.search.state import SearchState
from axisight.gap.separate.design import designed
from axisight.gap.separate.limits import ExperimentLimits
from axisight.gap.separate.loop_route import LoopRoute
from axisight.gap.separate.position_route import InverseRoute, TargetRoute
from axisight.gap.separate.record import record
from axisight.gap.separate.rivals import rivals_of
from axisight.gap.separate.route import Route
from axisight.gap.separate.sought import sought
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.gap.views.targets import TargetsView
from axisight.gap.views.view import View
from axisight.robot import Robot

LIMITS = "limits"
"""What stands in place of an effect to ask for a record that lowers all detection limits."""

# Verdicts after which a record helps without being asked for.
_OPEN = ("unknown", "explained_in_part")


@dataclass(frozen=True)
class Asked:
    """A request for an experiment: one that separates the remaining rivals, or one that shows what logs hide.

    ``to_show``: the effect with the size that must show, `LIMITS` for a record, None to separate rivals; ``within``:
    limits of the motors in place of those of the robot and the logs.
    """

    to_show: Effect | str | None
    within: ExperimentLimits | None

    def check_limits(self, view: View) -> None:
        """Raise InputError for limits that these motors cannot have."""
        self._route(view)

    def added(self, out: Diagnosis, view: View, found: SearchState, *, keep: bool) -> Diagnosis:
        """Return a diagnosis with the experiment as the next step.

        With ``keep``, with something to show, and beside a record, the step that the diagnosis already advises stays
        first.
        """
        route = self._route(view)
        experiment = self._design(route, found, out)
        if experiment is None:
            return out
        aside = keep or self.to_show is not None or out.verdict in _OPEN
        kept = out.next_experiment if aside else None
        advice = " ".join(filter(None, (kept, str(experiment))))
        made = None if isinstance(experiment, str) else experiment
        return replace(out, experiment=made, next_experiment=advice)

    def _route(self, view: View) -> Route:
        if isinstance(view, InverseView):
            return InverseRoute(view, self.within)
        if isinstance(view, TargetsView):
            return TargetRoute(view, self.within)
        assert isinstance(view, ClosedLoopView)  # there is no fourth comparison
        return LoopRoute(view, self.within)

    def _design(self, route: Route, found: SearchState, out: Diagnosis) -> Experiment | str | None:
        """Return the experiment, or the reason if none can show the effect; None if nothing is left to separate."""
        if isinstance(self.to_show, Effect):
            question = sought(found, route.view, self.to_show)
            if isinstance(question, str):
                return f"No experiment to show {placed(self.to_show.label)}: {question}."
            return designed(route, question)
        if self.to_show == LIMITS:
            return record(route, found.model)
        if (experiment := _separating(route, found)) is not None:
            return experiment
        return record(route, found.model) if out.verdict in _OPEN else None


def _separating(route: Route, found: SearchState) -> Experiment | None:
    """Return the experiment for the closest rivals, or one with more of them that decides; None without rivals."""
    closest: Experiment | None = None
    told = 0
    for most in route.hypotheses:
        rivals = rivals_of(found, route.view.settings, most)
        if rivals is None or len(rivals.labels) == told:
            break
        made, told = designed(route, rivals), len(rivals.labels)
        if made.decides:
            return made
        closest = closest or made
    return closest


def asked_of(
    robot: Robot, separate: bool, to_show: Effect | str | None, within: ExperimentLimits | None
) -> Asked | None:
    """Return the request for an experiment; None if there is none.

    Raises InputError for an effect that the robot cannot have or that has zero size, and for limits without a request.
    """
    if within is not None and to_show is None and not separate:
        raise InputError(f"within: expected with separate or to_show only, got {within}")
    if isinstance(to_show, str):
        if to_show != LIMITS:
            raise InputError(f"to_show: expected an Effect or {LIMITS!r}, got {to_show!r}")
    elif to_show is not None:
        (to_show,) = robot.placed([to_show])
        if not to_show.acts:
            raise InputError(
                f"to_show: expected {to_show.label} of a size that does something, got "
                f"{dict(to_show.parameters or {})}"
            )
        robot.with_effects([*(e for e in robot.effects if e.label != to_show.label), to_show])
    return Asked(to_show, within) if separate or to_show is not None else None

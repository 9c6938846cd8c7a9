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
from axisight.gap.separate.question import Question
from axisight.gap.separate.rivals import rivals_of
from axisight.gap.separate.sought import sought
from axisight.gap.separate.waves import ExperimentLimits, seen_range
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.gap.views.view import View
from axisight.robot import Robot


@dataclass(frozen=True)
class Asked:
    """A request for an experiment: one that separates the remaining rivals, or one that shows an effect.

    ``to_show``: the effect with the size that must show, None to separate rivals; ``within``: limits of the motors in
    place of those seen in the logs.
    """

    to_show: Effect | None
    within: ExperimentLimits | None

    def check_limits(self, view: View) -> None:
        """Raise InputError for limits that these motors cannot have."""
        if isinstance(view, ClosedLoopView):
            seen_range(view.logs, self.within)

    def added(self, out: Diagnosis, view: View, found: SearchState, *, keep: bool) -> Diagnosis:
        """Return a diagnosis with the experiment as the next step.

        With ``keep``, or with an effect to show, the step that the diagnosis already advises stays first.
        """
        experiment = self._design(view, found)
        if experiment is None:
            return out
        kept = out.next_experiment if keep or self.to_show is not None else None
        advice = " ".join(filter(None, (kept, str(experiment))))
        made = None if isinstance(experiment, str) else experiment
        return replace(out, experiment=made, next_experiment=advice)

    def _design(self, view: View, found: SearchState) -> Experiment | str | None:
        """Return the experiment, or the reason if none can show the effect; None if no rivals are left to separate.

        In inverse dynamics there is no loop to simulate, and so no experiment.
        """
        if not isinstance(view, ClosedLoopView):
            return self._no_experiment("by inverse dynamics there is no loop to run")
        question: Question | str | None
        question = (
            rivals_of(found, view.settings)
            if self.to_show is None
            else sought(found, view, self.to_show)
        )
        if question is None or isinstance(question, str):
            return self._no_experiment(question or "")
        return designed(view, question, seen_range(view.logs, self.within))

    def _no_experiment(self, why: str) -> str | None:
        if self.to_show is None:
            return None
        return f"No experiment to show {placed(self.to_show.label)}: {why}."


def asked_of(
    robot: Robot, separate: bool, to_show: Effect | None, within: ExperimentLimits | None
) -> Asked | None:
    """Return the request for an experiment; None if there is none.

    Raises InputError for an effect that the robot cannot have or that has zero size, and for limits without a request.
    """
    if within is not None and to_show is None and not separate:
        raise InputError(f"within: expected with separate or to_show only, got {within}")
    if to_show is not None:
        (to_show,) = robot.placed([to_show])
        if not to_show.acts:
            raise InputError(
                f"to_show: expected {to_show.label} of a size that does something, got "
                f"{dict(to_show.parameters or {})}"
            )
        robot.with_effects([*(e for e in robot.effects if e.label != to_show.label), to_show])
    return Asked(to_show, within) if separate or to_show is not None else None

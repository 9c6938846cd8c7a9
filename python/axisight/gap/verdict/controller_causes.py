"""Differences of the controller that logs show by themselves, where torques are compared by inverse dynamics.

Inverse dynamics predicts the torque from the measured motion, whatever commanded that motion, so its gap tells
nothing of gains. The controller's law does: targets, positions and torques of the log have to obey it.
"""

from __future__ import annotations

from dataclasses import replace

from axisight.gap.controller.torque_sensor import sensor_of, share_reported, unseen_constant
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval
from axisight.gap.verdict.conclusion import Conclusion, named_shown
from axisight.gap.views.view import View

SAYS = (
    "A torque predicted from the measured motion does not feel it. It makes none of this gap, but the "
    "simulator's own loop lacks it."
)
"""Sentence about a cause that the gap does not feel."""
NO_SHARE = Interval(0.0, 0.0, 0.0)
"""Its `gap_reduction`."""


def with_controllers_shown(conclusion: Conclusion, view: View) -> tuple[Conclusion, list[Interval]]:
    """Return a conclusion with the differences of the controller behind its causes, and their shares of the gap.

    | logs show | named |
    |---|---|
    | all gains off by one share, the torque constant by its inverse | a torque sensor gain instead |
    | all gains off by one share, too small to show as a constant | nothing; a check says so |
    | anything else | the cause |
    """
    shares, unseen = [], unseen_constant(view.settings)
    for cause in view.unfelt:
        gains, share = named_shown(cause), share_reported(cause)
        sensor = None if share is None else sensor_of(gains, conclusion.causes)
        if sensor is not None:
            conclusion = _with_sensor(conclusion, *sensor).with_checks([cause.says])
        elif share is not None and abs(share) < unseen:
            conclusion = conclusion.with_checks([cause.says])
        else:
            conclusion = conclusion.with_causes_behind([gains])
            conclusion = conclusion.with_checks([f"{cause.says} {SAYS}"])
            shares.append(NO_SHARE)
    return conclusion, shares


def _with_sensor(conclusion: Conclusion, place: int, sensor: NamedCause) -> Conclusion:
    """Return a conclusion with a torque sensor in the place of a torque constant; the gains rule out its rivals."""
    constant = conclusion.causes[place].label
    causes = (*conclusion.causes[:place], sensor, *conclusion.causes[place + 1 :])
    still = tuple(group for group in conclusion.equivalent if constant not in group)
    out = replace(conclusion, causes=causes, equivalent=still)
    if still or conclusion.verdict != "undecidable":
        return out
    return replace(out, verdict="explained", next_experiment=None)

"""What logs show of a controller by themselves, where torques are predicted from the measured motion.

Along the motion that was, the torque is right whatever commanded it: no such gap tells of gains. The algebra of
targets, positions and torques does.
"""

from __future__ import annotations

from dataclasses import replace

from axisight.gap.controller.torque_sensor import sensor_of, share_reported, unseen_constant
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval
from axisight.gap.verdict.conclusion import Conclusion, named_shown
from axisight.gap.views.view import View

SAYS = (
    "A torque predicted from the measured motion does not feel it: it makes none of this gap, but the "
    "simulator's own loop would run without it."
)
"""What is to be said of a cause that the gap does not feel."""
NO_SHARE = Interval(0.0, 0.0, 0.0)
"""Its `gap_reduction`."""


def with_controllers_shown(conclusion: Conclusion, view: View) -> tuple[Conclusion, list[Interval]]:
    """Return a conclusion with what is different about the controller behind its causes, and their shares.

    Gains off by one share and a torque constant off by its inverse are one cause, in the constant's place: a
    torque that is reported too large. Gains off by one share so small that such a constant does not show may
    be that: they are said, and no cause.
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
    """Return a conclusion with a torque sensor in the place of a torque constant, which the gains tell from rivals."""
    constant = conclusion.causes[place].label
    causes = (*conclusion.causes[:place], sensor, *conclusion.causes[place + 1 :])
    still = tuple(group for group in conclusion.equivalent if constant not in group)
    out = replace(conclusion, causes=causes, equivalent=still)
    if still or conclusion.verdict != "undecidable":
        return out
    return replace(out, verdict="explained", next_experiment=None)

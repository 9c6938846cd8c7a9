"""When the simulator's own parameters are at the edge of their tolerances."""

from types import SimpleNamespace

import pytest

from axisight import load_robot
from axisight.gap.fit.tolerance_edges import BENT, bent

ROBOT = load_robot("irb6600_like").with_effects([])
TOLERANCE = {"mass": 0.015, "stiffness": 0.015, "motor_inertia": 0.015}


KNOWN = [n for n in ROBOT.parameters() if n.rsplit(".", 1)[1] in TOLERANCE]


@pytest.mark.parametrize(
    ("off", "count", "bends"),
    [
        (2.9, len(KNOWN), False),
        (3.1, len(KNOWN), True),
        (3.1, len(KNOWN) // 4 - 1, False),
        (3.1, -(-len(KNOWN) // 4), True),
    ],
)
def test_bent_is_a_share_of_parameters_three_tolerances_off(off: float, count: int, bends: bool):
    known = ROBOT.parameters()
    values = {n: known[n] for n in KNOWN} | {n: (1 + off * 0.015) * known[n] for n in KNOWN[:count]}
    model = SimpleNamespace(robot_values=values, ended_at_bound=())
    fitter = SimpleNamespace(robot=ROBOT, tolerances=TOLERANCE, adds_up=False)
    share = count / len(KNOWN) if off > 3 else 0.0
    assert bent(fitter, model) == pytest.approx(share)
    assert (bent(fitter, model) >= BENT) is bends
    # Where errors add up it says nothing.
    fitter.adds_up = True
    assert bent(fitter, model) == 0.0

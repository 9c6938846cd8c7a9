"""When the simulator's own parameters are at the edge of their tolerances."""

from types import SimpleNamespace

import pytest

from axisight import load_robot
from axisight.gap.fit.tolerance_edges import BENT, bent

ROBOT = load_robot("irb6600_like").with_effects([])
TOLERANCE = {"mass": 0.015, "stiffness": 0.015, "motor_inertia": 0.015}


@pytest.mark.parametrize(("off", "share"), [(2.9, 0.0), (3.1, 1.0)])
def test_bent_is_a_share_of_parameters_three_tolerances_off(off: float, share: float):
    values = {
        name: (1 + off * 0.015) * value
        for name, value in ROBOT.parameters().items()
        if name.rsplit(".", 1)[1] in TOLERANCE
    }
    model = SimpleNamespace(robot_values=values, ended_at_bound=())
    fitter = SimpleNamespace(robot=ROBOT, tolerances=TOLERANCE, adds_up=False)
    assert bent(fitter, model) == share
    assert not 0 < share < BENT
    # Where errors add up it says nothing.
    fitter.adds_up = True
    assert bent(fitter, model) == 0.0

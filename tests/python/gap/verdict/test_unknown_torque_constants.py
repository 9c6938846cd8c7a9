"""Which torque constants nobody knows a weight or an inertia may be instead."""

from types import SimpleNamespace

import pytest

from axisight import load_robot
from axisight.gap.verdict.unknown_torque_constants import _constants_like


@pytest.mark.parametrize(
    ("effect", "axis", "like"),
    [
        # A motor and a balancer turn their own axis, a link weighs on all that carries it.
        ("motor_inertia", 2, [2]),
        ("gravity_compensation", 4, []),
        ("link_mass", 2, [1, 2]),
        # A load hangs on the last link; a pose changes what lies before and behind.
        ("payload", None, [1, 2, 3]),
        ("link_geometry", 1, [1, 2, 3]),
        ("joint_zero_offset", 2, [1, 2, 3]),
        # Neither the constant itself nor friction is one.
        ("torque_constant", 1, []),
        ("torque_offset", 1, []),
        ("coulomb_friction", 1, []),
        ("cable_stiffness", 1, []),
    ],
)
def test_constants_of_the_axes_that_feel_a_cause(effect, axis, like):
    cause = SimpleNamespace(effect=effect, axis=axis)
    found = _constants_like(cause, [1, 2, 3], load_robot("cobot_like"))
    assert found == tuple(f"torque_constant@{i}" for i in like)

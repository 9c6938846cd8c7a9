"""By inverse dynamics the rate of the logs counts, not that of the simulator."""

from __future__ import annotations

import numpy as np
import pytest

import rigid_arm
from axisight import Effect, InputError, Robot, Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.views.inverse_dynamics import InverseView

# A model file states no sample time, and its import one of 1 ms.
OF_AN_IMPORT_S = 1e-3
LATE = Effect("input_delay", 2, {"delay_s": 0.02})


def errors_of(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the residuals of a robot with a late drive, and the size of each block."""
    log = rigid_arm.log_of(rigid_arm.arm(), 1, seconds=12.0)
    view = InverseView(robot, [log], Settings(threads=1))
    late = view.fitter.fit([Hypothesis(LATE, ())], max_iterations=0)
    return late.residual, late.size


def test_a_simulator_of_another_rate_predicts_the_same_torque():
    """The low-pass of residuals, the delays of drives and the length of blocks all count in seconds."""
    same, other = rigid_arm.arm(), rigid_arm.arm().with_sample_time(OF_AN_IMPORT_S)
    (residual, size), (of_other, size_of_other) = errors_of(same), errors_of(other)
    assert size_of_other.tolist() == size.tolist()
    np.testing.assert_array_equal(of_other, residual)


def test_a_robot_at_another_rate_is_the_same_in_all_else():
    friction = Effect("coulomb_friction", 3, {"coulomb_nm": 0.5})
    angles = np.linspace(-0.2, 0.3, 6)
    before = (
        rigid_arm.arm()
        .with_parameters({"j2.mass": 11.0})
        .with_effects([friction])
        .with_operating_point(angles)
    )
    after = before.with_sample_time(OF_AN_IMPORT_S)
    assert after.sample_time_s == OF_AN_IMPORT_S
    assert after.parameters() == before.parameters()
    assert after.effects == before.effects
    np.testing.assert_array_equal(after.operating_point, angles)


@pytest.mark.parametrize("seconds", [0.0, -1e-3, float("nan")])
def test_a_sample_time_is_positive(seconds):
    with pytest.raises(InputError, match="sample_time_s"):
        rigid_arm.arm().with_sample_time(seconds)

"""Effects of one axis that hide one another, in logs so short that none alone looks sure."""

import numpy as np
import pytest

from axisight import Settings, diagnose
from rigid_arm import COULOMB_NM, VISCOUS, arm, log_of

ROBOT = arm()
SLOPE = 6 * np.array(VISCOUS)
OFFSET = 0.8 * np.array(COULOMB_NM)


def short_logs(seed):
    """Ten seconds each of friction, an offset, and slow torques that no effect stands for."""
    out = []
    for run in range(3):
        log = log_of(ROBOT, 10 * seed + run, COULOMB_NM, SLOPE, 10.0)
        rng = np.random.default_rng([seed, run])
        for frequency_hz in (0.3, 0.7, 1.3, 2.1):
            phase = 2 * np.pi * frequency_hz * log.time_s[:, None] + rng.uniform(0, 2 * np.pi, 6)
            log.torque_nm[:] += 0.1 * rng.normal(size=6) * np.array(COULOMB_NM) * np.sin(phase)
        log.torque_nm[:] += OFFSET
        out.append(log)
    return out


@pytest.fixture(scope="module")
def found():
    logs = short_logs(1)
    return diagnose(
        robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=Settings(bootstrap=20)
    )


def test_friction_and_offsets_of_all_axes_are_named(found):
    named = sorted((c.effect, c.axis) for c in found.causes)
    effects = ("coulomb_friction", "torque_offset", "viscous_friction")
    assert named == [(effect, axis) for effect in effects for axis in range(1, 7)]


def test_the_gap_falls_to_what_least_squares_leaves(found):
    """Slow torques of 0.14 of Coulomb friction on average are left by any model."""
    assert found.gap.after < 0.1 * found.gap.before


def test_values_are_those_of_the_machine(found):
    for cause in found.causes:
        if cause.effect == "torque_offset":
            (value,) = (v.value for v in cause.parameters.values())
            # An effect gives to the motor what the machine asks of it.
            assert value == pytest.approx(-OFFSET[cause.axis - 1], rel=0.25)

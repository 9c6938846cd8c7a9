"""Friction that falls while a machine warms up, where only the motion is compared."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, diagnose
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.signals.motion import motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from rigid_arm import RATE_HZ, arm, log_of
from rigid_arm import motion as exact_motion

ROBOT = arm()
AXIS, COLD, FALLS, TIME_S = 2, 18.0, -15.0, 15.0
WARMUP = Effect(
    "friction_warmup",
    AXIS,
    {"viscous_nm_s_rad": FALLS, "time_constant_s": TIME_S, "cold_nm_s_rad": COLD},
)


def friction_of(speed: np.ndarray) -> np.ndarray:
    """What such friction is along a speed (n, 6)."""
    time = np.arange(len(speed)) / RATE_HZ
    out = np.zeros_like(speed)
    out[:, AXIS - 1] = (COLD + FALLS * (1 - np.exp(-time / TIME_S))) * speed[:, AXIS - 1]
    return out


def warming(run: int) -> Log:
    """A log without any other friction."""
    log = log_of(ROBOT, run, seconds=40.0, coulomb=np.zeros(6), viscous=np.zeros(6))
    speed = exact_motion(run, 40.0)[1]
    return replace(log, torque_nm=log.torque_nm + friction_of(speed))


def test_a_predicted_torque_has_the_friction_of_its_time():
    """Closed form; to rounding of torques of some hundred Nm."""
    at = motion(warming(0), 10.0)
    more = predicted_torque(ROBOT, Variant({}, (WARMUP,)), at) - predicted_torque(
        ROBOT, Variant({}), at
    )
    np.testing.assert_allclose(more, friction_of(at[1]), atol=1e-10)


def test_warming_up_is_named_by_the_motion_alone():
    said = diagnose(robot=ROBOT, estimation=[warming(k) for k in range(3)], validation=[warming(5)])
    assert (said.mode, said.verdict) == ("inverse_dynamics", "explained")
    assert [c.label for c in said.causes] == [WARMUP.label]
    found = said.causes[0].parameters
    for name, value in (WARMUP.parameters or {}).items():
        assert found[name].value == pytest.approx(value, rel=0.1)
        assert found[name].low <= value <= found[name].high

"""A remainder in MuJoCo moves a joint as MuJoCo's own friction of the same size does."""

import mujoco
import numpy as np
import pytest

from axisight.errors import InputError
from axisight.mujoco import apply_remainder
from axisight.remainder import Remainder, RunningRemainder, Term

RATIO, VISCOUS_NM_S_RAD = 0.1, 0.002
ARM = """<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/><worldbody><body>
<joint name="hinge" axis="0 1 0" damping="{damping}"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator><motor joint="hinge"/></actuator></mujoco>"""


def constant(acts: str, value: float, corner_rad_s: float = 0.01) -> RunningRemainder:
    term = Term(
        axis=1,
        acts=acts,  # type: ignore[arg-type]
        variable="constant",
        of_axis=1,
        x=np.zeros(1),
        value=np.array([value]),
        standard_error=np.zeros(1),
        corner_rad_s=corner_rad_s,
        gain=1.0,
        significance=9.0,
    )
    return RunningRemainder(Remainder((term,), np.array([10.0]), np.zeros(1)))


def swung(damping: float, running: RunningRemainder | None) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed of the joint, driven by a torque for 0.5 s of 1 s."""
    model = mujoco.MjModel.from_xml_string(ARM.format(damping=damping))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    out = []
    for step in range(1000):
        data.ctrl[0] = 0.5 if step < 500 else 0.0
        if running is not None:
            apply_remainder(model, data, running, gear_ratio=RATIO)
        mujoco.mj_step(model, data)
        out.append([data.qpos[0], data.qvel[0]])
    return tuple(np.array(out).T)


def test_a_viscous_remainder_is_a_damping() -> None:
    # Torque c v of the motor is c / ratio^2 of the joint.
    native = swung(VISCOUS_NM_S_RAD / RATIO**2, None)
    applied = swung(0.0, constant("speed", VISCOUS_NM_S_RAD))
    # Both take the speed at the end of the step.
    np.testing.assert_allclose(applied, native, rtol=1e-6, atol=1e-9)
    assert native[1].max() < 0.9 * swung(0.0, None)[1].max()


def test_a_dry_remainder_stops_the_joint() -> None:
    """Without drive, friction F takes the speed off at F / J, and holds the joint without shaking it."""
    dry_nm = 0.04
    _, speed = swung(0.0, constant("direction", dry_nm))
    joint_nm, inertia = dry_nm / RATIO, 0.1
    top = (0.5 - joint_nm) / inertia * 0.5
    assert speed.max() == pytest.approx(top, rel=0.01)
    stops = 500 + int(1000 * top / (joint_nm / inertia))
    assert np.abs(speed[stops + 20 :]).max() < 1e-3


def test_joints_are_those_of_the_axes() -> None:
    model = mujoco.MjModel.from_xml_string(ARM.format(damping=0))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    two = RunningRemainder(Remainder((), np.zeros(2), np.zeros(2)))
    with pytest.raises(InputError, match="joints: expected 2"):
        apply_remainder(model, data, two)
    with pytest.raises(InputError, match="gear_ratio"):
        apply_remainder(model, data, constant("speed", 1.0), gear_ratio=0.0)

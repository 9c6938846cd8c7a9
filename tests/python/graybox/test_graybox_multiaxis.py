"""All axes of an arm in three steps."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, InputError, Log, simulate
from axisight.graybox import RobotIdentification, identified_robot, identify_robot
from axisight.graybox.multiaxis.operating_points import operating_points
from axisight.graybox.multiaxis.starts import from_its_start
from axisight.graybox.multiaxis.weightings import Sensors
from axisight.logs import Load
from axisight.robot import Accelerometer
from axisight.robot_file import Provenance, write_identified
from multiaxis_data import (
    POSES,
    ROBOT,
    THIRTEEN,
    TRUTH,
    broadband,
    errors,
    off_by,
    other_robot,
    slow,
)

RUBBING = [
    Effect("coulomb_friction", axis, {"coulomb_nm": size, "smoothing_rad_s": 0.1})
    for axis, size in ((1, 0.644), (2, 2.0), (3, 1.6))
]
CONVERGED = ("loss_converged", "step_converged", "exact")


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    return broadband()


@pytest.fixture(scope="module")
def thirteen(logs: list[Log]) -> RobotIdentification:
    """Values of the file are wrong by up to a factor of three, and tell nothing but the structure."""
    start = other_robot(off_by(3.0, 4))
    return identify_robot(start, logs, parameters=THIRTEEN, coulomb=False)


def test_thirteen_parameters_within_one_percent(thirteen: RobotIdentification) -> None:
    assert thirteen.status in CONVERGED, thirteen.findings
    assert thirteen.joint.fit.names == THIRTEEN
    wrong = errors(THIRTEEN, thirteen.joint.fit.values)
    assert np.abs(wrong).max() < 0.01
    # Two poses of two seconds: z-scores of thirteen parameters exceed 4 in one of a thousand cases.
    assert (np.abs(wrong) < 4 * thirteen.joint.fit.std / thirteen.joint.fit.values).all()
    assert {n: thirteen.robot.parameters()[n] for n in THIRTEEN} == dict(
        zip(THIRTEEN, thirteen.joint.fit.values, strict=True)
    )
    assert thirteen.joint.fit_percent.min() > 90


def test_the_report_has_all_steps(thirteen: RobotIdentification) -> None:
    text = thirteen.report()
    assert "Step 1: not performed" in text
    assert "Step 2: frequency responses at 2 operating points" in text
    assert "pose2_axis3" in text and "axis3_yaw.stiffness" in text
    assert "no slow log" in text


def test_friction_of_every_axis() -> None:
    """Steps 1 and 3 find it beside gears that are off by 1.5."""
    gears = ("axis1.stiffness", "axis2.stiffness", "axis3.stiffness")
    found = identify_robot(
        other_robot(off_by(1.5, 4, gears)),
        broadband(effects=RUBBING)[3:],
        slow=[slow(RUBBING, 6.0)],
        parameters=["axis?.stiffness", "*.viscous_friction"],
    )
    assert found.status in CONVERGED, found.findings
    assert found.rigid.regression is not None
    robot = [name for name in found.joint.fit.names if "@" not in name]
    values = dict(zip(found.joint.fit.names, found.joint.fit.values, strict=True))
    assert np.abs(errors(robot, np.array([values[n] for n in robot]))).max() < 0.02
    for effect, truth in zip(found.effects, RUBBING, strict=True):
        size = effect.parameters["coulomb_nm"]
        assert size == pytest.approx(truth.parameters["coulomb_nm"], rel=0.02)


def test_values_go_to_a_robot_file(thirteen: RobotIdentification, tmp_path) -> None:
    values = identified_robot(thirteen, Provenance("test"))
    assert values.value("axis2_yaw.stiffness") == pytest.approx(8559000.0, rel=0.01)
    assert "no slow log" in values.provenance.notes
    written = tmp_path / "arm.toml"
    write_identified(ROBOT, written, values)
    assert "axis2_yaw.stiffness = 8" in written.read_text("utf-8")


def test_bodies_come_from_step_one(logs: list[Log]) -> None:
    """With ``bodies`` the values of a file hold masses, too."""
    found = identify_robot(
        ROBOT,
        logs[:3],
        slow=[slow(seconds=6.0)],
        parameters=["axis*.stiffness"],
        bodies=True,
        responses=False,
        coulomb=False,
    )
    values = identified_robot(found, Provenance("test"))
    assert "axis1.stiffness" in values.names
    assert any(name.endswith(".mass") for name in values.names)


def test_starts_are_those_of_the_simulation(logs: list[Log]) -> None:
    """A motor reads its joint through the gear, which gravity deflects; the noise of a reading is 5e-8 rad."""
    for log, pose in zip(logs, np.repeat(POSES, 3, axis=0), strict=True):
        np.testing.assert_allclose(from_its_start(ROBOT, log).start_rad, pose, atol=3e-7)
    stated = replace(logs[0], start_rad=np.ones(3))
    assert from_its_start(ROBOT, stated) is stated


def test_logs_of_one_pose_and_load_make_a_response(logs: list[Log]) -> None:
    heavy = [
        replace(log, name=f"{log.name}_heavy", load=Load(9.0, (0.0, 0.0, 0.1))) for log in logs
    ]
    points, findings = operating_points(ROBOT, [*logs, *heavy[:4]])
    assert [point.logs[0] for point in points] == [
        "pose1_axis1",
        "pose2_axis1",
        "pose1_axis1_heavy",
    ]
    assert points[2].response.load == heavy[0].load
    assert findings == [
        "pose2_axis1_heavy: 1 log at this pose, and a response needs 3: used in step 3 only"
    ]
    # Each pose is the mean of the motion, a tenth of a radian at most from its start.
    np.testing.assert_allclose(points[1].response.joint_angle_rad, POSES[1], atol=0.1)


def test_accelerometers_take_part(logs: list[Log]) -> None:
    """Readings with 0.01 m/s^2 of noise beside torques with 0.3 Nm."""
    robot = ROBOT.with_accelerometers([Accelerometer("tip", "axis3_yaw", (1.2, 0.1, 0.2))])
    rng = np.random.default_rng(4)
    log = logs[1]
    sim = simulate(robot, log.velocity_ref_rad_s, start_rad=list(POSES[0]), noise_seed=3, run=1)
    tip = sim["acceleration_m_s2"].sel(accelerometer="tip").values
    bare = replace(log, torque_nm=log.torque_nm + rng.normal(0, 0.3, log.torque_nm.shape))
    sensed = replace(bare, acceleration_m_s2={"tip": tip + rng.normal(0, 0.01, tip.shape)})
    names = ("axis2.stiffness", "axis2.damping", "axis3.stiffness")
    start = robot.with_parameters({name: 1.3 * TRUTH[name] for name in names})
    options = {"parameters": names, "responses": False, "coulomb": False}
    found = identify_robot(start, [sensed], **options)
    without = identify_robot(start, [bare], **options)
    assert found.status in CONVERGED, found.findings
    assert "in the time domain, from motors and accelerometers\n" in found.report()
    assert without.joint.acceleration_weighting is None
    fit = found.joint.fit
    assert (np.abs(errors(fit.names, fit.values)) < 4 * fit.std / fit.values + 2e-4).all()
    assert (fit.std < 0.5 * without.joint.fit.std).all()
    with pytest.raises(InputError, match=r"\[\[accelerometer\]\] in the robot file"):
        identify_robot(ROBOT, [sensed], **options)


def test_a_reading_that_a_log_lacks_does_not_sharpen_the_others(logs: list[Log]) -> None:
    """White residuals of one; two of three logs lack the last joint encoder, whose weight would be 1.7."""
    rng = np.random.default_rng(0)
    some = [replace(log, joint_position_rad=log.position_rad) for log in logs[:3]]
    residuals = [rng.normal(size=(4000, 6)) for _ in some]
    for residual in residuals[1:]:
        residual[:, 5] = 0.0
    _, joints, readings = Sensors.of(some).weightings(ROBOT, some, residuals)
    assert joints is not None and readings is None
    # Four times the scatter of bands of a thousand lines, as in test_fit_of_many.py.
    np.testing.assert_allclose(joints.weight[:, -2:], 1.0, rtol=0.08)


def test_misuse(logs: list[Log]) -> None:
    with pytest.raises(InputError, match="broadband: expected at least one log, got none"):
        identify_robot(ROBOT, [])
    with pytest.raises(InputError, match="parameters: expected names or patterns of axis1"):
        identify_robot(ROBOT, logs, parameters=["axis9.*"])
    with pytest.raises(InputError, match="broadband: expected 3 logs of one pose and load"):
        identify_robot(ROBOT, logs[:2])
    with pytest.raises(InputError, match="logs: expected different names"):
        identify_robot(ROBOT, [*logs, logs[0]])
    late = replace(logs[0], sample_time_s=1e-3)
    with pytest.raises(InputError, match=r"expected the sample time of the robot, 0\.0005 s"):
        identify_robot(ROBOT, [late])


def test_what_is_not_determined_is_said(logs: list[Log]) -> None:
    """One axis that stands tells nothing of its friction and little of its damper."""
    assert TRUTH["axis1.damping"] > 0
    still = [replace(log, name=f"still{i}") for i, log in enumerate(logs[:1])]
    found = identify_robot(
        other_robot({"axis3_yaw.damping": 1e-3}),
        still,
        parameters=["axis3_yaw.damping"],
        responses=False,
        coulomb=False,
    )
    assert found.elastic.fit is None
    assert "Step 2: not performed" in found.report()

"""The diagnosis of a six-axis arm by inverse dynamics, friction missing from its simulator."""

from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from axisight import Robot, Settings, diagnose
from axisight.gap import verdict_schema
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.signals.lowpass_cutoff import chosen_filtering, highest_cutoff_hz
from axisight.gap.simulator.rigid_torque import predicted_torque
from rigid_arm import COULOMB_NM, VISCOUS, arm, arm_toml, log_of, motion

ROBOT = arm()
QUICK = Settings(bootstrap=50)


def rigid_torque(at):
    return predicted_torque(ROBOT, AS_GIVEN, at)


def diagnosis(coulomb=COULOMB_NM, viscous=VISCOUS, seconds=20.0):
    logs = [log_of(ROBOT, seed, coulomb, viscous, seconds) for seed in range(3)]
    return diagnose(robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=QUICK)


@pytest.fixture(scope="module")
def everywhere():
    return diagnosis()


def test_friction_missing_everywhere_is_twelve_causes(everywhere):
    assert everywhere.verdict == "explained"
    found = {(c.effect, c.axis): c for c in everywhere.causes}
    wanted = [(e, a) for e in ("coulomb_friction", "viscous_friction") for a in range(1, 7)]
    assert sorted(found) == sorted(wanted)
    for axis, (coulomb, viscous) in enumerate(zip(COULOMB_NM, VISCOUS, strict=True), start=1):
        level = found["coulomb_friction", axis].parameters["coulomb_nm"].value
        slope = found["viscous_friction", axis].parameters["viscous_nm_s_rad"].value
        # The machine's corner is algebraic: at v it lacks (0.002 / v)^2 / 2 of the Coulomb torque,
        # 2 % at 0.01 rad/s and less than 0.1 % from 0.05 on; speeds reach 0.3 to 0.6 rad/s, over
        # which a thousandth of 8 Nm passes for 3 % of the slope.
        assert level == pytest.approx(coulomb, rel=0.02)
        assert slope == pytest.approx(viscous, rel=0.05)
    orders = ("Coulomb and viscous", "viscous and Coulomb")
    assert any(f"{x} friction on all six axes" in everywhere.headline for x in orders)


def test_the_verdict_obeys_its_schema(everywhere):
    jsonschema.validate(everywhere.to_verdict(), verdict_schema())


def test_every_axis_has_its_line(everywhere):
    assert [a.axis for a in everywhere.axes] == list(range(1, 7))
    assert all(a.verdict == "explained" and a.explained > 0.99 for a in everywhere.axes)
    assert all(len(a.causes) == 2 for a in everywhere.axes)


def test_probabilities_of_the_strongest_place_sum_to_one(everywhere):
    total = sum(c.probability for c in everywhere.ranking)
    assert total + everywhere.p_none + everywhere.p_unknown == pytest.approx(1.0)
    assert all(c.family == "friction" and c.family_probability > 0.99 for c in everywhere.causes)


def test_one_weak_cause_on_one_of_six_axes_is_found():
    coulomb = np.zeros(6)
    coulomb[4] = 0.5 * COULOMB_NM[4]
    found = diagnosis(coulomb, np.zeros(6))
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 5)]
    verdicts = [a.verdict for a in found.axes]
    assert verdicts == ["none"] * 4 + ["explained", "none"]


def test_a_complete_simulator_lacks_nothing():
    found = diagnosis(np.zeros(6), np.zeros(6))
    assert found.verdict == "none"
    assert not found.causes
    assert found.p_none > 0.3


def test_a_cause_that_does_not_carry_over_is_withdrawn():
    logs = [log_of(ROBOT, seed, seconds=20.0) for seed in range(2)]
    # The validation log is of a machine without friction.
    other = log_of(ROBOT, 2, np.zeros(6), np.zeros(6), 20.0)
    found = diagnose(robot=ROBOT, estimation=logs, validation=[other], settings=QUICK)
    assert found.verdict == "unknown"
    assert not found.causes
    assert (
        "not carry over to the validation logs" in found.headline and "motion 2" in found.headline
    )


def test_none_is_withdrawn_where_a_validation_log_stands_above_the_floor():
    logs = [log_of(ROBOT, seed, np.zeros(6), np.zeros(6), 20.0) for seed in range(2)]
    other = log_of(ROBOT, 2, np.eye(6)[3] * COULOMB_NM[3], np.zeros(6), 20.0)
    found = diagnose(robot=ROBOT, estimation=logs, validation=[other], settings=QUICK)
    assert found.verdict == "unknown"
    assert "axis 4 of motion 2" in found.headline


def test_the_cutoff_follows_the_noise_of_the_position():
    def cutoff(noise_rad: float) -> float:
        log = log_of(ROBOT, 0, seconds=20.0)
        rng = np.random.default_rng(1)
        log.position_rad[:] += noise_rad * rng.normal(size=log.position_rad.shape)
        return chosen_filtering([log], rigid_torque).cutoff_hz

    quiet, loud = cutoff(0.0), cutoff(1e-3)
    assert loud < 0.5 * quiet <= 0.5 * highest_cutoff_hz(0.01)
    # Its own motion, five harmonics of 0.1 Hz, is left in.
    assert loud > 1.0


def test_the_cutoff_in_use_is_said(everywhere):
    used = everywhere.provenance["cutoff_hz"]
    assert any(f"{used:.3g} Hz" in check for check in everywhere.checks)


def test_an_axis_whose_cause_does_not_carry_over_takes_nothing_from_the_others():
    levels = np.array(COULOMB_NM)
    both = levels * np.isin(np.arange(6), (1, 4))
    logs = [log_of(ROBOT, seed, both, np.zeros(6), 20.0) for seed in range(2)]
    # On the validation log axis 5 runs freely.
    other = log_of(ROBOT, 2, levels * (np.arange(6) == 1), np.zeros(6), 20.0)
    found = diagnose(robot=ROBOT, estimation=logs, validation=[other], settings=QUICK)
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 2)]
    assert any("axis 5" in check and "does not carry over" in check for check in found.checks)
    assert found.axes[1].verdict == "explained" and found.axes[4].verdict == "unknown"


def test_a_zero_of_a_joint_is_found_from_gravity():
    # The machine's joint 3 stands 0.05 rad further than its encoder says.
    offset = 0.05 * (np.arange(6) == 2)

    def turned(seed):
        log = log_of(ROBOT, seed, np.zeros(6), np.zeros(6), 20.0)
        position, speed, acceleration = motion(seed, 20.0)
        there = ROBOT.inverse_dynamics(position + offset, speed, acceleration)
        change = there - ROBOT.inverse_dynamics(position, speed, acceleration)
        return replace(log, torque_nm=log.torque_nm + change)

    logs = [turned(seed) for seed in range(3)]
    found = diagnose(robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert [(c.effect, c.axis) for c in found.causes] == [("joint_zero_offset", 3)]
    value = found.causes[0].parameters["offset_rad"]
    assert value.value == pytest.approx(0.05, rel=0.05)


def test_a_tilted_base_is_one_cause_of_the_arm():
    a, b = 0.03, -0.02
    x, y, z = ROBOT.gravity_m_s2
    assert (x, y) == (0.0, 0.0)
    # Gravity as the tilted base sees it: R_y(-b) R_x(-a) g.
    leaning = (z * np.array([-np.sin(b) * np.cos(a), np.sin(a), np.cos(b) * np.cos(a)])).tolist()
    machine = Robot.from_toml(
        arm_toml().replace("gravity = [0.0, 0.0, -9.81]", f"gravity = {leaning}")
    )
    assert machine.gravity_m_s2[1] != 0.0
    logs = [log_of(machine, seed, np.zeros(6), np.zeros(6), 20.0) for seed in range(3)]
    found = diagnose(robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert [(c.effect, c.axis) for c in found.causes] == [("base_tilt", None)]
    values = found.causes[0].parameters
    assert values["about_x_rad"].value == pytest.approx(a, rel=0.05)
    assert values["about_y_rad"].value == pytest.approx(b, rel=0.05)


def test_an_axis_that_never_moves_does_not_stop_the_diagnosis():
    """Speeds and travel of such an axis give start values that no law allows; only the moving axes are told."""
    logs = [log_of(ROBOT, seed, seconds=10.0, held=[0]) for seed in range(3)]
    found = diagnose(robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert {c.axis for c in found.causes if c.effect == "coulomb_friction"} == {2, 3, 4, 5, 6}

"""Effects between two axes: where they are tried, what they are called, what a verdict says of them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from jsonschema import validate

from axisight import Effect, Robot, diagnose, load_robot, simulate
from axisight.effects import effect_info
from axisight.gap import verdict_schema
from axisight.gap.facts.result import Candidate, Cause, DetectionLimit, Interval
from axisight.gap.hypotheses.candidates import _places
from axisight.gap.verdict.headline import named
from axisight.report.limits import limit_table
from axisight.report.wording import place, title_of_label
from gap_data import log_of

ONE = Interval(1.0, 0.9, 1.1)


def coupling() -> Cause:
    return Cause("axis_coupling", 2, 0.9, {"share": ONE}, {"share": "1"}, ONE, axes=(2, 3))


def test_neighbours_are_tried():
    robot = load_robot("irb6600_like")
    assert _places(robot, effect_info("axis_coupling")) == [(1, 2), (2, 3)]
    assert _places(load_robot("two_mass_axis"), effect_info("axis_coupling")) == []


# Two rigid axes of a wrist whose motors share a drag: it acts on the difference of their speeds.
WRIST = """
schema = "axisight.robot/2"
name = "a rigid wrist"
gravity = [0.0, 0.0, -9.81]
sample_time = 0.002
[[joint]]
name = "bend"
kind = "driven"
origin = [0.0, 0.0, 0.1]
axis = [0.0, 1.0, 0.0]
link = { mass = 2.0, com = [0.08, 0.01, 0.0], inertia = [3e-3, 1e-2, 1e-2, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.02, motor_inertia = 3e-5, viscous_friction = 1e-4 }
[[joint]]
name = "roll"
kind = "driven"
origin = [0.12, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
link = { mass = 0.8, com = [0.03, 0.0, 0.02], inertia = [1e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.025, motor_inertia = 2e-5, viscous_friction = 1e-4 }
[controller]
kind = "pi_velocity"
kp = [5e-3, 3e-3]
ki = [5e-2, 3e-2]
[sensor]
position_noise_std = 2e-5
"""
DRAG = {"viscous_nm_s_rad": 2e-4, "coulomb_nm": 0.01, "speed_ratio": -1.0, "smoothing_rad_s": 0.3}


def test_friction_that_two_rigid_axes_share_is_named():
    robot = Robot.from_toml(WRIST)
    effect = Effect("axis_coupling", None, DRAG, (1, 2))
    n = int(5.0 / robot.sample_time_s)
    logs = [
        log_of(robot, [effect], 3.0 * motion(seed, n, robot.sample_time_s)[:, :2], seed)
        for seed in range(3)
    ]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    (cause,) = found.causes
    assert found.verdict == "explained"
    assert (cause.effect, cause.axes) == ("axis_coupling", (1, 2)) and cause.probability > 0.9
    for name in ("viscous_nm_s_rad", "coulomb_nm", "speed_ratio"):
        interval = cause.parameters[name]
        assert interval.low <= DRAG[name] <= interval.high, name


def test_places_are_words():
    assert coupling().label == "axis_coupling@2,3"
    assert named([coupling()]) == "axis coupling on axes 2 and 3"
    assert place(2, (2, 3)) == "axes 2 and 3"
    assert title_of_label("axis_coupling@2,3") == "Axis coupling, axes 2 and 3"


def test_an_effect_knows_its_axes():
    effect = Effect("axis_coupling", None, None, (2, 3))
    assert effect.first_axis == 2
    assert [effect.acts_on(axis) for axis in (1, 2, 3)] == [False, True, True]
    assert Effect("payload").acts_on(1)
    assert not Effect("backlash", 2).acts_on(1)


def motion(seed: int, n: int, sample_time_s: float) -> np.ndarray:
    time = np.arange(n) * sample_time_s
    rng = np.random.default_rng(seed)
    lines = np.arange(0.5, 25.0, 0.5)
    waves = [
        np.cos(2 * np.pi * np.outer(time, lines) + rng.uniform(0, 2 * np.pi, len(lines))).sum(
            axis=1
        )
        for _ in range(3)
    ]
    top = np.array([8.0 * w / np.abs(w).max() for w in waves]).T
    return top * np.minimum(time / 0.1, 1.0)[:, None]


@pytest.fixture(scope="module")
def said():
    robot = load_robot("irb6600_like").with_effects([])
    effect = Effect("axis_coupling", None, {"share": 0.08}, (2, 3))
    n = int(5.0 / robot.sample_time_s)
    logs = [
        log_of(robot, [effect], motion(seed, n, robot.sample_time_s), seed) for seed in range(3)
    ]
    return diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])


def test_a_gear_that_is_turned_along_is_named(said):
    (cause,) = said.causes
    assert said.verdict == "explained"
    assert (cause.label, cause.axis, cause.axes) == ("axis_coupling@2,3", 2, (2, 3))
    share = cause.parameters["share"]
    assert share.value == pytest.approx(0.08, rel=0.02)
    assert share.low < 0.08 < share.high < 0.1
    assert [0 in a.causes for a in said.axes] == [False, True, True]


def test_a_verdict_states_both_axes(said):
    verdict = said.to_verdict()
    validate(verdict, verdict_schema())
    (cause,) = verdict["causes"]
    assert (cause["axis"], cause["axes"]) == (2, [2, 3])
    assert json.loads(json.dumps(verdict))["ranking"][0]["axes"] == [2, 3]
    limits = [x for x in verdict["detection_limits"] if x["effect"] == "axis_coupling"]
    assert all(x["axis"] == x["axes"][0] for x in limits)
    assert all("axes" not in c for c in verdict["ranking"] if c["effect"] == "backlash")


def test_two_axes_leave_the_rest_as_it_was():
    for item in (
        Candidate("backlash", 2, 0.5, 0.1, 3.0, "converged"),
        DetectionLimit("backlash", 2, "half_width_rad", 1e-4, "rad"),
    ):
        assert item.axes is None
    assert replace(coupling(), axes=None).label == "axis_coupling@2"


def test_friction_of_coupled_axes_slows_both():
    robot = load_robot("irb6600_like").with_effects([])
    values = {"coulomb_nm": 1.0, "smoothing_rad_s": 0.1}
    ref = np.zeros((800, 3))
    ref[:, 1] = 20.0 * np.minimum(np.arange(800) / 100, 1.0)
    bare = simulate(robot, ref)["torque_cmd_nm"].values
    coupled = simulate(robot, ref, effects=[Effect("axis_coupling", None, values, (2, 3))])
    more = (coupled["torque_cmd_nm"].values - bare)[-50:].mean(axis=0)
    # The second axis stands still and is pulled along by the friction of the first one's turn; gears
    # still swing by a tenth of that.
    np.testing.assert_allclose(more, [0.0, 1.0, 1.0], atol=0.1)


def test_a_limit_between_axes_stands_at_the_first_and_says_so():
    limit = DetectionLimit("axis_coupling", 2, "share", 0.01, "1", (2, 3))
    table = limit_table([limit], 3)
    assert table.rows == [["Axis coupling, with the next axis", "", "–", "0.010", "–"]]
    assert table.note == ""

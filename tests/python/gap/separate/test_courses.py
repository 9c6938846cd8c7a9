"""Smooth motions of an experiment stay within their limits, from rest to rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from axisight import InputError, load_robot
from axisight.gap import ExperimentLimits
from axisight.gap.separate.courses import Room, SumOfSines, centred, courses, improved, whole_travel
from axisight.gap.separate.limits import Range, within_limits
from axisight.gap.separate.waves import Motion
from axisight.robot import JointLimits

RANGE = Range(
    speed=np.array([2.0, 0.5]),
    back=np.array([-1.0, -0.2]),
    forth=np.array([1.0, 0.2]),
    torque=np.array([10.0, 10.0]),
    acceleration=np.array([8.0, 20.0]),
)
ROOM = Room(RANGE, 0.01, 8.0, 5.0)
ALL = [*courses(ROOM, (1, 2), 0)]


@pytest.mark.parametrize("motion", ALL, ids=lambda m: f"{m.words}, {m.axes}")
def test_a_motion_keeps_its_limits(motion: Motion) -> None:
    speed = motion.reference
    turned = np.cumsum(speed, axis=0) * ROOM.step_s
    changes = np.diff(speed, axis=0, prepend=0.0, append=0.0) / ROOM.step_s
    slack = 1 + 1e-9
    assert np.all(np.abs(speed).max(axis=0) <= slack * RANGE.speed)
    assert np.all(np.abs(changes).max(axis=0) <= slack * RANGE.acceleration)
    assert np.all(turned.max(axis=0) <= slack * RANGE.forth + 1e-12)
    assert np.all(turned.min(axis=0) >= slack * RANGE.back - 1e-12)


@pytest.mark.parametrize("motion", ALL, ids=lambda m: f"{m.words}, {m.axes}")
def test_a_motion_ends_at_rest_where_it_began(motion: Motion) -> None:
    speed = motion.reference
    assert speed.shape == (ROOM.n_samples, 2)
    assert np.abs(speed[[0, -1]]).max() <= 0.05 * np.abs(speed).max()
    assert np.abs(speed.sum(axis=0)).max() * ROOM.step_s <= 1e-9
    assert [a for a in (1, 2) if np.any(speed[:, a - 1])] == list(motion.axes)


def test_the_largest_motion_reaches_a_limit() -> None:
    """Identity: of each axis, one of speed, acceleration and travel is what bounds the full size."""
    for motion in (m for m in ALL if m.axes == (1, 2) and "largest size" not in m.words):
        speed = motion.reference
        turned = np.cumsum(speed, axis=0) * ROOM.step_s
        changes = np.diff(speed, axis=0, prepend=0.0, append=0.0) / ROOM.step_s
        shares = [
            np.abs(speed).max(axis=0) / RANGE.speed,
            np.abs(changes).max(axis=0) / RANGE.acceleration,
            np.maximum(turned.max(axis=0) / RANGE.forth, turned.min(axis=0) / RANGE.back),
        ]
        np.testing.assert_allclose(np.max(shares, axis=0), 1.0, rtol=1e-9, err_msg=motion.words)


def test_variants_are_other_sums_of_sines_of_the_same_axes() -> None:
    best = next(m for m in ALL if isinstance(m, SumOfSines))
    found = improved(best, ROOM, 3, np.random.default_rng(0))
    assert [m.axes for m in found] == [best.axes] * 3
    assert all(np.abs(m.reference - best.reference).max() > 0.01 for m in found)
    assert (
        improved(Motion("Another", (1,), best.reference), ROOM, 3, np.random.default_rng(0)) == []
    )


def test_slow_triangles_take_the_whole_travel() -> None:
    """Closed form: 2 rad of triangle to either side at 0.4 rad/s, and 0.4 rad at 0.1 rad/s."""
    motion = whole_travel(ROOM)
    turned = np.cumsum(motion.reference, axis=0) * ROOM.step_s
    np.testing.assert_allclose(turned.max(axis=0), RANGE.forth, rtol=0.1)
    np.testing.assert_allclose(turned.min(axis=0), RANGE.back, rtol=0.1)
    assert np.all(np.abs(motion.reference).max(axis=0) <= 0.2 * RANGE.speed * (1 + 1e-9))


def test_a_range_of_one_side_is_used_from_its_middle() -> None:
    seen, middle = centred(replace(RANGE, back=np.zeros(2), forth=np.array([2.0, 0.4])))
    np.testing.assert_allclose(middle, [1.0, 0.2])
    np.testing.assert_allclose(seen.forth, [1.0, 0.2])
    np.testing.assert_allclose(seen.back, [-1.0, -0.2])


AXIS = load_robot("two_mass_axis")
ONE = Range(*(np.array([x]) for x in (2.0, -1.0, 1.0, 10.0, np.inf)))


def test_stated_limits_take_the_place_of_seen_ones() -> None:
    stated = ExperimentLimits(acceleration_rad_s2=3.0, room_m=[-1, -1, -1, 1, 1, 1])
    found = within_limits(ONE, stated, AXIS, np.zeros(1))
    assert found.acceleration.tolist() == [3.0]
    assert found.room is not None
    assert found.room.tolist() == [-1, -1, -1, 1, 1, 1]
    assert (found.speed, found.torque) == (ONE.speed, ONE.torque)


def test_travel_ends_where_the_joint_does() -> None:
    """Closed form: the range of a joint over its gear ratio, from where the motor starts."""
    ratio = float(AXIS.gear_ratio[0])
    robot = AXIS.with_joint_limits([JointLimits((-0.1 * ratio, 0.4 * ratio))])
    for given in (None, ExperimentLimits(travel_rad=9.0)):
        found = within_limits(ONE, given, robot, np.array([0.1]))
        np.testing.assert_allclose(found.forth, [0.3])
        np.testing.assert_allclose(found.back, [-0.2])
        assert found.sources["travel"] == ("model",)
    found = within_limits(ONE, ExperimentLimits(travel_rad=0.05), robot, np.array([0.1]))
    assert (found.back.tolist(), found.forth.tolist()) == ([-0.05], [0.05])
    assert found.sources["travel"] == ("given",)


# Three axes with gears of 1/200 and less; the logs reach one of everything, and the model states some limits.
ARM = load_robot("irb6600_like")
EACH = np.ones(3)
REACHED = Range(EACH, -EACH, EACH, EACH, EACH)
STATED = ARM.with_joint_limits(
    [
        JointLimits(velocity=0.02, effort=4000.0),
        JointLimits(acceleration=3.0),
        JointLimits(position=(-0.5, 0.25), velocity=0.04),
    ]
)


def test_limits_of_the_model_come_before_what_the_logs_reach() -> None:
    """Closed form: joint limits over the gear ratio, and torque times it."""
    ratio = np.abs(ARM.gear_ratio)
    found = within_limits(REACHED, None, STATED, np.zeros(3))
    np.testing.assert_allclose(found.speed, [0.02 / ratio[0], 1.0, 0.04 / ratio[2]])
    np.testing.assert_allclose(found.acceleration, [1.0, 3.0 / ratio[1], 1.0])
    np.testing.assert_allclose(found.torque, [4000.0 * ratio[0], 1.0, 1.0])
    ends = np.sort(np.array([-0.5, 0.25]) / ARM.gear_ratio[2])
    np.testing.assert_allclose(found.back, [-1.0, -1.0, ends[0]])
    np.testing.assert_allclose(found.forth, [1.0, 1.0, ends[1]])
    assert found.sources == {
        "speed": ("model", "logs", "model"),
        "acceleration": ("logs", "model", "logs"),
        "travel": ("logs", "logs", "model"),
        "torque": ("model", "logs", "logs"),
    }


def test_limits_of_the_user_come_first() -> None:
    given = ExperimentLimits(velocity_rad_s=9.0, torque_nm=[1.0, 2.0, 3.0])
    found = within_limits(REACHED, given, STATED, np.zeros(3))
    assert found.speed.tolist() == [9.0, 9.0, 9.0]
    assert found.torque.tolist() == [1.0, 2.0, 3.0]
    assert found.sources["speed"] == found.sources["torque"] == ("given",) * 3
    assert found.sources["acceleration"] == ("logs", "model", "logs")


def test_a_plan_says_where_its_limits_come_from() -> None:
    given = ExperimentLimits(velocity_rad_s=9.0, torque_nm=[1.0, 2.0, 3.0])
    limits = within_limits(replace(REACHED, acceleration=np.inf * EACH), given, STATED, np.zeros(3))
    speed, acceleration, travel, torque = map(str, limits.told())
    assert speed == "speed: 9 rad/s (as given)"
    most = 3.0 / abs(ARM.gear_ratio[1])
    assert acceleration == (
        f"acceleration: axis 1, 3: no limit (logs); axis 2: {most:.3g} rad/s^2 (robot's model)"
    )
    ends = np.sort(np.array([-0.5, 0.25]) / ARM.gear_ratio[2])
    assert travel == (
        f"travel: axis 1, 2: 1 rad (logs); axis 3: {ends[0]:.3g} to {ends[1]:.3g} rad (robot's model)"
    )
    assert torque == "torque: 1, 2, 3 Nm (as given)"


def test_a_run_must_stay_in_torque_and_room() -> None:
    turned, torque = np.zeros((5, 1)), np.full((5, 1), 9.0)
    assert ONE.allows(AXIS, np.zeros(1), turned, torque)
    assert not ONE.allows(AXIS, np.zeros(1), turned, 1.2 * torque)
    assert not ONE.allows(AXIS, np.zeros(1), turned, np.nan * torque)
    _, origin = AXIS.pose(np.zeros(AXIS.n_joints))
    room = np.concatenate([origin - 0.1, origin + 0.1])
    assert replace(ONE, room=room).allows(AXIS, np.zeros(1), turned, torque)
    assert not replace(ONE, room=room + 1.0).allows(AXIS, np.zeros(1), turned, torque)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"acceleration_rad_s2": 0.0}, "acceleration_rad_s2: expected positive"),
        ({"room_m": [0, 0, 0, 1, 1]}, "room_m: expected six numbers"),
        ({"room_m": [0, 0, 0, 1, 1, -1]}, "room_m: expected six numbers"),
    ],
)
def test_limits_that_cannot_be_are_refused(given: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        within_limits(ONE, ExperimentLimits(**given), AXIS, np.zeros(1))

"""Dry friction that sticks: a standing or reversing motor may hold any torque."""

from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Log, Robot, diagnose, load_robot
from axisight.blind.machine import Machine, Native
from axisight.fitting import Weighting
from axisight.gap.ranking.intervals import intervals
from axisight.gap.signals.standstill import open_errors, sure_friction_nm
from gap_data import scattered

STEP_S = 1e-3
FRICTION_NM = 0.1


def references(robot: Robot) -> list[np.ndarray]:
    """Slow sines, and moves with pauses between them."""
    time = np.arange(int(6.0 / robot.sample_time_s)) * robot.sample_time_s
    sines = [
        a * np.sin(2 * np.pi * f * time) * np.minimum(time, 1) for a, f in ((20, 0.3), (40, 0.2))
    ]
    phase = time % 2.0
    move = np.where(phase < 1.2, np.sin(np.pi * phase / 1.2) ** 2, 0.0)
    back_and_forth = 40 * move * (-1) ** (time // 2)
    return [x[:, None] for x in (*sines, back_and_forth, 0.7 * back_and_forth)]


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    engine = pytest.importorskip(
        "axisight.blind.mujoco_engine", reason="MuJoCo comes with the extra `blind`"
    )
    robot = load_robot("lever_like").with_effects([])
    machine = Machine(scattered(robot, 1), {0: Native(friction_nm=FRICTION_NM)})
    rng = np.random.default_rng(1)
    along = references(robot)
    noises = [1e-5 * rng.normal(size=x.shape) for x in along]
    ran = engine.run(machine, along, noises)
    return [
        Log(
            name=f"log{i}",
            source=Path(f"log{i}.parquet"),
            sample_time_s=robot.sample_time_s,
            time_s=np.arange(len(x)) * robot.sample_time_s,
            velocity_ref_rad_s=x,
            torque_nm=torque,
            position_rad=angle,
        )
        for i, (x, (torque, angle)) in enumerate(zip(along, ran, strict=True))
    ]


def test_friction_that_sticks_is_named(logs):
    robot = load_robot("lever_like").with_effects([])
    found = diagnose(robot=robot, estimation=logs[::2], validation=logs[1::2])
    # The load hardly changes along these motions: it may also be friction in proportion to it.
    assert found.verdict in ("explained", "undecidable"), found.headline
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 1)]
    assert found.causes[0].family_probability > 0.95
    coulomb = found.causes[0].parameters["coulomb_nm"]
    assert coulomb.value == pytest.approx(FRICTION_NM, rel=0.1)


def test_intervals_stay_within_what_an_effect_takes():
    values = {"coulomb_nm": 0.3, "smoothing_rad_s": 0.01}
    found = intervals(
        Effect("coulomb_friction", 1, values), tuple(values), {"smoothing_rad_s": 9.0}
    )
    # The table of the effect: no speed below 1e-5 rad/s.
    assert found["smoothing_rad_s"].low == 1e-5
    assert found["smoothing_rad_s"].high == pytest.approx(0.01 + 1.96 * 9.0, rel=1e-6)
    assert found["coulomb_nm"].low < 0.3 < found["coulomb_nm"].high


def test_only_reversals_and_standstill_are_open():
    time = np.arange(6000) * STEP_S
    speed = np.where(time < 4.0, 10.0 * np.sin(np.pi * time), 0.0)[:, None]
    left = open_errors(speed, np.array([0.3]), Weighting.flat(1), STEP_S)[:, 0]
    # Half-way between reversals: 0.3 Nm times the square of a hundredth and little more, over root three.
    assert left[500] < 0.3 / np.sqrt(3) * 1.2e-4
    # What stands holds anything up to the friction: the deviation of an even band.
    assert left[5000] == pytest.approx(0.3 / np.sqrt(3), rel=1e-6)
    # A reversal is open, over the tenth of a second that errors count together.
    assert left[1000] > 10 * left[1100] and left[1000] > 0.02


def test_without_dry_friction_nothing_is_open():
    speed = np.sin(np.arange(3000) / 100.0)[:, None]
    assert not open_errors(speed, np.zeros(1), Weighting.flat(1), STEP_S).any()


def motion_of(speed: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, ...]:
    none = np.zeros((len(speed), 1))
    return none, speed[:, None], none, torque[:, None]


def test_friction_is_what_every_log_shows_that_runs_both_ways():
    time = np.arange(6000) * STEP_S
    back_and_forth, on = 10.0 * np.sin(np.pi * time), 5.0 + np.sin(np.pi * time)
    still = 0.01 * np.sin(7 * time)
    least, more = (motion_of(back_and_forth, f * np.sign(back_and_forth)) for f in (0.2, 0.5))

    def nothing(at):
        return np.zeros((len(at[0]), 1))

    others = [motion_of(on, np.full(len(on), 0.1)), motion_of(still, 0.0 * still)]
    # The corner takes a hundredth of the top speed.
    assert sure_friction_nm([least, more, *others], nothing) == pytest.approx(0.2, rel=0.02)
    assert sure_friction_nm(others[:1], nothing) == 0.0

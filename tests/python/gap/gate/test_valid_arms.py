"""Valid logs of arms that lack much in their simulator, or of axes that hardly move, pass without a word."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, Robot
from axisight.gap import check_inputs
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import motion
from rigid_arm import COULOMB_NM, TORQUE_NOISE_NM, VISCOUS, arm, friction_torque, log_of

Array = np.ndarray
# Rotors of an arm whose model has none [kg m^2, joint side], as large as those of a 10 kg cobot.
ROTORS = np.array([5.0, 5.0, 3.0, 0.5, 0.5, 0.5])


def named(log: Callable[[int], Log]) -> set[str]:
    logs = [log(seed) for seed in range(3)]
    return {f.name for f in check_inputs(arm(), logs[:2], logs[2:])}


def along(robot: Robot, seed: int, change: Callable[[Array, Array], Array]) -> Log:
    """Return a log of a robot with friction along changed positions; ``change`` takes positions and time [s]."""
    log = log_of(robot, seed, seconds=20.0)
    moved = replace(log, position_rad=change(log.position_rad.copy(), log.time_s))
    at = motion(moved, 20.0)
    torque = predict(robot, at) + friction_torque(at[1], np.array(COULOMB_NM), np.array(VISCOUS))
    noise = np.random.default_rng(seed).normal(size=torque.shape) * np.array(TORQUE_NOISE_NM)
    return replace(moved, torque_nm=torque + noise)


def six_counts(position: Array, _: Array) -> Array:
    step = 2 * np.pi / 4096
    position[:, 4] = np.round(position[:, 4] / np.ptp(position[:, 4]) * 6) * step
    return position


def standing(position: Array, time: Array) -> Array:
    noise = np.random.default_rng(len(time)).normal(size=(len(time), 2))
    position[:, [3, 5]] = np.array([0.3, 0.1]) + 1e-5 * noise
    return position


def spinning(position: Array, time: Array) -> Array:
    position[:, 5] = 3.0 * time + 0.3 * np.sin(2.0 * time)
    return position


def one_at_a_time(position: Array, _: Array) -> Array:
    still = np.tile(position[0], (len(position), 1))
    length = len(position) // 6
    out_and_back = 0.6 * np.sin(2 * np.pi * np.arange(length) / length) ** 2
    for axis in range(6):
        still[axis * length : (axis + 1) * length, axis] += out_and_back
    return still


def test_an_axis_that_spans_six_counts_is_not_late() -> None:
    assert named(lambda seed: along(arm(), seed, six_counts)) <= {"quantized_position"}


@pytest.mark.parametrize("change", [standing, spinning, one_at_a_time])
def test_motions_of_some_axes_alone_pass(change: Callable[[Array, Array], Array]) -> None:
    assert named(lambda seed: along(arm(), seed, change)) == set()


def test_a_load_is_no_wrong_scale() -> None:
    """It multiplies the torque of the wrist by more than two."""
    mass = arm().parameters()["j6.mass"]
    loaded = arm().with_parameters({"j6.mass": mass + 10.0})
    assert named(lambda seed: log_of(loaded, seed, seconds=20.0)) == set()


def test_rotors_that_the_model_lacks_are_no_wrong_scale() -> None:
    """They multiply the torque of the first axis, which carries no weight."""

    def with_rotors(seed: int) -> Log:
        log = along(arm(), seed, lambda position, _: position)
        acceleration = motion(log, 20.0)[2]
        return replace(log, torque_nm=log.torque_nm + ROTORS * acceleration)

    assert named(with_rotors) == set()


def test_a_wrong_scale_stays_one_beside_a_load() -> None:
    """Amperes on one axis: neither a load nor a rotor has that shape."""

    def in_amperes(seed: int) -> Log:
        log = log_of(arm(), seed, seconds=20.0)
        return replace(log, torque_nm=log.torque_nm / np.array([1.0, 1.0, 0.3, 1.0, 1.0, 1.0]))

    assert named(in_amperes) == {"torque_scaled"}


def test_one_axis_says_nothing_of_the_unit_of_all() -> None:
    """Axis 5 alone shows what the prediction says, eight times as much of it."""

    def alone(seed: int) -> Log:
        log = along(arm(), seed, lambda position, _: position)
        rng = np.random.default_rng(seed)
        torque = rng.normal(size=log.torque_nm.shape)
        torque[:, 4] = 8.0 * log.torque_nm[:, 4]
        return replace(log, torque_nm=torque)

    logs = [alone(seed) for seed in range(3)]
    found = check_inputs(arm(), logs[:2], logs[2:])
    assert [f for f in found if f.severity == "refuse"] == []


def test_a_load_is_no_encoder_off_its_zero() -> None:
    """A load beside the axis of the flange turns the torque of the wrist as an offset of its angle does."""
    load = Effect("payload", None, {"mass_kg": 1.0, "x_m": 0.0, "y_m": 0.0, "z_m": 0.1})
    loaded = arm().with_effects([load])
    assert named(lambda seed: along(loaded, seed, lambda position, _: position)) == set()

"""Tells whether a log starts at rest or in motion, from its positions and, if these leave it open, by simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.gap.prepare.used_part import NOISES, STANDS
from axisight.gap.signals.noise import white_std
from axisight.gap.simulator.start_poses import OFFSET_RAD, start_of
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate

Array = NDArray[np.float64]
Begins = Literal["rest", "motion", "open"]

# Samples of the shortest parabola through the first positions.
_FEWEST = 4
# Duration of the longest parabola [s]: loops respond to a step of their reference within milliseconds.
_LONGEST_S = 0.01
# Standard deviations of noise that positions may be off a parabola, and first torques off those of a rest.
_OFF = 3.0
# Smallest acceleration that counts, as a share of the largest in the log.
_STEADY = 0.03
# Start of a log where two simulations are compared, as a share of the part that a run-up would cut off: the
# effect of a wrong start fades.
_COMPARED = 0.5
# Share of the total squared difference of the two simulations after which the comparison ends.
_FADED = 0.8
# Share of that difference that a log must show to start in motion.
_HALF = 0.5
# Fewest logs that can tell by a common constant, or by their first samples.
SEVERAL = 3
# Smallest noise of a torque, as a share of the arm's largest torque scatter.
_NOISELESS = 1e-3


def begins(log: Log, noise_std: float | Array) -> Begins:
    """Return whether a log starts at rest or in motion, or whether its first positions leave that open.

    Parabolas through ever more of the first positions give speed and acceleration. ``noise_std`` of positions:
    one, or (n_axes,) [rad].

    - *Motion*: there is a speed that the acceleration cannot have produced from rest.
    - *Open*: there is an acceleration. Either a motor turns round, or a step of its reference starts it.
    - *Rest*: neither; also for a log of four samples or fewer.
    """
    if log.n_samples <= _FEWEST:
        return "rest"
    found, n = set(_start_of_axes(log, _FEWEST, noise_std)), 2 * _FEWEST
    while n * log.sample_time_s <= _LONGEST_S and n < log.n_samples:
        found |= set(_start_of_axes(log, n, noise_std))
        n *= 2
    return "motion" if "motion" in found else "open" if "open" in found else "rest"


def _start_of_axes(log: Log, n: int, noise_std: float | Array) -> list[Begins]:
    """Return how each axis of a log starts, from the parabola through its first ``n`` positions."""
    step, first = log.sample_time_s, log.position_rad[:n]
    powers = np.vander(step * np.arange(n), 3, increasing=True)
    solved = np.linalg.pinv(powers)
    terms = solved @ first
    speed, acceleration = np.abs(terms[1]), 2 * np.abs(terms[2])
    of_speed, of_half = np.linalg.norm(solved[1:], axis=1)
    top = np.abs(np.diff(log.position_rad, axis=0)).max(axis=0) / step
    moves = speed > STANDS * top + NOISES * of_speed * noise_std
    most = _STEADY * _largest_acceleration(log, n)
    turns = acceleration > most + 2 * NOISES * of_half * noise_std
    # A start from rest has a parabola without speed. If positions are off the parabola, the motion began within
    # it.
    told = np.abs(first - powers @ terms).max(axis=0) < _OFF * noise_std + STANDS * top * step
    sure = moves & told & (speed > 0.5 * acceleration * step * (n - 1))
    return [
        "motion" if a else "open" if b else "rest" for a, b in zip(sure, moves | turns, strict=True)
    ]


def _largest_acceleration(log: Log, n: int) -> Array:
    """Return the largest acceleration (n_axes,) over ``n`` samples along a log."""
    half, x = n // 2, log.position_rad
    second = x[2 * half :] - 2 * x[half:-half] + x[: -2 * half]
    return np.asarray(np.abs(second).max(axis=0) / (half * log.sample_time_s) ** 2)


def torques_are_from_rest(robot: Robot, logs: Sequence[Log]) -> bool:
    """Whether the first torques of all logs are those of simulations from rest.

    | they differ from those | why that is a rest |
    |---|---|
    | by noise, over the first response of the loop | nothing moved before |
    | by one constant in all logs, over that response | a load or a gear is wrong; different motions would differ |
    | by noise in the first sample of every log | no motion yet, whatever the machine lacks |

    The last two hold for three logs and more, of one pose, with different first references.
    """
    missed = [_first_missed(robot, log) for log in logs]
    if not all(np.isfinite(x).all() for x in missed):
        return False
    if all(_is_noise(x) for x in missed):
        return True
    if len(logs) < SEVERAL or not differ(robot, logs):
        return False
    usual = np.median([x.mean(axis=0) for x in missed], axis=0)
    alike = all(_is_noise(x - usual) for x in missed)
    return alike or all(bool(np.all(np.abs(x[0]) < _OFF)) for x in missed)


def _is_noise(missed: Array) -> bool:
    """Whether the means of errors over noise (n, n_axes) are noise on every axis."""
    return bool(np.all(np.abs(missed.mean(axis=0)) < NOISES / np.sqrt(len(missed))))


def _first_missed(robot: Robot, log: Log) -> Array:
    """Return the first torques minus those of a simulation from rest, over noise (n, n_axes); NaN if it is unstable.

    Zero on axes that do not move.
    """
    n = min(_response_samples(log), log.n_samples)
    resting = _torques_from_rest(robot, log, n)
    if resting is None:
        return np.full((n, log.n_axes), np.nan)
    return np.where(_moving_axes(log), (log.torque_nm[:n] - resting) / _noise_nm(log), 0.0)


def differ(robot: Robot, logs: Sequence[Log]) -> bool:
    """Whether logs begin at one pose with different references."""
    poses = np.array([log.position_rad[0] for log in logs]) * robot.gear_ratio
    led = [log.velocity_ref_rad_s for log in logs if log.velocity_ref_rad_s is not None]
    first, top = np.array([x[0] for x in led]), max(float(np.abs(x).max()) for x in led)
    one_pose = bool(np.all(np.ptp(poses, axis=0) < OFFSET_RAD))
    return one_pose and bool(np.any(np.ptp(first, axis=0) > STANDS * top))


def run_up_is_better(robot: Robot, log: Log, run_up: Log) -> bool:
    """Whether the start of a log fits a simulation with a run-up better than one from rest.

    ``run_up``: the log as returned by `axisight.gap.prepare.run_up.run_up_to`. The first half of the part that
    it cuts off is compared. Errors that both simulations share do not count.
    """
    cut = log.n_samples - run_up.n_samples
    lead, n = run_up.lead - cut, max(1, round(_COMPARED * cut))
    references = run_up.led("velocity_ref_rad_s")[: lead + n]
    assert run_up.start_rad is not None  # run_up_to sets both
    moving = _first_torques(robot, references, run_up.start_rad, n)
    resting = _torques_from_rest(robot, log, n)
    if moving is None or resting is None:
        return moving is not None
    axes, noise = _moving_axes(log), _noise_nm(log)
    missed = ((log.torque_nm[:n] - resting) / noise)[:, axes]
    apart = ((moving - resting) / noise)[:, axes]
    return _shows_half(missed, apart, _response_samples(log))


def _response_samples(log: Log) -> int:
    """Return the number of samples in which a loop responds to a step of its reference."""
    return max(1, round(_LONGEST_S / log.sample_time_s))


def _torques_from_rest(robot: Robot, log: Log, n: int) -> Array | None:
    """Return the first ``n`` torques (n, n_axes) [Nm] of a simulation from rest; None if it is unstable."""
    assert log.velocity_ref_rad_s is not None  # closed loop only
    at_rest = start_of(robot, log.position_rad[0])
    return _first_torques(robot, log.velocity_ref_rad_s[:n], at_rest, n)


def _first_torques(robot: Robot, references: Array, start_rad: Array, n: int) -> Array | None:
    """Return the last ``n`` torques (n, n_axes) [Nm] of a simulation; None if it is unstable.

    Along references (m, n_axes) [rad/s], from rest at the joint angles ``start_rad`` (n_axes,) [rad].
    """
    run = simulate(robot, references, method="rk4", start_rad=start_rad)
    torque = run["torque_cmd_nm"].values
    return None if len(torque) < len(references) else torque[-n:]


def _moving_axes(log: Log) -> NDArray[np.bool_]:
    """Return whether an axis of a log moves (n_axes,)."""
    travel = np.ptp(log.position_rad, axis=0)
    return np.asarray(travel > STANDS * travel.max())


def _noise_nm(log: Log) -> Array:
    """Return the noise of torques (n_axes,) [Nm], at least a small share of the arm's torque."""
    size = log.torque_nm.std(axis=0).max()
    return np.maximum(white_std(log.torque_nm, log.sample_time_s), max(_NOISELESS * size, 1e-300))


def _shows_half(missed: Array, apart: Array, least: int) -> bool:
    """Whether errors contain more than half of the difference between two simulations.

    ``missed``: log minus simulation from rest; ``apart``: difference of the simulations; (n, n_axes) each, over
    noise. The share is a least-squares factor beside a constant for each axis. The comparison ends where the
    difference has faded, but has ``least`` samples, since the response to a step of the reference lasts one or
    two.
    """
    square = np.cumsum((apart**2).sum(axis=1))
    n = max(least, int(np.searchsorted(square, _FADED * square[-1])) + 1)
    varies = apart[:n] - apart[:n].mean(axis=0)
    size = float(np.sum(varies**2))
    return size > NOISES**2 and float(np.sum(varies * missed[:n])) > _HALF * size

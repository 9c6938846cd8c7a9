"""Tells whether a log starts at rest or in motion, from its positions and, if these leave it open, by simulation."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.gap.prepare.used_part import STANDS
from axisight.gap.signals.noise import white_std
from axisight.gap.simulator.start_poses import start_of
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate

Array = NDArray[np.float64]
Begins = Literal["rest", "motion", "open"]

# Samples of the shortest parabola through the first positions.
_FEWEST = 4
# Duration of the longest parabola [s]: loops respond to a step of their reference within milliseconds.
_LONGEST_S = 0.01
# Standard deviations of noise that a term of a parabola must exceed.
_NOISES = 6.0
# Standard deviations of noise that positions may be off a parabola.
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
    moves = speed > STANDS * top + _NOISES * of_speed * noise_std
    most = _STEADY * _largest_acceleration(log, n)
    turns = acceleration > most + 2 * _NOISES * of_half * noise_std
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


def torque_is_from_rest(robot: Robot, log: Log) -> bool:
    """Whether a log's first torque is that of a simulation from rest, within noise.

    At rest, missing effects do not change the torque unless they are constant. If the constant torque is off
    too, the answer is False.
    """
    resting = _torques_from_rest(robot, log, _response_samples(log))
    if resting is None:
        return False
    missed = ((log.torque_nm[: _response_samples(log)] - resting) / _noise_nm(log))[
        :, _moving_axes(log)
    ]
    return bool(np.all(np.abs(missed.mean(axis=0)) < _NOISES / np.sqrt(len(missed))))


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
    return size > _NOISES**2 and float(np.sum(varies * missed[:n])) > _HALF * size

"""How a log begins: at rest, in motion, or so that positions alone do not tell and a simulation does."""

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

# Samples of the shortest parabola through first positions, and seconds of the longest: loops answer a step of
# their reference in some milliseconds.
_FEWEST = 4
_LONGEST_S = 0.01
# Deviations by which noise moves a term of a parabola, and by which it moves positions off one.
_NOISES = 6.0
_OFF = 3.0
# Share of the largest acceleration below which there is none.
_STEADY = 0.03
# Share of what a run-up cuts off along which simulations are compared: what is wrong of a beginning fades. Share
# of the square of what they are apart after which it has, and share of it that tells one from the other.
_COMPARED = 0.5
_FADED = 0.8
_HALF = 0.5
# Of the arm's torque, below which there is none on an axis.
_NOISELESS = 1e-3


def begins(log: Log, noise_std: float | Array) -> Begins:
    """Return how a log begins, by parabolas through ever more of its first positions.

    ``noise_std`` of positions, one or (n_axes,) [rad]. In motion: with a speed that its acceleration has not
    made from rest. Open: with an acceleration, as of a motor that turns round, and of one that a step of its
    reference starts. A few samples are at rest, for all that they say.
    """
    if log.n_samples <= _FEWEST:
        return "rest"
    found, n = set(_of_first(log, _FEWEST, noise_std)), 2 * _FEWEST
    while n * log.sample_time_s <= _LONGEST_S and n < log.n_samples:
        found |= set(_of_first(log, n, noise_std))
        n *= 2
    return "motion" if "motion" in found else "open" if "open" in found else "rest"


def _of_first(log: Log, n: int, noise_std: float | Array) -> list[Begins]:
    """Return how every axis of a log begins, by the parabola through its first ``n`` positions."""
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
    # Of one that begins at rest a parabola has no speed; what is no parabola has begun within it.
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
    """Whether a log's first torque is that of a simulation from rest, for all that noise tells.

    Whatever is missing, what stands has the torque of one that stands, but for what is constant: where that is
    off too, this does not tell.
    """
    resting = _from_rest(robot, log, _few(log))
    if resting is None:
        return False
    missed = ((log.torque_nm[: _few(log)] - resting) / _noise_nm(log))[:, _that_move(log)]
    return bool(np.all(np.abs(missed.mean(axis=0)) < _NOISES / np.sqrt(len(missed))))


def run_up_is_better(robot: Robot, log: Log, run_up: Log) -> bool:
    """Whether a log's torque has what a simulation that is run up to its first motion has beyond one from rest.

    ``run_up``: the log as `axisight.gap.prepare.run_up.run_up_to` returns it; compared is the first half of what
    that cuts off. What is missing of both simulations says nothing.
    """
    cut = log.n_samples - run_up.n_samples
    lead, n = run_up.lead - cut, max(1, round(_COMPARED * cut))
    references = run_up.led("velocity_ref_rad_s")[: lead + n]
    assert run_up.start_rad is not None  # it has a run-up
    moving = _first_torques(robot, references, run_up.start_rad, n)
    resting = _from_rest(robot, log, n)
    if moving is None or resting is None:
        return moving is not None
    axes, noise = _that_move(log), _noise_nm(log)
    missed = ((log.torque_nm[:n] - resting) / noise)[:, axes]
    apart = ((moving - resting) / noise)[:, axes]
    return _has(missed, apart, _few(log))


def _few(log: Log) -> int:
    """Return the samples of a log in which a loop answers a step of its reference."""
    return max(1, round(_LONGEST_S / log.sample_time_s))


def _from_rest(robot: Robot, log: Log, n: int) -> Array | None:
    """Return the first ``n`` torques (n, n_axes) [Nm] of a simulation from rest; None where it is unstable."""
    assert log.velocity_ref_rad_s is not None  # closed loop only
    at_rest = start_of(robot, log.position_rad[0])
    return _first_torques(robot, log.velocity_ref_rad_s[:n], at_rest, n)


def _first_torques(robot: Robot, references: Array, start_rad: Array, n: int) -> Array | None:
    """Return the last ``n`` torques (n, n_axes) [Nm] of a simulation; None where it is unstable.

    Along references (m, n_axes) [rad/s], from rest at joint angles ``start_rad``.
    """
    run = simulate(robot, references, method="rk4", start_rad=start_rad)
    torque = run["torque_cmd_nm"].values
    return None if len(torque) < len(references) else torque[-n:]


def _that_move(log: Log) -> NDArray[np.bool_]:
    """Return which axes (n_axes,) of a log move."""
    travel = np.ptp(log.position_rad, axis=0)
    return np.asarray(travel > STANDS * travel.max())


def _noise_nm(log: Log) -> Array:
    """Return the noise of torques (n_axes,) [Nm]; of one that has next to none, a share of the arm's."""
    size = log.torque_nm.std(axis=0).max()
    return np.maximum(white_std(log.torque_nm, log.sample_time_s), max(_NOISELESS * size, 1e-300))


def _has(missed: Array, apart: Array, least: int) -> bool:
    """Whether errors have more than half of what two simulations are ``apart``, (n, n_axes) each over noise.

    By least squares beside a constant of each axis, along where they are apart, for that fades; along ``least``
    samples at least, for what a step of the reference makes is over in one or two.
    """
    square = np.cumsum((apart**2).sum(axis=1))
    n = max(least, int(np.searchsorted(square, _FADED * square[-1])) + 1)
    varies = apart[:n] - apart[:n].mean(axis=0)
    size = float(np.sum(varies**2))
    return size > _NOISES**2 and float(np.sum(varies * missed[:n])) > _HALF * size

"""Finds gains and filters of the controller that differ from the robot file, from logs without a fit.

The controller's law gives the torque from references and measured positions, whatever the machine does. If the
stated law misses the logged torque and another law gives it, the machine has the other controller. A fit cannot
see this where a feedback of its own keeps the simulator on the log.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.effects.stated import CLOCK, FEEDFORWARD, OTHER_GAINS, SPEED_FILTER
from axisight.errors import InputError
from axisight.gap.controller.clock_drift import drifting_clock
from axisight.gap.controller.feedback import as_taken, free_of_limits, gain_shares, told_of
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.result import Interval
from axisight.logs import Log, lowpass
from axisight.robot import Robot
from axisight.statistics.recursion import recursive

Array = NDArray[np.float64]

# Upper end of the compared band [Hz]. Drives filter the torques that they report above.
_BAND_HZ = 100.0
# Upper end of that band for slow logs, as a share of the Nyquist frequency; the lower of the two counts.
SHARE_OF_NYQUIST = 0.2
# Smallest error of the stated law, as a share of the torque's variance, that can show another controller.
_NOTHING = 1e-4
# Share of the stated law's squared error that another law may leave, in every log.
_LEFT = 0.02
# Start of a log that is left out, in periods of the band's upper end: its low-pass depends on what was before
# the log.
_BEGUN = 5
# Range of the lags of a filter that are searched [s].
_LAGS_S = (1e-4, 0.05)
# Number of grid points of that search before its refinement.
_STEPS = 12
# Damping ratios of the filters that are tried: first order (0), Butterworth, and two first-order filters in a
# row. The simulator's filter has the first order: slow motion shows the lag only.
_FILTERS = (0.0, float(np.sqrt(0.5)), 1.0)
# Relative difference up to which a gain counts as the stated one.
_SAME = 0.008
# Smallest half-width of the interval of a gain, relative: filters with one lag are implemented in several ways.
_FORMULA = 0.004
# Half-width of the interval of a lag, relative, for the same reason.
_OF_A_LAG = 0.1


class _Piece:
    """Torque of an axis in one log, and the torques that the stated gains make of references and positions."""

    def __init__(self, robot: Robot, log: Log, axis: int) -> None:
        time = log.sample_time_s
        self._robot, self._axis, self._time = robot, axis, time
        self._band_hz = min(_BAND_HZ, SHARE_OF_NYQUIST * 0.5 / time)
        self._reference, wanted, self._moved = told_of(robot, log, axis)
        position, speed = (x[:, axis] for x in as_taken(log))
        if is_continuous(robot) and log.velocity_rad_s is not None:
            speed = log.velocity_rad_s[:, axis]
        self._position, self._speed = position, speed
        self._angle = wanted - position
        torque = np.ascontiguousarray(log.torque_nm[:, axis])
        period = int(1.0 / (self._band_hz * time))
        self._kept = free_of_limits(torque, period)
        # No log contains the speed that the controller used at the first sample.
        self._kept[: _BEGUN * period] = False
        self.torque = self._in_band(torque)

    @property
    def gains(self) -> tuple[str, str]:
        """What the two gains act on, in words."""
        return ("position", "speed") if self._robot.told_positions else ("proportional", "integral")

    def shares(self, lag_s: float = 0.0, late: int = 0, damping: float = 0.0) -> Array:
        """Return the torques of the proportional and the integral gain (n, 2) [Nm].

        ``lag_s``: lag of a filter on the speed, of the second order if it has a ``damping``. ``late``: samples
        by which positions are read late.
        """
        speed = _filtered(self._speed, lag_s, damping, self._time)
        error, angle = self._reference - speed, self._angle
        if late:
            error = self._reference - _delayed(speed, late)
            angle = angle + self._position - _delayed(self._position, late)
        both = gain_shares(self._robot, error, angle, self._axis)
        return np.column_stack([self._in_band(x) for x in both])

    def forward(self) -> Array:
        """Return the rate of the speed reference and that reference (n, 2) [rad/s^2, rad/s]."""
        rate = np.diff(self._moved, prepend=self._moved[:1]) / self._time
        return np.column_stack([self._in_band(rate), self._in_band(self._moved)])

    def _in_band(self, x: Array) -> Array:
        """Return a torque, low-passed to the band, without samples near a limit and without its mean."""
        low = lowpass(np.ascontiguousarray(x), self._time, self._band_hz)[self._kept]
        return np.asarray(low - low.mean()) if len(low) else low


def _filtered(speed: Array, lag_s: float, damping: float, time_s: float) -> Array:
    """Return a speed, low-passed so that slow motion lags by ``lag_s`` [s]; of the first order without ``damping``."""
    if not damping or not lag_s:
        keep = lag_s / (lag_s + time_s)
        return recursive([1 - keep], [1, -keep], speed)
    corner = 2 * damping / lag_s
    # The bilinear transform, with the corner in half-samples.
    w = 0.5 * corner * time_s
    below = [1 + 2 * damping * w + w * w, 2 * (w * w - 1), 1 - 2 * damping * w + w * w]
    return recursive([w * w, 2 * w * w, w * w], below, speed)


def _delayed(x: Array, samples: int) -> Array:
    return np.concatenate([np.full(samples, x[0]), x[:-samples]])


@dataclass(frozen=True)
class _Law:
    """A controller's law, and the squared error (n_logs,) that it leaves of the torque in every log.

    ``factors`` (2,): multiples of the two stated gains; ``lag_s``: of the filter, of the second order with a
    ``damping``; ``forward`` (2,): torque per rate of the speed reference and per speed reference.
    """

    factors: Array
    lag_s: float
    left: Array
    forward: Array
    damping: float = 0.0

    @property
    def total(self) -> float:
        return float(self.left.sum())


def is_continuous(robot: Robot) -> bool:
    """Whether a controller acts between its samples too."""
    return _states_continuous(robot.toml) or robot.stepped is not None


@cache
def _states_continuous(toml: str) -> bool:
    """Return whether a robot file states a continuous controller.

    Cached, because every log and axis asks for it.
    """
    return bool(tomllib.loads(toml).get("controller", {}).get("continuous"))


def other_controllers(robot: Robot, logs: Sequence[Log]) -> tuple[AlgebraicCause, ...]:
    """Return how the controller differs from the stated one, axis by axis; empty where logs do not show it."""
    controllers = (OTHER_GAINS[0], SPEED_FILTER[0], FEEDFORWARD[0])
    known = {e.axis for e in robot.effects if e.name in controllers}
    axes = [i for i in range(robot.n_axes) if i + 1 not in known]
    pieces = {i: [_Piece(robot, log, i) for log in logs] for i in axes}
    stated = {i: _law(pieces[i], np.ones(2), 0.0) for i in axes}
    off = [i for i in axes if stated[i].total > _NOTHING * float(_power(pieces[i]).sum())]
    clock = _clock(robot, logs, pieces, stated, off)
    if clock is not None:
        return (clock,)
    return tuple(cause for i in off for cause in _causes_of_axis(i, stated[i], pieces[i]))


def clock_drift(robot: Robot, logs: Sequence[Log]) -> float:
    """Return by how much the machine's clock is fast against that of the references [1]; zero for one clock."""
    found = next((c for c in other_controllers(robot, logs) if c.name == CLOCK[0]), None)
    return 0.0 if found is None else found.values[CLOCK[1]].value


def _clock(
    robot: Robot,
    logs: Sequence[Log],
    pieces: Mapping[int, Sequence[_Piece]],
    stated: Mapping[int, _Law],
    off: Sequence[int],
) -> AlgebraicCause | None:
    """Return the drift of a clock, if it explains the error of the stated law on all axes that have one."""
    if not off or robot.told_positions or any(e.name == CLOCK[0] for e in robot.effects):
        return None

    def missed(log: Log, axis: int) -> float:
        return _law([_Piece(robot, log, axis)], np.ones(2), 0.0).total

    left = np.zeros((robot.n_axes, len(logs)))
    shows = np.zeros(left.shape, bool)
    for i in off:
        left[i] = stated[i].left
        shows[i] = stated[i].left > _NOTHING * _power(pieces[i])
    return drifting_clock(logs, left, shows, missed) if shows.any() else None


def _power(pieces: Sequence[_Piece]) -> Array:
    return np.array([float(p.torque @ p.torque) for p in pieces])


def _causes_of_axis(axis: int, stated: _Law, pieces: Sequence[_Piece]) -> list[AlgebraicCause]:
    for law in _others(pieces):
        if _holds(law, stated, pieces):
            return _causes(axis, law, stated, pieces)
    return []


def _others(pieces: Sequence[_Piece]) -> Iterator[_Law]:
    """Yield laws other than the stated one, the simplest first."""
    yield _law(pieces, _factors(pieces, 0.0), 0.0)
    for damping in _FILTERS:
        lag = _best_lag(pieces, lambda _lag: np.ones(2), damping)
        yield _law(pieces, np.ones(2), lag, damping=damping)
    lag = _best_lag(pieces, lambda lag: _factors(pieces, lag))
    yield _law(pieces, _factors(pieces, lag), lag)
    yield _law(pieces, np.ones(2), 0.0, _fed_forward(pieces))


def _law(
    pieces: Sequence[_Piece],
    factors: Array,
    lag_s: float,
    forward: Array | None = None,
    damping: float = 0.0,
) -> _Law:
    errors = [p.torque - p.shares(lag_s, damping=damping) @ factors for p in pieces]
    if forward is not None:
        errors = [e - p.forward() @ forward for e, p in zip(errors, pieces, strict=True)]
    left = np.array([float(e @ e) for e in errors])
    return _Law(factors, lag_s, left, np.zeros(2) if forward is None else forward, damping)


def _fed_forward(pieces: Sequence[_Piece]) -> Array:
    """Return the torque per rate and per speed of the reference, by least squares on what the stated law misses."""
    missed = np.concatenate([p.torque - p.shares().sum(axis=1) for p in pieces])
    columns = np.concatenate([p.forward() for p in pieces])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(columns / size, missed, rcond=1e-12)[0] / size)


def _factors(pieces: Sequence[_Piece], lag_s: float) -> Array:
    """Return the factors of the two gains by least squares; one for a gain whose torque is zero."""
    shares = np.concatenate([p.shares(lag_s) for p in pieces])
    torque = np.concatenate([p.torque for p in pieces])
    size = np.linalg.norm(shares, axis=0)
    acts = size > 1e-6 * size.max()
    out = np.ones(2)
    out[acts] = np.linalg.lstsq(shares[:, acts], torque, rcond=1e-12)[0]
    return out


def _best_lag(
    pieces: Sequence[_Piece], factors: Callable[[float], Array], damping: float = 0.0
) -> float:
    """Return the lag of a filter [s] with the smallest squared error; ``factors``: gain factors for a lag."""

    def left(log_lag: float) -> float:
        lag = float(np.exp(log_lag))
        return _law(pieces, factors(lag), lag, damping=damping).total

    grid = np.linspace(np.log(_LAGS_S[0]), np.log(_LAGS_S[1]), _STEPS)
    at = int(np.argmin([left(x) for x in grid]))
    between = (grid[max(at - 1, 0)], grid[min(at + 1, _STEPS - 1)])
    found = scipy.optimize.minimize_scalar(left, bounds=between, method="bounded")
    return float(np.exp(found.x))


def _holds(law: _Law, stated: _Law, pieces: Sequence[_Piece]) -> bool:
    """Whether a law explains nearly all that the stated one misses, in every log where it misses something.

    A filter or feedforward must also fit better than positions that are read a sample late. These look like a
    filter, and like feedforward where the machine follows its reference.
    """
    power = _power(pieces)
    shows = stated.left > _NOTHING * power
    if np.any(law.left[shows] > _LEFT * stated.left[shows]):
        return False
    resembles = law.lag_s > 0 or bool(law.forward.any())
    late = [p.torque - p.shares(late=1).sum(axis=1) for p in pieces] if resembles else []
    return not late or sum(float(x @ x) for x in late) > law.total


def _causes(axis: int, law: _Law, stated: _Law, pieces: Sequence[_Piece]) -> list[AlgebraicCause]:
    out = []
    explained = 1.0 - law.total / stated.total
    samples = sum(len(p.torque) for p in pieces)
    if np.any(np.abs(law.factors - 1) > _SAME):
        each = np.array([_factors([p], law.lag_s) for p in pieces])
        spread = np.maximum(each.std(axis=0) * 2 / np.sqrt(len(pieces)), _FORMULA)
        values = {
            name: Interval(float(f - 1), float(f - 1 - s), float(f - 1 + s))
            for name, f, s in zip(OTHER_GAINS[1], law.factors, spread, strict=True)
        }
        first, second = pieces[0].gains
        says = (
            f"Axis {axis + 1}: the logged torque is {law.factors[0]:.4g} times the {first} and "
            f"{law.factors[1]:.4g} times the {second} share of the stated controller. With these factors the error "
            f"of its law falls by {100 * explained:.4g} %."
        )
        out.append(AlgebraicCause(OTHER_GAINS[0], axis + 1, values, samples, explained, says))
    if law.forward.any():
        each = np.array([_fed_forward([p]) for p in pieces])
        spread = each.std(axis=0) * 2 / np.sqrt(len(pieces)) + _FORMULA * np.abs(law.forward)
        values = {
            name: Interval(float(f), float(f - s), float(f + s))
            for name, f, s in zip(FEEDFORWARD[1], law.forward, spread, strict=True)
        }
        says = (
            f"Axis {axis + 1}: a feed-forward of {law.forward[0]:.4g} Nm per rad/s^2 and {law.forward[1]:.4g} Nm per "
            f"rad/s of the reference lowers the error of the stated controller by {100 * explained:.4g} %."
        )
        out.append(AlgebraicCause(FEEDFORWARD[0], axis + 1, values, samples, explained, says))
    if law.lag_s:
        lag = law.lag_s
        value = {SPEED_FILTER[1]: Interval(lag, lag * (1 - _OF_A_LAG), lag * (1 + _OF_A_LAG))}
        order = " of the second order that lags it by" if law.damping else " of"
        says = (
            f"Axis {axis + 1}: a low-pass{order} {1e3 * lag:.3g} ms on the measured speed lowers the error of the "
            f"stated controller by {100 * explained:.4g} %."
        )
        out.append(AlgebraicCause(SPEED_FILTER[0], axis + 1, value, samples, explained, says))
    return out


def check_gains(shown: Sequence[AlgebraicCause]) -> None:
    """Raise InputError for a gain that is farther from the stated one than the simulator's effect allows."""
    limits = {p.name: p for p in effect_info(OTHER_GAINS[0]).parameters}
    for cause in shown:
        if cause.name != OTHER_GAINS[0]:
            continue
        for share, name in zip(("proportional", "integral"), OTHER_GAINS[1], strict=True):
            p, change = limits[name], cause.values[name].value
            if not p.lower <= change <= p.upper:
                raise InputError(
                    f"controller: axis {cause.axis}: expected gains whose shares the logged torque has "
                    f"{1 + p.lower:.3g} to {1 + p.upper:.3g} times, got {1 + change:.3g} times the {share} one: "
                    f"state the machine's gains in the robot file"
                )

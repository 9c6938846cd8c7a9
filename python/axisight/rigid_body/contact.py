"""Contacts of a floating base: a wrench on the base that the model cannot have.

Nothing drives the six coordinates of a base. In free flight, the wrench that the model needs for its measured motion
is therefore zero, and on a stand with a load cell it is the measured one. What is left is noise, an error of the
model, or a contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import positive
from axisight.display.summary import summarized
from axisight.errors import ContactError, InputError
from axisight.rigid_body.coordinates import floating_motion
from axisight.rigid_body.regressor import TorqueModel, rows
from axisight.robot import BaseMotion, Robot

Array = NDArray[np.float64]

TOLERANCE = 0.2
"""Default share by which the nominal masses and inertias may be wrong."""
# Probability of a false interval in a log without contact, from noise alone.
_FALSE = 0.05
# Intervals closer than this are one [s]: bounces of a foot.
_TOGETHER_S = 0.02
# Samples whose regressor is in memory at a time.
_CHUNK = 4000


@summarized
@dataclass(frozen=True, eq=False)
class ContactCheck:
    """The wrench on a floating base that the model leaves, and where it is too large.

    Arrays are over samples; index 0 of the second axis is the force, 1 the moment about the base origin. A base that
    is hung has only the moment about that point.

    residual
        (n, 6), wrench of the model minus the measured one: force [N], moment [Nm]; (n, 3) if hung.
    size, limit
        (n, 2), absolute force and moment of the residual, and what noise and model may leave; (n, 1) if hung.
    noise
        (2,), standard deviation of a component of force and moment, from sample to sample; (1,) if hung.
    intervals_s
        Times (begin, end) [s] at which a size exceeds its limit, from the first sample.
    sample_time_s
        Sample time [s].
    """

    residual: Array
    size: Array
    limit: Array
    noise: Array
    intervals_s: tuple[tuple[float, float], ...]
    sample_time_s: float

    @property
    def is_free(self) -> bool:
        """Whether nothing acts on the base but what was measured."""
        return not self.intervals_s


def contact_check(
    robot: Robot,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    base: BaseMotion,
    *,
    wrench: ArrayLike | None = None,
    hung_at_m: ArrayLike | None = None,
    parameters: ArrayLike | None = None,
    sample_time_s: float | None = None,
    tolerance: float = TOLERANCE,
) -> ContactCheck:
    """Return whether the motion of a floating base needs a wrench that the model cannot have.

    ``q``, ``v``, ``a`` (n, n_joints) and ``base`` are a motion, uniform in time. ``wrench`` (n, 6) is the measured
    external force [N] and moment [Nm] on the base, by default zero. ``hung_at_m`` (3,) [m] is the point of the base
    at which a rope holds it, see :class:`TorqueModel`. ``parameters`` are ten for each link, as in
    ``TorqueModel(robot).nominal``, by default the nominal ones, with a relative error up to ``tolerance`` [1].
    ``sample_time_s`` [s] is by default that of the robot.

    A residual is a contact if it exceeds ``z s + tolerance g``. s is the standard deviation of its noise, from the
    median step between samples. z is the quantile with which a log of noise alone has no interval with 95 %
    probability. g is the sum of the absolute wrenches of all links, and of the measured wrench: a model whose masses
    are wrong by ``tolerance`` leaves no more. In free flight the wrenches of the links cancel, and on the ground
    they add up to the weight.

    Raises InputError for other shapes.
    """
    motion = floating_motion(robot, q, v, a, base)
    n = len(motion[0])
    outside = np.zeros((n, 6)) if wrench is None else rows("wrench", wrench, 6)
    if len(outside) != n:
        raise InputError(f"wrench: expected {n} rows as q, got {len(outside)}")
    model = TorqueModel(robot, side="base", hung_at_m=hung_at_m)
    outside = outside @ model.base_map.T
    theta = model.nominal if parameters is None else np.asarray(parameters, dtype=np.float64)
    if theta.shape != (model.n_parameters,) or not np.isfinite(theta).all():
        raise InputError(
            f"parameters: expected {model.n_parameters} finite numbers, got shape {theta.shape}"
        )
    share = positive("tolerance", tolerance)
    step = (
        robot.sample_time_s if sample_time_s is None else positive("sample_time_s", sample_time_s)
    )
    needed, gross = _wrenches(model, motion, theta)
    residual = needed - outside
    size = _sizes(residual)
    parts = np.split(residual, size.shape[1], axis=1)
    noise = np.array([_noise(part) for part in parts])
    quantile = np.sqrt(scipy.stats.chi2.isf(_FALSE / size.size, 3))
    limit = quantile * noise + share * (gross + _sizes(outside))
    return ContactCheck(
        residual=residual,
        size=size,
        limit=limit,
        noise=noise,
        intervals_s=_intervals((size > limit).any(axis=1), step),
        sample_time_s=step,
    )


def refuse_contact(found: ContactCheck) -> None:
    """Raise ContactError with the intervals of a check that found a contact."""
    if found.is_free:
        return
    said = []
    for begin, end in found.intervals_s[:5]:
        part = slice(round(begin / found.sample_time_s), round(end / found.sample_time_s) + 1)
        units = zip(
            found.size[part].max(axis=0).tolist(), ("N", "Nm")[-found.size.shape[1] :], strict=True
        )
        largest = ", ".join(f"{x:.3g} {unit}" for x, unit in units)
        said.append(f"{begin:.3f} to {end:.3f} s (up to {largest})")
    more = len(found.intervals_s) - len(said)
    raise ContactError(
        f"base: expected no wrench on it but the measured one, got one that the model cannot have, such as of a "
        f"contact, in {'; '.join(said)}{f'; and {more} more' if more else ''}. Cut these samples out, give the "
        f'measured wrench, or, if nothing touches the robot, correct its masses or use contact="keep"',
        found.intervals_s,
    )


def _wrenches(
    model: TorqueModel, motion: tuple[Array, Array, Array], theta: Array
) -> tuple[Array, Array]:
    """Return the wrench (n, k) that a motion needs, and the sum of the absolute ones of the links (n, k / 3)."""
    needed, gross = [], []
    for first in range(0, len(motion[0]), _CHUNK):
        q, v, a = (x[first : first + _CHUNK] for x in motion)
        matrix = _core.torque_regressor(
            model.robot.core, q, v, a, rows=model.row_map, extras=model.extras
        )
        by_link = (matrix * theta).reshape(len(q), model.n_rows, -1, 10).sum(axis=-1)
        needed.append(by_link.sum(axis=-1))
        grouped = by_link.reshape(len(q), model.n_rows // 3, 3, -1)
        gross.append(np.linalg.norm(grouped, axis=2).sum(axis=-1))
    return np.concatenate(needed), np.concatenate(gross)


def _sizes(wrench: Array) -> Array:
    """Return absolute force and moment (n, k / 3) of wrenches (n, k)."""
    return np.asarray(np.linalg.norm(wrench.reshape(len(wrench), -1, 3), axis=2))


def _noise(part: Array) -> float:
    """Return the standard deviation of the worst component (n, 3), from its median step between samples."""
    if len(part) < 3:
        return 0.0
    # A step of white noise has twice its variance; the median of a normal absolute value is 0.6745 deviations.
    steps = np.median(np.abs(np.diff(part, axis=0)), axis=0)
    return float(steps.max() / (0.6745 * np.sqrt(2.0)))


def _intervals(touched: NDArray[np.bool_], step_s: float) -> tuple[tuple[float, float], ...]:
    """Return begin and end [s] of the samples ``touched``, joined over short gaps."""
    places = np.flatnonzero(touched)
    if not len(places):
        return ()
    gaps = np.flatnonzero(np.diff(places) * step_s > max(_TOGETHER_S, 1.5 * step_s))
    begins = places[np.concatenate([[0], gaps + 1])]
    ends = places[np.concatenate([gaps, [len(places) - 1]])]
    return tuple((float(b * step_s), float(e * step_s)) for b, e in zip(begins, ends, strict=True))

"""Errors of position and velocity if positions are compared; torque figures are derived from them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.facts.compared_quantity import VelocityFrom
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import AxisStages, MotionErrors
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant, combine
from axisight.gap.signals.noise import white_std
from axisight.gap.views.targets import TargetsView
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.simulation import white_noise

Array = NDArray[np.float64]

# Controller samples from which a speed is computed: a cubic needs four, and a step response needs a cubic.
_POINTS = 4
# Rounding tolerance, in samples.
_ROUNDING = 1e-6
# Name of the finding of the log checks for a velocity that does not match the position.
_OFF = "velocity_inconsistent"


def velocity_from(logs: Sequence[Log], noted: Sequence[Finding]) -> VelocityFrom:
    """Return the source of velocities: the logs, if all have one that matches its position; else the positions."""
    off = any(finding.name == _OFF for finding in noted)
    known = all(log.velocity_rad_s is not None for log in logs)
    return "logged" if known and not off else "positions"


def motion_errors(
    view: View, logs: Sequence[Log], refitted: Variant, after: Variant, source: VelocityFrom
) -> MotionErrors | None:
    """Return the errors of position and velocity on logs; None if torques are compared.

    ``refitted`` and ``after``: the simulators of these stages; ``source``: the source of measured velocities.
    """
    if not isinstance(view, TargetsView):
        return None
    stages = [_errors(view, variant, logs, source) for variant in (AS_GIVEN, refitted, after)]
    stages.append(_noises(view, logs, source))
    position, velocity = (AxisStages(*(_rms(errors[i]) for errors in stages)) for i in (0, 1))
    return MotionErrors(position, velocity, source)


def _errors(
    view: TargetsView, variant: Variant, logs: Sequence[Log], source: VelocityFrom
) -> tuple[list[Array], list[Array]]:
    """Return errors (n, n_axes) of position [rad] and velocity [rad/s] of a simulator at the samples of each log."""
    position, velocity = [], []
    for log, found in zip(logs, view.positions(variant, logs), strict=True):
        error = view.off_by(found, log)
        position.append(error)
        if source == "positions" or log.velocity_rad_s is None:
            velocity.append(slope(error, view.logged_s))
            continue
        lag_s = 0.0 if view.robot.stepped is None else 0.5 * view.robot.stepped[0]
        told = speeds_at_samples(found, view.robot.sample_time_s, view.step, lag_s)
        velocity.append(view.passed(told - log.velocity_rad_s[:: view.step]))
    return position, velocity


def _noises(
    view: TargetsView, logs: Sequence[Log], source: VelocityFrom
) -> tuple[list[Array], list[Array]]:
    """Return the same errors from sensor noise alone; noise of a logged velocity counts as white."""
    position = view.position_noises(logs, len(view.logs))
    if source == "positions":
        return position, [slope(x, view.logged_s) for x in position]
    seed, velocity = view.settings.seed, []
    for run, log in enumerate(logs, start=len(view.logs)):
        assert log.velocity_rad_s is not None  # guaranteed by the source
        measured = np.ascontiguousarray(log.velocity_rad_s[:: view.step])
        noise = white_noise(seed, run, *measured.shape)
        velocity.append(view.passed(noise * white_std(measured, view.logged_s)))
    return position, velocity


def slope(values: Array, time_s: float, lag_s: float = 0.0) -> Array:
    """Return the derivative of samples (n, n_axes) by a cubic spline, ``lag_s`` before each sample.

    At a fifth of the sample rate it is 2 % too small; a central difference is 25 % too small.
    """
    at = time_s * np.arange(len(values))
    return np.asarray(
        scipy.interpolate.make_interp_spline(at, values, k=3)(np.maximum(at - lag_s, 0.0), nu=1)
    )


def speeds_at_samples(position_rad: Array, time_s: float, step: int, lag_s: float = 0.0) -> Array:
    """Return speeds (n, n_axes) [rad/s] at every ``step``-th of simulated positions that are ``time_s`` apart.

    Each speed uses only positions before its sample if there are enough, because a new target begins there and the
    acceleration jumps. ``lag_s``: time before the sample at which a stepped simulator reports its speed; its targets
    begin as much earlier.
    """
    last = math.ceil(lag_s / time_s - _ROUNDING)
    if step < last + _POINTS - 1:
        return slope(position_rad, time_s, lag_s)[::step]
    # Derivative of a cubic through the points, counted back from the sample, at the time of the speed.
    back = -time_s * (last + np.arange(_POINTS))
    powers = np.arange(_POINTS)
    wanted = np.where(powers > 0, powers * (-lag_s) ** np.maximum(powers - 1, 0), 0.0)
    weights = np.linalg.solve(back ** powers[:, None], wanted)
    n = len(position_rad)
    at = np.arange(step, n, step)[:, None] - (last + np.arange(_POINTS))
    speed = np.einsum("k,nka->na", weights, position_rad[at])
    # Logs begin at rest, or where a run-up has brought the simulator.
    first = (position_rad[1:2] - position_rad[:1]) / time_s
    return np.concatenate([first, speed])


def _rms(errors: Sequence[Array]) -> Array:
    """Return the rms by axis (n_axes,) over time and logs."""
    return combine([np.mean(error**2, axis=0) for error in errors])

"""The sampled loop of a robot as the ``G`` and ``F`` of the error analysis."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import instance, reals
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.robot import Robot

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@summarized
@dataclass(frozen=True)
class Loop:
    """The loop ``u = F (P r - y)``, ``y = G u`` of a robot at its operating point.

    frequency_hz
        (n_freq,).
    response
        G, zero-order hold, from torque to motor position [rad/Nm], (n_freq, n, n).
    controller
        F, from position error to torque [Nm/rad], (n_freq, n, n).
    prefilter
        P, from the velocity reference [rad/s] to the equivalent position reference [rad],
        (n_freq, n, n).
    """

    frequency_hz: Real
    response: Complex
    controller: Complex
    prefilter: Complex


def robot_loop(robot: Robot, frequency_hz: Real, effects: Iterable[Effect] = ()) -> Loop:
    """Return the loop of a robot with a ``pi_velocity`` or ``p_velocity`` controller.

    ``frequency_hz`` [Hz] is (n_freq,), above zero and up to Nyquist. With z = exp(i w T),
    ``F = kp (1 - 1/z) / T + ki`` and ``F P = kp + ki T / (z - 1)``, from the controller equations in
    :doc:`conventions`. ``effects`` act as in :meth:`axisight.Robot.zoh_response`. Raises InputError for
    another controller and other frequencies.
    """
    kp, ki = velocity_gains(robot)
    frequency_hz = frequencies_below_nyquist(robot, frequency_hz)
    step = robot.sample_time_s
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) * step)[:, None]
    feedback = kp * (1 - 1 / z) / step + ki
    forward = kp + ki * step / (z - 1)
    return Loop(
        np.asarray(frequency_hz, np.float64),
        robot.zoh_response(frequency_hz, effects=effects).values,
        _diagonal(feedback),
        _diagonal(forward / feedback),
    )


def frequencies_below_nyquist(robot: Robot, frequency_hz: object) -> Real:
    """Return frequencies [Hz], (n_freq,); raises InputError unless above zero and up to Nyquist."""
    nyquist = 0.5 / robot.sample_time_s
    what = f"frequencies above 0 up to {nyquist:g} Hz (Nyquist)"
    found = reals("frequency_hz", frequency_hz, what, 1)
    outside = found[(found <= 0) | (found > nyquist * (1 + 1e-12))]
    if outside.size:
        raise InputError(f"frequency_hz: expected {what}, got {outside[0]:g}")
    return found


def velocity_gains(robot: Robot) -> tuple[Real, Real]:
    """Return kp [Nm s/rad] and ki [Nm/rad] (n_axes,); raises InputError for other controllers."""
    instance("robot", robot, Robot)
    kind = robot.controller_kind
    if kind not in ("pi_velocity", "p_velocity"):
        raise InputError(f"robot: expected a pi_velocity or p_velocity controller, got {kind}")
    gains = robot.controller_gains
    kp = np.asarray(gains["kp"])
    return kp, np.asarray(gains["ki"]) if kind == "pi_velocity" else np.zeros_like(kp)


def _diagonal(rows: Complex) -> Complex:
    return rows[:, :, None] * np.eye(rows.shape[1])

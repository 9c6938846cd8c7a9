"""Weights of the error that keeps a simulator on logs, from noise, model error and the torque's response to noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.fitting import Weighting
from axisight.gap.controller.feedback import loop_responses
from axisight.gap.facts.settings import Settings
from axisight.gap.signals.noise import (
    SLOW,
    Floor,
    position_noise_std,
    segment_of,
    smoothed,
    torque_density,
)
from axisight.gap.simulator.closed_loop_runs import noise_torques
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Number of logs along which noise is simulated. Runs with and without noise fill the lanes of one simulation.
_SIMULATED = 2
# Smallest share of the torque that counts as driven by the references, so that each weight stays positive.
_LEAST_DRIVEN = 1e-3
# Factor on the response to noise of a linear loop without lags, up to which torque counts as such a response. A
# lag of 1 ms raises the response by 20 %, and noise that is not white has more power where motion is. A tenth
# of a response still biases a fit: with a factor of two instead of ten, delays come out 10 % too long, and
# every second one fits better as a current loop.
_AS_ANSWER = 10.0


def tracking_floor(
    tracking: Robot, own: Robot, logs: list[Log], settings: Settings
) -> tuple[Floor, TrackingWeights]:
    """Return the floor of the feedback that keeps a simulator on logs, and the source of its weights.

    ``tracking``: the robot with that feedback as its controller; ``own``: with the machine's controller. The
    noise is simulated in the tracking loop.
    """
    std = np.maximum(position_noise_std(logs), own.position_noise_std)
    like = shortest(logs)
    torques = noise_torques(tracking, logs[:_SIMULATED], std, settings.seed)
    f, sampled = _density(torques, like)
    weights = TrackingWeights(tracking, own, f, std, sampled, settings.model_error)
    rate = 1.0 / like.sample_time_s
    decimation = max(1, int(rate / (2 * settings.bandwidth_hz)))
    band = f <= rate / (2 * decimation)
    weight = weights.of([x.torque_nm for x in logs], like)
    expected = np.mean((weights.noise * weight**2)[:, band], axis=1)
    return Floor(std, f, weights.noise, Weighting(f, weight, decimation), expected), weights


def shortest(logs: Sequence[Log]) -> Log:
    """Return the shortest log; all others have at least one segment of its length."""
    return min(logs, key=lambda log: log.n_samples)


class TrackingWeights:
    """Weights from the densities of noise and model error, and from the share of the torque that is not noise.

    - ``std_rad`` (n_axes,): sensor noise.
    - ``sampled`` (n_axes, n_freq): density of simulated torque noise in the tracking loop; ``noise``: the same,
      smoothed.
    - ``model_error``: error of formulas, as a share of the torque that the machine's own controller commands.
      It passes the loop like any torque on the motor.
    """

    def __init__(
        self,
        tracking: Robot,
        own: Robot,
        frequency_hz: Array,
        std_rad: Array,
        sampled: Array,
        model_error: float,
    ) -> None:
        self.model_error = model_error
        from_angle, kept = loop_responses(tracking, frequency_hz)
        self.noise = smoothed(sampled, _noise_response(from_angle, std_rad))
        from_angle, commanded = loop_responses(own, frequency_hz)
        self._passed = _of_axes(kept) / _of_axes(commanded)
        self._noise_response = _noise_response(from_angle, std_rad)

    def of(self, torques: Sequence[Array], like: Log) -> Array:
        """Return the weights (n_axes, n_freq) for logged torques, with segments as for the log ``like``."""
        _, torque = _density(torques, like)
        total = self.noise + self.model_error**2 * torque * self._passed**2
        total /= self.driven(torque)
        # A noise-free simulated log still needs a finite weight.
        return np.asarray(1.0 / np.sqrt(np.maximum(total, 1e-12 * torque.max())))

    def driven(self, torque: Array) -> Array:
        """Return the share of a logged torque's density that is not a response to noise (n_axes, n_freq).

        The machine's controller turns sensor noise into torque, which moves the machine: both are in the log. A
        simulator kept on torque and position would be fitted to respond little to it, instead of correctly.
        This is the bias of direct identification in closed loop (Forssell and Ljung, 1999). Torque that
        responds to noise therefore gets no weight.
        """
        share = 1.0 - _AS_ANSWER * self._noise_response / np.maximum(torque, 1e-300)
        share[:, :SLOW] = 1.0
        return np.asarray(np.clip(share, _LEAST_DRIVEN, 1.0))


def _density(torques: Sequence[Array], like: Log) -> tuple[Array, Array]:
    """Return frequencies and mean density of torques (n_axes, n_freq), with segments as for the log ``like``."""
    rate, segment = 1.0 / like.sample_time_s, segment_of(like)
    found = [torque_density(x, rate, segment) for x in torques]
    return found[0][0], np.asarray(np.mean([density for _, density in found], axis=0))


def _noise_response(from_angle: Complex, std_rad: Array) -> Array:
    """Return the density of the torque's linear response to sensor noise (n_axes, n_freq)."""
    return np.asarray(np.einsum("fij,j->if", np.abs(from_angle) ** 2, std_rad**2))


def passed(robot: Robot, frequency_hz: Array) -> Array:
    """Return the share of a torque on the motor that shows in the loop's command (n_axes, n_freq)."""
    _, from_torque = loop_responses(robot, frequency_hz)
    return _of_axes(from_torque)


def _of_axes(response: Complex) -> Array:
    return np.asarray(np.abs(np.einsum("fii->if", response)))

"""Weights of the error that keeps a simulator on logs: noise, errors of formulas, what answers noise."""

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

# Logs along which noise is simulated: with noise and without they fill the lanes of one simulation.
_SIMULATED = 2
# Share of the torque that is taken as driven by the references at least: a weight stays above zero.
_LEAST_DRIVEN = 1e-3
# Times the answer to noise, as a linear loop without lags gives it, that counts as answer. A lag of a millisecond
# amplifies it by a fifth, noise that is not white has more of it where motion is, and a tenth of it still bends what
# is fitted: with two times in place of ten, delays came out a tenth too long, and one in two better as a current loop.
_AS_ANSWER = 10.0


def tracking_floor(
    tracking: Robot, own: Robot, logs: list[Log], settings: Settings
) -> tuple[Floor, TrackingWeights]:
    """Return the floor of the feedback that keeps a simulator on logs, and what its weights come from.

    ``tracking`` has the controller that keeps it there, ``own`` the machine's. Noise is simulated
    in the loop.
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
    """Return the log whose segments all others have too."""
    return min(logs, key=lambda log: log.n_samples)


class TrackingWeights:
    """Weights by the density of noise and of errors of formulas, and by what the torque tells.

    ``std_rad`` (n_axes,) of the noise of the sensors, ``sampled`` (n_axes, n_freq) the density of what the
    loop that keeps the simulator on a log makes of it in a simulation, ``noise`` the same smoothed. Errors
    of formulas are a share ``model_error`` of the torque as the machine's own controller would
    command it: they pass the loop as any torque on the motor does.
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
        self.noise = smoothed(sampled, _answer(from_angle, std_rad))
        from_angle, commanded = loop_responses(own, frequency_hz)
        self._passed = _of_axes(kept) / _of_axes(commanded)
        self._answer = _answer(from_angle, std_rad)

    def of(self, torques: Sequence[Array], like: Log) -> Array:
        """Return the weights (n_axes, n_freq) for logged torques, sampled as a log is."""
        _, torque = _density(torques, like)
        total = self.noise + self.model_error**2 * torque * self._passed**2
        total /= self.driven(torque)
        # A noise-free simulated log still needs a finite weight.
        return np.asarray(1.0 / np.sqrt(np.maximum(total, 1e-12 * torque.max())))

    def driven(self, torque: Array) -> Array:
        """Return the share of a logged torque's density that does not answer noise (n_axes, n_freq).

        What the machine's controller makes of the noise moves the machine, and is in the logged torque as
        in the logged position. A simulator kept on both would be fitted to make little of it, and not to
        be right: the bias of direct identification in closed loop (Forssell and Ljung, 1999). Where
        the torque is such an answer, it tells nothing of the machine.
        """
        share = 1.0 - _AS_ANSWER * self._answer / np.maximum(torque, 1e-300)
        share[:, :SLOW] = 1.0
        return np.asarray(np.clip(share, _LEAST_DRIVEN, 1.0))


def _density(torques: Sequence[Array], like: Log) -> tuple[Array, Array]:
    """Return frequencies and mean density of torques (n_axes, n_freq), by segments as those of a log."""
    rate, segment = 1.0 / like.sample_time_s, segment_of(like)
    found = [torque_density(x, rate, segment) for x in torques]
    return found[0][0], np.asarray(np.mean([density for _, density in found], axis=0))


def _answer(from_angle: Complex, std_rad: Array) -> Array:
    """Return the density of torque that answers noise of the sensors (n_axes, n_freq), all linear."""
    return np.asarray(np.einsum("fij,j->if", np.abs(from_angle) ** 2, std_rad**2))


def passed(robot: Robot, frequency_hz: Array) -> Array:
    """Return the share of a torque on the motor that the loop answers with (n_axes, n_freq)."""
    _, from_torque = loop_responses(robot, frequency_hz)
    return _of_axes(from_torque)


def _of_axes(response: Complex) -> Array:
    return np.asarray(np.abs(np.einsum("fii->if", response)))

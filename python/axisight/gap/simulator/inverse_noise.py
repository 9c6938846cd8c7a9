"""Error of a torque predicted from measured motion that sensor noise alone causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.signals.motion import Filtering
from axisight.gap.signals.noise import position_noise_std
from axisight.gap.signals.noise_colour import noise_colour
from axisight.gap.signals.repeated_motions import repeated_std_nm
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.logs import Log, differentiate, lowpass
from axisight.robot import Robot
from axisight.simulation import white_noise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InverseNoise:
    """Noise of position, or measured velocity, through the inertia, and noise of the torque.

    - ``robot``: without effects.
    - ``position_std_rad`` (n_axes,): white noise in each sample. Noise of velocity and torque is estimated from
      each log.
    - ``scale`` (n_axes,): factor that makes the noise as large as the difference between repeated motions.
    - ``repeated``: whether there are any; else ``scale`` is one.
    """

    filtering: Filtering
    robot: Robot
    position_std_rad: Array
    scale: Array
    seed: int
    repeated: bool = False

    @classmethod
    def of(cls, robot: Robot, logs: Sequence[Log], filtering: Filtering, seed: int) -> InverseNoise:
        """Return the noise of logs, from the part of their spectra where motion has no power."""
        std = position_noise_std(list(logs))
        noise = cls(filtering, robot.with_effects([]), std, np.ones(robot.n_axes), seed)
        repeated = repeated_std_nm(logs, filtering)
        if repeated is None:
            return noise
        expected = np.std(noise.error(logs[0], 0), axis=0)
        scale = repeated / np.maximum(expected, 1e-300)
        return replace(noise, scale=scale, repeated=True)

    def error(self, log: Log, run: int) -> Array:
        """Return the error (n, n_axes) [Nm] that noise causes in a predicted torque; ``run`` seeds the noise."""
        step = log.sample_time_s
        cutoff = self.filtering.motion_cutoff_hz(step)
        white = white_noise(self.seed, 2 * run, log.n_samples, log.n_axes)
        _, acceleration = differentiate(white * self.position_std_rad, step, cutoff, curved=True)
        axes = np.flatnonzero(self.filtering.measured)
        if axes.size and log.velocity_rad_s is not None:
            noise = self._drawn(log, log.velocity_rad_s, 2 * run)
            speed = lowpass(noise[:, axes], step, cutoff, curved=True)
            acceleration[:, axes] = np.gradient(speed, step, axis=0)
        left = self._inertial(log, acceleration) - self._drawn(log, log.torque_nm, 2 * run + 1)
        return np.asarray(self.scale * self.filtering.compared(left, step))

    def _drawn(self, log: Log, x: Array, run: int) -> Array:
        """Return noise (n, n_axes) as on a signal of a log."""
        unit = white_noise(self.seed, run, 2 * log.n_samples, log.n_axes)
        return noise_colour(log, x, self.filtering.cutoff_hz).drawn(unit)

    def _inertial(self, log: Log, acceleration: Array) -> Array:
        """Return the torque (n, n_axes) [Nm] of an acceleration added to that of a log: the mass matrix times it."""
        position, velocity, own, torque = self.filtering(log)
        with_it, without = (
            predicted_torque(self.robot, AS_GIVEN, (position, velocity, a, torque))
            for a in (own + acceleration, own)
        )
        return with_it - without

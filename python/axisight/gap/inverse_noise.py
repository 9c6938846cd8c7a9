"""What sensor noise alone leaves of a torque predicted from the measured motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.motion import Filtering
from axisight.gap.noise import position_noise_std, segment_of
from axisight.gap.repeats import repeated_std_nm
from axisight.logs import Log, differentiate, lowpass
from axisight.robot import Robot
from axisight.simulation import white_noise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InverseNoise:
    """Noise of position (or measured velocity) through the inertia, and of the torque.

    ``inertia`` (n_axes,) [kg m^2] felt by each motor; ``position_std_rad`` (n_axes,) of white noise
    in each sample: that of velocity and torque is each log's own. ``scale`` (n_axes,): factor that
    makes of it what repeats of a motion differ by, where there are any (``repeated``).
    """

    filtering: Filtering
    inertia: Array
    position_std_rad: Array
    scale: Array
    seed: int
    repeated: bool = False

    @classmethod
    def of(cls, robot: Robot, logs: Sequence[Log], filtering: Filtering, seed: int) -> InverseNoise:
        """Return the noise of logs, from what is in their spectra where motion has no power."""
        std = position_noise_std(list(logs))
        noise = cls(filtering, _inertia(robot), std, np.ones(robot.n_axes), seed)
        repeated = repeated_std_nm(logs, filtering)
        if repeated is None:
            return noise
        expected = np.std(noise.error(logs[0], 0), axis=0)
        scale = repeated / np.maximum(expected, 1e-300)
        return replace(noise, scale=scale, repeated=True)

    def error(self, log: Log, run: int) -> Array:
        """Return the error (n, n_axes) [Nm] that noise causes in a predicted torque of run ``run``."""
        step, cutoff = log.sample_time_s, self.filtering.cutoff_hz
        white = white_noise(self.seed, 2 * run, log.n_samples, log.n_axes)
        _, acceleration = differentiate(white * self.position_std_rad, step, cutoff, curved=True)
        axes = np.flatnonzero(self.filtering.measured)
        if axes.size and log.velocity_rad_s is not None:
            speed = lowpass(
                (white * _top_std(log, log.velocity_rad_s))[:, axes], step, cutoff, curved=True
            )
            acceleration[:, axes] = np.gradient(speed, step, axis=0)
        torque = white_noise(self.seed, 2 * run + 1, log.n_samples, log.n_axes)
        left = acceleration * self.inertia - lowpass(
            torque * _top_std(log, log.torque_nm), step, cutoff
        )
        return np.asarray(self.scale * left)


def _inertia(robot: Robot) -> Array:
    """Return the inertia felt by each motor at the operating point (n_axes,) [kg m^2]."""
    q = robot.equilibrium()["joint_angle_rad"].values
    joints = robot.axis_joints
    ratio = robot.gear_ratio
    arm = np.diag(robot.inertia_matrix(q))[joints] * ratio**2
    own = robot.parameters()
    motors = [own[f"{robot.joint_names[j]}.motor_inertia"] for j in joints]
    return np.asarray(arm + np.array(motors))


def _top_std(log: Log, x: Array) -> Array:
    """Return the standard deviation of white noise (n_axes,) from the top fifth of the spectrum."""
    rate = 1.0 / log.sample_time_s
    f, density = scipy.signal.welch(x, rate, nperseg=segment_of(log), axis=0)
    top = (f > 0.4 * rate) & (f < 0.49 * rate)
    return np.asarray(np.sqrt(np.mean(density[top], axis=0) * rate / 2))

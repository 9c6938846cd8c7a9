"""Inverse-dynamics mode: torque predicted from the measured motion, no reference needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import FitOptions, Parameter, Weighting
from axisight.fitting.simulation_error import Spec, core_spec
from axisight.gap.cutoff import Motion, chosen_cutoff_hz
from axisight.gap.model import ModelFitter
from axisight.gap.noise import Floor, position_noise_std
from axisight.gap.settings import Settings
from axisight.gap.torques import AS_GIVEN, Variant
from axisight.gap.view import View
from axisight.logs import Log, differentiate, lowpass
from axisight.robot import Robot
from axisight.simulation import white_noise

Array = NDArray[np.float64]


# Natural step of effects, as a share of their typical size.
_STEP = 1e-3


class InverseView(View):
    """Torque predicted from the measured motion."""

    def __init__(self, robot: Robot, logs: list[Log], settings: Settings) -> None:
        cutoff = settings.cutoff_hz
        if cutoff is None:
            cutoff = chosen_cutoff_hz(logs, motion, lambda m: predicted_torque(robot, AS_GIVEN, m))
        if not 0 < cutoff < 0.5 / robot.sample_time_s:
            raise InputError(
                f"cutoff_hz: expected between 0 and the Nyquist frequency "
                f"{0.5 / robot.sample_time_s:g} Hz, got {cutoff:g} Hz"
            )
        floor = inverse_floor(robot, logs, cutoff, settings)
        fitter = InverseDynamicsFitter(
            robot,
            [motion(log, cutoff) for log in logs],
            floor.weighting,
            settings.tolerances_of(robot),
            block_s(logs, cutoff, settings),
        )
        self.cutoff = cutoff
        super().__init__("inverse_dynamics", robot, logs, settings, fitter, floor, cutoff)

    def measured(self, log: Log) -> Array:
        """Return the low-passed torque."""
        return motion(log, self.cutoff)[3]

    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the predicted torque of every log."""
        return [predicted_torque(self.robot, variant, motion(x, self.cutoff)) for x in logs]

    def noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the error that noise of position and torque causes, for every log."""
        std, seed = self.floor.position_std_rad, self.settings.seed
        return [
            inverse_noise(self.robot, log, std, self.cutoff, seed, 2 * run)
            for run, log in enumerate(logs, start=first_run)
        ]


# Stretches of time that a gain is compared over need that many blocks, all logs together.
_BLOCKS = 20.0
# A block is longer than what the low-pass and the friction around a reversal smear.
_PERIODS = 10.0


def block_s(logs: Sequence[Log], cutoff_hz: float, settings: Settings) -> float:
    """Return how long blocks of data are [s]: those of the settings, shorter in short logs."""
    total = sum(log.duration_s for log in logs)
    return min(settings.block_s, max(total / _BLOCKS, _PERIODS / cutoff_hz))


def motion(log: Log, cutoff_hz: float) -> Motion:
    """Return position, velocity, acceleration and torque (n, n_axes), low-passed alike."""
    velocity, acceleration = differentiate(log.position_rad, log.sample_time_s, cutoff_hz)
    smooth = lowpass(log.position_rad, log.sample_time_s, cutoff_hz)
    torque = lowpass(log.torque_nm, log.sample_time_s, cutoff_hz)
    out = tuple(np.ascontiguousarray(x) for x in (smooth, velocity, acceleration, torque))
    return out[0], out[1], out[2], out[3]


class InverseDynamicsFitter(ModelFitter):
    """Error of the torque predicted from the measured motion."""

    adds_up = True

    def __init__(
        self,
        robot: Robot,
        motions: Sequence[Motion],
        weighting: Weighting,
        tolerances: Mapping[str, float],
        block_s: float,
    ) -> None:
        super().__init__(robot, weighting, tolerances, block_s)
        self.motions = list(motions)

    def _keep(self, logs: Sequence[int]) -> None:
        self.motions = [self.motions[i] for i in logs]

    def takes_part(self, name: str) -> bool:
        """Springs and their damping do not show in a rigid prediction."""
        quantity = name.rsplit(".", 1)[1]
        return quantity not in ("stiffness", "damping")

    def _specs(self, parameters: Sequence[Parameter], effects: Sequence[Effect]) -> list[Spec]:
        """Return the parameters for the core, effects in small steps.

        What moves a block beyond all reason within its natural step has no derivative in the core: a
        simulation is chaotic there. A predicted torque never is, and motors may be small.
        """
        steps = (p if p.effect is None else replace(p, scale=_STEP * p.scale) for p in parameters)
        return [core_spec(p, effects) for p in steps]

    def solve(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        _near: _core.Courses | None = None,
    ) -> _core.FitResult:
        """Run the fit in the core."""
        return _core.fit_inverse_dynamics(
            self.robot.core,
            core_effects(effects),
            self._specs(parameters, effects),
            self.motions,
            self.weighting.core(),
            options,
            warm=warm,
            cancel=self.cancel,
        )

    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        _near: _core.Courses | None = None,
    ) -> _core.Linearization:
        """Evaluate the model in the core."""
        return _core.evaluate_inverse_dynamics(
            self.robot.core,
            core_effects(effects),
            self._specs(parameters, effects),
            self.motions,
            self.weighting.core(),
            options,
            warm=warm,
            cancel=self.cancel,
        )


def predicted_torque(robot: Robot, variant: Variant, at: Motion) -> Array:
    """Return the torque (n, n_axes) [Nm] a simulator predicts for a motion."""
    changed = robot.with_parameters(variant.robot_values)
    result = _core.evaluate_inverse_dynamics(
        changed.core,
        core_effects(variant.effects),
        [],
        [at],
        Weighting.flat(robot.n_axes).core(),
        FitOptions(),
    )
    # The residual is prediction minus measurement, axis by axis.
    residual = result.residual.reshape(robot.n_axes, -1).T
    return np.asarray(residual + at[3])


def inverse_floor(robot: Robot, logs: Sequence[Log], cutoff_hz: float, settings: Settings) -> Floor:
    """Return the floor of a predicted torque: position noise through the inertia, and torque noise."""
    std = position_noise_std(list(logs))
    log = logs[0]
    rate = 1.0 / log.sample_time_s
    noise = inverse_noise(robot, log, std, cutoff_hz, settings.seed)
    variance = np.mean([np.var(x.torque_nm, axis=0) for x in logs], axis=0)
    noise_variance = np.var(noise, axis=0)
    total = np.maximum(noise_variance + settings.model_error**2 * variance, 1e-12 * variance)
    decimation = max(1, int(rate / (2 * cutoff_hz)))
    weighting = Weighting(
        np.zeros(1), 1 / np.sqrt(total)[:, None] / np.sqrt(decimation), decimation
    )
    flat = np.ones((len(variance), 1))
    return Floor(
        std, np.zeros(1), noise_variance[:, None] * flat, weighting, noise_variance / total
    )


def inverse_noise(
    robot: Robot, log: Log, std_rad: Array, cutoff_hz: float, seed: int, run: int = 0
) -> Array:
    """Return the error (n, n_axes) [Nm] that sensor noise alone causes in a predicted torque."""
    noise = white_noise(seed, run, log.n_samples, robot.n_axes) * std_rad
    _, acceleration = differentiate(noise, log.sample_time_s, cutoff_hz)
    torque = white_noise(seed, run + 1, log.n_samples, robot.n_axes) * _torque_noise_std(log)
    return np.asarray(
        acceleration * _inertia(robot) - lowpass(torque, log.sample_time_s, cutoff_hz)
    )


def _inertia(robot: Robot) -> Array:
    """Return the inertia felt by each motor at the operating point (n_axes,) [kg m^2]."""
    q = robot.equilibrium()["joint_angle_rad"].values
    joints = robot.axis_joints
    ratio = robot.gear_ratio
    arm = np.diag(robot.inertia_matrix(q))[joints] * ratio**2
    own = robot.parameters()
    motors = [own[f"{robot.joint_names[j]}.motor_inertia"] for j in joints]
    return np.asarray(arm + np.array(motors))


def _torque_noise_std(log: Log) -> Array:
    rate = 1.0 / log.sample_time_s
    f, density = scipy.signal.welch(
        log.torque_nm, rate, nperseg=min(2048, log.n_samples // 2), axis=0
    )
    top = (f > 0.4 * rate) & (f < 0.49 * rate)
    return np.asarray(np.sqrt(np.mean(density[top], axis=0) * rate / 2))

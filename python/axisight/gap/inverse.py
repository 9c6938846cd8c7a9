"""Inverse-dynamics mode: torque predicted from the measured motion, no reference needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import FitOptions, Parameter, Weighting
from axisight.fitting.simulation_error import Spec, core_spec
from axisight.gap.cutoff import chosen_filtering, rigid_below_hz
from axisight.gap.inverse_noise import InverseNoise
from axisight.gap.model import ModelFitter
from axisight.gap.motion import Motion, has_velocity
from axisight.gap.noise import Floor
from axisight.gap.settings import Settings
from axisight.gap.standstill import certainty, dry_friction_nm, open_torque_nm
from axisight.gap.torques import AS_GIVEN, Variant
from axisight.gap.view import View
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]


# Natural step of effects, as a share of their typical size.
_STEP = 1e-3


class InverseView(View):
    """Torque predicted from the measured motion."""

    def __init__(
        self, robot: Robot, logs: list[Log], settings: Settings, held_out: Sequence[Log] = ()
    ) -> None:
        cutoff = settings.cutoff_hz
        nyquist_hz = 0.5 / logs[0].sample_time_s
        if cutoff is not None and not 0 < cutoff < nyquist_hz:
            raise InputError(
                f"cutoff_hz: expected between 0 and the Nyquist frequency {nyquist_hz:g} Hz, got {cutoff:g} Hz"
            )
        self.filtering = chosen_filtering(
            logs,
            lambda m: predicted_torque(robot, AS_GIVEN, m),
            cutoff,
            # All logs are treated alike, those held out too.
            measured=has_velocity([*logs, *held_out]),
            highest_hz=rigid_below_hz(robot),
        )
        self.noise = InverseNoise.of(robot, logs, self.filtering, settings.seed)
        floor = inverse_floor(logs, self.noise, settings)
        motions = [self.filtering(log) for log in logs]
        fitter = InverseDynamicsFitter(
            robot,
            motions,
            certainties(robot, motions, floor.weighting),
            floor.weighting,
            settings.tolerances_of(robot),
            block_s(logs, self.filtering.cutoff_hz, settings),
        )
        super().__init__(
            "inverse_dynamics", robot, logs, settings, fitter, floor, self.filtering.cutoff_hz
        )

    def measured(self, log: Log) -> Array:
        """Return the low-passed torque."""
        return self.filtering(log)[3]

    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the predicted torque of every log."""
        return [predicted_torque(self.robot, variant, self.filtering(x)) for x in logs]

    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the error that noise of position and torque causes, for every log."""
        del variant
        return [self.noise.error(log, run) for run, log in enumerate(logs, start=first_run)]

    def remarks(self) -> tuple[str, ...]:
        """Say how the logs were filtered, and what the floor is made of."""
        chosen = "chosen as what predicts data left out best"
        highest = rigid_below_hz(self.robot)
        if self.settings.cutoff_hz:
            chosen = "as given"
        elif np.isfinite(highest):
            chosen += f", below a third of the first elastic mode ({highest:.3g} Hz)"
        out = [
            f"Motion, torque and their noise are low-passed alike at {self.filtering.cutoff_hz:.3g} Hz, {chosen}."
        ]
        axes = [str(axis) for axis, used in enumerate(self.filtering.measured, 1) if used]
        if axes:
            out.append(
                f"Velocity and acceleration of axis {', '.join(axes)} come from the measured velocity, "
                f"which predicts data left out better than the position does."
            )
        if self.noise.repeated:
            out.append("The floor is what repeats of one motion differ by.")
        return tuple(out)


# Stretches of time that a gain is compared over need that many blocks, all logs together.
_BLOCKS = 20.0
# A block is longer than what the low-pass and the friction around a reversal smear.
_PERIODS = 10.0


def block_s(logs: Sequence[Log], cutoff_hz: float, settings: Settings) -> float:
    """Return how long blocks of data are [s]: those of the settings, shorter in short logs."""
    total = sum(log.duration_s for log in logs)
    return min(settings.block_s, max(total / _BLOCKS, _PERIODS / cutoff_hz))


def certainties(robot: Robot, motions: Sequence[Motion], weighting: Weighting) -> list[Array]:
    """Return how far torques can be predicted in every sample: dry friction leaves some open."""

    def rigid(at: Motion) -> Array:
        return predicted_torque(robot.with_effects([]), AS_GIVEN, at)

    left_open = open_torque_nm(motions, dry_friction_nm(motions, rigid))
    error_nm = 1 / (weighting.weight[:, 0] * np.sqrt(weighting.decimation))
    return [certainty(x, error_nm) for x in left_open]


class InverseDynamicsFitter(ModelFitter):
    """Error of the torque predicted from the measured motion."""

    adds_up = True

    def __init__(
        self,
        robot: Robot,
        motions: Sequence[Motion],
        certainty: Sequence[Array],
        weighting: Weighting,
        tolerances: Mapping[str, float],
        block_s: float,
    ) -> None:
        super().__init__(robot, weighting, tolerances, block_s)
        self.records = [(*m, c) for m, c in zip(motions, certainty, strict=True)]

    def _keep(self, logs: Sequence[int]) -> None:
        self.records = [self.records[i] for i in logs]

    def counted(self) -> Array:
        """Return what every residual counts for (n_residuals,): the square of its certainty."""
        step = self.weighting.decimation
        parts: list[Array] = []
        for *_, factor in self.records:
            # As `Weighting` decimates: each residual stands for so many samples.
            kept = factor[: len(factor) // step * step]
            parts += list((kept**2).reshape(-1, step, kept.shape[1]).mean(axis=1).T)
        return np.concatenate(parts)

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
            self.records,
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
            self.records,
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
        [(*at, np.ones_like(at[3]))],
        Weighting.flat(robot.n_axes).core(),
        FitOptions(),
    )
    # The residual is prediction minus measurement, axis by axis.
    residual = result.residual.reshape(robot.n_axes, -1).T
    return np.asarray(residual + at[3])


def inverse_floor(logs: Sequence[Log], noise: InverseNoise, settings: Settings) -> Floor:
    """Return the floor of a predicted torque: its noise, and the errors of formulas."""
    log = logs[0]
    rate = 1.0 / log.sample_time_s
    variance = np.mean([np.var(x.torque_nm, axis=0) for x in logs], axis=0)
    noise_variance = np.var(noise.error(log, 0), axis=0)
    total = np.maximum(noise_variance + settings.model_error**2 * variance, 1e-12 * variance)
    decimation = max(1, int(rate / (2 * noise.filtering.cutoff_hz)))
    weighting = Weighting(
        np.zeros(1), 1 / np.sqrt(total)[:, None] / np.sqrt(decimation), decimation
    )
    flat = np.ones((len(variance), 1))
    return Floor(
        noise.position_std_rad,
        np.zeros(1),
        noise_variance[:, None] * flat,
        weighting,
        noise_variance / total,
    )

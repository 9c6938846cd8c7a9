"""Inverse-dynamics comparison: torque predicted from the measured motion, without references."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects, effect_info
from axisight.errors import InputError
from axisight.fitting import FitOptions, Parameter, Weighting
from axisight.fitting.divergence import Diverged
from axisight.fitting.parameters import Spec, core_spec
from axisight.gap.controller.speed_loop import other_controllers_of_targets
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.drive_lags import is_lag
from axisight.gap.signals.lowpass_cutoff import chosen_filtering, rigid_below_hz
from axisight.gap.signals.motion import Motion, has_velocity
from axisight.gap.signals.noise import Floor
from axisight.gap.signals.standstill import (
    alike,
    certainty,
    dry_friction_nm,
    open_torque_nm,
    standing,
)
from axisight.gap.simulator.deflection_torque import deflection_torque
from axisight.gap.simulator.inverse_noise import InverseNoise
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]


# Points in the table of the low-pass gain; linear interpolation is exact to a few 1e-4.
_FREQUENCIES = 200
# Factor on the standard deviation of a band if the simulator lies at one end of it: a uniform band has four
# times the mean square distance from its end than from its middle.
_FROM_ONE_END = 2.0
# Step of the derivatives of effects, as a share of their natural size.
_STEP = 1e-3


class InverseView(View):
    """Compares the measured torque with that predicted from the measured motion."""

    fitter: InverseDynamicsFitter
    feels_steps: ClassVar[bool] = False
    """False: torque and motion both contain the loop's response to encoder steps.

    The low-pass removes the rest.
    """

    def __init__(
        self,
        robot: Robot,
        logs: list[Log],
        settings: Settings,
        held_out: Sequence[Log] = (),
        silent: Sequence[int] = (),
    ) -> None:
        # Torque is predicted at the rate of the logs, whatever the rate of the simulator.
        robot = _at_the_rate_of(robot, logs)
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
            # All logs use the same signals, validation logs too.
            measured=has_velocity([*logs, *held_out]),
            highest_hz=rigid_below_hz(robot),
        )
        self._sample_time_s = logs[0].sample_time_s
        self.noise = InverseNoise.of(robot, logs, self.filtering, settings.seed)
        floor = inverse_floor(logs, self.noise, settings, silent)
        motions = [self._as_rigid(robot, log) for log in logs]
        self._dry_friction_nm = dry_friction_nm(motions, _without_effects(robot))
        fitter = InverseDynamicsFitter(
            robot,
            motions,
            self._certain([self.whole(log) for log in logs], motions, floor.weighting),
            floor.weighting,
            settings.tolerances_of(robot),
            block_s(logs, self.filtering.cutoff_hz, settings),
        )
        super().__init__(
            "inverse_dynamics", robot, logs, settings, fitter, floor, self.filtering.cutoff_hz
        )
        self.silent = fitter.silent = tuple(silent)
        self.certainty: Sequence[Array] = fitter.certainty
        """Weight of each sample of the estimation logs in fits (n, n_axes)."""
        self.unfelt = other_controllers_of_targets(robot, logs)

    def _certain(
        self, whole: Sequence[Array], motions: Sequence[Motion], weighting: Weighting
    ) -> list[Array]:
        """Return the certainty of each sample of logs (n, n_axes); zero if it does not count."""
        found = certainties(
            motions,
            self._dry_friction_nm,
            weighting,
            lambda x: self.filtering.spread(x, self._sample_time_s),
        )
        return [certain * counts for certain, counts in zip(found, whole, strict=True)]

    def whole(self, log: Log) -> Array:
        """Return whether each sample of a log counts (n, 1), as 1 or 0.

        Next to an end in motion, the low-pass mixes in padding: the fit leaves these samples out.
        """
        return np.asarray(np.floor(self.filtering.counted(log))[:, None])

    def weighting_with(self, torque_nm: Array) -> Weighting:
        """Return the weighting that results if a log with this torque (n, n_axes) [Nm] is added."""
        noise, share = self.floor.noise[:, 0], self.settings.model_error**2
        variance = [np.var(log.torque_nm, axis=0) for log in self.logs]
        before, after = (
            noise + share * np.mean(each, axis=0)
            for each in (variance, [*variance, np.var(torque_nm, axis=0)])
        )
        weighting = self.floor.weighting
        factor = np.sqrt(before / np.maximum(after, 1e-300))
        return replace(weighting, weight=weighting.weight * factor[:, None])

    def fitter_along(
        self,
        motions: Sequence[Motion],
        whole: Sequence[Array],
        weighting: Weighting | None = None,
    ) -> InverseDynamicsFitter:
        """Return the fitter for motions in place of the logs, with another ``weighting`` if given.

        ``whole``: whether the samples of each motion count, as of `whole`.
        """
        used = self.floor.weighting if weighting is None else weighting
        return self.fitter.along(motions, self._certain(whole, motions, used), used)

    def _as_rigid(self, robot: Robot, log: Log) -> Motion:
        """Return the motion of a log, and its torque without the deflection of the gears."""
        position, velocity, acceleration, torque = at = self.filtering(log)
        bent = deflection_torque(robot, at, log.sample_time_s)
        return position, velocity, acceleration, np.ascontiguousarray(torque - bent)

    def candidates(
        self, model: FittedModel, *, axes: Collection[int] | None = None
    ) -> list[Hypothesis]:
        """Return the candidates of `View` that `_is_tried` allows beside the causes of ``model``."""
        return [f for f in super().candidates(model, axes=axes) if _is_tried(f.effect, model)]

    def measured(self, log: Log) -> Array:
        """Return the low-passed torque (n, n_axes) [Nm]."""
        return self._low_passed(log.torque_nm)

    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the predicted torque of each log (n, n_axes) [Nm], low-passed like the measured one."""
        return [self._low_passed(self._predicted(variant, log)) for log in logs]

    def counted(self, log: Log) -> Array:
        """Return the weight of each sample's error (n, 1), with mean square one; zero at ends in motion."""
        counts = self.filtering.counted(log)[:, None]
        return np.asarray(counts / np.sqrt(np.mean(counts**2)))

    def _predicted(self, variant: Variant, log: Log) -> Array:
        at = self.filtering(log)
        bent = deflection_torque(self.robot, at, log.sample_time_s)
        return predicted_torque(self.robot, variant, at) + bent

    def taken_off(self, log: Log, off_nm: Array) -> Array:
        """Return measured minus predicted torque of a log (n, n_axes) [Nm], before the low-pass."""
        del off_nm
        return log.torque_nm - self._predicted(AS_GIVEN, log)

    def apart(self, logs: Sequence[Log], others: Sequence[Log]) -> Array:
        """Return the relative difference between the motions of two sets of logs (n_axes,) [1].

        The rms difference of the speeds, or of the predicted torques if larger, over the scatter of ``logs``.
        """
        speeds, theirs = ([self.filtering(x)[1] for x in each] for each in (logs, others))
        torques = [self.torques(AS_GIVEN, each) for each in (logs, others)]
        return np.maximum(_relative(speeds, theirs), _relative(*torques))

    def _low_passed(self, torque_nm: Array) -> Array:
        return self.filtering.compared(torque_nm, self._sample_time_s)

    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the error (n, n_axes) [Nm] that noise of position and torque causes, for each log."""
        del variant
        out = [
            self.counted(log) * self.noise.error(log, run)
            for run, log in enumerate(logs, start=first_run)
        ]
        for noise in out:
            noise[:, list(self.silent)] = 0.0
        return out

    def left_open(self, logs: Sequence[Log]) -> list[Array]:
        """Return the standard deviation (n, n_axes) [Nm] that dry friction leaves open near standstill.

        The simulator may be at one end of the band, and the machine anywhere in it.
        """
        found = open_torque_nm([self.filtering(log) for log in logs], self._dry_friction_nm)
        return [_FROM_ONE_END * x for x in found]

    def remarks(self) -> tuple[str, ...]:
        """Return sentences about the filters of the logs and the source of the floor."""
        chosen = "the cutoff that predicts held-out data best"
        highest = rigid_below_hz(self.robot)
        if self.settings.cutoff_hz:
            chosen = "as given"
        elif np.isfinite(highest):
            chosen += f", below a third of the first elastic mode ({highest:.3g} Hz)"
        out = [
            f"Predicted torque, measured torque and noise pass the same low-pass of "
            f"{self.filtering.cutoff_hz:.3g} Hz, {chosen}. The motion is low-passed an octave above."
        ]
        cut = [log.name for log in self.logs if self.filtering.counted(log).min() < 1]
        if cut:
            out.append(
                f"{', '.join(cut)} begins or ends in motion. The low-pass does not know the torque outside the log, "
                f"so 1.5 of its periods there do not count."
            )
        axes = [str(axis) for axis, used in enumerate(self.filtering.measured, 1) if used]
        if axes:
            out.append(
                f"Velocity and acceleration of axis {', '.join(axes)} come from the measured velocity, "
                f"which predicts held-out data better than the position does."
            )
        if self.noise.repeated:
            out.append("The floor is the difference between repeats of one motion.")
        return tuple(out)


def _at_the_rate_of(robot: Robot, logs: Sequence[Log]) -> Robot:
    step_s = logs[0].sample_time_s
    return robot if robot.sample_time_s == step_s else robot.with_sample_time(step_s)


def _is_tried(effect: Effect, model: FittedModel) -> bool:
    """Whether an effect is tried beside the causes of a model by inverse dynamics.

    On a real machine, errors of formulas look like a lag beside another cause, and like an effect that changes
    with time if friction is missing. So a lag is tried only on an axis without causes. Effects that change with
    time are tried only beside the causes that they presuppose, such as plain friction.
    """
    beside = {f.effect.name for f in model.free if f.effect.axis == effect.axis}
    if first := effect_info(effect.name).beside:
        return beside.issuperset(first)
    return not (is_lag(effect) and beside)


def _relative(these: Sequence[Array], others: Sequence[Array]) -> Array:
    """Return the rms difference of two sets of signals, over the scatter of the first (n_axes,) [1]."""
    signal, other = np.concatenate(these), np.concatenate(others)
    size = np.maximum(signal.std(axis=0), 1e-300)
    return np.asarray(np.sqrt(np.mean((other - signal) ** 2, axis=0)) / size)


# Smallest number of blocks in all logs together, which effects that change with time need.
_BLOCKS = 20.0
# Shortest block, in periods of the cutoff: longer than the low-pass and the friction smear a reversal.
_PERIODS = 10.0


def block_s(logs: Sequence[Log], cutoff_hz: float, settings: Settings) -> float:
    """Return the length of blocks of data [s]: that of the settings, less for short logs."""
    total = sum(log.duration_s for log in logs)
    return min(settings.block_s, max(total / _BLOCKS, _PERIODS / cutoff_hz))


def certainties(
    motions: Sequence[Motion],
    friction_nm: Array,
    weighting: Weighting,
    spread: Callable[[Array], Array],
) -> list[Array]:
    """Return the certainty of each sample of low-passed torques (n, n_axes), lower where dry friction leaves them open.

    All samples of one standstill count as one residual. ``spread``: the largest torque that the low-pass leaves
    of an open torque.
    """
    # For white noise, with the weight at zero frequency.
    error_nm = 1 / (weighting.weight[:, 0] * np.sqrt(weighting.decimation))
    out = []
    for left_open, still in zip(
        open_torque_nm(motions, friction_nm), standing(motions), strict=True
    ):
        residuals = np.maximum(alike(still) / weighting.decimation, 1.0)
        out.append(certainty(np.sqrt(residuals) * spread(left_open), error_nm))
    return out


def _without_effects(robot: Robot) -> Callable[[Motion], Array]:
    """Return the prediction of a robot without its effects, as a function of the motion."""
    bare = robot.with_effects([])
    return lambda at: predicted_torque(bare, AS_GIVEN, at)


class InverseDynamicsFitter(ModelFitter):
    """Fits the error of the torque predicted from the measured motion."""

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
        self.certainty = list(certainty)
        self.motions = self._made_ready(motions)

    def _made_ready(self, motions: Sequence[Motion]) -> _core.MeasuredMotions:
        """Return motions in the form of the core."""
        records = [(*m, c) for m, c in zip(motions, self.certainty, strict=True)]
        weighting = self.weighting.core()
        return _core.MeasuredMotions(self.robot.core, records, weighting, block_s=self.block_s)

    def along(
        self, motions: Sequence[Motion], certainty: Sequence[Array], weighting: Weighting
    ) -> InverseDynamicsFitter:
        """Return the same fitter for other motions, with their certainty and weighting."""
        other = copy(self)
        other.certainty, other.weighting = list(certainty), weighting
        other.motions = other._made_ready(motions)
        return other

    def _keep(self, logs: Sequence[int]) -> None:
        self.certainty = [self.certainty[i] for i in logs]
        self.motions = self.motions.part(logs)

    def tempered(self, factor: Array) -> ModelFitter:
        """Return the same fitter with the errors of each axis multiplied by a factor (n_axes,)."""
        other = copy(self)
        other.certainty = [c * factor for c in self.certainty]
        other.motions = self.motions.with_certainty(other.certainty)
        return other

    def counted(self) -> Array:
        """Return the weight of each residual (n_residuals,): its squared certainty."""
        step = self.weighting.decimation
        kept = (factor[: len(factor) // step * step : step] for factor in self.certainty)
        return np.concatenate([row for log in kept for row in log.T**2])

    def tolerated(self, effect: Effect) -> float:
        """Return the size up to which an effect is ordinary scatter.

        For a lag, that is one sample: a drive holds its command for that long.
        """
        return self.robot.sample_time_s if is_lag(effect) else super().tolerated(effect)

    def takes_part(self, name: str) -> bool:
        """Whether an own parameter matters: stiffness and damping of gears do not, since the prediction is rigid."""
        quantity = name.rsplit(".", 1)[1]
        return quantity not in ("stiffness", "damping")

    def _specs(self, parameters: Sequence[Parameter], effects: Sequence[Effect]) -> list[Spec]:
        """Return the parameters for the core, with small steps for effects.

        The core gives no derivative for a parameter that changes a block too much within its natural step: a
        simulation is chaotic there. A predicted torque is never chaotic, but a natural step may be too large
        for a small motor.
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
    ) -> _core.FitResult | Diverged:
        """Run the fit in the core."""
        specs = self._specs(parameters, effects)
        return self.motions.fit(
            core_effects(effects), specs, options, warm=warm, cancel=self.cancel
        )

    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        _near: _core.Courses | None = None,
    ) -> _core.Linearization | Diverged:
        """Evaluate the model in the core."""
        specs = self._specs(parameters, effects)
        return self.motions.evaluate(
            core_effects(effects), specs, options, warm=warm, cancel=self.cancel
        )


def inverse_floor(
    logs: Sequence[Log], noise: InverseNoise, settings: Settings, silent: Sequence[int] = ()
) -> Floor:
    """Return the floor of a predicted torque, from its noise and the model error.

    ``silent``: axes (from 0) whose torque carries nothing; they have next to no weight.
    """
    rate = 1.0 / logs[0].sample_time_s
    variance = np.mean([np.var(x.torque_nm, axis=0) for x in logs], axis=0)
    # The variance of drawn noise scatters by a few per cent from log to log, and so does its estimate.
    noise_variance = np.mean([noise.error(x, i).var(axis=0) for i, x in enumerate(logs)], axis=0)
    total = np.maximum(noise_variance + settings.model_error**2 * variance, 1e-12 * variance)
    # Their errors are below rounding then, and so is their floor.
    total[list(silent)] = 1.0 / np.finfo(np.float64).eps ** 2
    filtering = noise.filtering
    decimation = max(1, int(rate / (2 * filtering.cutoff_hz)))
    frequency_hz = np.linspace(0.0, rate / (2 * decimation), _FREQUENCIES)
    weight = filtering.gain(frequency_hz) / np.sqrt(decimation * total)[:, None]
    weighting = Weighting(frequency_hz, weight, decimation)
    flat = np.ones((len(variance), 1))
    return Floor(
        noise.position_std_rad,
        np.zeros(1),
        noise_variance[:, None] * flat,
        weighting,
        noise_variance / total,
    )

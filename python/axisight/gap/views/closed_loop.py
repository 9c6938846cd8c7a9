"""Closed-loop comparison: simulator and machine under the same references and controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.fitting import FitOptions, Parameter, Weighting
from axisight.fitting.divergence import Diverged
from axisight.fitting.parameters import core_spec
from axisight.gap.controller.feedback import loop_responses, periodic_response
from axisight.gap.controller.loop_decay import FORGOTTEN, slowest_decay_1_s
from axisight.gap.controller.other_controllers import check_gains, other_controllers
from axisight.gap.controller.speed_loop import with_integral
from axisight.gap.controller.torque_limits import missing, reported, torque_limits
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.drive_lags import is_lag
from axisight.gap.search.state import SearchState
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.signals.lowpass_cutoff import highest_cutoff_hz
from axisight.gap.signals.motion import Motion, motion
from axisight.gap.signals.standstill import certainty, open_errors, sure_friction_nm
from axisight.gap.simulator.closed_loop_runs import noise_torques, simulated_run, simulated_torques
from axisight.gap.simulator.own_parameters import with_values
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.tracking_weights import passed, shortest, tracking_floor
from axisight.gap.views.view import View
from axisight.logs import Log, differentiate
from axisight.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


# Speed of the loop that keeps a simulator on a log, relative to the machine's loop. In a linear model any loop
# will do, since the weights undo its response. With lost motion or stiction a tight loop chatters: the losses
# of two plays 0.2 % apart differ by a third, while a loop of a third of the speed is almost smooth. In a still
# slower loop the simulator strays from the log by more than the length of a ripple.
TRACKING_SPEED = 1 / 3

# Position [rad] and torque [Nm] of a log (lead + n, n_axes); its certainty (n, n_axes); the joint angles where
# its simulation starts [rad], (n_axes,), None at the operating point; and the number of samples in its run-up.
Record = tuple[Array, Array, Array, Array | None, int]


class ClosedLoopView(View):
    """Compares the torques of simulator and machine under the same references."""

    fitter: ClosedLoopFitter

    def __init__(self, robot: Robot, logs: list[Log], settings: Settings) -> None:
        slow = with_integral(robot).with_controller_speed(TRACKING_SPEED)
        # The torque that keeps a simulator on a log acts on its motors without a lag.
        self.tracking = slow.with_effects([e for e in robot.effects if not is_lag(e)])
        limits = torque_limits(robot, logs)
        others = other_controllers(robot, logs)
        check_gains(others)
        self._noisy = robot.with_effects([*robot.effects, *(x.effect for x in others)])
        self._step_rad = encoder_steps(robot, logs)
        floor, self._weights = tracking_floor(self.tracking, self._noisy, logs, settings)
        # A torque that is reported after the limit is the motor's torque: limiting it again would be wrong.
        after = {limit.effect.label for limit in limits}
        own = [e for e in robot.effects if e.label not in after]
        kept_on_log = slow.with_effects(own)
        data = records_of(self.tracking, logs, floor.weighting)
        fitter = ClosedLoopFitter(
            kept_on_log, data, floor.weighting, settings.tolerances_of(robot), settings.block_s
        )
        super().__init__("closed_loop", robot, logs, settings, fitter, floor)
        self.limits = limits
        self.shown = (*missing(limits, robot), *others)
        self.not_offered = frozenset(after)
        self._loops: dict[tuple[int, float], tuple[Complex, Complex]] = {}

    def response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        """Return the response (n_freq,) of the feedback that keeps the simulator on the log to an effect.

        An error of the sensor passes the controller and the sensitivity, ``F (I + G F)^-1``. A torque on the
        motor passes the machine first. An error of the gear acts as such a torque.
        """
        loops = self._loop(frequency_hz)
        return periodic_response(self.tracking, effect, axis, loops, frequency_hz)

    def _loop(self, frequency_hz: Array) -> tuple[Complex, Complex]:
        """Return the responses to errors of sensors and to torques (n_freq, n_axes, n_axes)."""
        key = (len(frequency_hz), float(frequency_hz[-1]))
        if key not in self._loops:
            self._loops[key] = loop_responses(self.tracking, frequency_hz)
        return self._loops[key]

    def measured(self, log: Log) -> Array:
        """Return the logged torque (n, n_axes) [Nm]."""
        return log.torque_nm

    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the simulated torque of each log (n, n_axes) [Nm]."""
        out = simulated_torques(self.robot, variant, logs, threads=self.settings.threads)
        return [self._reported(torque, variant) for torque in out]

    def run(self, variant: Variant, log: Log) -> tuple[Array, Array]:
        """Return torque [Nm] and position [rad] of the simulator on one log, (n, n_axes) each."""
        torque, position = simulated_run(self.robot, variant, log)
        return self._reported(torque, variant), position

    def _reported(self, torque_nm: Array, variant: Variant) -> Array:
        # An effect of the variant replaces the simulator's own one.
        effects = {e.label: e for e in (*self.robot.effects, *variant.effects)}.values()
        return reported(torque_nm, self.limits, effects)

    def weighting_with(self, torque_nm: Array) -> Weighting:
        """Return the weighting that results if a log with this torque (n, n_axes) [Nm] is added."""
        torques = [*(log.torque_nm for log in self.logs), torque_nm]
        weight = self._weights.of(torques, shortest(self.logs))
        return replace(self.floor.weighting, weight=weight)

    def followed(self, found: SearchState, logs: Sequence[Log]) -> float:
        """Return the share of the explainable error that the causes remove in a simulator kept on ``logs``."""
        there = self.fitter.along(records_of(self.tracking, logs, self.floor.weighting))
        before = there.loss([], found.baseline)
        left = there.loss(found.model.free, found.model)
        if isinstance(before, Diverged) or isinstance(left, Diverged):
            # A simulator that diverges cannot be kept on these logs.
            return 0.0
        noise = float(there.counted_by_axis() @ self.floor.expected)
        return (before - left) / max(before - noise, 1e-300)

    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the torque (n, n_axes) [Nm] that sensor noise causes through the loop, for each log."""
        machine = with_values(self._noisy, variant.robot_values)
        effects = {e.label: e for e in (*machine.effects, *variant.effects)}.values()
        # Encoder steps are not white noise: noise_torques simulates them along the motion.
        stated = self.robot.position_noise_std
        return noise_torques(
            machine.with_effects(list(effects)),
            logs,
            np.where(self._step_rad > 0, stated, self.floor.position_std_rad),
            self.settings.seed,
            first_run,
            step_rad=self._step_rad,
            threads=self.settings.threads,
        )

    def sensor_noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the torque (n, n_axes) [Nm] that the stated sensor's noise causes through the loop, for each log."""
        std = np.full(self.robot.n_axes, self.robot.position_noise_std)
        seed, threads = self.settings.seed, self.settings.threads
        return noise_torques(self._noisy, logs, std, seed, first_run, threads=threads)


def _contiguous(x: Array) -> Array:
    return np.ascontiguousarray(x, dtype=np.float64)


# Cutoff for speeds [Hz], below which sensor noise does not count as motion.
_SPEED_HZ = 20.0
# Cutoff for the torque of rigid bodies [Hz], below which most arms are rigid.
_RIGID_HZ = 5.0


def certainties(tracking: Robot, logs: Sequence[Log], weighting: Weighting) -> list[Array]:
    """Return the certainty of each sample of logs (n, n_axes): how closely a simulator must follow it, from 0 to 1.

    It is lower where a motor stands or turns round: laws of dry friction differ there.
    """
    step_s = logs[0].sample_time_s
    highest = highest_cutoff_hz(step_s)
    cutoff = min(_SPEED_HZ, highest)
    speeds = [differentiate(log.position_rad, step_s, cutoff)[0] for log in logs]
    slow = [motion(log, min(_RIGID_HZ, highest)) for log in logs]

    def rigid(at: Motion) -> Array:
        return predicted_torque(tracking.with_effects([]), AS_GIVEN, at)

    friction = sure_friction_nm(slow, rigid)
    weight = weighting.weight * passed(tracking, weighting.frequency_hz)
    weighting = replace(weighting, weight=weight)
    out = []
    for speed in speeds:
        left_open = open_errors(speed, friction, weighting, step_s)
        factor = np.repeat(certainty(left_open, np.ones(1)), weighting.decimation, axis=0)
        out.append(_contiguous(np.pad(factor, ((0, len(speed) - len(factor)), (0, 0)), "edge")))
    return out


# Start of a log with a run-up that does not count [s]. The weighting mirrors the error at the start. A log from
# rest has no error there; a log in motion has noise, which would count twice.
_MIRRORED_S = 0.1


def records_of(tracking: Robot, logs: Sequence[Log], weighting: Weighting) -> list[Record]:
    """Return the records of logs with which a simulator kept on them is compared."""
    certain = certainties(tracking, logs, weighting)
    stepped = encoder_steps(tracking, logs) > 0
    forgets_s = _memory_s(tracking) if stepped.any() else 0.0
    out = []
    for log, c in zip(logs, certain, strict=True):
        if log.run_up is not None:
            c[: round(_MIRRORED_S / log.sample_time_s)] = 0.0
        c[np.ix_(_at_edges(log, forgets_s), stepped)] = 0.0
        position, torque = (_contiguous(log.led(x)) for x in ("position_rad", "torque_nm"))
        out.append((position, torque, c, log.start_rad, log.lead))
    return out


# Longest start or end of a log that does not count, as a share of the log.
_MOST_FORGOTTEN = 0.25
# End of a log that does not count if positions come in steps [s]. The weighting mirrors the error at the end
# too, and the error of a position there is at least half a step.
_END_S = 0.5


def _at_edges(log: Log, forgets_s: float) -> NDArray[np.bool_]:
    """Mark the samples (n,) at the start and end of a log that encoder steps make useless."""
    first_s = min(forgets_s, _MOST_FORGOTTEN * log.duration_s)
    time_s = np.arange(log.n_samples) * log.sample_time_s
    last_s = time_s[-1] - min(_END_S, _MOST_FORGOTTEN * log.duration_s)
    return np.asarray((time_s < first_s) | (time_s > last_s))


def _memory_s(tracking: Robot) -> float:
    """Return how long [s] a loop remembers its initial state.

    A motor that is held between two encoder steps moves between them before a log starts. Its speed at the
    start is unknown.
    """
    decay_1_s = slowest_decay_1_s(tracking, np.array(tracking.operating_point))
    return float(-np.log(FORGOTTEN) / decay_1_s) if decay_1_s > 0 else np.inf


# Shortest start of a log that is fitted alone [s].
_LEAST_S = 4.0


class ClosedLoopFitter(ModelFitter):
    """Fits the torque that feedback must add to the logged torque to keep the simulator on the log.

    In a linear loop this is the torque error of a simulation driven by the references. In a nonlinear one the
    feedback also keeps the simulator in phase with the log; else lost motion and stiction have no smooth error
    to fit. The controller is that of ``robot``, which may differ from the machine's. ``records``: one `Record`
    for each log.
    """

    driven_by: ClassVar[Literal["tracking", "reference"]] = "tracking"
    compared: ClassVar[Literal["torque", "position"]] = "torque"

    def __init__(
        self,
        robot: Robot,
        records: list[Record],
        weighting: Weighting,
        tolerances: Mapping[str, float],
        block_s: float,
    ) -> None:
        super().__init__(robot, weighting, tolerances, block_s)
        self.records = records
        self.simulated = self._made_ready()

    def _made_ready(self) -> _core.SimulatedLogs:
        """Return the records in the form of the core."""
        return _core.SimulatedLogs(
            self.robot.core,
            self.records,
            self.weighting.core(),
            input=self.driven_by,
            output=self.compared,
            block_s=self.block_s,
        )

    def _keep(self, logs: Sequence[int]) -> None:
        self.records = [self.records[i] for i in logs]
        self.simulated = self.simulated.part(logs)

    def counted(self) -> Array:
        """Return the weight of each residual (n_residuals,): its squared certainty."""
        return np.concatenate([row for log in self._counted_by_log() for row in log.T])

    def counted_by_axis(self) -> Array:
        """Return the sum of these weights by axis (n_axes,)."""
        return np.asarray(np.sum([log.sum(axis=0) for log in self._counted_by_log()], axis=0))

    def _counted_by_log(self) -> list[Array]:
        step = self.weighting.decimation
        return [c[: len(c) // step * step : step] ** 2 for _, _, c, _, _ in self.records]

    def along(self, records: list[Record], weighting: Weighting | None = None) -> Self:
        """Return the same fitter for other ``records``, with another ``weighting`` if given."""
        other = copy(self)
        other.records = records
        other.weighting = self.weighting if weighting is None else weighting
        other.simulated = other._made_ready()
        return other

    def beginnings(self) -> ModelFitter | None:
        """Return the same fitter for the first halves of the logs; None if one is shorter than 4 s."""
        halves = [len(c) // 2 for _, _, c, _, _ in self.records]
        if min(halves) < _LEAST_S / self.robot.sample_time_s:
            return None
        other = copy(self)
        other.records = [
            (p[: lead + n], t[: lead + n], c[:n], start, lead)
            for n, (p, t, c, start, lead) in zip(halves, self.records, strict=True)
        ]
        other.simulated = self.simulated.first(halves)
        return other

    def solve(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        near: _core.Courses | None = None,
    ) -> _core.FitResult | Diverged:
        """Run the fit in the core."""
        specs = [core_spec(p, effects) for p in parameters]
        return self.simulated.fit(
            core_effects(effects), specs, options, warm=warm, courses=near, cancel=self.cancel
        )

    def run(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter]
    ) -> _core.Courses | Diverged:
        """Run the model in the core."""
        specs = [core_spec(p, effects) for p in parameters]
        return self.simulated.run(core_effects(effects), specs, cancel=self.cancel)

    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        near: _core.Courses | None = None,
    ) -> _core.Linearization | Diverged:
        """Evaluate the model in the core."""
        specs = [core_spec(p, effects) for p in parameters]
        return self.simulated.evaluate(
            core_effects(effects), specs, options, warm=warm, courses=near, cancel=self.cancel
        )

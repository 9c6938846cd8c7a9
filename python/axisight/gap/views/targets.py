"""Comparison of positions under the same targets, for logs without torque.

An error of position is shown as the torque that the controller's gains make of it. This one number covers the
whole band, and compares with the torques of causes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.fitting import Weighting
from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.controller.feedback import (
    controller_response,
    inertia_of_motors,
    loop_responses,
    periodic_response,
    told_gain,
)
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.prepare.position_targets import Commanded
from axisight.gap.search.state import SearchState
from axisight.gap.signals.noise import Floor, position_noise_std, torque_density
from axisight.gap.simulator.closed_loop_runs import simulated_positions, simulated_runs
from axisight.gap.simulator.own_parameters import uncertain_gains
from axisight.gap.views.closed_loop import ClosedLoopFitter, Record
from axisight.gap.views.tracking_weights import shortest
from axisight.gap.views.view import View
from axisight.logs import Log, lowpass
from axisight.robot import Robot
from axisight.simulation import white_noise

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Cutoff of the comparison, as a share of the logs' rate. Below it, a spline between samples follows the motion.
# The speed gain amplifies fast noise, which would dominate above.
_BAND = 0.2
# Number of re-fits of uncertain gains, each with the motion between samples of the last one.
_ROUNDS = 2
# Largest number of samples in a segment of a spectral density, at the logs' rate.
_SEGMENT = 256
# Lowest frequency that is compared, in periods of the longest log; slower errors count as constant.
_WHOLE_LOG = 0.5


class TargetsView(View):
    """Compares the positions of simulator and machine, both driven by the same targets."""

    by_targets = True
    compared = "positions"
    fitter: TargetsFitter

    def __init__(self, commanded: Commanded, logs: list[Log], settings: Settings) -> None:
        self._commanded = commanded
        robot = commanded.robot
        std = np.maximum(position_noise_std(commanded.as_logged()), robot.position_noise_std)
        self._std_rad = std
        floor = self._floor(robot, logs, settings)
        self._like = AS_GIVEN
        records = _records(logs, self._between_samples(logs, settings))
        fitter = TargetsFitter(
            robot, records, floor.weighting, _tolerances(robot, settings), settings.block_s
        )
        for _ in range(_ROUNDS if fitter.gains else 0):
            # The motion between samples depends mostly on the gains.
            self._like = Variant(must_hold(fitter.fit([])).robot_values)
            fitter = fitter.along(_records(logs, self._between_samples(logs, settings)))
        super().__init__("closed_loop", robot, logs, settings, fitter, floor)

    def _between_samples(self, logs: Sequence[Log], settings: Settings) -> list[Array]:
        """Return the motion between the samples of logs (n, n_axes) [rad], from the simulator.

        The simulator is as given, with the fitted values of uncertain gains. Targets are steps, and a joint
        responds to each within a sample. A spline through positions that are logged just before the next step
        misses this, and lags the motion.
        """
        of, step = self._commanded, self._commanded.step
        positions = simulated_positions(of.robot, self._like, logs, threads=settings.threads)
        return [x - of.fine(x[::step]) for x in positions]

    def removed_there(self, found: SearchState, logs: Sequence[Log]) -> float | None:
        """Return the share of the weighted residuals above noise on ``logs`` that the causes remove.

        None if a simulation diverges.
        """
        there = self.fitter.along(_records(logs, self._between_samples(logs, self.settings)))
        before = there.loss([], found.baseline)
        left = there.loss(found.model.free, found.model)
        if isinstance(before, Diverged) or isinstance(left, Diverged):
            return None
        above = before - float(there.counted_by_axis() @ self.floor.expected)
        return (before - left) / above if above > 0 else 0.0

    def _floor(self, robot: Robot, logs: list[Log], settings: Settings) -> Floor:
        """Return the floor: sensor noise through the controller's gains, and the model error.

        Densities are at the logs' rate; below half of it, those at the controller's rate are ``step`` times as
        large. Constant errors get no weight, since the start position is only as well known as the other
        samples.
        """
        step = self._commanded.step
        rate = 1.0 / (robot.sample_time_s * step)
        slow = [x.torque_nm[::step] for x in logs]
        like = shortest(logs)
        segment = max(8, min(_SEGMENT, like.n_samples // step // 2))
        found = [torque_density(x, rate, segment) for x in slow]
        f, torque = found[0][0], np.asarray(np.mean([density for _, density in found], axis=0))
        torque[:, 0] = torque[:, 1]
        gain = self._gains(f)
        noise = gain**2 * (self._std_rad**2)[:, None]
        total = noise + settings.model_error**2 * torque
        weight = 1.0 / np.sqrt(np.maximum(total, 1e-12 * torque.max()))
        band = min(settings.bandwidth_hz, _BAND * rate)
        decimation = max(1, int(rate * step / (2 * band)))
        passed = f <= rate * step / (2 * decimation)
        expected = np.mean((noise * weight**2)[:, passed], axis=1)
        table = gain * weight / np.sqrt(step)
        slowest = _WHOLE_LOG / max(log.duration_s for log in logs)
        weighting = Weighting(
            np.array([0.0, slowest, *f[1:]]),
            np.column_stack([np.zeros(len(table)), table[:, 0], table[:, 1:]]),
            decimation,
        )
        return Floor(self._std_rad, f, noise, weighting, expected)

    def _gains(self, frequency_hz: Array) -> Array:
        """Return the gain of the controller for an error of position (n_axes, n_freq) [Nm/rad]."""
        f = np.maximum(frequency_hz, frequency_hz[1])
        return told_gain(self._commanded.robot, f)

    def weighting_with(self, torque_nm: Array) -> Weighting:
        """Return the weighting that results if a log with these commands (n, n_axes) [Nm] is added."""
        time = self.robot.sample_time_s
        added = Log(
            name="added",
            source=self.logs[0].source,
            sample_time_s=time,
            time_s=np.asarray(time * np.arange(len(torque_nm)), np.float64),
            torque_nm=torque_nm,
            position_rad=np.zeros_like(torque_nm),
        )
        return self._floor(self.robot, [*self.logs, added], self.settings).weighting

    def along_targets(self, log: Log) -> Log:
        """Return a log of targets at the logged rate, from rest, with the references of the controller at its rate."""
        return self._commanded.along_targets(log)

    def simulated(self, variant: Variant, logs: Sequence[Log]) -> tuple[list[Array], list[Array]]:
        """Return commands [Nm] and positions [rad] of a simulator on logs (n, n_axes), at the controller's rate."""
        return simulated_runs(self.robot, variant, logs, threads=self.settings.threads)

    def response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        """Return the response of the loop's position to an effect (n_freq,)."""
        f = np.maximum(frequency_hz, frequency_hz[1])
        found = periodic_response(self.robot, effect, axis, loop_responses(self.robot, f), f)
        return np.asarray(found / controller_response(self.robot, f)[:, axis, axis])

    def measured(self, log: Log) -> Array:
        """Return the controller's command along the measured positions (n, n_axes) [Nm]."""
        return log.torque_nm

    @property
    def step(self) -> int:
        """Samples of the controller per sample of the logs."""
        return self._commanded.step

    @property
    def logged_s(self) -> float:
        """Time between samples of the logs [s]."""
        return self.robot.sample_time_s * self.step

    @property
    def lowpass_hz(self) -> float:
        """Cutoff [Hz] of the low-pass for errors of position."""
        return _BAND / self.logged_s

    def positions(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the motor positions of a simulator on each log (n, n_axes) [rad], at the controller's rate."""
        return simulated_positions(self.robot, variant, logs, threads=self.settings.threads)

    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return measured commands plus the simulator's position error as torque (n, n_axes) [Nm], for each log."""
        return [
            log.torque_nm + self._as_torque(self.off_by(position, log))
            for position, log in zip(self.positions(variant, logs), logs, strict=True)
        ]

    def run(self, variant: Variant, log: Log) -> tuple[Array, Array]:
        """Return torque [Nm] as in `torques` and simulated position [rad] on one log, (n, n_axes) each."""
        (position,) = simulated_positions(self.robot, variant, [log])
        return log.torque_nm + self._as_torque(self.off_by(position, log)), position

    def off_by(self, position_rad: Array, log: Log) -> Array:
        """Return the compared part of a position error, at the samples of a log (n, n_axes) [rad].

        Low-passed and without its mean: a run starts at the log's first position, which is as noisy as the
        others.
        """
        logged = (position_rad - log.position_rad)[:: self.step]
        return self.passed(logged - logged.mean(axis=0))

    def passed(self, logged: Array) -> Array:
        """Return a signal at the logs' rate (n, n_axes), low-passed for the comparison."""
        return lowpass(np.ascontiguousarray(logged), self.logged_s, _BAND / self.logged_s)

    def _as_torque(self, passed_rad: Array) -> Array:
        """Return an error at the logs' rate (n, n_axes) [rad] as torque [Nm], at the controller's rate."""
        return self._commanded.told_as(self._commanded.fine(passed_rad))

    def position_noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the compared part of the sensor noise at the samples of each log (n, n_axes) [rad]."""
        noise = [
            white_noise(self.settings.seed, run, len(log.time_s[:: self.step]), self.robot.n_axes)
            for run, log in enumerate(logs, start=first_run)
        ]
        return [self.passed(x * self._std_rad) for x in noise]

    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the sensor noise as torque (n, n_axes) [Nm], for each log."""
        del variant
        return [self._as_torque(x) for x in self.position_noises(logs, first_run)]

    def remarks(self) -> tuple[str, ...]:
        """Return sentences about what is compared."""
        said = what_is_compared(1.0 / self.logged_s)
        short = ", ".join(map(str, self._commanded.short_of_inertia))
        if not short:
            return (said,)
        return (
            said,
            f"On axis {short} the steps of the simulator need more inertia than the motor has (explicit speed "
            f"gains). The motor counts as massless there, and the simulator is reproduced less well.",
        )


def what_is_compared(rate_hz: float) -> str:
    """Return a sentence about what is compared for logs of a rate [Hz]."""
    return (
        f"No torque was logged: positions are compared under the same targets, up to {_BAND * rate_hz:.3g} Hz. "
        "Their errors are given as the torque that the stated gains command."
    )


# Error of the time at which a target takes effect, as a share of the controller's sample. Simulators and drives
# differ by half of their own steps, which are shorter than that sample.
_WHEN = 0.125


def _tolerances(robot: Robot, settings: Settings) -> dict[str, float]:
    """Return the tolerances of the simulator's parameters under targets.

    A delay ``t`` of the targets acts as friction ``kp t`` on the motor. So viscous friction has at least that
    tolerance.
    """
    out = dict(settings.tolerances_of(robot))
    values, late_s = robot.parameters(), _WHEN * robot.sample_time_s
    for axis, gain in zip(robot.axis_numbers(), _stiffness(robot), strict=True):
        name = robot.axis_parameter(axis, "viscous_friction")
        if name is not None and values[name] > 0:
            stated = out.get(name, out["viscous_friction"])
            out[name] = float(np.hypot(stated, gain * late_s / values[name]))
    return out


def _stiffness(robot: Robot) -> Array:
    """Return the torque of each motor for its own error of angle (n_axes,) [Nm/rad], at the operating point."""
    gains = robot.controller_gains
    gain = np.asarray(gains["kp"])
    if "kv" in gains:
        return np.asarray(gain * gains["kv"])
    return gain * np.diag(inertia_of_motors(robot)) if robot.computed_torque else gain


def _records(logs: Sequence[Log], between: Sequence[Array]) -> list[Record]:
    """Return the record of each log: references, positions, certainty, start angles and length of the run-up.

    ``between`` (n, n_axes) [rad]: motion between the logged samples, added to the positions.
    """
    out = []
    for log, off in zip(logs, between, strict=True):
        before = np.zeros((log.lead, log.n_axes))
        reference, position = (
            np.ascontiguousarray(x, np.float64)
            for x in (
                log.led("velocity_ref_rad_s"),
                log.led("position_rad") + np.concatenate([before, off]),
            )
        )
        out.append((reference, position, np.ones_like(off), log.start_rad, log.lead))
    return out


class TargetsFitter(ClosedLoopFitter):
    """Fits the difference between positions of a simulator driven by targets and measured ones."""

    driven_by = "reference"
    compared = "position"

    def __init__(
        self,
        robot: Robot,
        records: list[Record],
        weighting: Weighting,
        tolerances: Mapping[str, float],
        block_s: float,
    ) -> None:
        super().__init__(robot, records, weighting, tolerances, block_s)
        gains = uncertain_gains(robot, tolerances)
        self.own += gains
        self.gains = frozenset(p.name for p in gains)

    def bends(self, name: str) -> bool:
        """Whether a parameter changes the sensitivities of others by far more than masses and stiffness do: a gain."""
        return name in self.gains

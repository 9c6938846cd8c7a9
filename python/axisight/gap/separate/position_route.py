"""Experiments of positions over time: for inverse dynamics, and for controllers of position targets."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.separate.courses import (
    Room,
    SumOfSines,
    centred,
    courses,
    improved,
    length_s,
    whole_travel,
)
from axisight.gap.separate.limits import ExperimentLimits, Range, travel_of, within_limits
from axisight.gap.separate.route import Route, Runs
from axisight.gap.separate.waves import Motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.gap.views.targets import TargetsView
from axisight.gap.views.view import View
from axisight.logs import Log, differentiate

Array = NDArray[np.float64]

# Smallest speed and acceleration of a motor as a share of the largest of all, so that a motor at rest may move.
_LEAST = 1e-6


class PositionRoute(Route):
    """Positions over time, from the middle of the allowed travel."""

    usual: ClassVar[str] = "The motion of the first log"
    # A log may begin and end in motion, which no controller can be told.
    offers_usual = False
    variants: ClassVar[int]
    """Variants of a motion in each round of its improvement."""

    def __init__(
        self,
        view: View,
        step_s: float,
        widest_hz: float,
        seen: Range,
        within: ExperimentLimits | None,
    ) -> None:
        self.view, self.step_s = view, step_s
        start = view.logs[0].position_rad[0]
        allowed = within_limits(seen, within, view.robot, start)
        self.limits, middle = centred(allowed)
        self.start_rad = start + middle
        seconds = length_s(max(log.duration_s for log in view.logs))
        self.room = Room(self.limits, step_s, seconds, widest_hz)

    def usual_motions(self) -> list[Motion]:
        """Return the motion of the first log."""
        course = self._course_of(self.view.logs[0])
        reference = np.diff(course, axis=0) / self.step_s
        return [Motion(self.usual, self.room.every, reference, course[0])]

    @abstractmethod
    def _course_of(self, log: Log) -> Array:
        """Return the positions of a log without noise (n, n_axes) [rad], at the rate of motions."""

    def motions(self, axes: Sequence[int]) -> list[Motion]:
        """Return the motions to try on ``axes`` (from 1), each alone and all together."""
        return list(courses(self.room, axes, self.view.settings.seed))

    def rich_motions(self) -> list[Motion]:
        """Return sums of sines of all axes."""
        tried = self.motions(self.room.every)
        return [m for m in tried if isinstance(m, SumOfSines) and m.axes == self.room.every]

    def slow_motion(self) -> Motion:
        """Return slow triangles of all axes."""
        return whole_travel(self.room)

    def improved(self, best: Motion, round_of: int) -> list[Motion]:
        """Return sums of sines like the best one, with changed sizes and phases."""
        rng = np.random.default_rng([self.view.settings.seed, 1 + round_of])
        return improved(best, self.room, self.variants, rng)

    def _positions(self, motion: Motion) -> Array:
        """Return the motors along a motion (n, n_axes) [rad]."""
        reference = motion.reference
        return self.begins_at(motion) + self.step_s * (np.cumsum(reference, axis=0) - reference)

    def _log(self, motion: Motion) -> Log:
        """Return a log of motors that follow a motion, without torque."""
        position = self._positions(motion)
        return Log(
            name=motion.words,
            source=self.view.logs[0].source,
            sample_time_s=self.step_s,
            time_s=np.asarray(self.step_s * np.arange(len(position)), np.float64),
            position_rad=position,
            torque_nm=np.zeros_like(position),
            velocity_rad_s=motion.reference,
            position_ref_rad=position,
            velocity_ref_rad_s=None if self.view.robot.computed_torque else motion.reference,
        )


class InverseRoute(PositionRoute):
    """Positions that the motors follow; their torque is predicted."""

    hypotheses = (3,)
    variants = 6
    view: InverseView

    def __init__(self, view: InverseView, within: ExperimentLimits | None = None) -> None:
        logs, step_s = view.logs, view.logs[0].sample_time_s
        moved = [view.filtering(log) for log in logs]
        seen = _seen_range(
            logs, [m[1] for m in moved], [m[2] for m in moved], [m[3] for m in moved]
        )
        # A torque that carries nothing says nothing about what the motor may do.
        seen.torque[list(view.silent)] = np.inf
        super().__init__(view, step_s, view.filtering.cutoff_hz, seen, within)

    def _course_of(self, log: Log) -> Array:
        return self.view.filtering(log)[0]

    def runs(self, machine: FittedModel, tried: Sequence[Motion]) -> Runs:
        """Return the torques of a machine along motions that its motors follow."""
        variant = Variant(machine.robot_values, machine.effects)
        records, torques, possible = [], [], []
        for motion in tried:
            log = self._log(motion)
            at = self.view.filtering(log)
            torque = predicted_torque(self.view.robot, variant, at)
            records.append(((*at[:3], torque), self.view.whole(log)))
            torques.append(torque)
            begin = self.begins_at(motion)
            possible.append(self.limits.allows(self.view.robot, begin, at[0] - begin, torque))
        return Runs(records, torques, np.array(possible, bool))

    def fitter(self, runs: Runs, which: Sequence[int], *, alone: bool) -> ModelFitter:
        """Return the fitter of inverse dynamics for some of the runs."""
        own = self.view.weighting_with(runs.torques[which[0]]) if alone else None
        motions, whole = zip(*(runs.records[k] for k in which), strict=True)
        return self.view.fitter_along(motions, whole, own)


class TargetRoute(PositionRoute):
    """Position targets; each machine is simulated in its loop, and positions are compared."""

    hypotheses = (2,)
    variants = 4
    view: TargetsView

    def __init__(self, view: TargetsView, within: ExperimentLimits | None = None) -> None:
        step_s = view.logged_s
        moved = [
            differentiate(log.position_rad[:: view.step], step_s, view.lowpass_hz)
            for log in view.logs
        ]
        # Commands of the simulator, as those of its runs below.
        torques, _ = view.simulated(AS_GIVEN, view.logs)
        seen = _seen_range(view.logs, [m[0] for m in moved], [m[1] for m in moved], torques)
        super().__init__(view, step_s, view.lowpass_hz, seen, within)

    def _course_of(self, log: Log) -> Array:
        assert log.position_ref_rad is not None  # the view needs targets
        return log.position_ref_rad[:: self.view.step]

    def runs(self, machine: FittedModel, tried: Sequence[Motion]) -> Runs:
        """Return runs of a machine under targets."""
        variant = Variant(machine.robot_values, machine.effects)
        logs = [self.view.along_targets(self._log(motion)) for motion in tried]
        torques, positions = self.view.simulated(variant, logs)
        records = [
            (log.velocity_ref_rad_s, position, np.ones_like(position), log.start_rad, 0)
            for log, position in zip(logs, positions, strict=True)
        ]
        possible = [
            self.limits.allows(self.view.robot, self.begins_at(m), q - q[0], u)
            for m, q, u in zip(tried, positions, torques, strict=True)
        ]
        return Runs(records, torques, np.array(possible, bool))

    def fitter(self, runs: Runs, which: Sequence[int], *, alone: bool) -> ModelFitter:
        """Return the fitter of positions for some of the runs."""
        own = self.view.weighting_with(runs.torques[which[0]]) if alone else None
        return self.view.fitter.along([runs.records[k] for k in which], own)


def _seen_range(
    logs: Sequence[Log],
    speeds: Sequence[Array],
    accelerations: Sequence[Array],
    torques: Sequence[Array],
) -> Range:
    """Return the range of the motors in logs, from the start of the first one."""
    speed, acceleration, torque = (
        np.max([np.abs(x).max(axis=0) for x in each], axis=0)
        for each in (speeds, accelerations, torques)
    )
    back, forth = travel_of(logs, logs[0].position_rad[0])
    return Range(
        np.maximum(speed, _LEAST * speed.max()),
        back,
        forth,
        torque,
        np.maximum(acceleration, _LEAST * acceleration.max()),
    )

"""Experiments for logs in closed loop under velocity references: each machine is simulated in its loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.separate.courses import Room, whole_travel
from axisight.gap.separate.limits import ExperimentLimits, Range, within_limits
from axisight.gap.separate.route import Route, Runs
from axisight.gap.separate.waves import SECONDS, Motion, motions, seen_range, standard
from axisight.gap.simulator.own_parameters import with_values
from axisight.gap.views.closed_loop import ClosedLoopFitter, ClosedLoopView, Record
from axisight.simulation import simulate_batch

Array = NDArray[np.float64]


class LoopRoute(Route):
    """Velocity references, from the pose where the first log begins."""

    usual = "A multisine on all axes"
    offers_usual = True
    hypotheses = (2, 3)
    view: ClosedLoopView

    def __init__(self, view: ClosedLoopView, within: ExperimentLimits | None = None) -> None:
        robot = view.robot
        self.view, self.step_s = view, robot.sample_time_s
        self.start_rad = view.logs[0].position_rad[0]
        self.limits: Range = within_limits(seen_range(view.logs), within, robot, self.start_rad)
        self._widest_hz = 0.8 * min(view.settings.bandwidth_hz, 0.5 / robot.sample_time_s)
        self._seed = view.settings.seed

    def usual_motions(self) -> list[Motion]:
        """Return a multisine on all axes at several levels."""
        return standard(self.limits, self.step_s, self._seed)

    def motions(self, axes: Sequence[int]) -> list[Motion]:
        """Return the motions to try on ``axes`` (from 1), each alone and all together."""
        return list(motions(self.limits, axes, self.step_s, self._widest_hz, self._seed))

    def rich_motions(self) -> list[Motion]:
        """Return the motions of all axes."""
        every = tuple(self.view.robot.axis_numbers())
        return [m for m in self.motions(every) if m.axes == every]

    def slow_motion(self) -> Motion:
        """Return slow triangles of all axes."""
        # Triangles begin in the middle of the travel: to either side is as far as the shorter side allows.
        half = np.minimum(self.limits.forth, -self.limits.back)
        room = Room(replace(self.limits, back=-half, forth=half), self.step_s, SECONDS, 1.0)
        return whole_travel(room)

    def runs(self, machine: FittedModel, tried: Sequence[Motion]) -> Runs:
        """Return runs of a machine in its loop."""
        robot = with_values(self.view.robot, machine.robot_values)
        out = simulate_batch(
            robot,
            np.stack([m.reference for m in tried]),
            effects=list(machine.effects),
            method="rk4",
            threads=self.view.settings.threads,
        )
        angle, torque = out["position_rad"].values, out["torque_cmd_nm"].values
        records: list[Record] = [
            (np.ascontiguousarray(q), np.ascontiguousarray(u), np.ones_like(u), None, 0)
            for q, u in zip(angle, torque, strict=True)
        ]
        possible = [
            self.limits.allows(robot, self.start_rad, q - q[0], u) and self._slow_enough(q)
            for q, u in zip(angle, torque, strict=True)
        ]
        return Runs(records, list(torque), np.array(possible, bool))

    def _slow_enough(self, motor_rad: Array) -> bool:
        """Return whether the accelerations of a run stay within their limits."""
        found = np.abs(np.diff(motor_rad, n=2, axis=0)).max(axis=0) / self.step_s**2
        return bool(np.all(found <= self.limits.acceleration))

    def fitter(self, runs: Runs, which: Sequence[int], *, alone: bool) -> ClosedLoopFitter:
        """Return the fitter of the closed loop for some of the runs."""
        own = self.view.weighting_with(runs.torques[which[0]]) if alone else None
        return self.view.fitter.along([runs.records[k] for k in which], own)

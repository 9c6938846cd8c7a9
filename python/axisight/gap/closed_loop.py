"""Closed-loop mode: simulator and machine under the same references and controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import FitOptions, Parameter, Weighting
from axisight.fitting.simulation_error import core_spec
from axisight.gap.model import ModelFitter
from axisight.gap.noise import Floor, position_noise_std, segment_of, torque_density
from axisight.gap.settings import Settings
from axisight.gap.torques import Variant
from axisight.gap.view import View
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate, white_noise

Array = NDArray[np.float64]


class ClosedLoopView(View):
    """Simulator and machine driven by the same references."""

    def __init__(self, robot: Robot, logs: list[Log], settings: Settings) -> None:
        floor = closed_loop_floor(robot, logs, settings)
        data = [(_contiguous(log.position_rad), _contiguous(log.torque_nm)) for log in logs]
        fitter = ClosedLoopFitter(
            robot, data, floor.weighting, settings.tolerances_of(robot), settings.block_s
        )
        super().__init__("closed_loop", robot, logs, settings, fitter, floor)

    def measured(self, log: Log) -> Array:
        """Return the logged torque."""
        return log.torque_nm

    def torque(self, variant: Variant, log: Log) -> Array:
        """Return the simulated torque."""
        return simulated_torque(self.robot, variant, log)

    def noise(self, log: Log, run: int) -> Array:
        """Return the torque that sensor noise causes through the loop."""
        return noise_torque(self.robot, log, self.floor.position_std_rad, self.settings.seed, run)


def _contiguous(x: Array) -> Array:
    return np.ascontiguousarray(x, dtype=np.float64)


class ClosedLoopFitter(ModelFitter):
    """Torque that the controller's feedback must add to the logged one to keep the simulator on the log.

    In a linear loop this is the torque by which a run driven by the references
    would be off; in a nonlinear one the simulator also stays in phase with the
    log, without which lost motion and stiction have no smooth error to fit.
    ``records``: (position [rad], torque [Nm]) of each log, (n, n_axes).
    """

    def __init__(
        self,
        robot: Robot,
        records: list[tuple[Array, Array]],
        weighting: Weighting,
        tolerances: Mapping[str, float],
        block_s: float,
    ) -> None:
        super().__init__(robot, weighting, tolerances, block_s)
        self.records = records

    def solve(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, Array]],
        near: _core.Courses | None = None,
    ) -> _core.FitResult:
        """Run the fit in the core."""
        return _core.fit_simulation(
            self.robot.core,
            core_effects(effects),
            [core_spec(p, effects) for p in parameters],
            self.records,
            self.weighting.core(),
            options,
            input="tracking",
            output="torque",
            warm=warm,
            courses=near,
            cancel=self.cancel,
        )

    def run(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter], options: FitOptions
    ) -> _core.Courses:
        """Run the model in the core."""
        return _core.courses(
            self.robot.core,
            core_effects(effects),
            [core_spec(p, effects) for p in parameters],
            self.records,
            self.weighting.core(),
            options,
            input="tracking",
            output="torque",
            cancel=self.cancel,
        )

    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, Array]],
        near: _core.Courses | None = None,
    ) -> _core.Linearization:
        """Evaluate the model in the core."""
        return _core.evaluate_simulation(
            self.robot.core,
            core_effects(effects),
            [core_spec(p, effects) for p in parameters],
            self.records,
            self.weighting.core(),
            options,
            input="tracking",
            output="torque",
            warm=warm,
            courses=near,
            cancel=self.cancel,
        )


def simulated_torque(robot: Robot, variant: Variant, log: Log) -> Array:
    """Return the commanded torque (n, n_axes) [Nm] of a simulator along a log's references.

    Where the simulation fails (an unstable model), the rest is NaN.
    """
    if log.velocity_ref_rad_s is None:
        raise InputError(f"log {log.name!r}: expected velocity references")
    changed = robot.with_parameters(variant.robot_values)
    out = simulate(changed, log.velocity_ref_rad_s, effects=variant.effects, method="rk4")
    torque = np.full(log.torque_nm.shape, np.nan)
    values = out["torque_cmd_nm"].values
    torque[: len(values)] = values
    return torque


def closed_loop_floor(robot: Robot, logs: list[Log], settings: Settings) -> Floor:
    """Return the floor of closed-loop logs, by simulating the loop with and without noise."""
    nominal = robot.position_noise_std
    std = np.maximum(position_noise_std(logs), nominal)
    log = logs[0]
    reference = log.velocity_ref_rad_s
    if reference is None:
        raise InputError(f"log {log.name!r}: expected velocity references")
    noise = noise_torque(robot, log, std, settings.seed)
    rate, segment = 1.0 / log.sample_time_s, segment_of(log)
    f, noise_density = torque_density(noise, rate, segment)
    torque = np.mean([torque_density(x.torque_nm, rate, segment)[1] for x in logs], axis=0)
    total = noise_density + settings.model_error**2 * torque
    # A noise-free simulated log still needs a finite weight.
    total = np.maximum(total, 1e-12 * torque.max())
    decimation = max(1, int(rate / (2 * settings.bandwidth_hz)))
    weighting = Weighting(f, 1.0 / np.sqrt(total), decimation)
    band = f <= rate / (2 * decimation)
    expected = np.mean((noise_density / total)[:, band], axis=1)
    return Floor(std, f, noise_density, weighting, expected)


def noise_torque(robot: Robot, log: Log, std_rad: Array, seed: int, run: int = 0) -> Array:
    """Return the torque (n, n_axes) [Nm] that position noise alone causes along a log."""
    scaled = white_noise(seed, run, log.n_samples, robot.n_axes) * std_rad
    clean = simulate(robot, log.velocity_ref_rad_s, method="rk4")
    noisy = simulate(robot, log.velocity_ref_rad_s, method="rk4", noise=scaled)
    n = min(clean.sizes["time"], noisy.sizes["time"])
    return np.asarray(noisy["torque_cmd_nm"].values[:n] - clean["torque_cmd_nm"].values[:n])

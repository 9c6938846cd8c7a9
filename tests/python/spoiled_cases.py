"""Clean cases, the table of mistakes that spoil them, and the parts of mistakes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from axisight import Effect, Log, Robot, load_robot, simulate
from rigid_arm import arm, log_of

SECONDS = 4.0


@dataclass(frozen=True)
class Case:
    """A simulator and its logs."""

    robot: Robot
    estimation: tuple[Log, ...]
    validation: tuple[Log, ...]

    @property
    def logs(self) -> tuple[Log, ...]:
        return (*self.estimation, *self.validation)


def references(kind: str, seed: int, n: int, step_s: float) -> np.ndarray:
    """Return motor speeds (n, 3) [rad/s]: a multisine on a square wave, or moves out and back."""
    time = np.arange(n) * step_s
    rng = np.random.default_rng(seed)
    if kind == "moves":
        phase = time / time[-1]
        top = rng.uniform(25.0, 50.0, 3) * rng.choice([-1.0, 1.0], 3)
        start = rng.uniform(0.03, 0.08, 3)

        def bump(s: np.ndarray) -> np.ndarray:
            return np.where((s > 0) & (s < 1), np.sin(np.pi * np.clip(s, 0, 1)) ** 2, 0.0)

        return np.column_stack(
            [
                v * (bump((phase - s) / 0.35) - bump((phase - s - 0.5) / 0.35))
                for v, s in zip(top, start, strict=True)
            ]
        )
    lines = np.arange(1.0, 40.0, 0.5)
    ramp = np.minimum(time / 0.1, 1.0)
    out = np.empty((n, 3))
    for i in range(3):
        waves = np.cos(2 * np.pi * np.outer(time, lines) + rng.uniform(0, 2 * np.pi, len(lines)))
        wave = waves.sum(axis=1)
        square = np.tanh(20 * np.sin(2 * np.pi * time / (1.6 + 0.3 * i)))
        out[:, i] = ramp * 8.0 * (0.7 * wave / np.abs(wave).max() + square)
    return out


def scattered(robot: Robot, seed: int) -> Robot:
    """Return a machine of the type, with about 1 % scatter in every parameter."""
    spread = {"mass": 0.01, "stiffness": 0.01, "damping": 0.05, "motor_inertia": 0.01}
    rng = np.random.default_rng(seed)
    return robot.with_parameters(
        {
            name: value * (1 + spread[q] * rng.uniform(-1, 1))
            for name, value in robot.parameters().items()
            if (q := name.rsplit(".", 1)[1]) in spread
        }
    )


def loop_case(effects: tuple[Effect, ...] = (), seed: int = 1) -> Case:
    """Return a closed-loop case of the three-axis elastic robot; the simulator lacks ``effects``."""
    robot = load_robot("irb6600_like")
    machine = scattered(robot, seed)
    logs = []
    for run, kind in enumerate(("multisine", "moves", "multisine", "moves")):
        n = round(SECONDS / robot.sample_time_s)
        ref = references(kind, 10 * seed + run, n, robot.sample_time_s)
        out = simulate(machine, ref, effects=effects, noise_seed=seed, run=run, method="rk4")
        assert out.attrs["status"] == "completed"
        torque = out.torque_cmd_nm.values
        limits = [e for e in effects if e.name == "torque_saturation"]
        for effect in limits:  # drives report torque after their limit
            limit = effect.parameters["limit_nm"]
            torque[:, effect.axis - 1] = np.clip(torque[:, effect.axis - 1], -limit, limit)
        logs.append(
            Log(
                name=f"{kind}_{run}",
                source=Path(f"{kind}_{run}.parquet"),
                sample_time_s=robot.sample_time_s,
                time_s=np.arange(n) * robot.sample_time_s,
                velocity_ref_rad_s=ref,
                torque_nm=torque,
                position_rad=out.position_rad.values,
            )
        )
    return Case(robot, tuple(logs[:2]), tuple(logs[2:]))


def arm_case() -> Case:
    """Return a case of the rigid six-axis arm: no controller, and no friction in the simulator."""
    logs = [log_of(arm(), seed, seconds=20.0) for seed in range(3)]
    return Case(arm(), tuple(logs[:2]), tuple(logs[2:]))


clean_loop = functools.cache(loop_case)
clean_arm = functools.cache(arm_case)


@dataclass(frozen=True)
class Mistake:
    spoil: Callable
    name: str
    """The name that the gate must give it."""
    severity: str
    axis: int | None
    kind: str
    """``loop`` or ``arm``: spoils a case; ``file``: spoils the files of a closed-loop case."""

    @property
    def id(self) -> str:
        return f"{self.kind}-{self.spoil.__name__}"


TABLE: list[Mistake] = []


def mistake(name: str, kind: str = "loop", severity: str = "refuse", axis: int | None = None):
    def enter(spoil: Callable) -> Callable:
        TABLE.append(Mistake(spoil, name, severity, axis, kind))
        return spoil

    return enter


def each(case: Case, change: Callable[[Log], Log]) -> Case:
    """Return the case with all its logs changed."""
    return Case(
        case.robot, tuple(map(change, case.estimation)), tuple(map(change, case.validation))
    )


def first(case: Case, change: Callable[[Log], Log]) -> Case:
    """Return the case with its first log changed."""
    return replace(case, estimation=(change(case.estimation[0]), *case.estimation[1:]))


def channel(log: Log, field: str, axis: int | None, change: Callable) -> Log:
    """Return the log with one channel of an axis (from 0; None: all axes) changed."""
    values = np.array(getattr(log, field))
    columns = range(values.shape[1]) if axis is None else [axis]
    for i in columns:
        values[:, i] = change(values[:, i].copy())
    return replace(log, **{field: values})


def every(case: Case, field: str, axis: int | None, change: Callable) -> Case:
    return each(case, lambda log: channel(log, field, axis, change))


def one(case: Case, field: str, axis: int | None, change: Callable) -> Case:
    return first(case, lambda log: channel(log, field, axis, change))


def rows(log: Log, index: np.ndarray) -> Log:
    """Return the log with the picked rows, stamped evenly."""
    fields = ("position_rad", "torque_nm", "velocity_ref_rad_s", "velocity_rad_s")
    picked = {f: getattr(log, f)[index] for f in fields if getattr(log, f) is not None}
    return replace(log, time_s=np.arange(len(index)) * log.sample_time_s, **picked)


def swapped(field: str) -> Callable[[Log], Log]:
    order = lambda n: [1, 0, *range(2, n)]  # noqa: E731
    return lambda log: replace(log, **{field: getattr(log, field)[:, order(log.n_axes)]})


def late(log: Log, samples: int, axis: int | None, *fields: str) -> Log:
    """Return the log with channels of an axis (None: all axes) late by ``samples``."""
    on_time = rows(log, np.arange(samples, log.n_samples))
    behind = rows(log, np.arange(log.n_samples - samples))
    for field in fields:
        values = getattr(on_time, field).copy()
        columns = slice(None) if axis is None else axis
        values[:, columns] = getattr(behind, field)[:, columns]
        on_time = replace(on_time, **{field: values})
    return on_time


def busy(log: Log, seconds: float = 0.2) -> tuple[int, int]:
    """Return the start and end of a stretch in which axis 2 moves fast."""
    n = round(seconds / log.sample_time_s)
    speed = np.abs(np.gradient(log.position_rad[:, 1]))
    mean = np.convolve(speed, np.ones(n), "valid")
    middle = slice(len(mean) // 5, -len(mean) // 5)
    start = int(np.argmax(mean[middle])) + middle.start
    return start, start + n

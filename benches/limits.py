"""Whether effects at twice their detection limit are found, and at a third of it claimed.

    python benches/limits.py [MACHINES] [SEED]

Machines that scatter as any of their type and lack nothing, on the motions of the benchmark; their
verdicts state limits. Then the same machines with one effect each, drawn among those limits, at twice and at
a third of them, along the same references with other noise. A twin counts as the effect.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Effect, Log, Robot, diagnose, load_robot, simulate
from axisight.blind import Share
from axisight.blind.drawing import scattered
from axisight.blind.motions import MOTIONS
from axisight.gap.facts.result import DetectionLimit
from axisight.gap.ranking.twins import twins_of

Array = NDArray[np.float64]
References = dict[str, tuple[str, Array]]

SETTINGS = (
    ("irb6600_like", "slow_and_short"),
    ("lever_like", "multisines"),
    ("scara_like", "slow_and_short"),
)
# Effects of a machine that are tried.
TRIED = 6
SIZES = {"twice": 2.0, "a third": 1 / 3}


@dataclass(frozen=True)
class Machine:
    """A machine of a robot's type, and what it is driven by."""

    simulator: Robot
    machine: Robot
    references: References

    def diagnosed(self, effects: list[Effect], run: int) -> Diagnosis:
        """Return the verdict on its logs with effects; ``run`` numbers the noise of their sensors."""
        logs: dict[str, list[Log]] = {"estimation": [], "validation": []}
        for k, (name, (role, reference)) in enumerate(self.references.items()):
            logs[role].append(log_of(self.machine, effects, reference, name, 100 * run + k))
        return diagnose(
            robot=self.simulator, estimation=logs["estimation"], validation=logs["validation"]
        )


class NotRunError(Exception):
    """A machine that an effect takes beyond its margin: its loop swings without end."""


def log_of(machine: Robot, effects: list[Effect], reference: Array, name: str, run: int) -> Log:
    """Return a log of the machine along a reference (n, n_axes) [rad/s]; raises NotRunError."""
    out = simulate(machine, reference, effects=effects, noise_seed=7, run=run, method="rk4")
    if len(out.time) < len(reference):
        raise NotRunError(name)
    return Log(
        name=name,
        source=Path(f"{name}.parquet"),
        sample_time_s=machine.sample_time_s,
        time_s=out.time.values,
        velocity_ref_rad_s=reference,
        torque_nm=out.torque_cmd_nm.values,
        position_rad=out.position_rad.values,
    )


def machine_of(rng: np.random.Generator, arm: str, motions: str) -> Machine:
    """Return another machine of an arm's type on a plan of motions."""
    robot = load_robot(arm)
    return Machine(robot, scattered(rng, robot), MOTIONS[motions](rng, robot))


def at(limit: DetectionLimit, factor: float) -> Effect:
    """Return the effect of a limit in so many times its size."""
    size = factor * float(limit.value or 0.0)
    axis = None if limit.axes else limit.axis
    return Effect(limit.effect, axis, {**limit.others, limit.parameter: size}, limit.axes)


def alike(effect: Effect, n_axes: int) -> set[str]:
    """Return the labels of an effect and its twins."""
    return {effect.label, *(replace(effect, name=n).label for n in twins_of(effect.name, n_axes))}


def claimed(found: Diagnosis, effect: Effect, n_axes: int) -> bool:
    """Whether a verdict names an effect or a twin of it."""
    return any(c.label in alike(effect, n_axes) for c in found.causes)


def allowed(found: Diagnosis, effect: Effect, n_axes: int) -> bool:
    """Whether a verdict says of an effect or a twin of it that it may be instead, or is likely beside it."""
    beside = {a.label for a in found.alternatives if a.probability >= 0.05}
    open_ = {label for group in found.equivalent for label in group}
    return bool(alike(effect, n_axes) & (beside | open_))


def main(machines: int, seed: int) -> None:
    """Print a line for every effect, and both shares."""
    rng = np.random.default_rng(seed)
    right: dict[str, list[bool]] = {name: [] for name in SIZES}
    left_open: dict[str, list[bool]] = {name: [] for name in SIZES}
    seen: dict[str, list[bool]] = {name: [] for name in SIZES}
    wrong = 0
    for number in range(machines):
        arm, motions = SETTINGS[number % len(SETTINGS)]
        machine = machine_of(rng, arm, motions)
        bare = machine.diagnosed([], 0)
        print(f"{arm}, {motions}: {bare.verdict}, {len(bare.detection_limits)} limits", flush=True)
        finite = [limit for limit in bare.detection_limits if limit.value is not None]
        for k in rng.choice(len(finite), min(TRIED, len(finite)), replace=False):
            line = [f"  {at(finite[k], 1.0).label:28s} {finite[k].value:.3g} {finite[k].unit}"]
            for run, (name, factor) in enumerate(SIZES.items(), 1):
                effect = at(finite[k], factor)
                try:
                    found = machine.diagnosed([effect], run)
                except NotRunError:
                    line.append(f"{name}: does not run")
                    continue
                hit = claimed(found, effect, machine.simulator.n_axes)
                others = [] if hit else [c.label for c in found.causes]
                wrong += found.verdict == "explained" and bool(others)
                right[name].append(hit)
                left_open[name].append(hit or allowed(found, effect, machine.simulator.n_axes))
                seen[name].append(found.verdict != "none")
                line.append(f"{name}: {'named' if hit else ', '.join(others) or found.verdict}")
            print("   ".join(line), flush=True)
    for name, hits in right.items():
        print(f"at {name} of the limit named: {Share(sum(hits), len(hits))}")
        open_ = left_open[name]
        print(f"  or left open beside what was named: {Share(sum(open_), len(open_))}")
        print(f"  and anything seen: {Share(sum(seen[name]), len(hits))}")
    print(f"another cause explained: {wrong}")


if __name__ == "__main__":
    given = [int(x) for x in sys.argv[1:]]
    main(*given, *(3, 1)[len(given) :])

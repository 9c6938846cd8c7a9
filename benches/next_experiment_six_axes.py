"""What the design of a next experiment costs on an arm of six axes, beside the diagnosis that asks for it.

    python benches/next_experiment_six_axes.py [ROUTE ...] [--profile]

The arm is the preset cobot_like; by inverse dynamics its gears are rigid, in closed loop elastic. A torque offset on
axis 2 is withheld from the simulator. The logs last 6 s and all motors turn one way, so other effects explain them
nearly as well. Prints the CPU time of the diagnosis and of the design, and what the design does: motions that are
simulated, and fits. With --profile, also the functions in which the design spends most time.
"""

from __future__ import annotations

import cProfile
import pstats
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Effect, Log, Robot, Settings, diagnose, simulate
from axisight.gap import ExperimentLimits
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.separate.asked import Asked
from axisight.gap.separate.loop_route import LoopRoute
from axisight.gap.separate.position_route import InverseRoute
from axisight.gap.simulator.rigid_torque import predicted_torque

Array = NDArray[np.float64]

SECONDS = 6.0
OFFSET = Effect("torque_offset", 2, {"offset_nm": -0.12})
# Noise of the torque, motor side, as a share of the withheld one.
NOISE_NM = 0.02
# What the motors may do in the experiment.
FREE = ExperimentLimits(
    velocity_rad_s=25.0,
    acceleration_rad_s2=150.0,
    travel_rad=80.0,
    torque_nm=[3.0, 3.0, 1.5, 0.5, 0.5, 0.5],
)


@dataclass
class Cost:
    """What a design did.

    CPU time [s]; motions that were simulated, each machine counted; fits of one linear step; and those of them that
    computed the sensitivities to the simulator's own parameters.
    """

    cpu_s: float = 0.0
    motions: int = 0
    fits: int = 0
    whole_fits: int = 0


def arm(route: str) -> Robot:
    """Return the simulator of a route: elastic in closed loop, else rigid at 100 Hz."""
    text = (resources.files("axisight.robot.presets") / "cobot_like.toml").read_text("utf-8")
    if route == "closed loop":
        return Robot.from_toml(text)
    text = re.sub(r"^(stiffness|damping) = .*\n", "", text, flags=re.MULTILINE)
    text = text.replace("axisight.robot/1", "axisight.robot/2")
    text = text.replace("sample_time = 1.0e-3", "sample_time = 1.0e-2")
    return Robot.from_toml(re.sub(r"\[controller\]\n(.+\n)*", "", text))


def speeds(robot: Robot, seed: int) -> Array:
    """Return speeds of the motors (n, 6) [rad/s] that never change their sign."""
    time_s = np.arange(round(SECONDS / robot.sample_time_s)) * robot.sample_time_s
    lines = np.arange(0.5, 4.0, 0.5)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(lines), robot.n_axes))
    waves = sum(
        np.cos(2 * np.pi * f * time_s[:, None] + p) for f, p in zip(lines, phase, strict=True)
    )
    ramp = np.clip(time_s / 0.5, 0, 1)[:, None]
    return np.asarray(ramp**2 * (3 - 2 * ramp) * (8.0 + 0.4 * waves))


def log_of(robot: Robot, route: str, seed: int) -> Log:
    """Return a log of the machine, which has the withheld effect."""
    step, speed = robot.sample_time_s, speeds(robot, seed)
    n, rng = len(speed), np.random.default_rng([3, seed])
    start = np.array(robot.equilibrium()["motor_angle_rad"].values, float)
    position = start + step * (np.cumsum(speed, axis=0) - speed)
    shared: dict[str, Any] = {
        "name": f"run{seed}",
        "source": Path(f"run{seed}.parquet"),
        "sample_time_s": step,
        "time_s": step * np.arange(n),
    }
    if route == "inverse dynamics":
        acceleration = np.gradient(speed, step, axis=0)
        torque = predicted_torque(
            robot, Variant({}, (OFFSET,)), (position, speed, acceleration, 0 * speed)
        )
        torque = torque + NOISE_NM * rng.standard_normal(torque.shape)
        return Log(position_rad=position, torque_nm=torque, **shared)
    out = simulate(robot, speed, effects=[OFFSET], noise_seed=5, run=seed)
    assert out.attrs["status"] == "completed"
    return Log(
        position_rad=out.position_rad.values,
        torque_nm=out.torque_cmd_nm.values,
        velocity_ref_rad_s=speed,
        **shared,
    )


@contextmanager
def counted(profile: cProfile.Profile | None = None) -> Iterator[Cost]:
    """Count what designs do while the context is open."""
    cost = Cost()
    added, fit = Asked.added, ModelFitter.fit
    inside = [False]

    def timed(self: Asked, *args: Any, **more: Any) -> Diagnosis:
        begin, inside[0] = time.process_time(), True
        if profile is not None:
            profile.enable()
        try:
            return added(self, *args, **more)
        finally:
            if profile is not None:
                profile.disable()
            inside[0] = False
            cost.cpu_s += time.process_time() - begin

    def counting_fit(self: ModelFitter, *args: Any, **more: Any) -> Any:
        cost.fits += inside[0]
        cost.whole_fits += inside[0] and not more.get("lazy", False)
        return fit(self, *args, **more)

    def counting(runs: Any) -> Any:
        def told(self: Any, machine: Any, tried: Any) -> Any:
            cost.motions += len(tried)
            return runs(self, machine, tried)

        return told

    routes: list[Any] = [LoopRoute, InverseRoute]
    before = [route.runs for route in routes]
    Asked.added, ModelFitter.fit = timed, counting_fit  # type: ignore[method-assign]
    for route in routes:
        route.runs = counting(route.runs)
    try:
        yield cost
    finally:
        Asked.added, ModelFitter.fit = added, fit  # type: ignore[method-assign]
        for route, runs in zip(routes, before, strict=True):
            route.runs = runs


def run(route: str, profile: cProfile.Profile | None = None) -> tuple[Diagnosis, Cost, float]:
    """Return a diagnosis with its experiment, the cost of the design, and the CPU time of the diagnosis alone [s]."""
    robot = arm(route)
    logs = [log_of(robot, route, seed) for seed in (1, 2, 3)]
    begin = time.process_time()
    with counted(profile) as cost:
        found = diagnose(
            robot=robot,
            estimation=logs[:2],
            validation=logs[2:],
            separate=True,
            within=FREE,
            settings=Settings(threads=1),
        )
    return found, cost, time.process_time() - begin - cost.cpu_s


ROUTES = ("inverse dynamics", "closed loop")


def main() -> None:
    """Print the table."""
    wanted = [x for x in sys.argv[1:] if x != "--profile"] or list(ROUTES)
    print("| route | verdict | diagnosis, CPU s | design, CPU s | ratio | motions | fits, whole |")
    print("|---|---|---|---|---|---|---|")
    for route in wanted:
        profile = cProfile.Profile() if "--profile" in sys.argv else None
        found, cost, alone = run(route, profile)
        print(
            f"| {route} | {found.verdict} | {alone:.1f} | {cost.cpu_s:.1f} | {cost.cpu_s / alone:.2f} | "
            f"{cost.motions} | {cost.fits}, {cost.whole_fits} |",
            flush=True,
        )
        print(found.next_experiment, file=sys.stderr)
        if profile is not None:
            pstats.Stats(profile).sort_stats("cumulative").print_stats(35)


if __name__ == "__main__":
    main()

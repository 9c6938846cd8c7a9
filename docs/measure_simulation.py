"""Print the measured tables of docs/simulation_accuracy.md, to be pasted there.

Usage: python docs/measure_simulation.py

Takes about two minutes. Errors are relative RMS errors of the worst position against 4,096
sub-steps; times are CPU times of the process, the shortest of several, on one thread.
"""

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import axisight

SAMPLE_S = 5e-4
SUBSTEPS = [1, 2, 4, 8, 16, 32, 64]
ROUNDS = 6
REFERENCE = {"method": "rk4", "substeps": 4096}


def read(text: str) -> axisight.Robot:
    """A robot from its description."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(text, encoding="utf-8")
        return axisight.load_robot(path)


def two_masses() -> axisight.Robot:
    """One motor, one gear, one link: the preset `two_mass_axis` without its effects."""
    return axisight.load_robot("two_mass_axis").with_effects([])


def chain(n_joints: int) -> axisight.Robot:
    """A chain of driven joints with rigid gears and a body on each."""
    joints = "".join(
        f"""
[[joint]]
name = "axis{i + 1}"
kind = "driven"
origin = [0.0, 0.0, {0.2 if i else 0.0}]
axis = [0.0, {float(i % 2)}, {float(1 - i % 2)}]
[joint.link]
mass = 1.0
com = [0.02, 0.0, 0.1]
inertia = [0.004, 0.004, 0.001, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 0.001
viscous_friction = 0.001
"""
        for i in range(n_joints)
    )
    per_axis = {"kp": 0.1, "ki": 1.0, "joint_angle": 0.1}
    kp, ki, angle = (str([x] * n_joints) for x in per_axis.values())
    return read(
        f'schema = "axisight.robot/1"\nname = "chain"\ngravity = [0.0, 0.0, -9.81]\n'
        f"sample_time = {SAMPLE_S}\n{joints}\n"
        f'[controller]\nkind = "pi_velocity"\nkp = {kp}\nki = {ki}\n'
        f"[sensor]\nposition_noise_std = 1e-5\n[operating_point]\njoint_angle = {angle}\n"
    )


def swing(n_samples: int, speed: float, frequency_hz: float) -> np.ndarray:
    """Motor-side velocity reference (n,) [rad/s] that starts smoothly."""
    t = np.arange(n_samples) * SAMPLE_S
    return speed * np.sin(2 * np.pi * frequency_hz * t) * (1 - np.exp(-((t / 0.05) ** 2)))


def error(run: xr.Dataset, exact: xr.Dataset) -> str:
    """Relative RMS error of the worst position."""
    if run.attrs["status"] != "completed":
        return run.attrs["status"].replace("_", " ")
    worst = 0.0
    for name in ("motor_position_rad", "joint_position_rad"):
        got, want = run[name].values, exact[name].values
        square = np.mean((got - want) ** 2, axis=0) / np.mean((want - want[0]) ** 2, axis=0)
        worst = max(worst, float(np.sqrt(square.max())))
    return f"{worst:.0e}".replace("e-0", "e-")


def row(*cells: object) -> None:
    """Print a row of a table."""
    print("|", " | ".join(str(c) for c in cells), "|")


def contact_speed(robot: axisight.Robot, run: xr.Dataset, half_width: float) -> float:
    """Rate of the gear deflection where it meets the edge of the gap [rad/s], median."""
    ratio = 0.004458314757021846
    deflection = (
        ratio * run["motor_position_rad"].values[:, 0] - run["joint_position_rad"].values[:, 0]
    )
    outside = np.abs(deflection) > half_width
    rate = np.abs(np.diff(deflection)) / robot.sample_time_s
    return float(np.median(rate[np.flatnonzero(outside[1:] != outside[:-1])]))


def events() -> None:
    """Error over the step for friction and backlash, and what error control makes of it."""
    robot = two_masses()
    v = swing(2001, 40.0, 3.0)
    speeding_up = 40.0 * 2 * np.pi * 3.0
    cases: list[tuple[str, list[axisight.Effect], float | None]] = [("none", [], None)]
    for width in (1.0, 0.1, 0.01, 0.001):
        friction = {"coulomb_nm": 0.5, "smoothing_rad_s": width}
        effects = [axisight.Effect("coulomb_friction", 1, friction)]
        cases.append((f"Coulomb, v_0 = {width:g} rad/s", effects, width / speeding_up))
    for half in (1e-4, 3e-4, 1e-3):
        effects = [axisight.Effect("backlash", 1, {"half_width_rad": half})]
        run = axisight.simulate(robot, v, effects=effects)
        crossing = half / 20 / contact_speed(robot, run, half)
        cases.append((f"backlash, b = {half:g} rad", effects, crossing))
    print("\n### Error of rk4 over the sub-steps per sample\n")
    row("effect", "crossing time [us]", *SUBSTEPS)
    row(*["---"] * (2 + len(SUBSTEPS)))
    exact = {}
    for name, effects, crossing in cases:
        exact[name] = axisight.simulate(robot, v, effects=effects, **REFERENCE)
        runs = [
            axisight.simulate(robot, v, effects=effects, method="rk4", substeps=n) for n in SUBSTEPS
        ]
        time_us = "" if crossing is None else f"{1e6 * crossing:.2g}"
        row(name, time_us, *(error(r, exact[name]) for r in runs))
    for method in ("dopri5", "radau5", "rodas4"):
        print(f"\n### {method}: error (rejected steps) over the tolerance\n")
        tolerances = [1e-3, 1e-5, 1e-7, 1e-9]
        row("effect", *tolerances)
        row(*["---"] * 5)
        for name, effects, _ in cases:
            options: dict[str, Any] = {"effects": effects, "method": method}
            runs = [axisight.simulate(robot, v, tolerance=t, **options) for t in tolerances]
            row(name, *(f"{error(r, exact[name])} ({r.attrs['rejected_steps']})" for r in runs))


def shortest(actions: list[Callable[[], object]]) -> list[float]:
    """CPU time of each [s], in rounds, so that a busy moment does not hit all runs of one."""
    times = [float("inf")] * len(actions)
    for _ in range(ROUNDS):
        for i, action in enumerate(actions):
            begin = time.process_time()
            action()
            times[i] = min(times[i], time.process_time() - begin)
    return times


def costs() -> None:
    """Microseconds per sample."""
    n, runs = 4001, 16
    robots = [
        ("two masses, 1 joint", two_masses()),
        ("`irb6600_like`, 7 joints, 20 states", axisight.load_robot("irb6600_like")),
        *((f"chain of {k}", chain(k)) for k in (1, 3, 7, 8, 12, 13, 32)),
    ]
    single = [
        {"method": "rk4"},
        {"method": "rkn4"},
        {"method": "dopri5"},
        {"method": "radau5"},
        {"method": "rodas4", "tolerance": 1e-5},
        {"model": "linear"},
    ]
    batch: list[dict[str, Any]] = [{"method": "rkn4"}, {"method": "dopri5"}, {"model": "linear"}]
    actions: list[Callable[[], object]] = []
    for _, robot in robots:
        v = np.outer(swing(n, 20.0, 1.0), np.ones(robot.n_axes))
        many = v * np.linspace(0.5, 1.0, runs)[:, None, None]
        several = partial(axisight.simulate_batch, robot, many, threads=1)
        actions += [partial(axisight.simulate, robot, v, **o) for o in single]
        actions += [partial(several, **o) for o in batch]
    samples = [n] * len(single) + [n * runs] * len(batch)
    each = np.array(shortest(actions)).reshape(len(robots), -1) / samples
    print("\n### Microseconds per sample and run\n")
    row("robot", *(o.get("method", "linear") for o in single), "batch rkn4", "dopri5", "linear")
    row(*["---"] * 10)
    for (name, _), seconds in zip(robots, each, strict=True):
        row(
            name, *(f"{1e6 * s:.{0 if s > 1e-4 else 2}{'f' if s > 1e-4 else 'g'}}" for s in seconds)
        )


if __name__ == "__main__":
    events()
    costs()

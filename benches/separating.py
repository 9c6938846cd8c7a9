"""Pairs of causes that weak logs leave open, and what the designed experiment makes of them.

    python benches/separating.py [NAME ...]

One elastic axis, simulated: two logs to fit and choose on, one to validate, 6 s each, which hardly show
the effect that is withheld. Diagnosed, with the experiment that separates the rivals; run as often as it says,
on the same machine; diagnosed again with those runs beside the logs.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Effect, Log, Robot, diagnose, load_robot, simulate

Array = NDArray[np.float64]

SECONDS = 6.0
# What is withheld; then peak, band and square wave of the multisine of the logs, and a constant speed.
CASES = {
    "backlash, cubic stiffness": (
        Effect("backlash", 1, {"half_width_rad": 1e-5}),
        (1.0, (1.0, 6.0), 2.0, 0.0),
    ),
    "cubic stiffness, backlash": (
        Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 3e10}),
        (1.0, (1.0, 6.0), 1.0, 0.0),
    ),
    "delay, current loop": (
        Effect("input_delay", 1, {"delay_s": 6e-4}),
        (1.0, (1.0, 15.0), 3.0, 0.0),
    ),
    "current loop, delay": (
        Effect("current_loop", 1, {"time_constant_s": 6e-4, "damping": 0.7}),
        (1.0, (1.0, 15.0), 3.0, 0.0),
    ),
    "torque constant, load": (
        Effect("torque_constant", 1, {"relative_error": -0.06}),
        (4.0, (1.0, 4.0), 4.0, 0.0),
    ),
    "load, torque constant": (
        Effect("payload", None, {"mass_kg": 100.0, "x_m": 1.0}),
        (4.0, (1.0, 4.0), 4.0, 0.0),
    ),
    "load-dependent friction, Stribeck": (
        Effect("load_dependent_friction", 1, {"coefficient": 0.002, "smoothing_rad_s": 0.1}),
        (1.0, (1.0, 12.0), 3.0, 0.0),
    ),
    "delay, lag": (
        Effect("input_delay", 1, {"delay_s": 6e-4}),
        (1.0, (1.0, 15.0), 3.0, 0.0),
    ),
    "lag, delay": (
        Effect("actuator_bandwidth", 1, {"time_constant_s": 6e-4}),
        (1.0, (1.0, 15.0), 3.0, 0.0),
    ),
    "Coulomb friction, offset": (
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.05, "smoothing_rad_s": 0.1}),
        (2.0, (1.0, 12.0), 0.0, 10.0),
    ),
    "resolver, torque ripple": (
        Effect("resolver_ripple", 1, {"order_1": 2.0, "cosine_1_rad": 2e-4}),
        (0.05, (1.0, 5.0), 0.0, 9.0),
    ),
    "torque, resolver ripple": (
        Effect("torque_ripple", 1, {"order_1": 2.0, "cosine_1_nm": 0.004}),
        (0.05, (1.0, 5.0), 0.0, 9.0),
    ),
    "inertia, torque constant": (
        Effect("motor_inertia", 1, {"relative_change": 0.1}),
        (6.0, (1.0, 6.0), 4.0, 0.0),
    ),
    "Stribeck, Coulomb friction": (
        Effect(
            "stribeck_friction",
            1,
            {
                "coulomb_nm": 0.05,
                "excess_nm": 0.05,
                "stribeck_speed_rad_s": 2.0,
                "smoothing_rad_s": 0.1,
            },
        ),
        (1.0, (1.0, 12.0), 3.0, 0.0),
    ),
}


def reference(
    seed: int, step: float, wave: tuple[float, tuple[float, float], float, float]
) -> Array:
    """A multisine on a square wave or a constant speed, (n, 1) [rad/s]."""
    peak, band, square, level = wave
    time = np.arange(round(SECONDS / step)) * step
    lines = np.arange(*band, 0.5)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    sine = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    turns = np.tanh(20 * np.sin(2 * np.pi * time / 3.0))
    full = peak * sine / np.abs(sine).max() + square * turns + level + 0.1 * seed * (level > 0)
    return (np.minimum(time / 0.1, 1.0) * full)[:, None]


def log_of(machine: Robot, effect: Effect, ref: Array, run: int) -> Log:
    """A log of the machine along a reference."""
    out = simulate(machine, ref, effects=[effect], noise_seed=5, run=run)
    assert out.attrs["status"] == "completed"
    name = f"run{run}"
    return Log(
        name=name,
        source=Path(name),
        sample_time_s=machine.sample_time_s,
        time_s=out.time.values,
        velocity_ref_rad_s=ref,
        torque_nm=out.torque_cmd_nm.values,
        position_rad=out.position_rad.values,
    )


def says(found: Diagnosis) -> str:
    """A verdict in a cell of a table."""
    named = ", ".join(f"{c.effect} {c.probability:.2f}" for c in found.causes)
    rivals = ", ".join(
        f"{a.effect} {a.probability:.2f}" for a in found.alternatives if a.probability > 0.05
    )
    return f"{found.verdict}: {named or 'nothing'}" + (f" ({rivals})" if rivals else "")


def main() -> None:
    """Print the table."""
    robot = load_robot("two_mass_axis").with_effects([])
    # A machine of the type: a per cent off.
    off = {"axis1.stiffness": 1.007, "axis1.motor_inertia": 0.994, "axis1.damping": 1.03}
    nominal = robot.parameters()
    machine = robot.with_parameters({k: nominal[k] * f for k, f in off.items()})
    wanted = set(sys.argv[1:])
    print("| withheld, rival | before | experiment | after |\n|---|---|---|---|")
    for name, (effect, wave) in CASES.items():
        if wanted and name not in wanted:
            continue
        refs = [reference(seed, robot.sample_time_s, wave) for seed in (1, 2, 3)]
        logs = [log_of(machine, effect, r, k) for k, r in enumerate(refs)]
        before = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], separate=True)
        made, after = before.experiment, ""
        if made is not None and made.decides:
            again = made.references.period[0]
            new = [log_of(machine, effect, again, 7 + k) for k in range(made.repeats)]
            after = says(diagnose(robot=robot, estimation=[*logs[:2], *new], validation=logs[2:]))
        print(f"| {name} | {says(before)} | {made or 'nothing is open'} | {after} |", flush=True)


if __name__ == "__main__":
    main()

"""Elastic parameters of a simulated robot from five operating points, ripple and noise on.

The preset 20-state robot runs the closed-loop experiments of Wernholt (2004), chapter 8: a
multisine from 1 to 40 Hz over a smoothed square wave, one experiment per axis and direction,
with the torque and resolver ripple of Table 8.1 and sensor noise, by the full nonlinear
equations of motion. Responses averaged over realizations of the excitation are then fitted
from starts 35 and 50 % off. The truth is known, so errors can be held against standard errors.
They are larger than those: what ripple and the motion do to a response does not all average
out, and the fit cannot know. The motion, above all, smears resonances and looks like damping.

Run ``python examples/frequency_fit/run.py [--realizations 8] [--linear]``; two minutes.
"""

import argparse
import time

import numpy as np
import pandas as pd
import xarray as xr

from axisight import Effect, Robot, excitation, frf, load_robot, robot_parameters, simulate_batch
from axisight.frequency_fit import (
    FrequencyFit,
    FrequencyFitOptions,
    choose_poses,
    fit_responses,
)
from axisight.records import PeriodicRecords

PERIOD_S = 10.0
LINES = np.arange(10, 401)
NAMES = (
    "axis1.stiffness",
    "axis1.damping",
    "axis1.motor_inertia",
    "axis2.stiffness",
    "axis2.damping",
    "axis2.motor_inertia",
    "axis2_roll.stiffness",
    "axis2_yaw.stiffness",
    "axis3.stiffness",
    "axis3.damping",
    "axis3.motor_inertia",
    "axis3_roll.stiffness",
    "axis3_yaw.stiffness",
)
# Wernholt (2004), Table 8.1: order, amplitude, phase [rad].
TORQUE_RIPPLE_NM = ((3, 0.06, 1.45), (36, 0.11, 0.90), (72, 0.08, 0.20))
PROPORTIONAL_RIPPLE = (18, 0.04, 0.0)
RESOLVER_RIPPLE_RAD = (
    (2, 0.40e-3, -1.84),
    (10, 0.20e-3, 0.81),
    (12, 0.22e-3, 2.94),
    (48, 0.18e-3, 2.94),
)


def ripple(robot: Robot, pose: np.ndarray) -> list[Effect]:
    """The disturbances of Table 8.1; proportional ripple without the static torque's share."""
    static = robot.equilibrium(pose.tolist())["motor_torque_nm"].values
    effects = []
    for axis, torque in zip(robot.axis_numbers(), static, strict=True):
        order, share, phase = PROPORTIONAL_RIPPLE
        parts = sines(TORQUE_RIPPLE_NM, "{}", "_nm") | sines(((order, share, phase),), "u", "")
        held = sines(((order, -share * torque, phase),), "{}", "_nm")
        effects.append(Effect("torque_ripple", axis, parts))
        effects.append(Effect("torque_ripple", axis, held))
        found = sines(RESOLVER_RIPPLE_RAD, "{}", "_rad")
        effects.append(Effect("resolver_ripple", axis, found))
    return effects


def sines(terms: tuple, label: str, unit: str) -> dict[str, float]:
    """``a sin(n x + phase)`` as parameters of a ripple effect."""
    out = {}
    for k, (order, amplitude, phase) in enumerate(terms, 1):
        name = label.format(k)
        out[f"order_{name}"] = float(order)
        out[f"cosine_{name}{unit}"] = amplitude * float(np.sin(phase))
        out[f"sine_{name}{unit}"] = amplitude * float(np.cos(phase))
    return out


def references(robot: Robot, seed: int, run: int) -> np.ndarray:
    """One period of velocity references, (experiment, sample, axis) [rad/s]."""
    step = robot.sample_time_s
    broadband = excitation.multisine(PERIOD_S, step, lines=LINES, seed=seed, run=run)
    wave = excitation.square(5.0, step, amplitude=9.6, smoothing_samples=40)
    return excitation.references(
        broadband.scaled(peak=8.0), robot.n_axes, directions="t1", square=wave
    ).period


def measure(
    robot: Robot, pose: np.ndarray, number: int, realizations: int, model: str
) -> tuple[np.ndarray, xr.Dataset]:
    """Operating point, and the response from torque to acceleration there with its variance.

    Every realization starts at its own motor angles within a turn, so that ripple meets
    other phases and averages out. The arm moves by a tenth of a radian during a period: the
    operating point is the mean measured angle, not the start.
    """
    records, angles = [], []
    for run in range(realizations):
        place = number * realizations + run
        turn = np.random.default_rng([9, place]).uniform(0, 2 * np.pi, robot.n_axes)
        # The linearized robot stays that of its starting point.
        start = pose if model == "linear" else pose + turn * robot.gear_ratio
        period = references(robot, 5, place)
        simulated = simulate_batch(
            robot,
            np.tile(period, (1, 2, 1)),
            effects=ripple(robot, pose),
            noise_seed=5,
            first_run=3 * place,
            start_rad=start.tolist(),
            model=model,
        )
        n = period.shape[1]
        torque, position = (
            simulated[name].values[:, None, n:] for name in ("torque_cmd_nm", "position_rad")
        )
        angles.append(position.mean(axis=(0, 1, 2)) * robot.gear_ratio)
        records.append(PeriodicRecords(robot.sample_time_s, torque, position, LINES))
    at = np.mean(angles, axis=0) if model == "nonlinear" else pose
    return at, frf.logarithmic_mean(records, quantity="acceleration")


def candidates() -> np.ndarray:
    """A grid over the working range; axis 1 turns the whole arm and changes nothing."""
    second, third = np.meshgrid(np.linspace(-0.9, 1.1, 7), np.linspace(-1.2, 0.9, 7))
    return np.stack([np.zeros(49), second.ravel(), third.ravel()], axis=1)


def compare(fit: FrequencyFit, truth: dict[str, float]) -> pd.DataFrame:
    """Errors against standard errors."""
    true = np.array([truth[name] for name in fit.names])
    return pd.DataFrame(
        {
            "parameter": fit.names,
            "truth": true,
            "fitted": fit.values,
            "error_percent": 100 * (fit.values / true - 1),
            "std_percent": 100 * fit.std / fit.values,
            "error_in_std": (fit.values - true) / fit.std,
        }
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--realizations", type=int, default=8)
    parser.add_argument("--linear", action="store_true", help="simulate the linearized robot")
    arguments = parser.parse_args()
    robot = load_robot("irb6600_like")
    truth = robot_parameters(robot)
    start = {name: truth[name] * (1.5 if i % 2 else 0.65) for i, name in enumerate(NAMES)}

    plan = choose_poses(robot, start, candidates(), LINES / PERIOD_S, 5)
    print(f"operating points [rad] chosen from {len(candidates())} by the start values,")
    print(f"D-efficiency {plan.efficiency:.3f}:")
    print(np.round(plan.operating_points_rad, 2))

    model = "linear" if arguments.linear else "nonlinear"
    began = time.perf_counter()
    responses = [
        measure(robot, pose, i, arguments.realizations, model)
        for i, pose in enumerate(plan.operating_points_rad)
    ]
    print(
        f"\n{15 * arguments.realizations} experiments ({model}): {time.perf_counter() - began:.0f} s"
    )

    for criterion in ("weighted_log_least_squares", "weighted_least_squares"):
        began = time.perf_counter()
        fit = fit_responses(
            robot, responses, start, options=FrequencyFitOptions(criterion=criterion)
        )
        found = compare(fit, truth)
        inside = np.mean(np.abs(found["error_in_std"]) < 1.96)
        print(
            f"\n{criterion}: {fit.status} in {time.perf_counter() - began:.2f} s, "
            f"misfit {fit.misfit:.2f}, std from the {fit.std_from}"
        )
        print(found.to_string(index=False, float_format=lambda x: f"{x:.4g}"))
        print(
            f"largest error {found['error_percent'].abs().max():.2f} %, "
            f"{inside:.0%} of the truth inside the 95 % intervals"
        )
        for warning in fit.warnings:
            print("warning:", warning)


if __name__ == "__main__":
    main()

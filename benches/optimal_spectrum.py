"""Variance of a stiffness with the optimal spectrum, against a flat one of the same power and time.

    python benches/optimal_spectrum.py [RUNS]

Robots in their loop, linear, with sensor noise of 1e-4 rad. Signals have 1-40 Hz and a period of 10 s; one period of
waiting before the measured ones. What is equal between the designs: neither the mean square of the motor torque nor
that of the motor speed, over axes and experiments, exceeds that of the flat spectrum. The number of measured periods
is the same. Every run fits all stiffnesses and dampings.

- known model: 4 periods flat, or 4 periods optimal for the true robot
- two steps: 4 periods flat, or 2 flat, a design from their fit, 2 optimal; both combined
- wrong model: 4 periods optimal for a robot whose stiffnesses are 20 % wrong, of a random sign each, scaled until a
  power in the true robot is that of the flat spectrum
- robust: the same with relative_uncertainty=0.2

Predicted is the ratio of the variances from the information of the true model.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from axisight import Robot, load_robot, simulate_batch
from axisight.excitation import Multisine, multisine, optimal_spectrum, references
from axisight.frequency_fit import (
    FrequencyFitOptions,
    MeasuredResponse,
    fit_responses,
    line_information,
)
from axisight.frequency_fit.line_information import Power
from axisight.frf import local_polynomial, with_input_covariance
from axisight.records import PeriodicRecords

NOISE = "1.0e-4"
RMS_RAD_S = 0.2
QUESTIONS = (
    ("two_mass_axis", "axis1.stiffness"),
    ("irb6600_like", "axis1.stiffness"),
    ("irb6600_like", "axis3.stiffness"),
)


def robot_of(name: str) -> Robot:
    """Return the preset without nonlinear effects, with more noise."""
    text = load_robot(name).toml.replace(
        "position_noise_std = 1.2e-5", f"position_noise_std = {NOISE}"
    )
    return Robot.from_toml(text).with_effects([])


def parameters_of(robot: Robot) -> list[str]:
    """Return the names of all stiffnesses and dampings."""
    return [p for p in robot.parameters() if p.endswith((".stiffness", ".damping"))]


def measure(
    robot: Robot, signal: Multisine, periods: int, seed: int
) -> tuple[MeasuredResponse, dict[str, float]]:
    """Return the response of an experiment with the signal, and the rms of torque and velocity."""
    made = references(signal, robot.n_axes)
    refs = made.repeated(periods + 1)
    run = simulate_batch(robot, refs, noise_seed=seed, model="linear", threads=1)
    shape = (made.n_experiments, periods, made.n_samples, made.n_inputs)
    u, y = (
        run[x].values[:, made.n_samples :].reshape(shape) for x in ("torque_cmd_nm", "position_rad")
    )
    records = PeriodicRecords(robot.sample_time_s, u, y, made.lines)
    found = with_input_covariance(local_polynomial(records, threads=1), records)
    spectra = {
        "torque": np.fft.rfft(u.mean(axis=1), axis=1)[:, made.lines],
        "velocity": np.fft.rfft(y.mean(axis=1), axis=1)[:, made.lines]
        * (2 * np.pi * records.frequency_hz[:, None]),
    }
    rms = {
        name: float(np.sqrt(2 * np.sum(np.abs(x) ** 2, axis=1).mean()) / made.n_samples)
        for name, x in spectra.items()
    }
    data = MeasuredResponse.of(robot.operating_point, found, covariance=found["covariance"])
    return data, rms


def fitted(robot: Robot, data: list[MeasuredResponse]) -> dict[str, float]:
    """Return the parameters fitted from starts 10 % off."""
    names = parameters_of(robot)
    start = {n: robot.parameters()[n] * 1.1 ** (1 if i % 2 else -1) for i, n in enumerate(names)}
    for criterion in ("weighted_log_least_squares", "weighted_least_squares"):
        fit = fit_responses(
            robot, data, start, options=FrequencyFitOptions(criterion=criterion, neighbours=0)
        )
        start = dict(zip(fit.names, fit.values.tolist(), strict=True))
    return start


def wrong(robot: Robot, seed: int) -> Robot:
    """Return the robot with stiffnesses that are 20 % wrong."""
    rng = np.random.default_rng([seed, 20])
    names = [n for n in parameters_of(robot) if n.endswith("stiffness")]
    known = robot.parameters()
    return robot.with_parameters({n: known[n] * (1 + 0.2 * rng.choice([-1, 1])) for n in names})


def at_power(robot: Robot, signal: Multisine, rms: dict[Power, float]) -> Multisine:
    """Return the signal scaled to the largest amplitude that keeps both powers."""
    lines = line_information(
        robot,
        parameters_of(robot),
        signal.frequency_hz,
        directions=np.eye(robot.n_axes),
        n_samples=signal.n_samples,
    )
    used = [
        np.sqrt(signal.amplitude**2 @ lines.power[name]) / rms[name]
        for name in ("torque", "velocity")
    ]
    return signal.scaled(rms=signal.rms / max(used))


Run = Callable[[int], tuple[float, dict[str, float]]]


def cases(robot: Robot, question: str) -> tuple[float, dict[str, Run]]:
    """Return the predicted ratio of the variances, and functions from the run to estimate and rms."""
    flat = multisine(10.0, robot.sample_time_s, band_hz=(1.0, 40.0), seed=1).scaled(rms=RMS_RAD_S)
    best = optimal_spectrum(robot, flat, question)

    def once(signal: Multisine) -> Run:
        def run(seed: int) -> tuple[float, dict[str, float]]:
            data, rms = measure(robot, signal, 4, seed)
            return fitted(robot, [data])[question], rms

        return run

    def two_steps(seed: int) -> tuple[float, dict[str, float]]:
        first, _ = measure(robot, flat, 2, seed)
        model = robot.with_parameters(fitted(robot, [first]))
        design = optimal_spectrum(model, flat, question).signal
        second, rms = measure(robot, design, 2, seed + 10**6)
        return fitted(robot, [first, second])[question], rms

    def from_wrong(uncertainty: float) -> Run:
        designs = (
            optimal_spectrum(wrong(robot, i), flat, question, relative_uncertainty=uncertainty)
            for i in range(4)
        )
        signals = [at_power(robot, d.signal, best.flat_rms) for d in designs]
        return lambda seed: once(signals[seed % 4])(seed)

    return 1 / best.gain, {
        "flat": once(flat),
        "known model": once(best.signal),
        "two steps": two_steps,
        "wrong model": from_wrong(0.0),
        "robust": from_wrong(0.2),
    }


def main(runs: int) -> None:
    """Print the table."""
    print("robot  parameter  design  std  variance / flat  rms torque (Nm), velocity (rad/s)")
    for name, question in QUESTIONS:
        robot = robot_of(name)
        true, flat = robot.parameters()[question], 0.0
        predicted, runners = cases(robot, question)
        for case, run in runners.items():
            found = [run(seed) for seed in range(runs)]
            variance = float(np.mean((np.array([x for x, _ in found]) / true - 1) ** 2))
            flat = flat or variance
            ratio = variance / flat
            torque, velocity = (
                np.mean([r[key] for _, r in found]) for key in ("torque", "velocity")
            )
            said = f"  predicted {predicted:.3f}" if case == "known model" else ""
            print(
                f"{name:14s} {question} {case:12s} {100 * np.sqrt(variance):.4f} %"
                f"  {ratio:6.3f} +- {ratio * np.sqrt(4 / runs):.3f}  {torque:.4f}  {velocity:.4f}{said}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)

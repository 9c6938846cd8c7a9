"""Response of three axes from one zippered experiment, against three orthogonal experiments.

    python benches/single_experiment.py [RUNS]

Preset irb6600_like in its loop, linear, with its sensor noise times a factor. All signals have 1-40 Hz, a reference
of 4 rad/s rms per axis, one period of waiting and four measured ones. Three experiments with DFT directions are
estimated by Y U^-1 from each line alone. Columns:

- lines: distance of the lines of one axis, as a share of the narrowest bandwidth of the closed loop (0.51 Hz)
- ratio: mean square error of the one experiment over that of the three, median over lines and elements
- per time: the same times the ratio of the measuring times, 1/3
- smoothed: per time, against three experiments estimated by the same local models over as many lines
- coverage: share of lines, elements and runs within the stated 95 % disc, then the lowest of a 1 Hz band
- bias: largest over the standard deviation, without noise in the data
"""

from __future__ import annotations

import sys

import numpy as np

from axisight import load_robot, simulate_batch
from axisight.excitation import multisine, references, simultaneous_references, zippered
from axisight.frf import confidence_radius, local_joint_input_output, mfrf
from axisight.records import PeriodicRecords

NARROWEST_HZ = 0.514
PERIODS = 4
RMS_RAD_S = 4.0


def records_of(robot, made, seed: int, factor: float) -> PeriodicRecords:
    """Return the steady-state periods of a simulation."""
    refs = made.repeated(PERIODS + 1)
    rng = np.random.default_rng([seed, made.n_experiments])
    noise = factor * robot.position_noise_std * rng.standard_normal(refs.shape)
    run = simulate_batch(robot, refs, noise=noise, model="linear", threads=1)
    shape = (made.n_experiments, PERIODS, made.n_samples, made.n_inputs)
    u, y, r = (
        x[:, made.n_samples :].reshape(shape)
        for x in (run["torque_cmd_nm"].values, run["position_rad"].values, refs)
    )
    return PeriodicRecords(robot.sample_time_s, u, y, made.lines, r)


def designs(robot, period_s: float, seed: int):
    """Return the zippered experiment and the three orthogonal ones, of the same power per axis."""
    flat = multisine(period_s, robot.sample_time_s, band_hz=(1.0, 40.0), seed=seed)
    single = [s.scaled(rms=RMS_RAD_S) for s in zippered(flat, robot.n_axes)]
    return simultaneous_references(single), references(
        flat.scaled(rms=RMS_RAD_S), 3, directions="dft"
    )


def row(period_s: float, factor: float, runs: int, **options) -> str:
    """Return the figures of a period and a noise level."""
    robot = load_robot("irb6600_like")
    errors, others, smoothed, inside = [], [], [], []
    for seed in range(runs):
        one, three = designs(robot, period_s, seed)
        found = local_joint_input_output(records_of(robot, one, seed, factor), **options)
        true = robot.zoh_response(found["frequency_hz"].values).values
        error = np.abs(found["response"].values - true)
        inside.append(error <= confidence_radius(found).values)
        errors.append(error**2)
        records = records_of(robot, three, seed, factor)
        others.append(np.abs(mfrf(records)["response"].values - true) ** 2)
        local = local_joint_input_output(records, half_width=found.attrs["half_width"])
        smoothed.append(np.abs(local["response"].values - true) ** 2)
    mean = np.mean(errors, axis=0)
    ratio, fair = (np.median(mean / np.mean(x, axis=0)) for x in (others, smoothed))
    one, _ = designs(robot, period_s, runs)
    exact = local_joint_input_output(records_of(robot, one, runs, 0.0), **options)
    bias = np.abs(exact["response"].values - true) / np.sqrt(mean)
    covered = np.mean(inside, axis=(0, 2, 3))
    f = found["frequency_hz"].values
    bands = [covered[(f >= low) & (f < low + 1)].mean() for low in range(1, 40)]
    relative = np.median(np.sqrt(mean) / np.abs(true))
    distance = 3 / period_s / NARROWEST_HZ
    lowest = int(np.argmin(bands))
    return (
        f"{period_s:6g} s  {distance:5.2f}  {factor:5g}  {100 * relative:7.3f} %  {ratio:6.3f}"
        f"  {ratio / 3:8.3f}  {fair / 3:8.2f}  {100 * covered.mean():6.1f} %"
        f"  {100 * bands[lowest]:5.1f} % at {1 + lowest:2d} Hz"
        f"  {np.quantile(bias, 0.5):6.3f}  {bias.max():6.2f}"
    )


def main(runs: int) -> None:
    """Print the table."""
    print(
        "period  lines  noise  std (median)  ratio  per time  smoothed  coverage  lowest band"
        "  bias (median)  bias (largest)"
    )
    for period_s in (5.0, 10.0, 20.0):
        for factor in (1.0, 10.0, 100.0):
            print(row(period_s, factor, runs), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)

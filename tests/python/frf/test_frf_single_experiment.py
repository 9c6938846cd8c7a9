"""The full response from one experiment: `local_joint_input_output`."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Robot, load_robot, simulate_batch
from axisight.errors import InputError
from axisight.excitation import (
    Multisine,
    References,
    multisine,
    references,
    simultaneous_references,
    zippered,
)
from axisight.frf import Flag, confidence_radius, local_joint_input_output, mfrf, robot_loop
from axisight.records import PeriodicRecords

PERIODS = 4
PERIOD_S = 20.0
BAND_HZ = (1.0, 20.0)


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("irb6600_like")


def flat_of(robot: Robot, seed: int, period_s: float = PERIOD_S) -> Multisine:
    return multisine(period_s, robot.sample_time_s, band_hz=BAND_HZ, seed=seed)


def one_experiment(robot: Robot, seed: int, period_s: float = PERIOD_S) -> References:
    parts = zippered(flat_of(robot, seed, period_s), robot.n_axes)
    return simultaneous_references([p.scaled(rms=4.0) for p in parts])


def records_of(robot: Robot, made: References, seed: int, factor: float) -> PeriodicRecords:
    """Return periods in steady state, with the sensor noise times a factor."""
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


def rational_records(zeta: float, period_s: float, noise: float, seed: int) -> PeriodicRecords:
    """Return one steady-state experiment of a loop of two inputs whose poles are one complex pair.

    Signals follow from the spectra, so there is no leakage.
    """
    step, n = 1e-2, round(period_s / 1e-2)
    rng = np.random.default_rng(seed)
    lines = np.arange(round(2 * period_s), round(20 * period_s))
    s = 2j * np.pi * lines / period_s
    pole = 1 / (s**2 + 2 * zeta * 60 * s + 3600)
    mix = np.array([[1.0, 0.3], [0.2, 1.0]])
    to_input = np.eye(2) * (1 + 3600 * pole)[:, None, None] + 0.1 * mix
    # The output per velocity is a constant over the same poles.
    to_output = mix * 3600 * (pole / s)[:, None, None]
    reference = np.zeros((len(lines), 2), np.complex128)
    turns = np.exp(2j * np.pi * rng.random(len(lines))) * n / 2
    reference[np.arange(len(lines)), np.arange(len(lines)) % 2] = turns
    u, y = (np.einsum("kij,kj->ki", h, reference) for h in (to_input, to_output))

    def signal(spectrum: NDArray[np.complex128]) -> NDArray[np.float64]:
        whole = np.zeros((n // 2 + 1, 2), np.complex128)
        whole[lines] = spectrum
        return np.fft.irfft(whole, n, axis=0)[None, None]

    output = signal(y)
    output = output + noise * rng.standard_normal(output.shape)
    records = PeriodicRecords(step, signal(u), output, lines, signal(reference))
    object.__setattr__(records, "true", to_output @ np.linalg.inv(to_input))
    return records


def test_resonance_inside_the_window_causes_no_bias() -> None:
    # Identity: responses with one pole pair obey the local model exactly if the orders suffice: N of
    # order 4 over D of order 2. The bandwidth is 0.19 Hz, the lines of an input are 0.4 Hz apart.
    records = rational_records(0.01, 5.0, 0.0, 0)
    true = records.true  # type: ignore[attr-defined]
    found = local_joint_input_output(records)["response"].values
    assert np.abs(found / true - 1).max() < 1e-6
    polynomial = local_joint_input_output(records, denominator_order=0)["response"].values
    assert np.abs(polynomial / true - 1).max() > 0.01


def test_three_experiments_agree_with_the_exact_estimate(arm: Robot) -> None:
    # Oracle: with n experiments at every line, Y U^-1 of each line is exact without noise.
    made = references(flat_of(arm, 1).scaled(rms=4.0), 3, directions="dft")
    records = records_of(arm, made, 0, 0.0)
    exact = mfrf(records)["response"].values
    found = local_joint_input_output(records)
    error = np.abs(found["response"].values - exact) / np.abs(exact)
    assert np.median(error) < 1e-5
    assert error.max() < 1e-2


def test_zippered_experiment_recovers_the_response(arm: Robot) -> None:
    # Monte Carlo over 6 runs. Coverage of 380 lines, 9 elements and 6 runs; a window of 27 lines makes
    # 380 * 6 / 27 = 84 independent lines, whose disc fails with 5 %: a standard deviation of 2.4 % if
    # elements are fully correlated. The bench prints 94 to 95 %, with 40 runs.
    inside, errors, others = [], [], []
    for seed in range(6):
        found = local_joint_input_output(records_of(arm, one_experiment(arm, seed), seed, 10.0))
        assert (found["flag"] == Flag.GOOD).all()
        true = arm.zoh_response(found["frequency_hz"].values).values
        error = np.abs(found["response"].values - true)
        inside.append(error <= confidence_radius(found).values)
        errors.append(error**2)
        made = references(flat_of(arm, seed).scaled(rms=4.0), 3, directions="dft")
        three = mfrf(records_of(arm, made, seed, 10.0))["response"].values
        others.append(np.abs(three - true) ** 2)
    assert 0.93 <= np.mean(inside) <= 0.97
    # In a third of the time, so the variance per time is a third of this ratio.
    ratio = np.median(np.mean(errors, axis=0) / np.mean(others, axis=0))
    assert ratio / 3 <= 1.2


def test_bandwidth_against_the_distance_of_lines_decides(arm: Robot) -> None:
    # Without noise only the bias is left. The narrowest pole of this loop is 0.51 Hz wide; lines of an
    # axis are 0.15 Hz and 0.6 Hz apart.
    worst = []
    for period_s in (20.0, 5.0):
        records = records_of(arm, one_experiment(arm, 0, period_s), 0, 0.0)
        found = local_joint_input_output(records)
        true = arm.zoh_response(found["frequency_hz"].values).values
        worst.append(np.max(np.abs(found["response"].values / true - 1)))
    assert worst[0] < 5e-3
    assert worst[1] > 10 * worst[0]


def test_random_phases_on_all_lines_of_all_axes(arm: Robot) -> None:
    flat = flat_of(arm, 0)
    signals = [
        multisine(PERIOD_S, arm.sample_time_s, lines=flat.lines, seed=9, run=i) for i in range(3)
    ]
    made = simultaneous_references([s.scaled(rms=4.0) for s in signals])
    found = local_joint_input_output(records_of(arm, made, 0, 10.0))
    true = arm.zoh_response(found["frequency_hz"].values).values
    inside = np.abs(found["response"].values - true) <= confidence_radius(found).values
    # One run: 380 / 27 = 14 independent lines, a standard deviation of 6 %.
    assert np.mean(inside) > 0.8


def test_quantity_is_a_derivative(arm: Robot) -> None:
    records = records_of(arm, one_experiment(arm, 0), 0, 1.0)
    position = local_joint_input_output(records, lines=records.lines[5:8])
    acceleration = local_joint_input_output(
        records, lines=records.lines[5:8], quantity="acceleration"
    )
    factor = (2j * np.pi * position["frequency_hz"].values[:, None, None]) ** 2
    assert acceleration["response"].values == pytest.approx(position["response"].values * factor)
    assert acceleration["variance"].values == pytest.approx(
        position["variance"].values * np.abs(factor) ** 2
    )


def test_one_axis_without_excitation_is_flagged(arm: Robot) -> None:
    made = one_experiment(arm, 0)
    records = records_of(arm, made, 0, 1.0)
    assert records.reference is not None
    silent = records.reference.copy()
    silent[..., 2] = 0.0
    found = local_joint_input_output(
        PeriodicRecords(records.sample_time_s, records.input, records.output, records.lines, silent)
    )
    assert (found["flag"] == Flag.RANK_DEFICIENT).all()
    assert np.isnan(found["response"].values).all()


def test_misuse_is_named(arm: Robot) -> None:
    made = one_experiment(arm, 0)
    records = records_of(arm, made, 0, 1.0)
    without = PeriodicRecords(records.sample_time_s, records.input, records.output, records.lines)
    with pytest.raises(InputError, match=r"records\.reference: expected the recorded reference"):
        local_joint_input_output(without)
    with pytest.raises(InputError, match="at least 28 excited lines"):
        few = PeriodicRecords(
            records.sample_time_s,
            records.input,
            records.output,
            records.lines[:20],
            records.reference,
        )
        local_joint_input_output(few)
    with pytest.raises(InputError, match="half_width"):
        local_joint_input_output(records, half_width=2)
    with pytest.raises(InputError, match="lines: expected excited lines"):
        local_joint_input_output(records, lines=np.array([3]))


def test_loop_is_the_reason_for_the_reference(arm: Robot) -> None:
    # The closed loop of this robot has wider resonances than the arm alone, so its responses can be
    # interpolated between lines where G cannot.
    f = np.linspace(8.0, 9.0, 401)
    loop = robot_loop(arm, f)
    torque = np.linalg.inv(np.eye(3) + loop.controller @ loop.response) @ loop.controller

    def width(values: NDArray[np.complex128]) -> float:
        size = np.abs(values)
        return float(np.mean(size > size.max() / np.sqrt(2)))

    assert width(loop.response[:, 0, 0]) < 0.4 * width((loop.response @ torque)[:, 0, 0])

"""Optimal spectra of robots in their loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import Robot, load_robot, simulate_batch
from axisight.errors import InputError
from axisight.excitation import (
    Multisine,
    excite,
    multisine,
    optimal_spectrum,
    read_design,
    read_references,
    references,
    write_references,
)
from axisight.frequency_fit import (
    FrequencyFitOptions,
    MeasuredResponse,
    fit_responses,
    line_information,
    model_response,
)
from axisight.frf import local_polynomial, robot_loop, with_input_covariance
from axisight.records import PeriodicRecords

QUESTION = "axis1.stiffness"


@pytest.fixture(scope="module")
def axis() -> Robot:
    return load_robot("two_mass_axis").with_effects([])


@pytest.fixture(scope="module")
def arm() -> Robot:
    return load_robot("irb6600_like")


def flat_of(robot: Robot) -> Multisine:
    return multisine(5.0, robot.sample_time_s, band_hz=(1.0, 40.0), seed=1).scaled(rms=0.2)


def test_information_is_that_of_the_output_error(axis: Robot) -> None:
    # Oracle: 2 |dG U|^2 / E|V|^2 with central differences of the response in the logarithm of the
    # parameter; their error is of the order of h^2 = 1e-8.
    f = np.array([2.0, 8.0, 9.5, 20.0])
    n, h = 10_000, 1e-4
    found = line_information(axis, [QUESTION], f, directions=np.eye(1), n_samples=n, n_periods=3)
    at = axis.parameters()[QUESTION]
    up, down = (
        model_response(axis.with_parameters({QUESTION: at * np.exp(s * h)}), f).values[:, 0, 0]
        for s in (1, -1)
    )
    loop = robot_loop(axis, f)
    g, c, p = (x[:, 0, 0] for x in (loop.response, loop.controller, loop.prefilter))
    u = c * p / (1 + c * g) * n / 2
    noise = n * axis.position_noise_std**2 / 3
    expected = 2 * np.abs((up - down) / (2 * h) * u) ** 2 / noise
    assert found.information[:, 0, 0] == pytest.approx(expected, rel=1e-5)
    assert found.power["torque"] == pytest.approx(0.5 * np.abs(u / (n / 2)) ** 2, rel=1e-9)
    velocity = 2 * np.pi * f * np.abs(g * u) / (n / 2)
    assert found.power["velocity"] == pytest.approx(0.5 * velocity**2, rel=1e-9)


def test_information_grows_with_power_and_time_not_with_turned_directions(arm: Robot) -> None:
    f = np.array([3.0, 9.0, 15.0])
    one = line_information(arm, [QUESTION], f, directions=np.eye(3), n_samples=10_000)
    two = line_information(arm, [QUESTION], f, directions=2 * np.eye(3), n_samples=10_000)
    more = line_information(arm, [QUESTION], f, directions=np.eye(3), n_samples=10_000, n_periods=4)
    assert two.information == pytest.approx(4 * one.information, rel=1e-9)
    assert more.information == pytest.approx(4 * one.information, rel=1e-9)
    orthogonal = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turned = line_information(arm, [QUESTION], f, directions=orthogonal, n_samples=10_000)
    # Orthogonal directions bring the same information, (6.18).
    assert turned.information == pytest.approx(one.information, rel=1e-6)
    assert turned.power["torque"] == pytest.approx(one.power["torque"], rel=1e-9)


@pytest.mark.parametrize("limited", ["torque", "velocity", "both"])
def test_limited_powers_are_those_of_the_flat_signal(axis: Robot, limited: str) -> None:
    flat = flat_of(axis)
    found = optimal_spectrum(axis, flat, QUESTION, limited=limited)  # type: ignore[arg-type]
    assert found.status == "converged"
    assert found.dispersion.max() < 1.01
    names = ("torque", "velocity") if limited == "both" else (limited,)
    ratios = [found.rms[name] / found.flat_rms[name] for name in names]  # type: ignore[index]
    assert max(ratios) == pytest.approx(1.0, rel=1e-9)
    assert found.gain > 2
    assert found.gain == pytest.approx(
        (found.flat_relative_std[QUESTION] / found.relative_std[QUESTION]) ** 2
    )
    assert found.shares.sum() == pytest.approx(1.0)


def test_response_spectra_give_equal_accuracy(axis: Robot) -> None:
    # (5.2): the power of the output is in proportion to that of the noise, which is white here.
    flat = flat_of(axis)
    found = optimal_spectrum(axis, flat, "relative_response", limited="torque")
    loop = robot_loop(axis, found.signal.frequency_hz)
    g, c, p = (x[:, 0, 0] for x in (loop.response, loop.controller, loop.prefilter))
    u = c * p / (1 + c * g) * found.signal.amplitude
    assert np.abs(g * u) == pytest.approx(np.full(len(u), np.abs(g * u)[0]))
    # (5.1): the power of the input is in proportion to that of the noise.
    found = optimal_spectrum(axis, flat, "absolute_response", limited="torque")
    u = c * p / (1 + c * g) * found.signal.amplitude
    assert np.abs(u) == pytest.approx(np.full(len(u), np.abs(u)[0]))
    assert found.status == "closed_form"


def noisy(robot: Robot) -> Robot:
    text = robot.toml.replace("position_noise_std = 1.2e-5", "position_noise_std = 1.0e-4")
    return Robot.from_toml(text).with_effects([])


def response_of(robot: Robot, signal: Multisine, seed: int) -> MeasuredResponse:
    """Return the response of two periods after one of waiting."""
    made = references(signal, robot.n_axes)
    run = simulate_batch(robot, made.repeated(3), noise_seed=seed, model="linear", threads=1)
    shape = (made.n_experiments, 2, made.n_samples, made.n_inputs)
    u, y = (
        run[x].values[:, made.n_samples :].reshape(shape) for x in ("torque_cmd_nm", "position_rad")
    )
    records = PeriodicRecords(robot.sample_time_s, u, y, made.lines)
    found = with_input_covariance(local_polynomial(records, threads=1), records)
    return MeasuredResponse.of(robot.operating_point, found, covariance=found["covariance"])


def estimate(robot: Robot, data: list[MeasuredResponse]) -> tuple[float, Robot]:
    names = [p for p in robot.parameters() if p.endswith((".stiffness", ".damping"))]
    options = FrequencyFitOptions(criterion="weighted_least_squares", neighbours=0)
    fit = fit_responses(
        robot, data, {n: 1.02 * robot.parameters()[n] for n in names}, options=options
    )
    return float(
        fit.values[fit.names.index(QUESTION)] / robot.parameters()[QUESTION] - 1
    ), fit.robot


def test_two_steps_halve_the_variance(axis: Robot) -> None:
    # Two periods flat, a design from their fit, two optimal, against two times two flat: the same
    # time, torque and velocity. Predicted for the second step alone: 0.1. The ratio of two variances
    # of 20 runs is below 2.1 times its expectation with 95 % probability (F distribution).
    robot = noisy(axis)
    flat = flat_of(robot)
    twice, steps = [], []
    for seed in range(20):
        first = response_of(robot, flat, seed)
        twice.append(estimate(robot, [first, response_of(robot, flat, 100 + seed)])[0])
        _, model = estimate(robot, [first])
        found = optimal_spectrum(model, flat, QUESTION)
        steps.append(estimate(robot, [first, response_of(robot, found.signal, 100 + seed)])[0])
    assert np.mean(np.square(steps)) < 0.5 * np.mean(np.square(twice))


def test_robust_design_covers_models_that_are_20_percent_off(arm: Robot) -> None:
    flat = flat_of(arm)
    names = [p for p in arm.parameters() if p.endswith((".stiffness", ".damping"))]
    sharp = optimal_spectrum(arm, flat, QUESTION)
    robust = optimal_spectrum(
        arm, flat, QUESTION, relative_uncertainty=0.2, models=16, tolerance=1e-2
    )
    assert robust.gain < sharp.gain
    rng = np.random.default_rng(5)
    ratios: dict[str, list[float]] = {"sharp": [], "robust": []}
    for _ in range(6):
        other = {
            n: arm.parameters()[n] * float(np.exp(0.18 * rng.standard_normal())) for n in names
        }
        lines = line_information(
            arm, other, flat.frequency_hz, directions=np.eye(3), n_samples=flat.n_samples
        )
        before = flat.amplitude**2
        at = lines.names.index(QUESTION)
        for name, found in (("sharp", sharp), ("robust", robust)):
            after = np.zeros(len(before))
            after[np.isin(flat.lines, found.signal.lines)] = found.signal.amplitude**2
            after /= max(
                lines.power[q] @ after / (lines.power[q] @ before) for q in ("torque", "velocity")
            )
            variance = [
                np.linalg.inv(np.einsum("k,kij->ij", a, lines.information))[at, at]
                for a in (after, before)
            ]
            ratios[name].append(variance[0] / variance[1])
    assert np.mean(ratios["robust"]) < np.mean(ratios["sharp"])
    assert np.mean(ratios["robust"]) < 0.6


def test_measured_information_moves_the_power(axis: Robot) -> None:
    # If the damping is known, the stiffness alone decides.
    flat = flat_of(axis)
    names = ["axis1.stiffness", "axis1.damping"]
    known = optimal_spectrum(
        axis, flat, "all", parameters=names, measured_information=np.diag([0.0, 1e20])
    )
    alone = optimal_spectrum(
        axis, flat, QUESTION, parameters=names, measured_information=np.diag([0.0, 1e20])
    )
    assert known.relative_std[QUESTION] == pytest.approx(alone.relative_std[QUESTION], rel=1e-2)


def test_effects_without_linear_model_are_named() -> None:
    robot = load_robot("two_mass_axis")
    found = optimal_spectrum(robot, flat_of(robot), "all")
    assert found.left_out == ("nonlinear_stiffness@1", "coulomb_friction@1")


def test_misuse_is_named(axis: Robot) -> None:
    flat = flat_of(axis)
    with pytest.raises(InputError, match=r"Did you mean 'axis1\.stiffness'"):
        optimal_spectrum(axis, flat, "axis1.stifness")
    with pytest.raises(InputError, match="flat_share"):
        optimal_spectrum(axis, flat, flat_share=1.0)
    with pytest.raises(InputError, match="limited"):
        optimal_spectrum(axis, flat, limited="current")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="measured_information"):
        optimal_spectrum(axis, flat, measured_information=np.eye(5))


def design(**changes: object) -> dict[str, object]:
    signal = {"period_s": 5.0, "band_hz": [1.0, 40.0], "peak_rad_s": 2.0, "starts": 1}
    return {"robot": "irb6600_like", "signal": signal, **changes}


def test_design_keeps_the_optimal_spectrum(tmp_path: Path) -> None:
    made = excite(read_design(design(optimal={"optimal_for": "axis3.stiffness"})))
    assert made.optimal is not None
    assert made.optimal.gain > 2
    assert made.signal.peak == pytest.approx(2.0)
    write_references(made.references, tmp_path / "r.parquet")
    kept = read_references(tmp_path / "r.parquet").design
    assert kept["excite"]["optimal"]["optimal_for"] == "axis3.stiffness"
    assert kept["broadband"]["amplitude"] == pytest.approx(made.signal.amplitude)  # type: ignore[union-attr]


def test_design_with_zippered_axes() -> None:
    made = excite(read_design(design(directions="zippered")))
    assert made.references.n_experiments == 1
    assert len(made.signals) == 3
    spectrum = np.abs(np.fft.rfft(made.references.period[0], axis=0))
    for axis, signal in enumerate(made.signals):
        assert signal.peak == pytest.approx(2.0)
        others = np.delete(spectrum[signal.lines], axis, axis=1)
        assert others.max() < 1e-9 * spectrum.max()
        assert (spectrum[signal.lines, axis] > 1e-3 * spectrum.max()).all()


def test_designs_that_do_not_go_together() -> None:
    with pytest.raises(InputError, match="at most one of an optimal spectrum and zippered"):
        excite(read_design(design(directions="zippered", optimal={})))
    chirp = {"kind": "chirp", "period_s": 5.0, "band_hz": [1.0, 40.0], "peak_rad_s": 2.0}
    with pytest.raises(InputError, match="optimal: expected the signal kind multisine"):
        excite(read_design(design(signal=chirp, optimal={})))

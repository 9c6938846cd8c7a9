"""Responses from logs: exact without noise, whatever the logs hold; covered by their variance with noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import axisight
from axisight.frf import confidence_radius
from axisight.responses import ESTIMATORS, OPERATING_POINT, joint_angles, response_of_logs
from response_logs import gain, joined, log, periodic_logs, robot_logs, truth

# Rounding of a transform of 256 samples, times the condition of U (below 3) and the spread of the spectra
# (below 1e2): 1e-16 * 16 * 3 * 1e2.
ROUNDING = 1e-12


def error(found) -> float:
    """Return the largest error relative to the largest element of the line."""
    exact = truth(found.response)
    size = np.abs(exact).max(axis=(1, 2), keepdims=True)
    return float((np.abs(found.response["response"].values - exact) / size).max())


@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
@pytest.mark.parametrize("realizations", [1, 2])
def test_exact_without_noise(quantity: str, realizations: int) -> None:
    found = response_of_logs(periodic_logs(realizations=realizations), quantity=quantity)
    assert error(found) < ROUNDING
    assert len(found.response["frequency_hz"]) == 58


@pytest.mark.parametrize("estimator", ESTIMATORS[1:-1])
def test_every_estimator_is_exact_without_noise(estimator: str) -> None:
    """Local rational methods smooth over harmonics: curvature over a window of lines biases by up to 1e-4."""
    lines = np.arange(3, 60, 2)
    found = response_of_logs(
        periodic_logs(realizations=1 if estimator == "fast" else 2, lines=lines),
        estimator=estimator,
    )
    smooths = estimator in ("local_rational", "local_joint_input_output")
    assert error(found) < (1e-3 if smooths else ROUNDING)


@pytest.mark.parametrize("average", ["arithmetic", "logarithmic", "harmonic", "none"])
def test_every_mean_is_exact_without_noise(average: str) -> None:
    found = response_of_logs(periodic_logs(realizations=2), average=average)
    assert error(found) < ROUNDING
    assert f"{average} mean" in found.choices[-1] or average == "none"


def test_a_robot_has_its_zero_order_hold_response() -> None:
    """The linear robot from rest: what is left of the transient bounds the error."""
    robot, pose, periods = axisight.load_robot("irb6600_like"), [0.0, 0.3, -0.4], 24
    logs = robot_logs(robot, periods, pose=pose)
    found = response_of_logs(logs, robot=robot, drop_periods=periods - 2, estimator="mfrf")
    frequency = found.response["frequency_hz"].values
    factor = (2j * np.pi * frequency[:, None, None]) ** 2
    exact = robot.with_operating_point(pose).zoh_response(frequency).values * factor
    # The transient falls by a constant factor per period, so the change from one period to the next
    # is at least as large as what is left if that factor is below one half (it is one fifth).
    records = found.records
    change, size = 0.0, np.inf
    for signal, weight in ((records.input, exact), (records.output, factor)):
        spectrum = np.fft.rfft(signal, axis=2)[:, :, records.lines]
        part = np.abs(spectrum[:, 1] - spectrum[:, 0]).max(axis=(0, 2))
        change += part * np.abs(weight).max(axis=(1, 2))
    u = np.fft.rfft(records.input.mean(axis=1), axis=1)[:, records.lines]
    size = np.linalg.svd(u.transpose(1, 2, 0), compute_uv=False)[:, -1]
    bound = 3 * change / size  # three experiments add up
    miss = np.abs(found.response["response"].values - exact).max(axis=(1, 2))
    # Sampling by the matrix exponential leaves 1e-10 of the largest element.
    assert (miss <= bound + 1e-9 * np.abs(exact).max(axis=(1, 2))).all()
    assert np.median(miss / np.abs(exact).max(axis=(1, 2))) < 1e-4


@pytest.mark.parametrize(
    ("options", "estimator", "lines"),
    [
        ({"realizations": 4}, "auto", None),
        ({}, "mfrf", None),
        ({}, "auto", np.arange(3, 60, 2)),
        ({}, "local_polynomial", None),
    ],
)
def test_the_variance_covers_the_truth(options: dict, estimator: str, lines) -> None:
    """Of the 95 % discs 95 % hold the truth, +- 4 standard deviations of a share of that many lines.

    Lines are independent, elements of a line are not: they count as one.
    """
    held = []
    for seed in range(20):
        logs = periodic_logs(noise=0.05, periods=6, seed=seed, lines=lines, **options)
        found = response_of_logs(logs, estimator=estimator, drop_periods=0)
        miss = np.abs(found.response["response"].values - truth(found.response))
        held.append((miss <= confidence_radius(found.response).values).mean(axis=(1, 2)))
    share, count = np.mean(held), np.size(held)
    assert abs(share - 0.95) < 4 * np.sqrt(0.95 * 0.05 / count)


def test_experiments_in_one_log_are_those_of_several() -> None:
    logs = periodic_logs(realizations=2, periods=5)
    apart = response_of_logs(logs, drop_periods=1)
    for rest in (0, 100):
        together = response_of_logs([joined(logs, rest)], drop_periods=1)
        np.testing.assert_allclose(
            together.response["response"], apart.response["response"], rtol=1e-9
        )
        assert any("4 stretches" in text for text in together.choices)


def test_experiments_are_grouped_by_direction() -> None:
    """All first experiments before all second ones: in a row they excite one direction."""
    logs = periodic_logs(realizations=3)
    turned = [logs[2 * m + e] for e in range(2) for m in range(3)]
    found = response_of_logs(turned)
    assert error(found) < ROUNDING
    assert any("the first one is m1e1, m1e2" in text for text in found.choices)


def test_repeated_phases_show_no_distortion() -> None:
    logs = [*periodic_logs(noise=0.01), *periodic_logs(noise=0.01, seed=1)]
    found = response_of_logs(logs)
    assert any("same phases" in text for text in found.choices)
    assert any("distortion: not seen (all realizations" in text for text in found.account.sentences)


def test_distortion_is_told_from_noise() -> None:
    logs = [
        log(one.name, one.torque_nm, one.position_rad + 0.002 * one.position_rad**3,
            one.velocity_ref_rad_s)
        for one in periodic_logs(realizations=4, noise=1e-4)
    ]  # fmt: skip
    found = response_of_logs(logs)
    bands = found.account.bands
    assert (bands["distortion"] > 2 * bands["noise"]).all()
    assert any("distortion dominates" in text for text in found.account.sentences)
    quiet = response_of_logs(periodic_logs(realizations=4, noise=0.05))
    assert not any("distortion dominates" in text for text in quiet.account.sentences)


def test_one_experiment_is_enough_if_lines_are_shared_out() -> None:
    """Zippered lines: axis 1 has the even ones, axis 2 the odd ones. The response is smooth over a window."""
    n, lines = 2048, np.arange(20, 400)
    g, phases = gain(n), np.random.default_rng(5).uniform(0, 2 * np.pi, 380)
    r = np.zeros((n // 2 + 1, 2), complex)
    r[lines, lines % 2] = np.exp(1j * phases)
    u = r @ np.array([[1.0, 0.1], [-0.2, 0.8]])
    y = np.einsum("koi,ki->ko", g, u)
    r, u, y = (np.tile(np.fft.irfft(x, n, axis=0), (4, 1)) for x in (r, u, y))
    for reference, estimator in ((r, "local_joint_input_output"), (None, "local_rational")):
        found = response_of_logs([log("one", u, y, reference)], quantity="position")
        assert found.choices[-1].startswith(f"estimator: {estimator} (1 experiment for 2 axes")
        exact = truth(found.response, n)
        # Lines at either edge of the band have one-sided windows.
        miss = np.abs(found.response["response"].values - exact)[20:-20]
        assert miss.max() < 1e-6 * np.abs(exact).max()


def test_logs_that_do_not_repeat_give_a_local_model() -> None:
    generator = np.random.default_rng(7)
    u = generator.standard_normal((2, 4000, 2))
    y = np.zeros_like(u)
    for t in range(1, 4000):
        y[:, t] = 0.6 * y[:, t - 1] + u[:, t] @ np.array([[1.0, 0.3], [0.2, 0.5]])
    found = response_of_logs(
        [log(f"e{e}", u[e], y[e], u[e]) for e in range(2)], quantity="position"
    )
    frequency = found.response["frequency_hz"].values
    pole = 1 / (1 - 0.6 * np.exp(-2j * np.pi * frequency * 1e-3))
    exact = pole[:, None, None] * np.array([[1.0, 0.2], [0.3, 0.5]])
    assert np.abs(found.response["response"].values - exact).max() < 1e-9
    assert "the logs do not repeat" in found.choices[-1]
    spectral = response_of_logs(
        [log(f"e{e}", u[e], y[e], u[e]) for e in range(2)],
        quantity="position",
        estimator="spectral",
    )
    near = np.abs(spectral.response["response"].values - exact)
    # Lines at the edges have too few neighbours.
    assert np.nanmedian(near) < 0.05


def test_the_operating_point_is_that_of_the_joints() -> None:
    """Of motors with gears: within what the motion shifts it; of joint encoders: their mean."""
    robot, pose = axisight.load_robot("irb6600_like"), [0.0, 0.3, -0.4]
    logs = robot_logs(robot, 4, pose=pose)
    at = response_of_logs(logs, robot=robot, drop_periods=2).response.attrs[OPERATING_POINT]
    # Gears deflect by 2 and 3 mrad here; the linear robot moves about its pose by 0.1 mrad in the mean.
    np.testing.assert_allclose(at, pose, atol=3e-4)
    assert response_of_logs(logs, drop_periods=2).response.attrs.get(OPERATING_POINT) is None
    still = robot.equilibrium(pose)
    gear = still["motor_angle_rad"].values * robot.gear_ratio
    torque = still["motor_torque_nm"].values / robot.gear_ratio
    np.testing.assert_allclose(joint_angles(robot, gear, torque), pose, atol=1e-12)
    encoders = [
        log(one.name, one.torque_nm, one.position_rad, one.velocity_ref_rad_s, robot.sample_time_s,
            joint=np.tile(pose, (one.n_samples, 1)))
        for one in logs
    ]  # fmt: skip
    found = response_of_logs(encoders, drop_periods=2)
    np.testing.assert_allclose(found.response.attrs[OPERATING_POINT], pose, atol=1e-12)


def test_still_axes_are_left_out() -> None:
    wide = [
        log(one.name, *(np.insert(x, 1, 0.5, axis=1) for x in
                        (one.torque_nm, one.position_rad, one.velocity_ref_rad_s)))
        for one in periodic_logs()
    ]  # fmt: skip
    found = response_of_logs(wide)
    assert list(found.response["input"].values) == [1, 3]
    assert error(found) < ROUNDING
    assert found.choices[0].startswith("axes: 1, 3; without 2")


def test_position_targets_are_a_reference_too() -> None:
    """Their rate is the reference. The targets themselves drift, and their high lines are weak."""
    logs = []
    for one in periodic_logs():
        rate = one.velocity_ref_rad_s
        target = np.cumsum(rate, axis=0) * one.sample_time_s
        logs.append(replace(one, velocity_ref_rad_s=None, position_ref_rad=target))
    found = response_of_logs(logs, drop_periods=1)
    assert found.choices[0].endswith("found from the reference")
    assert error(found) < ROUNDING

"""The three steps of chapter 9 on motions of known parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

from axisight.errors import InputError
from axisight.excitation import multisine, square, triangle
from axisight.frf import etfe, frequency_response
from axisight.graybox import (
    AxisData,
    AxisModel,
    Collocated,
    Landmark,
    axis_data,
    collocated,
    flexibilities,
    identify_axis,
    initial_model,
)
from axisight.graybox.flexibilities import cubic_spring, initial_flexibility, simulate_deflection
from axisight.graybox.landmarks import find_notch
from axisight.graybox.spring_masses import SpringMassChain
from axisight.graybox.step_one import rigid_body_friction
from axisight.logs import Log
from axisight.records import PeriodicRecords
from axisight.robot import load_robot
from axisight.simulation import simulate

STEP = 5e-4
FINE_HZ = np.arange(5, 251) / 5
RATIO = 1 / 224.3
RIGID = 0.0121 + RATIO**2 * 1130.0
TWO = SpringMassChain(
    np.array([0.0121 / RATIO**2, 1130.0]), np.array([1.46e6]), np.array([2.63e3]), RATIO
)


def rigid_motion(seconds: float = 12.0) -> tuple[np.ndarray, np.ndarray]:
    """Torque and position of an axis without flexibility, smooth motion below 1 Hz."""
    t = STEP * np.arange(round(seconds / STEP))
    rates = 2 * np.pi * np.array([0.2, 0.5])
    sizes = np.array([30.0, 8.0])
    position = sum(-a / w * np.cos(w * t) for a, w in zip(sizes, rates, strict=True))
    velocity = sum(a * np.sin(w * t) for a, w in zip(sizes, rates, strict=True))
    acceleration = sum(a * w * np.cos(w * t) for a, w in zip(sizes, rates, strict=True))
    torque = 0.03 * acceleration + 0.013 * velocity + 0.64 * np.sign(velocity)
    return torque, position


def test_step_one_recovers_a_rigid_axis() -> None:
    torque, position = rigid_motion()
    found = rigid_body_friction(torque, position, STEP, cutoff_hz=10.0)
    # The filter takes (0.5 / 10)^8 of the motion; differences are off by (w T)^2 / 6.
    assert found.inertia_kg_m2 == pytest.approx(0.03, rel=1e-4)
    assert found.viscous_friction_nm_s_rad == pytest.approx(0.013, rel=1e-3)
    assert found.coulomb_friction_nm == pytest.approx(0.64, rel=1e-4)
    assert found.fit_percent > 99.9 and not found.findings


def test_step_one_is_the_least_squares_of_numpy_on_its_columns() -> None:
    torque, position = rigid_motion()
    rng = np.random.default_rng(0)
    torque = torque + rng.normal(0, 0.2, len(torque))
    found = rigid_body_friction(torque, position, STEP, cutoff_hz=10.0, offset=True)
    shifted = rigid_body_friction(torque + 1.0, position, STEP, cutoff_hz=10.0, offset=True)
    # A constant torque changes the offset, and nothing else.
    assert found.offset_nm is not None and shifted.offset_nm is not None
    assert shifted.offset_nm - found.offset_nm == pytest.approx(1.0, abs=1e-9)
    assert shifted.inertia_kg_m2 == pytest.approx(found.inertia_kg_m2, rel=1e-9)
    # And motion ten times as slow has a hundred times the inertia: units cancel.
    slow = rigid_body_friction(torque, position, 10 * STEP, cutoff_hz=1.0)
    fast = rigid_body_friction(torque, position, STEP, cutoff_hz=10.0)
    assert slow.inertia_kg_m2 == pytest.approx(100 * fast.inertia_kg_m2, rel=1e-6)


def test_step_one_standard_errors_cover() -> None:
    torque, position = rigid_motion()
    rng = np.random.default_rng(1)
    truth = np.array([0.03, 0.013, 0.64])
    score = []
    for _ in range(40):
        # Noise correlated over 0.05 s, as errors of a rigid model are.
        noise = np.convolve(rng.normal(0, 0.02, len(torque) + 99), np.ones(100), "valid")
        found = rigid_body_friction(torque + noise, position, STEP, cutoff_hz=5.0)
        values = np.array(
            [found.inertia_kg_m2, found.viscous_friction_nm_s_rad, found.coulomb_friction_nm]
        )
        score.append((values - truth) / np.sqrt(np.diag(found.covariance)))
    # 120 scores, three correlated ones at a time: mean square one within about 0.3; the
    # triangular window of the covariance falls a little short.
    assert 0.6 < np.mean(np.square(score)) < 1.6


def test_step_one_of_the_flexible_axis() -> None:
    robot = load_robot("two_mass_axis")
    wave = np.tile(triangle(5.0, STEP, amplitude=40.0).period, 2)[:12_500]
    run = simulate(robot, wave, noise_seed=0)
    found = rigid_body_friction(
        run["torque_cmd_nm"].values[:, 0], run["position_rad"].values[:, 0], STEP
    )
    # The tips of the triangle ring the arm, which a rigid model takes for inertia.
    assert abs(found.inertia_kg_m2 - RIGID) < 3 * found.inertia_standard_error
    assert found.inertia_kg_m2 == pytest.approx(RIGID, rel=0.02)
    assert found.coulomb_friction_nm == pytest.approx(0.644, rel=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda u, y: (u, np.abs(y).cumsum() * STEP),
            "expected motion in both directions, got 100 %",
        ),
        (lambda u, y: (u, y[:-1]), "expected 24000 samples as torque_nm, got 23999"),
        (lambda u, y: (u * np.nan, y), "torque_nm: expected finite numbers, got nan at sample 1"),
        (lambda u, y: (u[:1000], y[:1000]), "expected more than 2050 samples"),
        (lambda u, y: (u, y[:, None]), "position_rad: expected real numbers of shape"),
        (lambda u, y: (u, ["a"] * len(u)), "position_rad: expected real numbers of shape"),
    ],
)
def test_step_one_misuse(change: object, message: str) -> None:
    torque, position = change(*rigid_motion())  # type: ignore[operator]
    with pytest.raises(InputError, match=message):
        rigid_body_friction(torque, position, STEP)


def test_step_one_tells_what_the_motion_does_not_show() -> None:
    # A square wave of speed smoothed little: viscous and Coulomb friction are one.
    speed = np.tile(square(4.0, STEP, amplitude=20.0, smoothing_samples=20).period, 4)
    position = np.cumsum(speed) * STEP
    torque = 0.03 * np.gradient(speed, STEP) + 0.013 * speed + 0.64 * np.sign(speed)
    with pytest.raises(InputError, match="tells viscous friction and Coulomb friction apart"):
        rigid_body_friction(torque, position, STEP, cutoff_hz=2.0, least_speed_rad_s=19.9)
    reversed_sign = rigid_body_friction(-rigid_motion()[0], rigid_motion()[1], STEP)
    assert any("wrong sign" in text for text in reversed_sign.findings)


def two_mass_response(top_hz: float = 40.0, bottom_hz: float = 1.0) -> xr.Dataset:
    frequency = np.arange(round(5 * bottom_hz), round(5 * top_hz) + 1) / 5
    value = TWO.acceleration_response(frequency)[:, None, None]
    attrs = {"quantity": "acceleration"}
    return frequency_response(
        frequency, value, estimator="given", output_unit="rad/s^2", attrs=attrs
    )


def test_step_two_of_two_masses() -> None:
    found = initial_flexibility(two_mass_response(), rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO)
    notch = np.sqrt(1.46e6 / 1130)
    # Lines are 1.26 rad/s apart; the notch is found to a hundredth of that.
    assert found.notch.frequency_rad_s == pytest.approx(notch, abs=0.02)
    assert found.notch.damping_ratio == pytest.approx(2630 / (2 * notch * 1130), rel=0.05)
    # From 1.6 times the peak: what is left of sixth order is below 1 %.
    assert found.motor_inertia_kg_m2 == pytest.approx(0.0121, rel=0.01)
    assert found.arm_inertia_kg_m2 == pytest.approx(1130.0, rel=0.01)
    assert found.stiffness_nm_rad == pytest.approx(1.46e6, rel=0.01)
    assert found.damping_nm_s_rad == pytest.approx(2630.0, rel=0.05)
    assert not found.findings


def test_step_two_scales_with_the_gear() -> None:
    # Torque in other units: inertias, stiffness and damping scale, the notch does not.
    data = two_mass_response()
    one = initial_flexibility(data, rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO)
    half = data.assign(response=data["response"] / 2)
    two = initial_flexibility(half, rigid_inertia_kg_m2=2 * RIGID, gear_ratio=2 * RATIO)
    assert two.notch.frequency_rad_s == pytest.approx(one.notch.frequency_rad_s, rel=1e-9)
    assert two.notch.damping_ratio == pytest.approx(one.notch.damping_ratio, rel=1e-6)
    assert two.motor_inertia_kg_m2 == pytest.approx(2 * one.motor_inertia_kg_m2)
    assert two.stiffness_nm_rad == pytest.approx(one.stiffness_nm_rad / 2)


def test_the_notch_error_is_that_of_the_noise() -> None:
    data = two_mass_response()
    rng = np.random.default_rng(2)
    level = 0.5  # a fiftieth of the level at low frequency
    shape = data["response"].shape
    score = []
    for _ in range(60):
        noise = level * (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)
        noisy = data.assign(
            response=data["response"] + noise,
            variance=(data["response"].dims, np.full(shape, level**2)),
        )
        found = initial_flexibility(noisy, rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO).notch
        score.append(
            (found.frequency_rad_s - np.sqrt(1.46e6 / 1130)) / found.frequency_standard_error_rad_s
        )
    # Seventeen lines give the error itself a scatter of a quarter.
    assert 0.5 < np.mean(np.square(score)) < 2.5


def test_a_variance_of_two_periods_serves_the_landmarks() -> None:
    value = TWO.acceleration_response(FINE_HZ)
    std = 0.1 * np.abs(value)
    score = []
    for run in range(60):
        rng = np.random.default_rng([4, run])
        parts = rng.normal(size=(2, 2, len(value)))
        every = value + std * (parts[0] + 1j * parts[1])
        mean = every.mean(axis=0)
        data = frequency_response(
            FINE_HZ,
            mean[:, None, None],
            estimator="given",
            variance=(np.abs(every - mean) ** 2).sum(axis=0)[:, None, None] / 2,
            degrees_of_freedom=np.ones((len(value), 1, 1)),
            output_unit="rad/s^2",
        )
        notch = find_notch(collocated(data))
        frequency = np.sqrt(1.46e6 / 1130)
        apart = (
            notch.frequency_rad_s - frequency,
            notch.damping_ratio - 2630 / (2 * frequency * 1130),
        )
        score.append(
            np.array(apart) / [notch.frequency_standard_error_rad_s, notch.damping_standard_error]
        )
    # Mean square of 120 scores: one within 0.13 at one deviation, less where seventeen lines
    # make the larger of two errors count. Weighted line by line it is 1.9.
    assert 0.5 < np.mean(np.square(score)) < 1.2


@pytest.mark.parametrize(
    ("band", "message"),
    [
        ((7.0, 40.0), "expected a notch .* at the edge of the band"),
        ((1.0, 7.5), "expected a resonance .* edge of the band"),
        ((1.0, 14.0), "lines above .* for the high-frequency gain"),
    ],
)
def test_step_two_says_what_the_band_lacks(band: tuple[float, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        initial_flexibility(
            two_mass_response(), rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO, band_hz=band
        )


def test_step_two_refuses_a_slope_for_a_plateau() -> None:
    with pytest.raises(InputError, match=r"expected a plateau .* still .* from the level"):
        initial_flexibility(
            two_mass_response(top_hz=14.0),
            rigid_inertia_kg_m2=RIGID,
            gear_ratio=RATIO,
            plateau_from_hz=11.0,
        )
    with pytest.raises(InputError, match="rigid_inertia_kg_m2: expected more than J_m"):
        initial_flexibility(two_mass_response(), rigid_inertia_kg_m2=0.012, gear_ratio=RATIO)
    with pytest.raises(InputError, match="rigid_inertia_kg_m2: expected a positive number"):
        initial_flexibility(two_mass_response(), rigid_inertia_kg_m2=np.nan, gear_ratio=RATIO)
    with pytest.raises(InputError, match="response: expected a Dataset"):
        initial_flexibility([1.0], rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO)  # type: ignore[arg-type]
    upside_down = initial_flexibility(
        two_mass_response(), rigid_inertia_kg_m2=RIGID, gear_ratio=1 / RATIO
    )
    assert any("joint angle per motor angle" in text for text in upside_down.findings)


def test_cubic_spring_of_9_14_is_its_least_squares_solution() -> None:
    rng = np.random.default_rng(3)
    sets = [rng.normal(0, s, 4000) for s in (1e-3, 2e-3)]
    stiffness = [1.0e6, 1.2e6]
    columns = np.vstack([np.stack([x, x**3 * 1e6], axis=1) for x in sets])
    target = np.concatenate([k * x for k, x in zip(stiffness, sets, strict=True)])
    (linear, cubic), *_ = np.linalg.lstsq(columns, target, rcond=None)
    found = cubic_spring(stiffness, sets)
    assert found.linear_nm_rad == pytest.approx(linear, rel=1e-9)
    assert found.cubic_nm_rad3 == pytest.approx(1e6 * cubic, rel=1e-9)


def test_cubic_spring_from_equivalent_gains() -> None:
    # Gains that a spring of these values has for normal deflections, k1 + 3 s^2 k3.
    rng = np.random.default_rng(4)
    sets = [rng.normal(0, s, 200_000) for s in (1e-3, 2e-3)]
    gains = [1e6 + 3e11 * float(np.mean(x**4) / np.mean(x**2)) / 3 for x in sets]
    exact = cubic_spring(gains, sets, method="sets", standard_error_nm_rad=[1e3, 1e3])
    assert exact.linear_nm_rad == pytest.approx(1e6, rel=1e-9)
    assert exact.cubic_nm_rad3 == pytest.approx(1e11, rel=1e-9)
    # Two gains and two unknowns: the difference has sqrt(2) of one error, over 9 (1e-3)^2.
    assert exact.cubic_standard_error == pytest.approx(np.sqrt(2) * 1e3 / 9e-6, rel=0.02)
    # (9.14) leaves 0.14 of it (64.8 / 454.8 from its normal equations); the scatter of the
    # sixth moments of 200,000 samples is 1 %.
    biased = cubic_spring(gains, sets)
    assert biased.cubic_nm_rad3 == pytest.approx(64.8 / 454.8 * 1e11, rel=0.05)


@pytest.mark.parametrize(
    ("stiffness", "sizes", "message"),
    [
        ([1e6], [1e-3], "at least two of different amplitude, got 1 and 1"),
        ([1e6, 1.1e6], [1e-3, 1.05e-3], "at least 10 % apart"),
        ([1e6, 1.1e6], [1e-3], "got 2 and 1"),
        ([1e6, np.nan], [1e-3, 2e-3], "stiffness_nm_rad: expected finite"),
        ([1e6, 1.1e6], [0.0, 2e-3], "not all zero, in set 1"),
    ],
)
def test_cubic_spring_misuse(stiffness: list[float], sizes: list[float], message: str) -> None:
    sets = [s * np.sin(np.arange(100.0)) for s in sizes]
    with pytest.raises(InputError, match=message):
        cubic_spring(stiffness, sets)


def test_deflection_obeys_the_equations_of_motion() -> None:
    # SciPy's Runge-Kutta on (9.9) with the torque held; no friction but viscous.
    rng = np.random.default_rng(5)
    torque = np.repeat(rng.normal(0, 5, 20), 10)
    values = {"motor": 0.0121, "arm": 1130.0, "k": 1.46e6, "d": 2.63e3, "f": 0.013}

    def slope(t: float, x: np.ndarray) -> list[float]:
        u = torque[min(int(t / STEP + 1e-9), len(torque) - 1)]
        spring = values["k"] * x[0] + values["d"] * (RATIO * x[1] - x[2])
        return [
            RATIO * x[1] - x[2],
            (u - values["f"] * x[1] - RATIO * spring) / values["motor"],
            spring / values["arm"],
        ]

    times = STEP * np.arange(len(torque))
    state = np.zeros(3)
    expected = [0.0]
    for t in times[:-1]:
        part = solve_ivp(slope, (t, t + STEP * (1 - 1e-9)), state, rtol=1e-10, atol=1e-14)
        state = part.y[:, -1]
        expected.append(state[0])
    found = simulate_deflection(
        torque,
        np.ones_like(torque),
        STEP,
        motor_inertia_kg_m2=0.0121,
        arm_inertia_kg_m2=1130.0,
        stiffness_nm_rad=1.46e6,
        damping_nm_s_rad=2.63e3,
        viscous_friction_nm_s_rad=0.013,
        coulomb_friction_nm=0.0,
        gear_ratio=RATIO,
    )
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(found).max())


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """A triangle and two amplitudes of multisine with square wave on the preset m3."""
    robot = load_robot("two_mass_axis")
    waves = [np.tile(triangle(5.0, STEP, amplitude=40.0).period, 2)[:12_500]]
    for run, (peak, level) in enumerate(((5.0, 8.0), (10.0, 12.0)), 2):
        lines = multisine(5.0, STEP, band_hz=(1.0, 40.0), seed=0, run=run).scaled(peak=peak)
        waves.append(np.tile(lines.period + square(5.0, STEP, amplitude=level).period, 2))
    out = []
    for number, wave in enumerate(waves, 1):
        run = simulate(robot, wave, noise_seed=0, run=number)
        out.append(
            Log(
                name=f"set {number}",
                sample_time_s=STEP,
                time_s=STEP * np.arange(len(wave)),
                torque_nm=run["torque_cmd_nm"].values,
                position_rad=run["position_rad"].values,
                source=Path("simulated"),
                velocity_ref_rad_s=wave[:, None],
            )
        )
    return out


def test_identify_axis_recovers_m3(logs: list[Log]) -> None:
    found = identify_axis(
        logs[0],
        logs[1:],
        gear_ratio=RATIO,
        period_s=5.0,
        lines=np.arange(5, 201),
        drop_periods=1,
    )
    truth = {"J_m": 0.0121, "J_a": 1130.0, "k1": 1.46e6, "k3": 3.72e10, "d": 2630.0}
    truth |= {"F_v": 0.013, "F_c": 0.644}
    for name, value in truth.items():
        # Sensor noise alone, and the preset's friction rounded over 0.01 rad/s.
        assert found.fit.parameters[name] == pytest.approx(value, rel=5e-3), name
    assert found.fit.converged
    # The differenced noise of the sensor is what is left, 0.034 rad/s.
    assert found.fit.error_std == pytest.approx(np.sqrt(2) * 1.2e-5 / STEP, rel=0.1)
    assert min(found.fit.fit_percent) > 99 > min(found.initial_fit_percent)
    text = found.report()
    for piece in ("Step 1", "Step 2, set 2", "Step 3", "J_a", "k3", "set 3: "):
        assert piece in text
    assert len(found.tests) == 3


def test_lines_are_those_of_the_reference(logs: list[Log]) -> None:
    found = initial_model(logs[0], logs[1:], gear_ratio=RATIO, period_s=5.0, drop_periods=1)
    for response in found.responses:
        frequency = response["frequency_hz"].values
        # The square wave excites odd lines below the band too, and may cancel a line in it.
        found_lines = np.round(5 * frequency)
        assert np.isin(np.arange(5, 201), found_lines).mean() > 0.95
        assert found_lines.max() == 200
    assert not any("found from the torque" in text for text in found.findings)
    blind = [replace(log, velocity_ref_rad_s=None) for log in logs]
    said = initial_model(
        blind[0],
        blind[1:],
        gear_ratio=RATIO,
        period_s=5.0,
        drop_periods=1,
        notch_band_hz=(4.0, 8.0),
        plateau_from_hz=20.0,
    )
    assert any("found from the torque" in text for text in said.findings)


def test_initial_model_of_one_amplitude_says_so(logs: list[Log]) -> None:
    found = initial_model(
        logs[0],
        logs[1:2],
        gear_ratio=RATIO,
        period_s=5.0,
        lines=np.arange(5, 201),
        drop_periods=1,
    )
    assert found.spring is None and found.start["k3"] == 0.0
    assert any("second amplitude" in text for text in found.findings)


def test_a_notch_that_one_line_decides_has_no_standard_error(
    logs: list[Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    def alone(data: Collocated, **options: object) -> Landmark:
        found = find_notch(data, **options)
        nan = np.nan
        return replace(found, frequency_standard_error_rad_s=nan, damping_standard_error=nan)

    monkeypatch.setattr(flexibilities, "find_notch", alone)
    found = initial_model(
        logs[0],
        logs[1:],
        gear_ratio=RATIO,
        period_s=5.0,
        lines=np.arange(5, 201),
        drop_periods=1,
    )
    assert found.spring is not None and found.spring.cubic_nm_rad3 > 0
    assert np.isnan([found.spring.linear_standard_error, found.spring.cubic_standard_error]).all()
    assert any("too narrow or too noisy to show damping" in text for text in found.findings)


def test_initial_model_misuse(logs: list[Log]) -> None:
    with pytest.raises(InputError, match="broadband: expected at least one record"):
        initial_model(logs[0], [], gear_ratio=RATIO)
    with pytest.raises(InputError, match="axis: expected 1, got 2"):
        initial_model(logs[0], logs[1:], gear_ratio=RATIO, axis=2)
    with pytest.raises(InputError, match="rigid: expected AxisData or a Log, got list"):
        initial_model([1.0], logs[1:], gear_ratio=RATIO)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="gear_ratio: expected that of the model"):
        identify_axis(logs[0], logs[1:], gear_ratio=RATIO, model=AxisModel(gear_ratio=0.01))
    blind = replace(axis_data(logs[0]), position_rad=None)
    with pytest.raises(InputError, match="expected position_rad, got none"):
        initial_model(blind, logs[1:], gear_ratio=RATIO)


def test_responses_of_the_preset_show_its_spring(logs: list[Log]) -> None:
    notches = []
    for log in logs[1:]:
        u, y = (v[10_000:].reshape(1, 1, -1, 1) for v in (log.torque_nm, log.position_rad))
        response = etfe(PeriodicRecords(STEP, u, y, np.arange(5, 201)), quantity="acceleration")
        found = initial_flexibility(response, rigid_inertia_kg_m2=RIGID, gear_ratio=RATIO)
        notches.append(found.notch.frequency_rad_s)
    assert np.sqrt(1.46e6 / 1130) < notches[0] < notches[1]


def test_data_of_a_log() -> None:
    position = np.cumsum(np.arange(10.0))[:, None]
    log = Log(
        name="a",
        sample_time_s=0.5,
        time_s=0.5 * np.arange(10),
        torque_nm=np.ones((10, 1)),
        position_rad=position,
        source=Path("a"),
    )
    data = axis_data(log)
    assert isinstance(data, AxisData)
    np.testing.assert_allclose(data.velocity_rad_s, 2 * np.arange(10.0))

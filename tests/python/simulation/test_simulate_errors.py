"""Misuse of `simulate` names the field; trouble of a run is a status with the sample."""

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import axisight
from axisight import Effect, InputError, Robot, RobotError, _core, load_robot

ARM = load_robot("irb6600_like")
N = 50
ONES = np.ones((N, 3))
CONTROLLED = ("dopri5", "radau5", "rodas4", "auto")


def with_nan() -> NDArray[np.float64]:
    bad = np.ones((N, 3))
    bad[10, 1] = np.nan
    return bad


WRONG = {
    "no input": ({}, r"velocity_ref_rad_s, torque_nm: expected exactly one"),
    "two inputs": (
        {"velocity_ref_rad_s": ONES, "torque_nm": ONES},
        r"velocity_ref_rad_s, torque_nm: expected exactly one",
    ),
    "zero samples": ({"torque_nm": np.zeros((0, 3))}, r"torque_nm.*at least one sample.*\(0, 3\)"),
    "wrong width": ({"torque_nm": np.zeros((9, 2))}, r"torque_nm.*\(n, 3\).*\(9, 2\)"),
    "a batch": ({"torque_nm": np.zeros((2, 9, 3))}, r"torque_nm.*\(n, 3\).*\(2, 9, 3\)"),
    "ragged": ({"torque_nm": [[1, 2, 3], [1]]}, r"torque_nm.*different lengths"),
    "text": ({"torque_nm": [["a", "b", "c"]]}, r"torque_nm.*real numbers.*got <U1"),
    "complex": ({"torque_nm": ONES * 1j}, r"torque_nm.*real numbers.*complex128"),
    "NaN torque": ({"torque_nm": with_nan()}, r"torque.*finite.*NaN at sample 10"),
    "NaN reference": ({"velocity_ref_rad_s": with_nan()}, r"velocity_ref.*finite.*sample 10"),
    "infinite": ({"torque_nm": np.full((N, 3), np.inf)}, r"torque.*finite.*inf at sample 0"),
}
OPTIONS = {
    "method": ({"method": "euler"}, r"method: expected .*rodas4.*euler"),
    "method of linear": ({"method": "euler", "model": "linear"}, r"method: expected .*euler"),
    "model": ({"model": "affine"}, r"model: expected one of nonlinear, linear, got .affine"),
    "tolerance 0": ({"tolerance": 0.0}, r"tolerance: expected between 1e-14 and 1, got 0"),
    "tolerance 1": ({"tolerance": 1.0}, r"tolerance: expected between 1e-14 and 1, got 1"),
    "negative tolerance": ({"tolerance": -1e-6}, r"tolerance: .*-0.000001"),
    "NaN tolerance": ({"tolerance": np.nan, "method": "radau5"}, r"tolerance: .*NaN"),
    "substeps 0": ({"substeps": 0, "method": "rk4"}, r"substeps: expected at least 1, got 0"),
    "negative substeps": ({"substeps": -2}, r"substeps: expected at least 1, got -2"),
    "noise length": ({"noise": ONES[1:]}, r"noise: .*shape of the input.*\(50, 3\).*\(49, 3\)"),
    "noise width": ({"noise": ONES[:, 1:]}, r"noise.*\(n, 3\).*\(50, 2\)"),
    "noise without axes": ({"noise": ONES[:, 0]}, r"noise.*\(n, 3\).*\(50,\)"),
    "NaN noise": ({"noise": with_nan()}, r"noise.*finite.*sample 10"),
    "two noises": ({"noise": ONES, "noise_seed": 1}, r"noise, noise_seed"),
    "negative cutoff": ({"noise_seed": 1, "noise_cutoff_hz": -1.0}, r"cutoff_hz.*positive"),
    "cutoff of nothing": ({"noise_cutoff_hz": 9.0}, r"noise_cutoff_hz.*noise_seed"),
    "negative seed": ({"noise_seed": -1}, r"seed: expected 0 to 2\^64 - 1, got -1"),
    "huge seed": ({"noise_seed": 1 << 64}, r"seed: expected 0 to 2\^64 - 1"),
    "negative run": ({"noise_seed": 1, "run": -1}, r"run: expected 0 to 2\^48 - 1, got -1"),
    # The core has 48 bits for the run: this one would repeat run 0.
    "huge run": ({"noise_seed": 1, "run": 1 << 48}, r"run: expected 0 to 2\^48 - 1"),
    "negative resolution": ({"position_resolution_rad": -1e-5}, r"resolution.*-0.00001"),
    "NaN resolution": ({"position_resolution_rad": np.nan}, r"resolution.*NaN"),
    "start": ({"start_rad": [0.0, 0.0]}, r"start_rad: expected 3 finite angles, got \[0.0, 0.0\]"),
    "NaN start": ({"start_rad": [0.0, np.nan, 0.0]}, r"start_rad: expected 3 finite angles"),
}
EFFECTS = {
    "huge ripple": (("torque_ripple", 1, {"sine_1_nm": 1e5}), r"sine_1_nm.*10000.*100000"),
    "huge order": (("torque_ripple", 1, {"order_1": 501.0}), r"order_1.*500.*501"),
    "NaN ripple": (("torque_ripple", 1, {"sine_1_nm": np.nan}), r"sine_1_nm.*NaN"),
    "negative delay": (("input_delay", 1, {"delay_s": -1e-3}), r"delay_s.*-0.001"),
    "negative friction": (("coulomb_friction", 2, {"coulomb_nm": -1.0}), r"coulomb_nm.*-1"),
    "axis 0": (("torque_ripple", 0, {}), r"torque_ripple.*axis.*0"),
    "negative axis": (("torque_ripple", -1, {}), r"torque_ripple.*axis.*-1"),
    "axis 4": (("torque_ripple", 4, {}), r"torque_ripple.*from 1 to 3.*4"),
    "no axis": (("torque_ripple", None, {}), r"torque_ripple.*no axis"),
    "unknown": (("wobble", 1, {}), r"unknown effect 'wobble'\. axisight\.effect_table"),
    "parameter": (("torque_ripple", 1, {"sine_nm": 1.0}), r"torque_ripple.*sine_nm.*sine_1_nm"),
}


@pytest.mark.parametrize("case", WRONG)
def test_input_is_refused_by_name(case: str) -> None:
    arguments, message = WRONG[case]
    with pytest.raises(InputError, match=message):
        axisight.simulate(ARM, **arguments)


@pytest.mark.parametrize("case", OPTIONS)
def test_option_is_refused_by_name(case: str) -> None:
    options, message = OPTIONS[case]
    with pytest.raises(InputError, match=message):
        axisight.simulate(ARM, ONES, **options)


@pytest.mark.parametrize("case", EFFECTS)
def test_effect_is_refused_by_name(case: str) -> None:
    (name, axis, parameters), message = EFFECTS[case]
    with pytest.raises(InputError, match=message):
        axisight.simulate(ARM, ONES, effects=[Effect(name, axis, parameters)])


def test_what_is_left_when_nothing_is_wrong() -> None:
    """The cases above fail for the reason they name: the same call without it completes."""
    options = {"method": "rk4", "substeps": 1, "noise_seed": 0, "run": (1 << 48) - 1}
    options |= {"noise_cutoff_hz": 9.0, "start_rad": [0.0, 0.0, 0.0]}
    effects = [Effect("torque_ripple", 3, {"sine_1_nm": 1e-2, "order_1": 500.0})]
    assert axisight.simulate(ARM, ONES, effects=effects, **options).attrs["status"] == "completed"


@pytest.mark.parametrize("name", ["coulomb_friction", "presliding_friction", "backlash"])
def test_linear_model_refuses_what_it_cannot_follow(name: str) -> None:
    amplitude = "half_width_rad" if name == "backlash" else "coulomb_nm"
    with pytest.raises(InputError, match=rf"{name}.*nonlinear"):
        axisight.simulate(ARM, ONES, model="linear", effects=[Effect(name, 1, {amplitude: 0.01})])
    neutral = axisight.simulate(ARM, ONES, model="linear", effects=[Effect(name, 1)])
    assert np.array_equal(
        neutral["torque_cmd_nm"], axisight.simulate(ARM, ONES, model="linear")["torque_cmd_nm"]
    )


def changed(old: str, new: str) -> Robot:
    text = ARM.toml
    assert text.count(old) == 1
    return Robot(_core.Robot.from_toml(text.replace(old, new)))


@pytest.mark.parametrize("value", ["-5.0e-4", "0.0", "nan", "inf"])
def test_sample_time_is_refused_by_name(value: str) -> None:
    with pytest.raises(RobotError, match="sample_time"):
        changed("sample_time = 5.0e-4", f"sample_time = {value}")


def test_reference_needs_a_controller() -> None:
    head, _, tail = ARM.toml.partition('kind = "pi_velocity"')
    without = head + 'kind = "none"\n[sensor]' + tail.partition("[sensor]")[2]
    robot = Robot(_core.Robot.from_toml(without))
    with pytest.raises(InputError, match=r"controller.*none"):
        axisight.simulate(robot, ONES)
    assert axisight.simulate(robot, torque_nm=ONES).attrs["status"] == "completed"


def ends_at(run: xr.Dataset, *statuses: str) -> int:
    """The sample at which it stopped: the arrays end there, finite up to what overflowed in it."""
    assert run.attrs["status"] in statuses
    stop = int(run.attrs["stopped_at"])
    assert run.sizes["time"] == stop + 1
    assert all(np.isfinite(run[name][:stop]).all() for name in run.data_vars)
    return stop


@pytest.mark.parametrize("method", [*CONTROLLED, "rk4", "rkn4"])
def test_unstable_controller_is_a_status(method: str) -> None:
    robot = changed("kp = [7.039", "kp = [-7.039")
    run = axisight.simulate(robot, np.ones((500, 3)), method=method)
    # Fixed steps run into overflow; error control sees the end of its digits before.
    want = "diverged" if method in ("rk4", "rkn4") else "step_size_collapsed"
    # The motor alone: e^(kp T / J) = 1.3 per sample, 1e308 after 2500 at the latest.
    assert 20 < ends_at(run, want) < 500


def test_unstable_linear_loop_diverges() -> None:
    robot = changed("kp = [7.039", "kp = [-7.039")
    run = axisight.simulate(robot, np.ones((5000, 3)), model="linear")
    # The same growth from the same start; nothing saturates it: 1e308 takes longer.
    assert 500 < ends_at(run, "diverged") < 5000


@pytest.mark.parametrize("method", CONTROLLED)
def test_tolerance_below_rounding_is_refused(method: str) -> None:
    with pytest.raises(axisight.InputError, match=r"tolerance: expected between 1e-14 and 1"):
        axisight.simulate(ARM, ONES, tolerance=1e-17, method=method)


@pytest.mark.parametrize("method", [*CONTROLLED, "rk4", "rkn4"])
def test_huge_torque_is_a_status(method: str) -> None:
    torque = np.zeros((N, 3))
    torque[7] = 1e200
    run = axisight.simulate(ARM, torque_nm=torque, method=method)
    assert ends_at(run, "diverged", "step_size_collapsed") in (7, 8)


# A slope of 500 A torque per angle turns the motor within a sample: 500 A T^2 / J = 100.
@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("amplitude_nm", [1e3, 1e4])
def test_huge_ripple_stays_a_ripple(model: str, amplitude_nm: float) -> None:
    effects = [Effect("torque_ripple", 1, {"order_1": 500.0, "sine_1_nm": amplitude_nm})]
    run = axisight.simulate(ARM, ONES, model=model, effects=effects)
    assert run.attrs["status"] in ("completed", "diverged", "step_size_collapsed")
    # The linear model moves the ripple by up to 0.1 rad along its slope: 0.1^2 / 2.
    slack = 5e-3 if model == "linear" else 1e-12
    assert np.abs(run["torque_disturbance_nm"]).max() <= amplitude_nm * (1 + slack)

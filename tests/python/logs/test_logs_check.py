"""check_log reports what is wrong without raising, and nothing on a clean log."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from axisight.logs import LogReport, check_log, render
from axisight.logs.quality import quantization, saturation_runs
from logs_data import native_columns, write


def messages(report: LogReport, severity: str) -> str:
    return "\n".join(f"{f.column}: {f.message}" for f in report.findings if f.severity == severity)


def rendered(report: LogReport) -> str:
    console = Console(width=160, file=io.StringIO())
    console.print(render(report))
    return console.file.getvalue()


def test_clean_log_has_no_warnings(tmp_path):
    report = check_log(write(tmp_path / "a.parquet", native_columns()))
    assert report.ok
    assert {f.severity for f in report.findings} == {"ok"}
    assert (report.sample_rate_hz, report.n_samples, report.n_axes) == (500.0, 1000, 2)
    assert "uniform at 500 Hz" in messages(report, "ok")
    assert "velocity_ref_1: agrees" in messages(report, "ok")
    assert "readable: 0 errors, 0 warnings" in rendered(report)


def test_all_problems_are_reported_together(tmp_path):
    columns = {k: np.delete(v, slice(100, 104)) for k, v in native_columns(n_axes=3).items()}
    columns["torque_cmd_1"][3] = np.nan
    columns["position_2"][4] = np.inf
    del columns["torque_cmd_3"]
    columns["[odd]"] = columns["time_s"]
    report = check_log(write(tmp_path / "a.npz", columns))
    assert not report.ok
    errors = messages(report, "error")
    for words in ("time_s: expected uniform", "torque_cmd_1: ", "position_2: ", "torque_cmd_3: "):
        assert words in errors
    text = rendered(report)
    assert "not readable as it is: 4 errors" in text
    assert "[odd]" in text  # brackets are not taken for markup


def test_unreadable_file_is_a_report(tmp_path):
    report = check_log(tmp_path / "none.csv")
    assert not report.ok
    assert report.sample_rate_hz is None
    assert "got nothing" in messages(report, "error")
    assert "unknown rate" in rendered(report)


def test_saturation(tmp_path):
    columns = native_columns()
    columns["torque_cmd_1"] = np.clip(columns["torque_cmd_1"], -0.4, 0.9)
    report = check_log(write(tmp_path / "a.npz", columns))
    warnings = messages(report, "warning")
    assert "torque_cmd_1: saturates" in warnings
    assert "maximum 0.9 Nm" in warnings
    assert "minimum -0.4 Nm" in warnings
    assert "torque_cmd_2" not in warnings
    assert report.ok


def test_saturation_runs_counts_only_long_runs():
    x = np.array([0.0] * 3 + [1] * 5 + [0] * 2 + [1] * 4 + [0.5] + [1] * 7 + [-1])
    assert saturation_runs(x) == (0, 2)


def test_constant_and_coarse_channels(tmp_path):
    columns = native_columns()
    columns["torque_cmd_1"][:] = 2.5
    columns["position_2"] = np.round(columns["position_2"] / 0.05) * 0.05
    warnings = messages(check_log(write(tmp_path / "a.npz", columns)), "warning")
    assert "torque_cmd_1: constant at 2.5 Nm over all 1000 samples" in warnings
    assert "position_2: quantized in steps of 0.05 rad" in warnings


@given(bits=st.integers(6, 16), offset=st.floats(-10, 10), seed=st.integers(0, 99))
def test_quantization_step_and_bits_are_recovered(bits, offset, seed):
    step = 2.0 / (2**bits - 1)
    x = np.random.default_rng(seed).uniform(-1, 1, 3000)
    found = quantization(np.round(x / step) * step + offset)
    assert found is not None
    # In 3000 samples of at most 2^16 levels, neighbours occur, so the step itself is seen
    assert found.step == pytest.approx(step, rel=1e-6)
    assert found.bits == pytest.approx(bits, abs=0.1)


def test_continuous_noise_is_not_called_quantized():
    assert quantization(np.random.default_rng(0).standard_normal(5000)) is None


@pytest.mark.parametrize(
    ("position", "velocity", "expected"),
    [
        (1.0, np.degrees(1), "velocity in deg/s, position in rad"),
        (np.degrees(1), 1.0, "velocity in rad/s, position in deg"),
        (1.0, 30 / np.pi, "velocity in rpm, position in rad"),
        (np.degrees(1), 30 / np.pi, "velocity in rpm, position in deg"),
        (0.5 / np.pi, 1.0, "position in revolutions"),
        (1.0, -1.0, "sign of one is wrong"),
    ],
)
def test_wrong_units_are_found(tmp_path, position, velocity, expected):
    columns = native_columns(n_axes=1)
    columns["velocity_1"] = columns["velocity_ref_1"] * velocity
    columns["position_1"] = columns["position_1"] * position
    report = check_log(write(tmp_path / "a.npz", columns))
    assert expected in messages(report, "error")
    assert not report.ok


def test_reference_is_used_without_velocity_and_odd_ratios_warn(tmp_path):
    columns = native_columns(n_axes=1)
    columns["velocity_ref_1"] = columns["velocity_ref_1"] * 100.0
    report = check_log(write(tmp_path / "a.npz", columns))
    assert "velocity_ref_1: expected ratio 1" in messages(report, "warning")
    assert "gear ratio" in messages(report, "warning")
    assert report.ok


def test_impossibly_fast_position_warns(tmp_path):
    columns = native_columns(n_axes=1)
    columns["position_1"] = columns["position_1"] * 8192
    del columns["velocity_ref_1"]
    assert "counts or deg" in messages(check_log(write(tmp_path / "a.npz", columns)), "warning")

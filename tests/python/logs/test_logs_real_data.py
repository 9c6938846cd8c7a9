"""The real data read with suitable column maps; the published EMPS estimate."""

import numpy as np
import pytest

from axisight.errors import LogError
from axisight.logs import (
    ColumnMap,
    check_log,
    decimate_zero_phase,
    differentiate,
    load_column_map,
    read_log,
)

EMPS_PUBLISHED = {"M": 95.1089, "Fv": 203.5034, "Fc": 20.3935, "offset": -3.1648}


def kr300_map():
    def signal(name, axis, unit):
        return {"name": f"rec.{name}", "index": f"{axis},:", "unit": unit}

    axes = [
        {
            "position": signal("act_pos_mot_deg", axis, "deg"),
            "velocity": signal("act_vel_mot_deg_per_s", axis, "deg/s"),
            "torque": signal("act_torque_abs_nm", axis, "Nm"),
        }
        for axis in range(6)
    ]
    for axis in range(3):  # the secondary encoder is live on axes 1-3 only
        axes[axis]["joint_position"] = signal("act_pos_se_deg", axis, "deg")
    return ColumnMap.model_validate({"time": {"name": "rec.time_cont"}, "axis": axes})


def odrive_map(resample_hz=None, *, cells=False):
    def signal(row, **keys):
        return {"name": "data", "index": f"{row + 1},0" if cells else f"{row},:", **keys}

    axis = {
        "position": signal(1, unit="counts", counts_per_rev=8192),
        "torque": signal(2, unit="A", scale=0.03),
    }
    return ColumnMap.model_validate({"time": signal(0, resample_hz=resample_hz), "axis": [axis]})


@pytest.mark.parametrize("name", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_emps_is_read(shared_data, repository, name):
    columns = load_column_map(repository / "examples/emps/columns.toml")
    log = read_log(shared_data / "emps" / name, columns, n_axes=1)
    assert (log.n_samples, log.sample_time_s) == (24841, 1e-3)
    assert log.axis_kinds == ("prismatic",)
    assert check_log(shared_data / "emps" / name, columns).ok


def test_emps_published_least_squares(shared_data, repository):
    log = read_log(
        shared_data / "emps/DATA_EMPS.mat", repository / "examples/emps/columns.toml", n_axes=1
    )
    force = log.torque_nm[:, 0]
    velocity, acceleration = differentiate(log.position_rad[:, 0], log.sample_time_s, 60.0)
    regressors = np.column_stack(
        [acceleration, velocity, np.sign(velocity), np.ones_like(velocity)]
    )
    half_second = slice(50, -50)  # after decimation by 10
    left = decimate_zero_phase(regressors, 10)[half_second]
    right = decimate_zero_phase(force, 10)[half_second]
    found, *_ = np.linalg.lstsq(left, right, rcond=None)
    np.testing.assert_allclose(found, list(EMPS_PUBLISHED.values()), rtol=0.02)
    relative_error = np.linalg.norm(right - left @ found) / np.linalg.norm(right)
    assert relative_error == pytest.approx(0.0408, abs=0.004)


@pytest.mark.parametrize("run", ["A", "B", "C"])
def test_kr300_is_read_and_its_velocity_agrees(shared_data, run):
    path = shared_data / "kuka_kr300" / run / "data.mat"
    log = read_log(path, kr300_map(), n_axes=6)
    assert (log.n_samples, log.sample_time_s) == (2501, 0.004)
    assert np.isnan(log.joint_position_rad[:, 3:]).all()
    assert np.isfinite(log.joint_position_rad[:, :3]).all()
    agreeing = [f for f in check_log(path, kr300_map()).findings if "agrees with" in f.message]
    assert len(agreeing) == 6


@pytest.mark.parametrize("run", ["A", "B"])
def test_fditools_is_read_and_its_slow_velocity_is_noticed(shared_data, run):
    axis = {
        "position": {"name": "theta_mx", "unit": "rad"},
        "torque": {"name": "iq_adx", "unit": "A", "scale": 1.0},
        "joint_position": {"name": "theta_my", "unit": "rad", "sign": -1},
        "velocity": {"name": "omega_max", "unit": "rad/s"},
    }
    columns = ColumnMap.model_validate(
        {"sample_rate_hz": "fs", "time": {"name": "time", "unit": "us"}, "axis": [axis]}
    )
    path = shared_data / "fditools_multisine" / f"MultisineType{run}.mat"
    log = read_log(path, columns)
    assert (log.n_samples, log.sample_time_s) == (50000, 0.0004)
    warnings = [f.message for f in check_log(path, columns).findings if f.severity == "warning"]
    assert any("does not follow" in message for message in warnings)


def test_tx40_is_read_from_two_files(shared_data):
    axes = [
        {
            "position": {"name": f"Joint_{axis}", "unit": "rad"},
            "torque": {"name": f"Joint_{axis}", "unit": "Nm", "file": "curr_data.csv"},
        }
        for axis in range(1, 7)
    ]
    columns = ColumnMap.model_validate({"sample_rate_hz": 5000, "axis": axes})
    path = shared_data / "staubli_tx40/pos_read_data.csv"
    log = read_log(path, columns, n_axes=6)
    assert (log.n_samples, log.n_axes) == (45000, 6)
    assert log.position_rad[0, 1] == 50.265
    assert log.torque_nm[0, 1] == -0.76036
    assert check_log(path, columns).ok


def test_odrive_is_irregular_and_read_resampled(shared_data):
    folder = shared_data / "odrive_cogging"
    paths = sorted(path for path in folder.rglob("*.mat") if path.parent.name != "accel_tests")
    assert paths
    for path in paths:
        assert not check_log(path, odrive_map()).ok
        with pytest.raises(LogError, match="uniform sampling"):
            read_log(path, odrive_map())
        log = read_log(path, odrive_map(400.0))
        assert log.sample_time_s == 1 / 400
        assert any("resampled" in note for note in log.notes)


def test_odrive_spinups_in_cells_are_read(shared_data):
    for path in sorted((shared_data / "odrive_cogging/accel_tests").glob("*.mat")):
        assert read_log(path, odrive_map(400.0, cells=True)).n_samples == 400

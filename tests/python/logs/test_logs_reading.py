"""Round trips of every format, native names and column maps."""

import dataclasses

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from axisight.errors import AxisightError, ConvergenceError, InputError, LogError
from axisight.logs import ColumnMap, Log, parse_column_map, read_log
from logs_data import FORMAT_IDS, FORMATS, RATE_HZ, native_columns, write, write_mat73


@pytest.mark.parametrize(("name", "kind"), FORMATS, ids=FORMAT_IDS)
def test_round_trip_of_native_columns(tmp_path, name, kind):
    columns = native_columns()
    columns["velocity_1"] = columns["velocity_ref_1"] + 0.01
    log = read_log(write(tmp_path / name, columns, kind), n_axes=2)
    # Some releases of pandas read decimals to the last bit of one.
    decimals = name.endswith(("csv", "csv.gz", "tsv"))
    exact = {"rtol": 1e-15, "atol": 3e-16 if decimals else 0}
    for axis in (1, 2):
        np.testing.assert_allclose(
            log.position_rad[:, axis - 1], columns[f"position_{axis}"], **exact
        )
        np.testing.assert_allclose(
            log.torque_nm[:, axis - 1], columns[f"torque_cmd_{axis}"], **exact
        )
        np.testing.assert_allclose(
            log.velocity_ref_rad_s[:, axis - 1], columns[f"velocity_ref_{axis}"], **exact
        )
    np.testing.assert_allclose(log.velocity_rad_s[:, 0], columns["velocity_1"], **exact)
    assert np.isnan(log.velocity_rad_s[:, 1]).all()  # no such sensor on axis 2
    assert log.temperature_c is None
    assert log.joint_position_rad is None
    assert log.sample_time_s == 1 / RATE_HZ
    assert (log.n_samples, log.n_axes, log.name) == (1000, 2, "run")
    assert log.duration_s == pytest.approx(2.0)
    assert log.time_s[0] == 0.0


def test_reference_may_be_missing_altogether(tmp_path):
    columns = {k: v for k, v in native_columns().items() if not k.startswith("velocity_ref")}
    assert read_log(write(tmp_path / "a.csv", columns)).velocity_ref_rad_s is None


def test_parquet_with_time_as_index(tmp_path):
    frame = pd.DataFrame(native_columns()).set_index("time_s")
    frame.to_parquet(tmp_path / "a.parquet")
    assert read_log(tmp_path / "a.parquet").n_samples == 1000


MAP = """
schema = "axisight.columns/1"
sample_rate_hz = 500.0
[time]
name = "t"
unit = "ms"
[[axis]]
position = { name = "q", index = "0,:", unit = "deg" }
torque = { name = "rec.i", index = ":,0", unit = "A", scale = "kt", sign = -1 }
velocity = { name = "w", unit = "rpm" }
[[axis]]
position = { name = "q", index = "1,:", unit = "counts", counts_per_rev = 4096 }
torque = { name = "rec.i", index = ":,1", unit = "A", scale = 0.5 }
temperature = { name = "temp", unit = "K" }
"""


def foreign():
    t = np.arange(1000) / 500.0
    q = np.vstack([90 * np.sin(t), 2048 * np.cos(t)])
    i = np.column_stack([np.sin(3 * t), np.cos(3 * t)])
    return t, q, i


@pytest.mark.parametrize("version", ["mat5", "mat73"])
def test_map_with_matrices_structs_units_and_file_scalars(tmp_path, version):
    t, q, i = foreign()
    path = tmp_path / "a.mat"
    rest = {"t": 1e3 * t + 7.0, "q": q, "w": 60 * t, "temp": 300 + 0 * t, "kt": 0.25}
    if version == "mat5":
        scipy.io.savemat(path, {**rest, "rec": {"i": i}})
    else:
        write_mat73(path, {**rest, "rec.i": i})
    log = read_log(path, parse_column_map(MAP))
    np.testing.assert_allclose(log.position_rad[:, 0], np.pi / 2 * np.sin(t), rtol=1e-14)
    np.testing.assert_allclose(log.position_rad[:, 1], np.pi * np.cos(t), rtol=1e-14)
    np.testing.assert_allclose(log.torque_nm, i * [-0.25, 0.5], rtol=1e-14)
    np.testing.assert_allclose(log.velocity_rad_s[:, 0], 2 * np.pi * t, rtol=1e-14)
    np.testing.assert_allclose(log.temperature_c[:, 1], 26.85, rtol=1e-12)
    assert np.isnan(log.temperature_c[:, 0]).all()
    assert log.time_s[0] == 0.0
    assert log.sample_time_s == 0.002


def test_mat73_cells_are_followed(tmp_path):
    path = tmp_path / "a.mat"
    t, q, _ = foreign()
    write_mat73(path, {"t": t})
    with h5py.File(path, "r+") as file:
        file["#refs#/a"], file["#refs#/b"] = q[0][:, None], q[1][:, None]
        cells = file.create_dataset("runs", (2, 1), dtype=h5py.ref_dtype)
        cells[0, 0], cells[1, 0] = file["#refs#/a"].ref, file["#refs#/b"].ref
    axis = {
        "position": {"name": "runs", "index": 1, "unit": "rad"},
        "torque": {"name": "runs", "index": "0", "unit": "Nm"},
    }
    log = read_log(path, ColumnMap.model_validate({"time": {"name": "t"}, "axis": [axis]}))
    np.testing.assert_array_equal(log.position_rad[:, 0], q[1])
    np.testing.assert_array_equal(log.torque_nm[:, 0], q[0])


def test_map_file_prismatic_sibling_and_csv_options(tmp_path):
    n = 600
    (tmp_path / "f.csv").write_text("noise\n" + "".join(f"{k},5;1\n" for k in range(n)))
    (tmp_path / "q.csv").write_text("noise\n" + "".join(f"{k},0;2\n" for k in range(n)))
    (tmp_path / "map.toml").write_text("""
schema = "axisight.columns/1"
sample_rate_hz = 500
csv = { separator = ";", decimal = ",", header = false, skip_rows = 1 }
[[axis]]
position = { name = "0", unit = "mm" }
torque = { name = "0", file = "f.csv", unit = "N", scale = 2.0 }
""")
    log = read_log(tmp_path / "q.csv", tmp_path / "map.toml")
    np.testing.assert_allclose(log.position_rad[:, 0], np.arange(n) * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(log.torque_nm[:, 0], 2 * (np.arange(n) + 0.5), rtol=1e-14)
    assert log.axis_kinds == ("prismatic",)
    data = log.to_xarray()
    assert data.position.attrs["units"] == "m"
    assert data.torque.attrs["units"] == "N"


def test_small_jitter_is_replaced_by_the_grid(tmp_path):
    columns = native_columns()
    rng = np.random.default_rng(1)
    columns["time_s"] = columns["time_s"] + rng.uniform(-0.009, 0.009, 1000) / RATE_HZ
    log = read_log(write(tmp_path / "a.npz", columns))
    assert np.ptp(np.diff(log.time_s)) < 1e-12
    assert "uniform grid" in log.notes[0]


def test_irregular_stamps_are_resampled_only_on_demand(tmp_path):
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.5e-3, 1.4e-3, 4000))
    path = write(tmp_path / "a.npz", {"t": t, "q": 3 * (t - t[0]), "i": 0 * t + 1})
    axis = {"position": {"name": "q", "unit": "rad"}, "torque": {"name": "i", "unit": "Nm"}}
    spec = {"time": {"name": "t"}, "axis": [axis]}
    with pytest.raises(LogError, match="uniform sampling"):
        read_log(path, ColumnMap.model_validate(spec))
    spec["time"]["resample_hz"] = 1000.0
    log = read_log(path, ColumnMap.model_validate(spec))
    np.testing.assert_allclose(log.position_rad[:, 0], 3 * log.time_s, atol=1e-12)
    assert any("resampled" in note for note in log.notes)


def test_single_precision_stamps_give_the_whole_rate(tmp_path):
    columns = native_columns(n=2000, rate_hz=250.0)
    columns["time_s"] = columns["time_s"].astype(np.float32)
    assert read_log(write(tmp_path / "a.npz", columns)).sample_time_s == 0.004


def test_to_xarray_names_dims_units_and_provenance(tmp_path):
    log = read_log(write(tmp_path / "a.parquet", native_columns()))
    log = dataclasses.replace(log, excitation="sine", period_s=2.0)
    data = log.to_xarray()
    assert data.position.dims == ("time", "axis")
    assert data.axis.values.tolist() == [1, 2]
    units = {name: data[name].attrs["units"] for name in ("time", *data.data_vars)}
    assert units == {"time": "s", "position": "rad", "torque": "Nm", "velocity_ref": "rad/s"}
    assert data.attrs["source"] == "a.parquet"
    assert data.attrs["period_s"] == 2.0
    assert data.attrs["excitation"] == "sine"


def test_log_refuses_unequal_shapes(tmp_path):
    t = np.arange(10) * 0.1
    with pytest.raises(InputError, match=r"torque_nm: expected shape \(10, 2\), got \(10, 1\)"):
        Log(
            name="a",
            sample_time_s=0.1,
            time_s=t,
            torque_nm=np.zeros((10, 1)),
            position_rad=np.zeros((10, 2)),
            source=tmp_path,
        )


def test_error_tree():
    assert issubclass(LogError, InputError)
    assert issubclass(InputError, AxisightError)
    assert issubclass(InputError, ValueError)
    assert issubclass(ConvergenceError, RuntimeError)

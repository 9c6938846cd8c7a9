"""Logs out of DataFrames, Datasets and mappings: the same as the log that they were made of."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from axisight import Log, load_robot
from axisight.errors import LogError
from axisight.logs import log_of_table, parse_column_map

STEP_S = 0.002
TIME_S = np.arange(600) * STEP_S
ANGLE = np.column_stack([np.sin(3 * TIME_S), np.cos(2 * TIME_S), 0.2 * np.sin(5 * TIME_S)])
ROBOT = load_robot("irb6600_like")
LOG = Log(
    name="run", sample_time_s=STEP_S, time_s=TIME_S, torque_nm=10 * ANGLE, position_rad=ANGLE,
    velocity_ref_rad_s=2 * ANGLE, source=Path("run"), period_s=0.6,
)  # fmt: skip


def frame(position: str, torque: str, reference: str, factors=(1.0, 1.0, 1.0)) -> pd.DataFrame:
    """A table whose columns have these names, with the axis in place of braces."""
    columns = {"time_s": TIME_S}
    for k in range(3):
        axis = k + 1
        columns[position.format(axis)] = factors[0] * ANGLE[:, k]
        columns[torque.format(axis)] = factors[1] * 10 * ANGLE[:, k]
        columns[reference.format(axis)] = factors[2] * 2 * ANGLE[:, k]
    return pd.DataFrame(columns)


NATIVE = frame("position_{}", "torque_cmd_{}", "velocity_ref_{}")
TABLES = {
    "native names": NATIVE,
    "units behind": frame("position_{}_rad", "torque_{}_nm", "velocity_ref_{}_rad_s"),
    "other units": frame(
        "position_deg_{}", "torque_nm_{}", "velocity_ref_rpm_{}",
        (180 / np.pi, 1.0, 30 / np.pi),
    ),
    "joint names": frame("position_axis{}", "torque_axis{}", "velocity_ref_axis{}"),
    "index": NATIVE.set_index("time_s"),
    "dates": NATIVE.drop(columns="time_s").set_index(
        pd.Timestamp("2026-01-01") + pd.to_timedelta(TIME_S, unit="s")
    ),
    "milliseconds": NATIVE.assign(time_ms=1e3 * TIME_S).drop(columns="time_s"),
    "levels": NATIVE.set_axis(
        pd.MultiIndex.from_tuples([tuple(n.rsplit("_", 1)) for n in NATIVE]), axis=1
    ),
    "dataset of a log": LOG.to_xarray(),
    "dataset by joint": xr.Dataset(
        {
            "position": (("time", "joint"), ANGLE[:, ::-1]),
            "torque_nm": (("time", "joint"), 10 * ANGLE[:, ::-1]),
            "velocity_ref": (("joint", "time"), 2 * ANGLE[:, ::-1].T, {"units": "rad/s"}),
        },
        coords={"time": TIME_S, "joint": ["axis3", "axis2", "axis1"]},
    ),
    "mapping": {
        "time": TIME_S, "position_rad": ANGLE, "torque_nm": 10 * ANGLE, "velocity_ref": 2 * ANGLE,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_the_log_that_it_was_made_of(name):
    found = log_of_table(TABLES[name], name="mine", robot=ROBOT)
    assert found.name == "mine"
    assert found.sample_time_s == pytest.approx(STEP_S, rel=1e-9)
    for field in ("position_rad", "torque_nm", "velocity_ref_rad_s"):
        np.testing.assert_allclose(getattr(found, field), getattr(LOG, field), atol=1e-12)


def test_attributes_of_a_dataset_count():
    found = log_of_table(LOG.to_xarray())
    assert found.period_s == LOG.period_s
    degrees = LOG.to_xarray()
    degrees["position"] = degrees["position"] * 180 / np.pi
    degrees["position"].attrs["units"] = "deg"
    np.testing.assert_allclose(log_of_table(degrees).position_rad, ANGLE, atol=1e-12)
    rate = NATIVE.drop(columns="time_s")
    rate.attrs["sample_time_s"] = STEP_S
    assert log_of_table(rate).sample_time_s == pytest.approx(STEP_S)


def test_a_column_map_says_what_is_what():
    axes = "".join(
        f"[[axis]]\nposition = {{ name = 'q{k}', unit = 'rad' }}\ntorque = {{ name = 'u{k}', unit = 'Nm' }}\n"
        for k in (1, 2, 3)
    )
    columns = parse_column_map(f"[time]\nname = 't'\nunit = 's'\n{axes}")
    table = pd.DataFrame(
        {
            "t": TIME_S,
            **{f"q{k + 1}": ANGLE[:, k] for k in range(3)},
            "u1": 1.0,
            "u2": 2.0,
            "u3": 3.0,
        }
    )
    found = log_of_table(table, columns)
    np.testing.assert_array_equal(found.position_rad, ANGLE)
    with pytest.raises(LogError, match=r"u3.*expected a column named 'u3'"):
        log_of_table(table.drop(columns="u3"), columns)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (NATIVE.rename(columns={"position_2": "postion_2"}), "Did you mean 'position_2' by 'postion_2'"),
        (NATIVE.drop(columns="time_s"), r"time_s: expected a column time_s \[s\]"),
        (NATIVE[["time_s", "position_1", "position_2", "position_3"]], "torque_cmd_1: expected"),
        (NATIVE.assign(torque_1=1.0), "torque of axis 1: expected one column, got torque_cmd_1 and"),
        (pd.concat([NATIVE, NATIVE], axis=1), "time_s: expected one column of that name, got several"),
        (NATIVE.assign(position_1=np.nan), "position_1"),
        (NATIVE.assign(position_1="a"), "expected numbers, got 'a' at index 0"),
        (NATIVE.iloc[:100], "at least 1 s|shorter|1 s"),
        (pd.DataFrame({"a": [1.0]}), r"position_1: expected a column position_1 \[rad\].*got a$"),
        (NATIVE.assign(position_4=0.0, torque_4=0.0, velocity_ref_4=0.0), "expected 3 axes"),
    ],
)  # fmt: skip
def test_another_table_is_refused_by_name(table, message):
    with pytest.raises(LogError, match=message):
        log_of_table(table, robot=ROBOT)


SCARA = load_robot("scara_like")
SLIDING = int(np.flatnonzero(SCARA.axis_is_prismatic)[0]) + 1


def with_units(name: str, units: str) -> xr.Dataset:
    """A log as a Dataset, with another unit said of one signal."""
    table = LOG.to_xarray()
    table[name].attrs["units"] = units
    return table


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (with_units("position", "degrees"), r"position\[0\]: unit: expected one of rad, .*got 'degrees'; a column map"),
        (with_units("torque", "mNm"), r"torque\[0\]: unit: .*'mNm'; a column map.*unit = 'Nm' and scale = 0.001"),
        (with_units("torque", "Nm, N"), r"torque\[0\]: unit: .* got 'Nm, N'"),
        (with_units("time", "milliseconds"), "time: unit: expected one of s, ms, us, ns, got 'milliseconds'"),
        (NATIVE.rename(columns={"position_1": "position_nm_1"}), "position_nm_1: unit: expected .*got 'Nm'"),
        (NATIVE.rename(columns={"torque_cmd_1": "torque_deg_1"}), "torque_deg_1: unit: expected one of Nm.* got 'deg'"),
        (NATIVE.rename(columns={"torque_cmd_1": "torque_mnm_1"}), "torque_mnm_1: unit: .* got 'mNm'"),
        (NATIVE.assign(velocity_1_mrad_s=0.0), "velocity_1_mrad_s: unit: .* got 'mrad/s'"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("robot", [ROBOT, None], ids=["robot", "no robot"])
def test_a_unit_that_a_signal_cannot_have_is_refused(table, message, robot):
    with pytest.raises(LogError, match=message):
        log_of_table(table, robot=robot)


def test_sliding_axes_have_their_own_usual_units():
    n = SCARA.n_axes
    columns = {"time_s": TIME_S}
    for k in range(1, n + 1):
        columns |= {f"position_{k}": 0.1 * ANGLE[:, 0], f"torque_{k}": ANGLE[:, 0]}
    table = pd.DataFrame(columns)
    found = log_of_table(table, robot=SCARA)
    assert found.axis_kinds[SLIDING - 1] == "prismatic"
    np.testing.assert_array_equal(found.position_rad[:, SLIDING - 1], 0.1 * ANGLE[:, 0])
    again = log_of_table(found.to_xarray(), robot=SCARA)
    np.testing.assert_array_equal(again.position_rad, found.position_rad)
    name = f"position_{SLIDING}"
    in_mm = table.assign(**{name: 1e3 * table[name]}).rename(columns={name: f"{name}_mm"})
    np.testing.assert_allclose(log_of_table(in_mm, robot=SCARA).position_rad, found.position_rad)
    with pytest.raises(LogError, match=f"{name}_rad: unit: expected one of mm, m, got 'rad'"):
        log_of_table(table.rename(columns={name: f"{name}_rad"}), robot=SCARA)
    with pytest.raises(
        LogError, match="position_mm_1: unit: expected one of rad, deg, rev, got 'mm'"
    ):
        log_of_table(table.rename(columns={"position_1": "position_mm_1"}), robot=SCARA)


def arrays(**labels) -> xr.Dataset:
    """A Dataset of matrices whose axes are labelled."""
    return xr.Dataset(
        {name: (("time", "axis"), values) for name, values in (("position", ANGLE), ("torque", 10 * ANGLE))},
        coords={"time": TIME_S, **labels},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (NATIVE.assign(t=TIME_S), "time: expected one time column, got time_s and t; a column map"),
        (NATIVE.set_index("time_s").assign(time_ms=TIME_S), "expected one time column, got time_s and time_ms"),
        (arrays(axis=[3, 2, 1]), r"axes: expected the labels 1 to 3 in order, or joint names, got \[3, 2, 1\]"),
        (arrays(axis=[0, 1, 2]), r"position: axes: expected the labels 1 to 3"),
        (arrays(axis=["3", "2", "1"]), r"position: axes: expected the labels 1 to 3"),
        ({"time": TIME_S, "position_1": ANGLE}, r"position_1: expected one signal, .* shape \(600, 3\)"),
        ({"time": TIME_S, "position": np.zeros((600, 3, 2))}, r"position: expected shape \(n,\) or \(n, axes\)"),
    ],
)  # fmt: skip
def test_times_and_axes_that_are_not_clear_are_refused(table, message):
    with pytest.raises(LogError, match=message):
        log_of_table(table, robot=ROBOT)


def test_a_matrix_of_one_column_keeps_the_axis_of_its_name():
    table = {"time": TIME_S}
    for k in (3, 1, 2):
        table |= {f"position_{k}": ANGLE[:, k - 1 : k], f"torque_axis{k}": 10 * ANGLE[:, [k - 1]]}
    found = log_of_table(table, robot=ROBOT)
    np.testing.assert_array_equal(found.position_rad, ANGLE)
    np.testing.assert_array_equal(found.torque_nm, 10 * ANGLE)
    np.testing.assert_array_equal(log_of_table(arrays(), robot=ROBOT).position_rad, ANGLE)


def rate(step: object, **attrs) -> pd.DataFrame:
    """A table without stamps, whose attributes say the sample time."""
    table = NATIVE.drop(columns="time_s")
    table.attrs = {"sample_time_s": step, **attrs}
    return table


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (rate(0), r"attrs\['sample_time_s'\]: expected a positive number, got 0"),
        (rate(-0.01), r"attrs\['sample_time_s'\]: expected a positive number, got -0.01"),
        (rate("2 ms"), r"attrs\['sample_time_s'\]: expected a positive number, got '2 ms'"),
        (rate(1e-320), "sample_rate_hz.*expected a finite number, got inf"),
        (rate(STEP_S, period_s="x"), r"attrs\['period_s'\]: expected a positive number, got 'x'"),
        (rate(STEP_S, excitation=5), r"attrs\['excitation'\]: expected text, got 5"),
        (TABLES["dates"].iloc[:0], "time_s: expected at least 2 time stamps, got 0"),
        (NATIVE.rename(columns={"position_1": "position_AXIS1"}), "position_AXIS1: axis: .* Did you mean 'axis1'"),
        ({"time": TIME_S, "position": [[1, 2], [3]]}, r"position: expected an array \(n,\) or"),
    ],
)  # fmt: skip
def test_errors_name_the_field_that_is_wrong(table, message):
    with pytest.raises(LogError, match=message):
        log_of_table(table, robot=ROBOT)


def test_units_of_two_kinds_of_axis_are_refused_without_a_robot():
    table = NATIVE.rename(columns={"position_1": "position_1_mm"})
    with pytest.raises(LogError, match=r"axis 1: torque: expected a unit that goes with .* in mm"):
        log_of_table(table)

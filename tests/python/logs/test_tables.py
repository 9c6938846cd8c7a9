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

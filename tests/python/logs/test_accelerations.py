"""Columns of accelerometers: names, units, faults, tables and parts of logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from axisight import InputError, Log, LogError, check_log, read_log
from axisight.logs import parse_column_map
from axisight.logs.tables import log_of_table

N = 400
TIME = 5e-3 * np.arange(N)
COLUMNS = {
    "time_s": TIME,
    "position_1": np.sin(TIME),
    "torque_cmd_1": np.cos(3 * TIME),
    "acceleration_tip_x": np.sin(2 * TIME),
    "acceleration_tip_z": 9.81 + np.cos(2 * TIME),
    "acceleration_upper_arm_y": np.cos(TIME),
}
MAP = """
schema = "axisight.columns/1"
time = { name = "t" }
[[axis]]
position = { name = "q", unit = "rad" }
torque = { name = "tau", unit = "Nm" }
[[accelerometer]]
name = "tip"
x = { name = "ax", unit = "g" }
z = { name = "az", unit = "mm/s^2", sign = -1 }
"""
FOREIGN = {
    "t": TIME,
    "q": np.sin(TIME),
    "tau": np.cos(3 * TIME),
    "ax": np.sin(2 * TIME),
    "az": np.cos(2 * TIME),
}


def csv(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    path = folder / "run.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def test_native_columns_are_read(tmp_path) -> None:
    log = read_log(csv(tmp_path, COLUMNS))
    assert set(log.acceleration_m_s2) == {"tip", "upper_arm"}
    tip = log.acceleration_m_s2["tip"]
    np.testing.assert_allclose(tip[:, 0], COLUMNS["acceleration_tip_x"], rtol=1e-12)
    np.testing.assert_allclose(tip[:, 2], COLUMNS["acceleration_tip_z"], rtol=1e-12)
    assert np.isnan(tip[:, 1]).all()
    arm = log.acceleration_m_s2["upper_arm"]
    assert np.isfinite(arm).all(axis=0).tolist() == [False, True, False]


def test_a_map_states_units(tmp_path) -> None:
    columns = parse_column_map(MAP)
    tip = read_log(csv(tmp_path, FOREIGN), columns).acceleration_m_s2["tip"]
    np.testing.assert_allclose(tip[:, 0], 9.80665 * FOREIGN["ax"], rtol=1e-12)
    np.testing.assert_allclose(tip[:, 2], -1e-3 * FOREIGN["az"], rtol=1e-12)


def test_a_pattern_has_them_too(tmp_path) -> None:
    text = MAP.replace("[[axis]]", "[every_axis]").replace('"q"', '"q{1}"')
    columns = parse_column_map(text.replace('"tau"', '"tau{1}"'))
    renamed = {{"q": "q1", "tau": "tau1"}.get(name, name): x for name, x in FOREIGN.items()}
    log = read_log(csv(tmp_path, renamed), columns)
    np.testing.assert_allclose(log.acceleration_m_s2["tip"][:, 0], 9.80665 * FOREIGN["ax"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "g"', 'unit = "rad"', r"accelerometer 1: x.unit: expected one of m/s\^2"),
        ('unit = "g"', 'unit = "g", place = 1', "x.place: expected a known key"),
        ('name = "tip"', 'name = "the tip"', "accelerometer 1: name"),
        ("[[accelerometer]]", '[[accelerometer]]\nname = "none"\n[[accelerometer]]', "x, y or z"),
        (
            "[[accelerometer]]",
            '[[accelerometer]]\nname = "tip"\ny = { name = "ay", unit = "g" }\n[[accelerometer]]',
            "expected different names, got 'tip' twice",
        ),
    ],
)
def test_a_faulty_map_is_refused(old: str, new: str, message: str) -> None:
    with pytest.raises(LogError, match=message):
        parse_column_map(MAP.replace(old, new))


def test_faulty_columns_are_refused(tmp_path) -> None:
    lost = COLUMNS["acceleration_tip_x"].copy()
    lost[7] = np.nan
    path = csv(tmp_path, {**COLUMNS, "acceleration_tip_x": lost})
    with pytest.raises(LogError, match="acceleration_tip_x: expected finite values, got 1 NaN"):
        read_log(path)
    with pytest.raises(LogError, match="az: expected a column named 'az'"):
        few = {name: x for name, x in FOREIGN.items() if name != "az"}
        read_log(csv(tmp_path, few), parse_column_map(MAP))
    with pytest.raises(LogError, match="acceleration_tip_x: expected 400 samples"):
        np.savez(tmp_path / "run.npz", **{**COLUMNS, "acceleration_tip_x": np.ones(399)})
        read_log(tmp_path / "run.npz")


def test_a_check_names_a_dead_channel(tmp_path) -> None:
    path = csv(tmp_path, {**COLUMNS, "acceleration_tip_x": np.ones(N)})
    dead = [f for f in check_log(path).findings if f.column == "acceleration_tip_x"]
    assert [f.severity for f in dead] == ["warning"]
    assert dead[0].message == "constant at 1 m/s^2 over all 400 samples"


def test_uneven_stamps_are_resampled(tmp_path) -> None:
    jitter = np.random.default_rng(0).uniform(-1e-3, 1e-3, N)
    jitter[0] = 0.0
    uneven = {**FOREIGN, "t": TIME + jitter, "ax": np.sin(2 * (TIME + jitter))}
    text = MAP.replace('name = "t"', 'name = "t", resample_hz = 200')
    log = read_log(csv(tmp_path, uneven), parse_column_map(text))
    # Straight lines over steps of 5 ms are off by (2 * 5e-3)^2 / 8.
    expected = 9.80665 * np.sin(2 * log.time_s)
    np.testing.assert_allclose(log.acceleration_m_s2["tip"][:, 0], expected, atol=3e-4)


def test_a_table_and_back() -> None:
    log = log_of_table(COLUMNS)
    again = log_of_table(log.to_xarray())
    assert set(again.acceleration_m_s2) == {"tip", "upper_arm"}
    for name, readings in log.acceleration_m_s2.items():
        np.testing.assert_array_equal(again.acceleration_m_s2[name], readings)
    assert "acceleration_tip_x" in log._repr_html_()
    data = log.to_xarray()
    data["acceleration_tip_x"].attrs["units"] = "rad"
    with pytest.raises(LogError, match=r"acceleration_tip_x: unit: expected one of m/s\^2"):
        log_of_table(data)


def test_parts_and_shapes(tmp_path) -> None:
    log = read_log(csv(tmp_path, COLUMNS))
    part = log.part(0.5, 1.75)
    tip = part.acceleration_m_s2["tip"]
    np.testing.assert_array_equal(tip, log.acceleration_m_s2["tip"][100:350])
    with pytest.raises(InputError, match=r"acceleration_m_s2\['tip'\]: expected shape \(400, 3\)"):
        replace(log, acceleration_m_s2={"tip": np.zeros((N, 1))})
    assert isinstance(log, Log)

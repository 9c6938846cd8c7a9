"""Dates as time stamps: ISO 8601 in text files, dates in tables, read as seconds from the first."""

import numpy as np
import pandas as pd
import pytest

from axisight.errors import LogError
from axisight.logs import check_log, parse_column_map, read_log
from axisight.logs.guessing import guess_columns
from axisight.logs.stamps import seconds_from_first
from columns_data import maker_columns, robot
from logs_data import native_columns, write

N = 600


def stamped(start="2024-10-27T00:59:59", zone="", sep="T"):
    columns = native_columns(N, 1)
    when = pd.Timestamp(start) + pd.to_timedelta(columns["time_s"], unit="s")
    columns["time_s"] = [t.isoformat(sep=sep, timespec="microseconds") + zone for t in when]
    return columns


@pytest.mark.parametrize("zone", ["", "Z", "+02:00", "-0530"])
@pytest.mark.parametrize("sep", ["T", " "])
@pytest.mark.parametrize("suffix", [".csv", ".json", ".jsonl", ".tsv"])
def test_stamps_count_from_the_first(tmp_path, zone, sep, suffix):
    log = read_log(write(tmp_path / f"a{suffix}", stamped(zone=zone, sep=sep)))
    assert log.sample_rate_hz == 500.0
    assert log.n_samples == N
    np.testing.assert_allclose(log.time_s, np.arange(N) / 500.0, atol=1e-12)


def test_stamps_go_on_where_clocks_are_set_back(tmp_path):
    """02:59:59.998+02:00 is followed by 02:00:00+01:00, two milliseconds later."""
    columns = stamped()
    when = pd.Timestamp("2024-10-27T00:59:59Z") + pd.to_timedelta(np.arange(N) / 500, unit="s")
    local = when.tz_convert("Europe/Berlin")
    columns["time_s"] = [t.isoformat(timespec="microseconds") for t in local]
    assert {t[-6:] for t in columns["time_s"]} == {"+01:00", "+02:00"}
    assert read_log(write(tmp_path / "a.csv", columns)).sample_rate_hz == 500.0


def test_dates_of_parquet(tmp_path):
    columns = native_columns(N, 1)
    columns["time_s"] = pd.Timestamp("2024-05-01") + pd.to_timedelta(columns["time_s"], unit="s")
    for name, zone in (("a", None), ("b", "UTC")):
        frame = pd.DataFrame(columns)
        frame["time_s"] = frame["time_s"].dt.tz_localize(zone)
        frame.to_parquet(tmp_path / f"{name}.parquet")
        assert read_log(tmp_path / f"{name}.parquet").sample_rate_hz == 500.0


def test_a_missing_first_date_takes_none_of_the_others():
    dates = np.array(["NaT", "2024-05-01T00:00:01", "2024-05-01T00:00:03"], dtype="datetime64[ns]")
    found = seconds_from_first(dates)
    assert np.isnan(found[0]) and found[1:].tolist() == [0.0, 2.0]
    assert np.isnan(seconds_from_first(dates[:1])).all()


def spoil(k, text):
    columns = stamped(zone="Z")
    columns["time_s"][k] = text
    return columns


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (spoil(5, "noon"), "expected an ISO 8601 stamp, got 'noon' at index 5"),
        (spoil(5, "2024-10-27T00:59:59.01"), "expected stamps with a zone throughout or without"),
        (spoil(5, "2024-13-27T00:59:59.01Z"), "expected ISO 8601 stamps.*2024-13-27"),
        (spoil(5, None), "1 NaN/inf, first at index 5"),
        (
            spoil(0, "27.10.2024 00:59"),
            "expected numbers or ISO 8601 stamps.*got '27.10.2024 00:59'",
        ),
        (spoil(5, "2023-10-27T00:59:59Z"), "expected strictly increasing time"),
        (spoil(0, "0001-01-01T00:00:00Z"), "time_s"),
    ],
)
def test_stamps_that_are_none(tmp_path, columns, words):
    path = write(tmp_path / "a.csv", columns)
    with pytest.raises(LogError, match=words):
        read_log(path)
    assert not check_log(path).ok


def test_a_unit_does_not_go_with_dates(tmp_path):
    text = 'time = { name = "time_s", unit = "ms" }\n[[axis]]\n'
    text += 'position = { name = "position_1", unit = "rad" }\n'
    text += 'torque = { name = "torque_cmd_1", unit = "Nm" }\n'
    path = write(tmp_path / "a.csv", stamped())
    with pytest.raises(LogError, match="unit: expected s, or none, with dates, got ms"):
        read_log(path, parse_column_map(text))


def test_other_signals_are_no_dates(tmp_path):
    columns = native_columns(N, 1)
    columns["position_1"] = stamped()["time_s"]
    with pytest.raises(LogError, match="position_1: expected numbers, got '2024-10-27"):
        read_log(write(tmp_path / "a.csv", columns))


@pytest.mark.parametrize("maker", ["ur-rtde", None])
def test_a_map_with_dates_is_guessed(tmp_path, maker):
    columns = maker_columns("ur-rtde", 3)
    when = pd.Timestamp("2024-05-01") + pd.to_timedelta(columns["timestamp"], unit="s")
    columns["timestamp"] = [t.isoformat(timespec="microseconds") for t in when]
    if maker is None:
        columns = {name.replace("actual_q_", "pos_"): v for name, v in columns.items()}
    path = write(tmp_path / "a.csv", columns)
    found = guess_columns(path, robot(3))
    assert found.named == maker
    log = read_log(path, found.columns, robot=robot(3))
    assert log.sample_rate_hz == 250.0


def test_native_columns_with_uneven_dates(tmp_path):
    columns = stamped()
    when = np.arange(N) / 500.0 + np.random.default_rng(1).uniform(-2e-4, 2e-4, N)
    start = pd.Timestamp("2024-05-01")
    columns["time_s"] = [(start + pd.Timedelta(t, unit="s")).isoformat() for t in when]
    path = write(tmp_path / "a.csv", columns)
    found = guess_columns(path)
    assert read_log(path, found.columns).sample_rate_hz == 500.0

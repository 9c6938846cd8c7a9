"""Logs with uneven stamps: their rows are checked as they were recorded, and by the same names as even ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import check_log, read_log
from axisight.errors import LogError
from axisight.gap.gate.log_only import check_log_alone
from axisight.logs.map_files import parse_column_map
from axisight.logs.mean_rate import mean_rate_hz

MAP = parse_column_map(
    """
sample_rate_hz = 100
[time]
name = "t"
unit = "s"
resample_hz = 100
[[axis]]
position = { name = "q", unit = "rad" }
torque = { name = "tau", unit = "Nm" }
""",
    "columns.toml",
)
N = 2000


def recorded(seed: int = 1) -> np.ndarray:
    """Return stamps that are off by 15 % of a step, a position and a torque, (n, 3)."""
    rng = np.random.default_rng(seed)
    time = np.arange(N) * 0.01 + 0.0015 * rng.uniform(-1, 1, N)
    time -= time[0]
    position = np.sin(1.1 * time) + 0.4 * np.sin(3.7 * time + 1.0)
    torque = 3.0 * np.cos(1.1 * time) + rng.normal(0.0, 0.02, N)
    return np.column_stack([time, position + rng.normal(0.0, 1e-5, N), torque])


def spikes(rows: np.ndarray) -> np.ndarray:
    rows[[300, 700, 1100, 1500, 1900], 1] += 0.5
    return rows


def of_two_publishers(rows: np.ndarray) -> np.ndarray:
    """Every eleventh row is of another source, which reports zeros."""
    rows[5::11, 1:] = 0.0
    return rows


def frozen(rows: np.ndarray) -> np.ndarray:
    rows[700:850, 1:] = rows[700, 1:]
    return rows


def shuffled(rows: np.ndarray) -> np.ndarray:
    np.random.default_rng(3).shuffle(rows[500:540, 1:])
    return rows


def shuffled_for_long(rows: np.ndarray) -> np.ndarray:
    """A third of the log."""
    np.random.default_rng(3).shuffle(rows[700:1400, 1:])
    return rows


def repeated(rows: np.ndarray) -> np.ndarray:
    rows[3::4, 1:] = rows[2::4, 1:]
    return rows


def cut(rows: np.ndarray) -> np.ndarray:
    """Half a second is missing, and the stamps hide it."""
    return np.column_stack([rows[:-50, 0], np.delete(rows[:, 1:], np.s_[1210:1260], axis=0)])


FAULTS = {
    "position_spike": [spikes, of_two_publishers],
    "samples_frozen": [frozen],
    "rows_shuffled": [shuffled, shuffled_for_long],
    "rows_repeated": [repeated],
    "rows_missing": [cut],
}


def written(rows: np.ndarray, path: Path) -> Path:
    np.savetxt(path, rows, delimiter=",", header="t,q,tau", comments="", fmt="%.9f")
    return path


@pytest.mark.parametrize(
    ("name", "spoil"), [(name, spoil) for name, all_of in FAULTS.items() for spoil in all_of]
)
def test_a_fault_of_uneven_rows_is_named_by_check_and_gate(tmp_path, name, spoil):
    path = written(spoil(recorded()), tmp_path / "run.csv")
    named = {f.name for f in check_log(path, MAP).findings if f.severity == "error"}
    assert name in named
    refused = {f.name for f in check_log_alone(read_log(path, MAP)) if f.severity == "refuse"}
    assert refused == named


@pytest.mark.parametrize("seed", range(5))
def test_sound_rows_with_uneven_stamps_have_no_fault(tmp_path, seed):
    path = written(recorded(seed), tmp_path / "run.csv")
    assert check_log(path, MAP).ok
    assert check_log_alone(read_log(path, MAP)) == []


@pytest.mark.parametrize("share", [0.001, 0.005, 0.03, 0.1])
def test_rows_that_the_stamps_show_to_be_missing_are_no_jumps(tmp_path, share):
    """A recorder under load drops rows; resampling bridges them, with a warning."""
    rows = recorded()
    kept = np.random.default_rng(5).random(N) > share
    path = written(rows[kept], tmp_path / "run.csv")
    assert {f.name for f in check_log(path, MAP).findings if f.severity == "error"} == set()
    assert [f for f in check_log_alone(read_log(path, MAP)) if f.severity == "refuse"] == []


@pytest.mark.parametrize("jitter", [0.3, 0.45])
def test_late_stamps_are_no_jumps(tmp_path, jitter):
    rows = recorded()
    even = np.arange(N) * 0.01
    rows[:, 0] = even + 0.01 * jitter * np.random.default_rng(6).uniform(-1, 1, N)
    rows[:, 0] -= rows[0, 0]
    rows[:, 1] = np.sin(1.1 * rows[:, 0]) + 0.4 * np.sin(3.7 * rows[:, 0] + 1.0)
    path = written(rows, tmp_path / "run.csv")
    assert {f.name for f in check_log(path, MAP).findings if f.severity == "error"} == set()


def test_a_stamp_that_is_off_makes_no_spike_of_its_reading(tmp_path):
    """Two stamps are a tenth of a step late; their readings are not."""
    rows = recorded()
    even = np.arange(N) * 0.01
    rows[:, 1] = np.sin(1.1 * even) + 0.4 * np.sin(3.7 * even + 1.0)
    rows[:, 0] = even + 1e-3 * np.isin(np.arange(N), [600, 1200])
    path = written(rows, tmp_path / "run.csv")
    assert {f.name for f in check_log(path, MAP).findings if f.name} == set()


def test_a_part_without_the_fault_is_sound(tmp_path):
    log = read_log(written(frozen(recorded()), tmp_path / "run.csv"), MAP)
    assert check_log_alone(log.part(10.0)) == []
    assert [f.name for f in check_log_alone(log.part(0.0, 9.5))] == ["samples_frozen"] * 2


def test_a_reader_out_of_step_with_its_source_is_sound(tmp_path):
    """A source of 100 Hz is read at uneven times: some of its rows are read twice, others never."""
    rng = np.random.default_rng(8)
    read = (np.arange(N) + 0.22) * 0.01 + 0.0025 * rng.uniform(-1, 1, N)
    source = recorded()
    ticks = np.clip(np.floor(read / 0.01).astype(int), 0, None)
    rows = np.column_stack([read, source[ticks, 1:]])
    assert 0.03 < np.mean(np.diff(ticks) == 0) < 0.1
    rows[:, 0] -= rows[0, 0]
    path = written(rows, tmp_path / "run.csv")
    named = {f.name: f.severity for f in check_log(path, MAP).findings if f.name}
    assert "rows_repeated" in named
    assert "error" not in named.values()


def test_a_hole_is_told_the_line_that_bridges_it() -> None:
    time = np.delete(np.arange(N) * 0.01, np.s_[700:720])
    with pytest.raises(LogError, match=r"resample_hz = 100 in \[time\]"):
        mean_rate_hz(time + 1e-4 * np.sin(np.arange(len(time))), "run.csv")

"""Faults of rows are errors where they change the motion, and warnings where they do not."""

from __future__ import annotations

import numpy as np
import pytest

from axisight.logs.harm import LITTLE, deviations, is_harmless
from axisight.logs.rows import check_rows

STEP_S = 1e-3
TIME = STEP_S * np.arange(5000)
RNG = np.random.default_rng(4)
MOTIONS = np.column_stack([np.sin(2.1 * TIME + k) + 0.3 * np.sin(5.7 * TIME) for k in range(2)])
TORQUE = np.cos(3.0 * TIME) + 0.01 * RNG.normal(size=len(TIME))


def found(position: np.ndarray, step_s: float = STEP_S) -> dict[str, str]:
    """Return the severities of the findings about positions (n, k) and one torque, by name."""
    signals = {("position", k): x for k, x in enumerate(position.T)}
    signals["torque", 0] = np.interp(np.arange(len(position)), np.arange(len(TIME)), TORQUE)
    return {f.name: f.severity for f in check_rows(signals, dict.fromkeys(signals, "x"), step_s)}


def signals_with(index: np.ndarray) -> dict[tuple[str, int], np.ndarray]:
    out = {("position", k): x[index] for k, x in enumerate(MOTIONS.T)}
    out["torque", 0] = TORQUE[index]
    return out


def severities(index: np.ndarray) -> dict[str, str]:
    """Return the severities of the findings about the rows of ``index``, by name."""
    signals = signals_with(index)
    return {f.name: f.severity for f in check_rows(signals, dict.fromkeys(signals, "x"), STEP_S)}


def test_two_rows_given_twice_in_thousands_are_a_warning() -> None:
    index = np.sort(np.concatenate([np.arange(5000), [1234, 3210]]))
    assert severities(index) == {"rows_repeated": "warning"}


def test_a_hundred_rows_given_twice_are_an_error() -> None:
    index = np.sort(np.concatenate([np.arange(5000), np.arange(1000, 1500, 5)]))
    assert severities(index)["rows_repeated"] == "error"


def test_one_lost_row_is_a_warning_and_twenty_are_an_error() -> None:
    assert set(severities(np.delete(np.arange(5000), 2000)).values()) <= {"warning"}
    lost = severities(np.delete(np.arange(5000), np.s_[2000:2020]))
    assert lost["rows_missing"] == "error"


@pytest.mark.parametrize(("size", "severity"), [(2e-3, "warning"), (5e-2, "error")])
def test_a_counter_that_loses_steps_counts_by_what_it_changes(size: float, severity: str) -> None:
    position = MOTIONS.copy()
    position[2600:, 0] -= size
    assert set(found(position).values()) == {severity}


@pytest.mark.parametrize(("share", "severity"), [(0.3, "warning"), (3.0, "error")])
def test_a_reading_within_its_sample_is_a_warning(share: float, severity: str) -> None:
    """A spike of less than half a step is a reading that came early or late."""
    position = MOTIONS.copy()
    k = 1500
    position[k, 0] += share * abs(position[k, 0] - position[k - 1, 0])
    assert found(position) == {"position_spike": severity}


def test_jitter_of_the_clock_is_no_jump_in_a_log_that_rests_for_long() -> None:
    """Every reading is up to a quarter of a sample early or late; half of the log is rest."""
    step_s = 1e-2
    time = step_s * np.arange(3000)
    read = time + 0.25 * step_s * RNG.uniform(-1, 1, len(time))
    moving = np.clip(read, 8.0, 22.0) - 8.0
    assert np.mean((time < 8.0) | (time > 22.0)) > 0.5
    position = 0.5 * np.sin(1.3 * moving)[:, None] + 0.2 * np.sin(2.9 * moving)[:, None]
    assert found(position, step_s) == {}


def test_an_axis_that_rests_and_starts_at_once_was_not_frozen() -> None:
    """A driver that reports zero speed exactly at rest: it brakes gently and starts with a step of the motion."""
    position = MOTIONS.copy()
    braked = np.where(TIME < 1.0, TIME, 1.5 - 0.5 * (2.0 - TIME) ** 2)
    path = np.where(TIME < 2.0, braked, 1.5 + np.clip(TIME - 2.4, 0.0, None))
    position[:, 0] = np.sin(2.1 * path)
    assert np.all(np.diff(position[2001:2400, 0]) == 0.0)
    assert "samples_frozen" not in found(position)


def test_a_channel_that_missed_motion_was_frozen() -> None:
    position = MOTIONS.copy()
    position[2000:2400, 0] = position[2000, 0]
    assert found(position)["samples_frozen"] == "error"


def test_warnings_say_that_the_log_can_be_used() -> None:
    signals = signals_with(np.sort(np.concatenate([np.arange(5000), [1234]])))
    (finding,) = check_rows(signals, dict.fromkeys(signals, "x"), STEP_S)
    assert finding.message.endswith(LITTLE)


def test_what_a_fault_does_counts_against_the_motion() -> None:
    """A step of a thousandth of the top step does nothing; one a hundred times as large as it does harm."""
    motion = np.sin(2.1 * TIME)
    top = float(np.abs(np.diff(motion)).max())
    for share, harmless in ((1e-3, True), (1e2, False)):
        stepped = motion + share * top * (np.arange(len(TIME)) > 2500)
        wrong = deviations(stepped, np.array([2500]))
        assert is_harmless(stepped, wrong, STEP_S) is harmless


def test_readings_that_are_late_now_and_then_are_a_warning() -> None:
    """A reader that is faster than its source reads old rows, and makes up for them in the next."""
    late = RNG.random(len(TIME)) < 0.05
    late[1:] &= ~late[:-1]
    index = np.arange(len(TIME)) - late
    index[0] = 0
    named = severities(index)
    assert "rows_repeated" in named
    assert set(named.values()) == {"warning"}


def test_an_axis_that_stands_beside_others_is_set_aside() -> None:
    """Other axes shake it: its encoder jumps."""
    position = MOTIONS.copy()
    position[:, 1] = 0.3 + 1e-6 * RNG.normal(size=len(TIME))
    position[3000:, 1] += 2e-4
    assert found(position) == {}


def test_a_slide_beside_joints_is_looked_at() -> None:
    """Its travel in metres is a hundredth of theirs in radians."""
    position = MOTIONS.copy()
    position[:, 1] *= 2e-3 * np.ptp(position[:, 0]) / np.ptp(position[:, 1])
    position[3000:, 1] += 0.3 * np.ptp(position[:, 1])
    assert found(position) == {"position_jumps": "error"}


def test_a_glitch_of_an_axis_that_stands_is_an_error() -> None:
    position = MOTIONS.copy()
    position[:, 1] = 0.3 + 1e-6 * RNG.normal(size=len(TIME))
    position[1000, 1] += 0.5
    assert found(position) == {"position_spike": "error"}

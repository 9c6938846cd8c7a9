"""Where a log moves, and what is used of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import Log
from axisight.gap.prepare.used_part import Used, motions, stands

STEP_S = 0.01


def log_of(*turns: tuple[float, float], seconds: float = 10.0, told: bool = False) -> Log:
    """A log of two axes, the second of which turns from each start for so long [s]; ``told``: so the reference."""
    time = STEP_S * np.arange(round(seconds / STEP_S))
    speed = sum(np.where((time > a) & (time < a + n), 2.0, 0.0) for a, n in turns)
    position = np.column_stack([0 * time, STEP_S * np.cumsum(speed)])
    position += 1e-5 * np.random.default_rng(1).normal(size=position.shape)
    reference = np.column_stack([np.where((time > 1.0) & (time < 2.0), 1.0, 0.0), speed])
    return Log(
        name="run",
        source=Path("run.csv"),
        sample_time_s=STEP_S,
        time_s=time,
        torque_nm=np.zeros_like(position),
        position_rad=position,
        velocity_ref_rad_s=reference if told else None,
    )


@pytest.mark.parametrize(
    ("turns", "expected"),
    [
        ([(3.0, 2.0)], [(2.7, 5.3)]),
        ([(3.0, 1.0), (4.4, 1.0), (7.0, 1.0)], [(2.7, 5.7), (6.7, 8.3)]),
        # A move that is too short for a log goes with the next, the last with the one before.
        ([(1.0, 0.2), (4.0, 1.0), (7.0, 0.2)], [(0.7, 7.5)]),
        # In motion from the first sample to the last.
        ([(-1.0, 20.0)], [(0.0, 10.0)]),
        ([(9.5, 0.2)], [(9.0, 10.0)]),
        ([], []),
    ],
)
def test_motions_are_what_is_between_rests(turns, expected):
    found = motions(log_of(*turns) if turns else log_of((20.0, 1.0)), 0.5)
    assert len(found) == len(expected)
    for span, wanted in zip(found, expected, strict=True):
        assert span == pytest.approx(wanted, abs=0.06)


def test_a_reference_that_moves_is_no_rest():
    """A motor that sticks at first: its controller has begun."""
    assert stands(log_of((4.0, 2.0)))[150]
    log = log_of((4.0, 2.0), told=True)
    assert not stands(log)[150]
    (part,) = Used(moving=True).of(log)
    assert part.notes == ("from 0.72 s to 6.29 s",)


def test_a_whole_log_stays_as_it_is():
    log = log_of((3.0, 2.0))
    assert Used().of(log) == [log]

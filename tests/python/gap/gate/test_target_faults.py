"""Targets of positions that no motion generator makes are refused by name; any motion that one makes is not."""

from pathlib import Path

import numpy as np
import pytest

from axisight import Log
from axisight.gap.gate.log_only import check_log_alone

RATE_HZ = 100.0
TIME = np.arange(3000) / RATE_HZ
SMOOTH = 0.8 * np.sin(2.0 * TIME) + 0.3 * np.sin(5.3 * TIME)


def log_with(target: np.ndarray) -> Log:
    rng = np.random.default_rng(2)
    return Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=1 / RATE_HZ,
        time_s=TIME,
        torque_nm=np.cos(3.0 * TIME)[:, None] + 0.01 * rng.normal(size=(len(TIME), 1)),
        position_rad=SMOOTH[:, None] + 1e-5 * rng.normal(size=(len(TIME), 1)),
        position_ref_rad=target[:, None],
    )


def refused(target: np.ndarray) -> set[tuple[str, str]]:
    found = check_log_alone(log_with(target))
    return {(f.name, f.field) for f in found if f.severity == "refuse" and "ref" in f.field}


@pytest.mark.parametrize("count", [1, 8])
def test_single_samples_off_are_refused(count: int):
    target = SMOOTH.copy()
    target[200 : 200 + 300 * count : 300] += 0.6
    assert refused(target) == {("position_spike", "position_ref_1")}


def test_wrapped_turns_are_refused():
    whole = SMOOTH + 0.5 * TIME
    wrapped = np.mod(whole + np.pi, 2 * np.pi) - np.pi
    assert refused(wrapped) == {("position_wrapped", "position_ref_1")}


MOTIONS = {
    "smooth": SMOOTH,
    "square": 0.5 * np.sign(np.sin(2.0 * TIME + 0.1)),
    "steps and rests": np.round(SMOOTH, 1),
    "triangle": np.abs(np.mod(TIME, 2.0) - 1.0),
    "chirp to 40 Hz": 0.2 * np.sin(2 * np.pi * 0.5 * 40.0 / TIME[-1] * TIME**2),
    "noise": np.random.default_rng(3).normal(0.0, 0.1, len(TIME)),
    "pulses of 50 ms": SMOOTH + 0.4 * (np.mod(TIME, 3.0) < 0.05),
}


@pytest.mark.parametrize("kind", MOTIONS)
def test_what_generators_make_is_taken(kind: str):
    assert refused(MOTIONS[kind]) == set()

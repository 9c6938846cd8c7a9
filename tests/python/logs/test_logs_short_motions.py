"""Logs that hardly resolve a motion: short ones are no accidents, accidents stay ones."""

from __future__ import annotations

import numpy as np
import pytest

from axisight.logs.jumps import position_jumps
from axisight.logs.spikes import isolated_spikes

RATE_HZ = 50.0
TIME = np.arange(500) / RATE_HZ


def position(width_s: float) -> np.ndarray:
    """A slow sine, and a turn of half a radian within a few samples, as of a wrist near a singular pose."""
    turn = 0.25 * (1 + np.tanh((TIME - 5.003) / width_s))
    return 0.3 * np.sin(0.5 * TIME) + turn


@pytest.mark.parametrize("width_s", [0.03, 0.045, 0.06, 0.1])
def test_a_short_motion_is_no_jump(width_s: float):
    assert position_jumps(position(width_s), 0, [])[0] == []


def test_lost_rows_beside_a_short_motion_are_jumps():
    """Three rows at the fastest stretch of the slow motion."""
    swing = 2.0 * np.sin(2.0 * TIME)
    whole = position(0.045) + swing
    assert position_jumps(whole, 0, [])[0] == []
    at = 157  # 3.14 s, where the swing passes zero
    (jump,), _ = position_jumps(np.delete(whole, slice(at, at + 3)), 0, [])
    assert jump.index == at - 1


def test_a_spike_counts_by_the_motion():
    """A hundredth of the largest step says nothing of the motion; a fifth of it does."""
    smooth = np.sin(TIME)
    step = np.abs(np.diff(smooth)).max()
    for share, found in ((0.01, []), (0.2, [200])):
        spiked = smooth.copy()
        spiked[200] += share * step
        assert isolated_spikes(spiked).tolist() == found

"""A torque that repeats: frozen, or all that a loop has to say to a coarse encoder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.logs.frozen import check_frozen

Array = NDArray[np.float64]
STEP_S, STEP_RAD = 5e-4, 3.8e-4
TIME = STEP_S * np.arange(4000)
# Shaken, but for twenty samples of one speed to the last step of the encoder.
SHAKEN = 10.0 + 3.0 * np.sin(9 * TIME) + 20.0 * np.sin(2 * np.pi * 311.7 * TIME)
SPEED = np.where((TIME > 1.0) & (TIME < 1.01), 13 * STEP_RAD / STEP_S, SHAKEN)


def faults(position: Array, torque: Array) -> list[str]:
    signals = {("position", 0): position, ("torque", 0): torque}
    return [f.name for f in check_frozen(signals, dict.fromkeys(signals, "x"), STEP_S)]


def coarse() -> Array:
    """The angle as a coarse encoder counts it."""
    return STEP_RAD * np.round(np.cumsum(SPEED) * STEP_S / STEP_RAD)


def loop(position: Array) -> Array:
    """The torque of a loop that answers the speed which it makes of the counts."""
    speed = np.gradient(position, STEP_S)
    return np.round(3.0 * (12.0 - np.roll(speed, 1)), 6)


def test_a_loop_at_one_speed_to_the_last_count_repeats_its_torque() -> None:
    position = coarse()
    torque = loop(position)
    assert np.any(np.diff(torque) == 0.0)
    assert faults(position, torque) == []


def test_a_torque_that_stands_still_while_counts_change_is_frozen() -> None:
    position = coarse()
    torque = loop(position)
    torque[3000:3040] = torque[3000]
    assert np.ptp(np.diff(position[3000:3040])) > 0.0
    assert faults(position, torque) == ["samples_frozen"]

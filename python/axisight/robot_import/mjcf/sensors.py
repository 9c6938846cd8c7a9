"""Delays of sensors in a compiled MJCF."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import numpy as np

from axisight.robot_import.mjcf.actuators import numbers


def reading_delay_s(model: Any, j: int) -> float:
    """Return the delay [s] of the position sensors of joint ``j``; 0 without one, or if they differ."""
    found = {float(_delays(model)[i]) for i, joint in _encoders(model) if joint == j}
    return found.pop() if len(found) == 1 else 0.0


def notes_of_sensors(model: Any, name: Callable[[str, int], str]) -> list[str]:
    """Return notes on delayed sensors that are left out; ``name`` gives names of elements."""
    kept = {i for i, joint in _encoders(model) if reading_delay_s(model, joint) > 0}
    late = np.flatnonzero(_delays(model) > 0).tolist()
    return [
        f"sensor {name('sensor', i)!r}: its delay left out: expected sensors of joint positions, all equally late"
        for i in late
        if i not in kept
    ]


def _delays(model: Any) -> Any:
    return numbers(model, "sensor_delay", np.zeros(model.nsensor))


def _encoders(model: Any) -> Iterator[tuple[int, int]]:
    """Yield sensors of joint positions and the numbers of their joints."""
    kind = int(import_module("mujoco").mjtSensor.mjSENS_JOINTPOS)
    for i in np.flatnonzero(model.sensor_type == kind).tolist():
        yield i, int(model.sensor_objid[i])

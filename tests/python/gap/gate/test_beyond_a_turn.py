"""Angles beyond a turn on most joints are no angles of joints: of targets nothing else tells the unit."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight.gap.gate.beyond_a_turn import check_turns

SWEEP = np.sin(np.linspace(0.0, 20.0, 400))[:, None]


def found(amplitudes, *, ratio=1.0, slides=(), targets=True) -> list[str]:
    """Names of findings of axes that swing so far [of the motor], as the file reads them."""
    n = len(amplitudes)
    position = SWEEP * np.asarray(amplitudes)
    robot = SimpleNamespace(
        n_axes=n,
        axis_is_prismatic=[i in slides for i in range(n)],
        gear_ratio=np.full(n, ratio),
    )
    log = SimpleNamespace(
        name="run", n_axes=n, position_rad=position, position_ref_rad=position if targets else None
    )
    return [f.name for f in check_turns(robot, log)]


def test_degrees_are_refused():
    assert found(np.degrees([1.2, 0.9, 2.0])) == ["position_in_degrees"]
    # Half of the axes hardly move: others tell.
    assert found(np.degrees([1.2, 0.02, 0.03, 2.0])) == ["position_in_degrees"]
    # Angles of motors, read as those of joints.
    assert found(np.array([1.2, 0.9, 2.0]) * 1000) == ["position_scaled"]


@pytest.mark.parametrize(
    "fine",
    [
        {"amplitudes": [3.1, 2.9, 6.2]},
        {"amplitudes": [310.0, 290.0, 620.0], "ratio": -0.01},
        {"amplitudes": [1.0, 0.5, 900.0]},
        {"amplitudes": [900.0]},
        {"amplitudes": [120.0, 250.0], "slides": (0, 1)},
        {"amplitudes": [120.0, 250.0], "targets": False},
    ],
    ids=["of joints", "of motors with gears", "one turns on", "a wheel", "slides", "torques tell"],
)
def test_angles_of_joints_are_not(fine):
    assert found(**fine) == []

"""Finds joint angles beyond a turn in logs without torque, where nothing else shows their unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.logs import Log
from axisight.logs.guessing.evidence import LARGEST_JOINT_DEG, LARGEST_JOINT_RAD
from axisight.robot import Robot

Array = NDArray[np.float64]

# Smallest number of axes beyond a turn for a finding. A single axis of an arm may turn without limits.
_AXES = 2
# Smallest share of the rotary axes beyond a turn for a finding.
_SHARE = 0.5


def check_turns(robot: Robot, log: Log) -> list[Finding]:
    """Return a finding if most rotary joints have angles beyond a turn: degrees, or motor angles.

    Targets in the same unit follow the positions, so that a comparison with them shows nothing.
    """
    if log.position_ref_rad is None or log.n_axes != robot.n_axes:
        return []
    turns = ~np.asarray(robot.axis_is_prismatic)
    largest = np.abs(log.position_rad).max(axis=0) * np.abs(robot.gear_ratio)
    beyond = np.flatnonzero(turns & (largest > LARGEST_JOINT_RAD))
    if len(beyond) < max(_AXES, _SHARE * turns.sum()):
        return []
    top = float(largest[beyond].max())
    name = "position_in_degrees" if top <= LARGEST_JOINT_DEG else "position_scaled"
    axes = ", ".join(str(i + 1) for i in beyond)
    message = (
        f"expected joint angles of at most {LARGEST_JOINT_RAD:g} rad, got up to {top:.3g} on axes {axes}. Are "
        "these degrees, or motor angles? State the unit and the gear of positions and targets in a column map"
    )
    return [Finding(name, "refuse", message, log.name, None, "position")]

"""Findings that need the results of two steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.graybox.multiaxis.elastic_step import ElasticStep
from axisight.graybox.multiaxis.joint_step import POOR_PERCENT, JointStep

_FAR = 0.3
"""Share of a stiffness or motor inertia by which step 3 may move it."""
_UNKNOWN = 0.5
"""Standard error over value from which a parameter counts as unknown."""


def between_steps(elastic: ElasticStep, joint: JointStep, logs: Sequence[str]) -> list[str]:
    """Return what the values of steps 2 and 3 together say about the model; ``logs`` are names."""
    out = []
    for name, value, std in zip(joint.fit.names, joint.fit.values, joint.fit.std, strict=True):
        if std > _UNKNOWN * abs(value):
            out.append(
                f"{name}: {value:.3g} with a standard error of {std:.2g}: the logs do not determine it; "
                "excite it more, or leave it out"
            )
    if float(np.min(joint.fit_percent)) < POOR_PERCENT:
        out += _poor(elastic, joint, logs)
    return out


def _poor(elastic: ElasticStep, joint: JointStep, logs: Sequence[str]) -> list[str]:
    """Return what a poor fit says; a good one shows that step 2 was no more than a start."""
    log, axis = divmod(int(np.argmin(joint.fit_percent)), joint.fit_percent.shape[1])
    out = [
        f"{logs[log]}, axis {axis + 1}: the model explains {joint.fit_percent[log, axis]:.0f} % only: an effect "
        "is missing, the search ended far from the machine, or the axis hardly moves there"
    ]
    before = {} if elastic.fit is None else elastic.robot.parameters()
    for name, value in zip(joint.fit.names, joint.fit.values, strict=True):
        old = before.get(name, 0.0)
        moved = abs(value / old - 1) if old > 0 else 0.0
        if name.endswith((".stiffness", ".motor_inertia")) and moved > _FAR:
            out.append(
                f"{name}: step 3 moved it by {100 * moved:.0f} % from the value of step 2: responses and "
                "motions disagree; look for an effect that the model lacks"
            )
    return out

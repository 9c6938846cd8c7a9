"""Findings that need the results of two steps."""

from __future__ import annotations

import numpy as np

from axisight.graybox.multiaxis.elastic_step import ElasticStep
from axisight.graybox.multiaxis.joint_step import JointStep

_FAR = 0.3
"""Share of a value by which step 3 may move it: chapter 9 moves dampings by more, stiffnesses by less."""
_CERTAIN = 5.0
"""Standard errors of step 2 by which step 3 may move a value."""
_POOR_PERCENT = 80.0
"""Fit of a log below which a model misses something that is larger than noise [%]."""
_UNKNOWN = 0.5
"""Standard error over value from which a parameter counts as unknown."""


def between_steps(elastic: ElasticStep, joint: JointStep) -> list[str]:
    """Return what the values of steps 2 and 3 together say about the model."""
    out = []
    before = {} if elastic.fit is None else elastic.robot.parameters()
    known = {} if elastic.fit is None else dict(zip(elastic.fit.names, elastic.fit.std, strict=True))
    for name, value, std in zip(joint.fit.names, joint.fit.values, joint.fit.std, strict=True):
        if std > _UNKNOWN * abs(value):
            out.append(
                f"{name}: the standard error is {100 * std / max(abs(value), 1e-300):.0f} % of the value: the "
                "logs do not determine it; excite it more, or leave it out"
            )
        old = before.get(name, 0.0)
        moved = abs(value / old - 1) if old > 0 else 0.0
        certain = abs(value - old) > _CERTAIN * known.get(name, np.inf)
        if name.endswith((".stiffness", ".motor_inertia")) and moved > _FAR and certain:
            out.append(
                f"{name}: step 3 moved it by {100 * moved:.0f} % from the value of step 2: the responses and "
                "the motions disagree; look for an effect that the model lacks"
            )
    worst = float(np.min(joint.fit_percent))
    if worst < _POOR_PERCENT:
        log, axis = np.unravel_index(int(np.argmin(joint.fit_percent)), joint.fit_percent.shape)
        out.append(
            f"log {log + 1}, axis {axis + 1}: the model explains {worst:.0f} % only; an effect is missing, or "
            "the axis hardly moves there"
        )
    return out

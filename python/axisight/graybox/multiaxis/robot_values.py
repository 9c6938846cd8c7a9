"""The identification of an arm as values of a robot file."""

from __future__ import annotations

import numpy as np

from axisight.arguments import instance
from axisight.effects import Effect
from axisight.graybox.multiaxis.procedure import RobotIdentification
from axisight.robot_file import Identified, Provenance, identified
from axisight.robot_file.values import noted

_FROM_STEP_3 = ("stiffness", "damping", "motor_inertia", "viscous_friction")
"""Quantities of a joint that step 1 does not decide."""


def identified_robot(found: RobotIdentification, provenance: Provenance) -> Identified:
    """Return the result of :func:`identify_robot` for `axisight.robot_file.write_identified`.

    Values and covariance are those of step 3, with masses and inertias of step 1 if it was asked for
    ``bodies``; those have no standard errors. The notes hold the status and the findings. Effects of the
    model get their fitted values. Raises InputError for another type.
    """
    instance("found", found, RobotIdentification)
    fit = found.joint.fit
    values = dict(zip(fit.names, fit.values.tolist(), strict=True))
    errors = dict(zip(fit.names, fit.std.tolist(), strict=True))
    removed: tuple[Effect, ...] = ()
    bodies: dict[str, float] = {}
    if found.rigid.bodies and found.rigid.regression is not None:
        step = found.rigid.regression.identified(provenance)
        removed = tuple(e for e in step.removed if e.name not in {f.name for f in found.effects})
        bodies = {
            name: float(value)
            for name, value in zip(step.names, step.values, strict=True)
            if "@" not in name and name.rpartition(".")[2] not in _FROM_STEP_3
        }
    known = bool(np.isfinite(fit.covariance).all()) and not bodies
    return identified(
        bodies | values,
        noted(provenance, [f"search: {found.status}", *found.findings]),
        standard_errors=None if known else {n: e for n, e in errors.items() if np.isfinite(e)},
        covariance=fit.covariance if known else None,
        effects=found.effects,
        removed=removed,
    )

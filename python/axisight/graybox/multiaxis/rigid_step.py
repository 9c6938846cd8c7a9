"""Step 1: friction, and on request the bodies, from slow logs by regression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.effects.stated import friction_corner
from axisight.logs import Log
from axisight.rigid_body import LogIdentification, identify_logs
from axisight.robot import Robot
from axisight.robot_file import Provenance
from axisight.robot_file.document import render

COULOMB_CERTAIN = 3.0
"""A Coulomb friction below this many standard errors is left out of the model."""


@summarized
@dataclass(frozen=True)
class RigidStep:
    """Result of step 1.

    ``regression`` is the rigid-body identification, None without slow logs. ``robot`` has the viscous
    friction found, and on request the bodies. ``effects`` are the Coulomb frictions that are certain.
    """

    regression: LogIdentification | None
    robot: Robot
    effects: tuple[Effect, ...]
    findings: tuple[str, ...]


def rigid_step(
    robot: Robot, slow: Sequence[Log], *, bodies: bool, cutoff_hz: float
) -> RigidStep:
    """Return friction, and with ``bodies`` masses and inertias, from slow logs.

    See :func:`axisight.rigid_body.identify_logs`, whose errors it raises.
    """
    if not slow:
        text = "no slow log: friction starts at the robot's values; record slow motions both ways"
        return RigidStep(None, robot, (), (text,))
    found = identify_logs(robot, slow, cutoff_hz=cutoff_hz, consistent=bodies)
    estimate = found.estimate
    spread = np.sqrt(np.diag(estimate.covariance))
    errors = dict(zip(estimate.base.names, spread, strict=True))
    values = dict(zip(estimate.base.names, estimate.values, strict=True))
    top = np.max([np.abs(m.velocity_rad_s).max(axis=0) for m in found.motions], axis=0)
    corner = friction_corner(top)
    machine, findings = robot, [str(f) for f in estimate.findings if f.serious]
    if bodies:
        machine = _with_bodies(robot, found)
    viscous, effects = {}, []
    for number, joint in enumerate(robot.axis_names, 1):
        drag = values.get(f"{joint}.viscous_friction")
        if drag is not None and drag > 0:
            viscous[f"{joint}.viscous_friction"] = float(drag)
        name = f"{joint}.coulomb_friction"
        if name in values and values[name] > COULOMB_CERTAIN * errors[name]:
            shape = {"smoothing_rad_s": float(corner[number - 1])}
            size = {"coulomb_nm": float(values[name])}
            effects.append(Effect("coulomb_friction", number, size | shape))
    return RigidStep(found, machine.with_parameters(viscous), tuple(effects), tuple(findings))


def _with_bodies(robot: Robot, found: LogIdentification) -> Robot:
    """Return the robot with the bodies found and its other values and effects."""
    identified = found.identified(Provenance("step 1"))
    return Robot.from_toml(render(robot, identified, "")).with_effects(robot.effects)

"""Step 1: friction, and on request the bodies, from slow logs by regression."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.effects.stated import friction_corner
from axisight.errors import IdentificationWarning
from axisight.logs import Log
from axisight.rigid_body import LogIdentification, TorqueModel, identify_logs
from axisight.rigid_body.friction import USUAL_TERMS
from axisight.robot import Robot
from axisight.robot_file import Provenance
from axisight.robot_file.document import render

Real = NDArray[np.float64]

_OF_DRIVES = ("motor_inertia", "viscous_friction", "coulomb_friction", "torque_offset")


@summarized
@dataclass(frozen=True)
class RigidStep:
    """Result of step 1.

    ``regression`` is the rigid-body identification, None without slow logs. ``robot`` has the viscous
    friction found, and with ``bodies`` also masses and inertias. ``effects`` are the Coulomb frictions of the
    axes, of zero size without slow logs.
    """

    regression: LogIdentification | None
    robot: Robot
    effects: tuple[Effect, ...]
    bodies: bool
    findings: tuple[str, ...]


def rigid_step(
    robot: Robot,
    slow: Sequence[Log],
    broadband: Sequence[Log],
    *,
    bodies: bool,
    cutoff_hz: float,
) -> RigidStep:
    """Return friction, and with ``bodies`` masses and inertias, from slow logs.

    Without ``bodies`` the regression holds the links at the robot's values, so that a short motion is enough.
    ``broadband`` logs only say how fast the axes move. Raises InputError as
    :func:`axisight.rigid_body.identify_logs`.
    """
    corner = friction_corner(np.max([_top_speed(log) for log in (*slow, *broadband)], axis=0))
    if not slow:
        text = "no slow log: friction starts at the robot's values; record slow motions both ways"
        return RigidStep(None, robot, _coulomb(corner, np.zeros(robot.n_axes)), False, (text,))
    with warnings.catch_warnings():
        # The findings say the same.
        warnings.simplefilter("ignore", IdentificationWarning)
        found = identify_logs(
            robot,
            slow,
            cutoff_hz=cutoff_hz,
            consistent=bodies,
            known=None if bodies else _links(robot),
        )
    estimate = found.estimate
    values = dict(zip(estimate.base.names, estimate.values.tolist(), strict=True))
    findings = [f"step 1: {f}" for f in estimate.findings if f.serious]
    machine = _with_bodies(robot, found) if bodies else robot
    names = robot.axis_names
    drag = {f"{joint}.viscous_friction": values.get(f"{joint}.viscous_friction") for joint in names}
    dry = [values.get(f"{joint}.coulomb_friction", 0.0) for joint in names]
    return RigidStep(
        found,
        machine.with_parameters({n: v for n, v in drag.items() if v is not None and v > 0}),
        _coulomb(corner, np.maximum(dry, 0.0)),
        bodies,
        tuple(findings),
    )


def _top_speed(log: Log) -> Real:
    speed = np.gradient(log.position_rad, log.sample_time_s, axis=0)
    return np.asarray(np.abs(speed).max(axis=0))


def _coulomb(corner: Real, size: Real) -> tuple[Effect, ...]:
    return tuple(
        Effect(
            "coulomb_friction",
            number,
            {"coulomb_nm": float(nm), "smoothing_rad_s": float(max(speed, 1e-3))},
        )
        for number, (speed, nm) in enumerate(zip(corner, size, strict=True), 1)
    )


def _links(robot: Robot) -> dict[str, float]:
    """Return the parameters of all links, at the robot's values."""
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    pairs = zip(model.names, model.nominal.tolist(), strict=True)
    return {name: value for name, value in pairs if not name.endswith(_OF_DRIVES)}


def _with_bodies(robot: Robot, found: LogIdentification) -> Robot:
    """Return the robot with the bodies found and its other values and effects."""
    identified = found.identified(Provenance("step 1"))
    return Robot.from_toml(render(robot, identified, "")).with_effects(robot.effects)

"""Step 3: all parameters together in the time domain, with residuals weighted by their own spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fitting import (
    FitOptions,
    Fitted,
    Parameter,
    Weighting,
    effect_parameter,
    fit,
    robot_parameter,
)
from axisight.graybox.multiaxis.starts import from_its_start
from axisight.graybox.multiaxis.weightings import Sensors
from axisight.logs import Log
from axisight.robot import Robot

Real = NDArray[np.float64]

PASSES = 3
"""Largest number of fits; each weights its residuals by the spectrum of those before."""
_SETTLED = 0.05
"""The weights have settled when the loss per residual is within this share of one."""
_SMALL_CHANGE = 0.02
"""Natural change of a Coulomb friction, relative to the typical one."""
_FIRST_TOLERANCE = 1e-4
"""Share of the loss by which a pass that is not the last has to go on falling."""


@summarized
@dataclass(frozen=True)
class JointStep:
    """Result of step 3.

    ``fit`` is the last fit, ``effects`` those of the model with their fitted values, ``robot`` the robot with
    its fitted parameters. ``weighting``, ``joint_weighting`` (None without encoders) and
    ``acceleration_weighting`` (None without accelerometers) are those of the last fit. ``passes`` counts the
    fits. ``fit_percent`` and ``initial_fit_percent`` (n_logs, n_axes) are the fit (3.54) of the torque at the
    end and before step 3 [%].
    """

    fit: Fitted
    robot: Robot
    effects: tuple[Effect, ...]
    weighting: Weighting
    joint_weighting: Weighting | None
    acceleration_weighting: Weighting | None
    passes: int
    initial_fit_percent: Real
    fit_percent: Real
    findings: tuple[str, ...]


POOR_PERCENT = 80.0
"""Fit of a log below which a model misses something that is larger than noise [%]."""


def best_joint_step(
    starts: Sequence[Robot],
    logs: Sequence[Log],
    names: Sequence[str],
    effects: Sequence[Effect],
    more: Sequence[Parameter],
    *,
    options: FitOptions,
) -> JointStep:
    """Return :func:`joint_step` from the first of ``starts`` that explains all logs, or else the best.

    A simulation has other minima where a resonance of the model lies on another one of the arm.
    """
    found: list[JointStep] = []
    for robot in starts:
        one = joint_step(robot, logs, names, effects, more, options=options)
        found.append(one)
        if one.fit_percent.min() > POOR_PERCENT:
            break
    return max(found, key=lambda one: float(one.fit_percent.mean()))


def joint_step(
    robot: Robot,
    logs: Sequence[Log],
    names: Sequence[str],
    effects: Sequence[Effect],
    more: Sequence[Parameter],
    *,
    options: FitOptions,
) -> JointStep:
    """Return robot parameters ``names``, the sizes of Coulomb friction and ``more``, fitted to all logs.

    The spectrum of the residuals serves as the noise model of a prediction-error fit. It is estimated at the
    start and again after each fit, until the residuals are white. Raises InputError as `axisight.fit`.
    """
    sensors = Sensors.of(logs)
    placed = [from_its_start(robot, log) for log in logs]
    before = sensors.residuals(robot, placed, effects, options)
    residuals, model, acting = before, robot, list(effects)
    found: Fitted | None = None
    passes = 0
    while found is None or passes < PASSES:
        weighting, of_joints, of_accelerations = sensors.weightings(robot, logs, residuals)
        parameters = _parameters(model, names, acting, more, found)
        rough = replace(options, loss_tolerance=_FIRST_TOLERANCE)
        chosen = rough if passes == 0 else options
        found = fit(
            model,
            placed,
            parameters,
            effects=acting,
            weighting=weighting,
            joint_weighting=of_joints,
            acceleration_weighting=of_accelerations,
            options=chosen,
        )
        passes += 1
        model, acting = _with_values(model, acting, found)
        # The deflection at the start follows from the stiffness.
        placed = [from_its_start(model, log) for log in logs]
        residuals = sensors.residuals(model, placed, acting, options)
        per_residual = found.loss / max(len(found.core.residual), 1)
        if passes > 1 and abs(per_residual - 1.0) < _SETTLED:
            break
    return JointStep(
        fit=found,
        robot=model,
        effects=tuple(acting),
        weighting=weighting,
        joint_weighting=of_joints,
        acceleration_weighting=of_accelerations,
        passes=passes,
        initial_fit_percent=_fit_percent(robot, logs, before),
        fit_percent=_fit_percent(robot, logs, residuals),
        findings=tuple(f"step 3: {text}" for text in found.warnings),
    )


def _parameters(
    robot: Robot,
    names: Sequence[str],
    effects: Sequence[Effect],
    more: Sequence[Parameter],
    found: Fitted | None,
) -> list[Parameter]:
    """Return the parameters to fit, at the values of the robot, the effects and the last fit."""
    given = {one.effect for one in more}
    out = [robot_parameter(robot, name) for name in names]
    for place, effect in enumerate(effects):
        if effect.name == "coulomb_friction" and place not in given:
            size = effect_parameter(effects, place, "coulomb_nm")
            # A change of the whole friction is thousands of deviations of noise, without chaos.
            out.append(replace(size, scale=_SMALL_CHANGE * size.scale))
    known = {} if found is None else dict(zip(found.names, found.values, strict=True))
    for one in more:
        name = one.name if one.effect is None else f"{effects[one.effect].label}.{one.name}"
        value = float(np.clip(known.get(name, one.initial), one.lower, one.upper))
        out.append(replace(one, initial=value))
    return out


def _with_values(
    robot: Robot, effects: Sequence[Effect], found: Fitted
) -> tuple[Robot, list[Effect]]:
    """Return robot and effects with the fitted values."""
    values = {n: float(v) for n, v in zip(found.names, found.values, strict=True)}
    own = robot.parameters()
    updated = []
    for effect in effects:
        label = f"{effect.label}."
        new = {n.removeprefix(label): v for n, v in values.items() if n.startswith(label)}
        updated.append(effect.with_values(new))
    return robot.with_parameters({n: v for n, v in values.items() if n in own}), updated


def _fit_percent(robot: Robot, logs: Sequence[Log], residuals: Sequence[Real]) -> Real:
    """Return the fit (3.54) of the motor outputs, (n_logs, n_axes) [%]."""
    out = []
    for log, residual in zip(logs, residuals, strict=True):
        measured = log.torque_nm if robot.told_speeds else log.position_rad
        error = np.linalg.norm(residual[:, : log.n_axes], axis=0)
        spread = np.linalg.norm(measured - measured.mean(axis=0), axis=0)
        out.append(100 * (1 - np.divide(error, spread, out=np.ones_like(error), where=spread > 0)))
    return np.array(out)


def check_logs(robot: Robot, logs: Sequence[Log]) -> None:
    """Raise InputError for logs that cannot be fitted together."""
    if len({log.name for log in logs}) < len(logs):
        raise InputError("logs: expected different names, got one twice")
    for log in logs:
        if log.n_axes != robot.n_axes:
            raise InputError(f"{log.name}: expected {robot.n_axes} axes, got {log.n_axes}")
        if not np.isclose(log.sample_time_s, robot.sample_time_s, rtol=1e-6):
            raise InputError(
                f"{log.name}: expected the sample time of the robot, {robot.sample_time_s} s, got "
                f"{log.sample_time_s} s"
            )
        if not np.isfinite(log.torque_nm).all():
            raise InputError(f"{log.name}: expected torques of all axes, got NaN")

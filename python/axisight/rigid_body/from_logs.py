"""Rigid-body identification from motor logs to a robot file, in one call."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.display import html
from axisight.display.summary import summarized
from axisight.effects.stated import friction_corner
from axisight.errors import IdentificationWarning, InputError
from axisight.logs import Log
from axisight.rigid_body.base import base_parameters
from axisight.rigid_body.bending import bending
from axisight.rigid_body.consistent import (
    ConsistentParameters,
    identify_consistent,
    prior_spread,
)
from axisight.rigid_body.coupling import MotorCoupling
from axisight.rigid_body.estimate import Method, identify_rigid_body
from axisight.rigid_body.friction import USUAL_TERMS, DriveTerms
from axisight.rigid_body.log_checks import few_samples, misfit, refuse_repeated
from axisight.rigid_body.motion import MotionEstimate, estimate_motion
from axisight.rigid_body.regressor import TorqueModel
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.rigid_body.reversal_window import reversal_weight
from axisight.rigid_body.robot_values import identified_bodies
from axisight.rigid_body.standstill import at_rest
from axisight.robot import Robot
from axisight.robot.fixed_base import refuse_floating
from axisight.robot_file import Identified, Provenance, identified
from axisight.robot_file.sidecar import known as known_number
from axisight.robot_file.values import noted

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array, Array]


@summarized
@dataclass(frozen=True, eq=False)
class LogIdentification:
    """Result of :func:`identify_logs`.

    estimate
        Base parameters with standard errors.
    consistent
        Parameters of bodies that can exist; None if not requested.
    motions
        Filtered motions of the fitted logs: band, decimation, dropped samples.
    errors
        ``rms_nm`` [Nm] and ``relative_error`` (relative to the rms torque) over (parameters:
        ``estimate`` and, if requested, ``consistent``; log; axis, from 1). The coordinate
        ``held_out`` (log) tells which logs took no part in the fit.
    samples_kept
        Number of fitted samples of each axis (n_axes,), after filtering; the others lie around
        reversals. Residuals of ``estimate`` are over fitted samples, ``errors`` over all samples.
    """

    estimate: RigidBodyEstimate
    consistent: ConsistentParameters | None
    motions: tuple[MotionEstimate, ...]
    errors: xr.Dataset
    samples_kept: NDArray[np.intp]

    def _repr_html_(self) -> str:
        """Return base parameters and torque errors on every log, for notebooks."""
        rows = []
        for which in self.errors["parameters"].values:
            one = self.errors.sel(parameters=which)
            for i, log in enumerate(one["log"].values):
                held = " (held out)" if one["held_out"].values[i] else ""
                shares = one["relative_error"].values[i]
                rows.append((f"{log}{held}", str(which), *(f"{100 * x:.3g} %" for x in shares)))
        axes = [f"axis {axis}" for axis in self.errors["axis"].values]
        return self.estimate._repr_html_() + html.table(
            ("log", "parameters", *axes), rows, "torque error over torque"
        )

    def identified(self, provenance: Provenance) -> Identified:
        """Return the values for a robot file, those of ``consistent`` if available.

        - Parameters that the motions do not show keep their value in the file and are left out.
        - Combinations are split by the values in the file, without standard errors; a note says so.
        - Drive parameters that are identifiable alone have standard errors, but not with
          ``consistent``, which mixes in a prior.
        - Known values have standard error zero and a note.
        - Link parameters have no standard errors, because only combinations have them. The settings of
          ``provenance`` hold the table of base parameters and the torque errors; the notes hold the
          findings.
        - Effects that the values include are removed (:func:`identified_bodies`).

        Raises RobotError for masses that no body has, which ``estimate`` alone can give.
        """
        model = self.estimate.model
        theta = self.estimate.standard() if self.consistent is None else self.consistent.theta
        notes = [str(finding) for finding in self.estimate.findings]
        if self.consistent is not None:
            notes.insert(0, f"bodies that can exist: {self.consistent.status}")
            notes += [self.consistent.advice] if self.consistent.advice else []
        if not any(name.endswith(".motor_inertia") for name in model.names):
            notes.append(
                "no term for motor inertias: links hold them, and those of the file count on top; "
                "hold them with `known` instead"
            )
        notes += self._undetermined()
        if self.estimate.known:
            listed = ", ".join(
                f"{name} = {value:.6g}" for name, value in self.estimate.known.items()
            )
            notes.append(f"held at given values: {listed}")
        settings = {**provenance.settings, "base_parameters": self._base_table()}
        settings["torque_error"] = self._error_table()
        source = noted(replace(provenance, settings=settings), notes)
        held = self.estimate.known
        # Values computed from known ones alone have no variance.
        free = np.diag([float(name not in held) for name in model.names])
        corner = _corners(model, self.motions)
        found = identified_bodies(model, theta, source, covariance=free, corner_rad_s=corner)
        before = identified_bodies(model, model.nominal, source).values
        size = np.abs(before).max(initial=1e-300)
        same = np.isclose(found.values, before, rtol=1e-9, atol=1e-12 * size)
        errors = np.where(found.standard_errors == 0.0, 0.0, self._lone_errors())
        kept = [
            (name, float(value), float(error))
            for name, value, error, unchanged in zip(
                found.names, found.values, errors, same, strict=True
            )
            if "@" in name or error > 0 or not unchanged
        ]
        return identified(
            {name: value for name, value, _ in kept},
            found.provenance,
            standard_errors={name: error for name, _, error in kept if np.isfinite(error)},
            effects=found.effects,
            removed=found.removed,
        )

    def _lone_errors(self) -> Array:
        """Return standard errors (n_parameters,) of drive parameters identifiable alone, NaN for others."""
        estimate, model = self.estimate, self.estimate.model
        out = np.full(model.n_parameters, np.nan)
        if self.consistent is not None:
            return out
        for name, column, row, error in zip(
            estimate.names,
            estimate.base.columns,
            estimate.base.matrix,
            estimate.standard_error,
            strict=True,
        ):
            drive = model.columns[column].extra is not None
            if drive and np.count_nonzero(row) == 1 and name not in estimate.eliminated:
                out[column] = error
        return out

    def _undetermined(self) -> list[str]:
        """Return a note on parameters that show only in combinations, naming those of drives."""
        base = self.estimate.base
        mixed = [
            (text, any(base.model.columns[i].extra is not None for i in np.flatnonzero(row)))
            for text, row in zip(base.combinations, base.matrix, strict=True)
            if np.count_nonzero(row) > 1
        ]
        if not mixed:
            return []
        named = [text for text, drive in mixed if drive]
        links = len(mixed) - len(named)
        parts = [f"the combination {text}" for text in named]
        if links:
            parts.append(
                f"{links} combinations of link parameters (base_parameters in the settings)"
            )
        return [
            f"only {'; '.join(parts)} determined, not what they are made of: the parts written have "
            "no standard error and follow the values in the robot file"
        ]

    def _base_table(self) -> list[dict[str, Any]]:
        found = self.estimate
        return [
            {"combination": text, "value": value, "standard_error": error, "unit": unit}
            for text, value, error, unit in zip(
                found.base.combinations,
                found.values.tolist(),
                found.standard_error.tolist(),
                found.base.units,
                strict=True,
            )
        ]

    def _error_table(self) -> list[dict[str, Any]]:
        last = self.errors.isel(parameters=-1)
        return [
            {
                "log": str(one["log"].item()),
                "held_out": bool(one["held_out"].item()),
                "rms_nm": one["rms_nm"].values.tolist(),
                "relative_error": [known_number(x) for x in one["relative_error"].values],
            }
            for one in (last.isel(log=i) for i in range(last.sizes["log"]))
        ]


def identify_logs(
    robot: Robot,
    logs: Sequence[Log] | Log,
    *,
    held_out: Sequence[Log] = (),
    cutoff_hz: float = 10.0,
    reversal_s: float | None = None,
    torque_held: bool = True,
    terms: DriveTerms = USUAL_TERMS,
    coupling: MotorCoupling | None = None,
    method: Method = "wls",
    known: Mapping[str, float] | None = None,
    eliminate: float | None = None,
    deficient: Literal["raise", "group"] = "raise",
    consistent: bool = False,
    prior_share: float = 1.0,
) -> LogIdentification:
    """Return masses, inertias and friction identified from motor logs, with rigid gears.

    :func:`estimate_motion` filters every log, and the gears convert motor angles to joint angles.
    Then :func:`identify_rigid_body` regresses all logs together, on the motor side.

    Parameters
    ----------
    robot : chain and gears. Its masses and inertias complete what the motions do not show. Elastic
        joints stay at angle zero.
    logs, held_out : logs to fit, and logs that only measure torque errors.
    cutoff_hz : cutoff of the filter [Hz], well above the motion and well below the first resonance.
    reversal_s : time before and after a reversal of a motor in which the fit leaves out its torque [s].
        There the filter smears the step of Coulomb friction, which is sharp in the regressor. By
        default two periods of the cutoff, or less, with a warning, on axes with less than a fifth of
        the samples left; 0 for none.
    torque_held : whether torques are commands u_k that hold from sample k to the next, as in the
        conventions. The torque at sample k is then the mean of u_(k-1) and u_k. Without this mean
        friction would be wrong by half a sample, viscous friction by -J w^2 T / 2. False for torques
        measured at the samples.
    terms : terms of the drives, see :class:`DriveTerms`.
    coupling : gears between motors and joints; default the gear ratios of the robot.
    method, known, eliminate, deficient : as for :func:`identify_rigid_body`.
    consistent : whether to find also bodies that can exist (:func:`identify_consistent`), with the
        values of the robot as a prior and ``known`` values held. It excludes ``eliminate``.
    prior_share : standard deviation of that prior as a share of each link's size, see
        :func:`prior_spread`.

    Issues IdentificationWarning for doubts about the estimate. Raises InputError naming the log or
    option, and IdentifiabilityError for motions that do not determine the parameters.

    """
    given = [logs] if isinstance(logs, Log) else list(logs)
    if not given:
        raise InputError("logs: expected at least one, got none")
    if consistent and eliminate is not None:
        raise InputError(
            "eliminate: expected none together with consistent, where the prior decides what the "
            f"motions hardly show, got {eliminate!r}"
        )
    if not isinstance(torque_held, bool | np.bool_):
        raise InputError(f"torque_held: expected True or False, got {torque_held!r}")
    refuse_floating(robot, "identify_logs")
    model = TorqueModel(robot, terms=terms, side="motor", coupling=coupling)
    held = bool(torque_held)
    motions = [_estimate(log, robot, cutoff_hz, held) for log in given]
    others = [_estimate(log, robot, cutoff_hz, held) for log in held_out]
    refuse_repeated(given, held_out)
    quiet, standing = at_rest([*motions, *others], cutoff_hz)
    motions, others = quiet[: len(given)], quiet[len(given) :]
    moving = ~np.concatenate(standing[: len(given)])
    weight, left_out = reversal_weight(motions, reversal_s, cutoff_hz, moving)
    joint = [joint_motion(model, motion) for motion in motions]
    stacked = [np.concatenate(parts) for parts in zip(*joint, strict=True)]
    base = base_parameters(model, known=known or (), locked=True)
    left_out += few_samples(base, (stacked[0], stacked[1], stacked[2]), weight)
    estimate = identify_rigid_body(
        model,
        *stacked,
        sample_weight=weight,
        base=base,
        method=method,
        known=known,
        eliminate=eliminate,
        deficient=deficient,
    )
    possible = None
    if consistent:
        possible = identify_consistent(
            model,
            *stacked,
            known=known,
            sample_weight=weight,
            torque_std_nm=estimate.residual_std_nm,
            prior_std=prior_spread(model, prior_share),
        )
    joint += [joint_motion(model, motion) for motion in others]
    thetas = {"estimate": estimate.standard()}
    if possible is not None:
        thetas["consistent"] = possible.theta
    names = [log.name for log in (*given, *held_out)]
    errors = _errors(model, thetas, joint, [~still for still in standing], names, len(given))
    seen = [*left_out, *bending(estimate, given, stacked[0], cutoff_hz), *misfit(errors)]
    for finding in seen:
        if finding.serious:
            warnings.warn(str(finding), IdentificationWarning, stacklevel=2)
    return LogIdentification(
        estimate.with_findings([*estimate.findings, *seen]),
        possible,
        tuple(motions),
        errors,
        np.count_nonzero(weight, axis=0),
    )


def _corners(model: TorqueModel, motions: Sequence[MotionEstimate]) -> Array:
    """Return the motor speeds (n_axes,) [rad/s] over which to smooth dry friction, from the motions."""
    chosen = float(model.terms.smoothing_rad_s)
    top = np.max([np.abs(m.velocity_rad_s).max(axis=0) for m in motions], axis=0)
    return np.full(len(top), chosen) if chosen > 0 else friction_corner(top)


def _estimate(log: Log, robot: Robot, cutoff_hz: float, torque_held: bool) -> MotionEstimate:
    if not isinstance(log, Log):
        raise InputError(f"logs: expected Logs, got {type(log).__name__}")
    if log.n_axes != robot.n_axes:
        raise InputError(f"{log.name}: expected {robot.n_axes} axes, got {log.n_axes}")
    return log_motion(log, cutoff_hz, torque_held=torque_held)


def log_motion(log: Log, cutoff_hz: float, *, torque_held: bool) -> MotionEstimate:
    """Return the filtered motion of a log, with ``torque_held`` as in :func:`identify_logs`.

    Raises InputError naming the log.
    """
    torque = log.torque_nm
    if torque_held:
        # The command before the first is unknown, but the filter drops that sample anyway.
        torque = np.concatenate([torque[:1], 0.5 * (torque[1:] + torque[:-1])])
    try:
        return estimate_motion(
            log.position_rad, torque, sample_time_s=log.sample_time_s, cutoff_hz=cutoff_hz
        )
    except InputError as error:
        raise InputError(f"{log.name}: {error}") from None


def joint_motion(model: TorqueModel, motion: MotionEstimate) -> Motion:
    """Return position, velocity and acceleration of all joints, with elastic joints at zero, and motor torques."""
    parts = []
    for motor in (motion.position_rad, motion.velocity_rad_s, motion.acceleration_rad_s2):
        full = np.zeros((motion.n_samples, model.robot.n_joints))
        full[:, model.robot.axis_joints] = model.coupling.joint_motion(motor)
        parts.append(full)
    torque = np.zeros((0, 0)) if motion.torque_nm is None else motion.torque_nm
    return parts[0], parts[1], parts[2], torque


def _errors(
    model: TorqueModel,
    thetas: Mapping[str, Array],
    motions: Sequence[Motion],
    moving: Sequence[NDArray[np.bool_]],
    names: Sequence[str],
    fitted: int,
) -> xr.Dataset:
    """Return torque errors by log and axis, over samples where the axis moves; NaN if it never does."""
    shape = (len(thetas), len(motions), model.n_rows)
    rms, relative = np.empty(shape), np.full(shape, np.nan)
    for i, (q, v, a, torque) in enumerate(motions):
        matrix = model.matrix(q, v, a)
        count = np.where(moving[i].any(axis=0), moving[i].sum(axis=0), np.nan)
        size = np.sqrt((torque**2 * moving[i]).sum(axis=0) / count)
        for k, theta in enumerate(thetas.values()):
            squares = (matrix @ theta - torque) ** 2 * moving[i]
            rms[k, i] = np.sqrt(squares.sum(axis=0) / count)
            np.divide(rms[k, i], size, out=relative[k, i], where=size > 0)
    dims = ("parameters", "log", "axis")
    return xr.Dataset(
        {"rms_nm": (dims, rms, {"units": "Nm"}), "relative_error": (dims, relative)},
        coords={
            "parameters": list(thetas),
            "log": list(names),
            "axis": model.row_labels,
            "held_out": ("log", np.arange(len(motions)) >= fitted),
        },
    )

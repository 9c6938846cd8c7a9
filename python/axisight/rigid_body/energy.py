"""The energy (integral) model (4.3): the work of the motors is stored or dissipated.

No accelerations are needed. Over a window from t_a to t_b,

    E(t_b) - E(t_a) + losses = integral of torque times speed

is one equation, linear in the same parameters as the torques.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.integrate
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.display.summary import summarized
from axisight.errors import IdentifiabilityError, IdentificationWarning, InputError
from axisight.rigid_body import checks
from axisight.rigid_body.base import BaseParameters
from axisight.rigid_body.estimate import DATA_TOLERANCE, default_blocks, known_base, numbers
from axisight.rigid_body.findings import IdentificationFinding
from axisight.rigid_body.grouping import group
from axisight.rigid_body.least_squares import (
    Factors,
    block_covariance,
    solve_weighted,
    triangle,
)
from axisight.rigid_body.regressor import TorqueModel, rows
from axisight.statistics.intervals import student_interval
from axisight.statistics.least_squares import condition

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class EnergyRegression:
    """Equations of the energy model, one per window.

    matrix
        Shape (n_windows, n_parameters), energy per unit of each parameter of the torque model [J].
    work_j
        Work of the torques over each window, shape (n_windows,) [J].
    start, stop
        First and last sample of each window.
    """

    matrix: Array
    work_j: Array
    start: NDArray[np.intp]
    stop: NDArray[np.intp]


@summarized
@dataclass(frozen=True, eq=False)
class EnergyEstimate:
    """Base parameters from the energy model.

    base
        Definition of the base parameters.
    values, covariance
        Base parameters (n_base,) and their covariance (n_base, n_base) from the scatter of
        blocks of windows; NaN for parameters with fewer than three degrees of freedom.
    degrees_of_freedom
        Degrees of freedom of that scatter, per parameter; zero with as many windows as parameters.
    residual_rms_j, relative_error
        Rms residual [J], and the same relative to the rms work.
    condition_number_scaled
        Condition number of the regressor with columns of unit length.
    findings
        Reasons to doubt the estimate.
    """

    base: BaseParameters
    values: Array
    covariance: Array
    degrees_of_freedom: Array
    residual_rms_j: float
    relative_error: float
    condition_number_scaled: float
    findings: tuple[IdentificationFinding, ...] = ()

    @property
    def standard_error(self) -> Array:
        """Standard errors, shape (n_base,), NaN for too few windows."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, level: float = 0.95) -> tuple[Array, Array]:
        """Return lower and upper bounds of confidence intervals with probability ``level``, by Student."""
        return student_interval(self.values, self.standard_error, self.degrees_of_freedom, level)


def identify_by_energy(
    regression: EnergyRegression,
    model: TorqueModel,
    *,
    base: BaseParameters | None = None,
    known: Mapping[str, float] | None = None,
    blocks: int | None = None,
) -> EnergyEstimate:
    """Return the least-squares estimate of the base parameters from the energy model.

    Parameters
    ----------
    regression : result of :func:`energy_regression` with the same model.
    model : the torque model.
    base : base parameters with the same known ones; default: computed here.
    known : values to hold parameters at, by name.
    blocks : number of blocks of consecutive windows for the standard errors; default 30 with
        at least two windows each.

    Issues an IdentificationWarning, also among the findings, for too few windows for standard errors.
    Raises InputError for unknown names, and IdentifiabilityError if the windows do not determine the
    parameters.

    """
    known = numbers("known", known)
    base = known_base(model, base, known)
    held = np.array([known.get(name, 0.0) for name in model.names])
    rest = regression.work_j - regression.matrix @ held
    matrix = regression.matrix[:, base.columns]
    n, k = matrix.shape
    found = group(matrix, DATA_TOLERANCE)
    if len(found.independent) < k:
        raise IdentifiabilityError(
            f"regression: expected windows of rank {k}, got {len(found.independent)} from {n} "
            "windows; take shorter or overlapping windows or a richer motion"
        )
    count = default_blocks(blocks, n, least=2)
    ends = np.arange(count + 1) * n // count
    rows_of = np.column_stack([matrix, rest])
    factor = np.stack([triangle(rows_of[i:j])[None] for i, j in pairwise(ends)])
    factors = Factors(factor, np.array([float(n)]))
    solution = solve_weighted(factors, np.ones(1))
    covariance, freedom = block_covariance(factors, solution)
    few = freedom < checks.LEAST_FREEDOM
    covariance[few], covariance[:, few] = np.nan, np.nan
    advice = f"{n} windows for {k} parameters tell too little of their scatter, take more windows"
    findings = checks.few_degrees(base.names, freedom, advice, serious=True)
    for finding in findings:
        warnings.warn(str(finding), IdentificationWarning, stacklevel=2)
    residual = float(np.sqrt(solution.loss[0] / n))
    size = float(np.sqrt((regression.work_j**2).mean()))
    r = solution.normal
    return EnergyEstimate(
        base=base,
        values=solution.values,
        covariance=covariance,
        degrees_of_freedom=freedom,
        residual_rms_j=residual,
        relative_error=residual / size if size > 0 else float("nan"),
        condition_number_scaled=condition(r),
        findings=tuple(findings),
    )


def energy_regressor(model: TorqueModel, q: ArrayLike, v: ArrayLike) -> Array:
    """Return stored energy per unit of each parameter, shape (n, n_parameters) [J].

    ``q`` and ``v`` are joint angles [rad] and velocities [rad/s], (n, n_joints).

    The energy is the kinetic and potential energy of links, the kinetic energy of rotors and the
    elastic energy of springs. Columns of friction and offsets, which store nothing, are zero. With the
    parameters of the robot it gives the energy of :meth:`axisight.Robot` up to a constant. Raises
    InputError for wrong shapes.
    """
    q = rows("q", q, model.robot.n_joints)
    v = rows("v", v, model.robot.n_joints)
    if len(v) != len(q):
        raise InputError(f"v: expected {len(q)} rows as q, got {len(v)}")
    out = np.zeros((len(q), model.n_parameters))
    links = _core.energy_regressor(model.robot.core, q, v)
    out[:, : links.shape[1]] = links
    for i, column in enumerate(model.columns):
        if column.extra is None:
            continue
        signal, motion = column.extra[0], np.array(column.extra[1])
        if signal == "acceleration":
            out[:, i] = 0.5 * (v @ motion) ** 2
        elif signal == "position":
            out[:, i] = 0.5 * (q @ motion) ** 2
    return out


def energy_regression(
    model: TorqueModel,
    q: ArrayLike,
    v: ArrayLike,
    torque_nm: ArrayLike,
    *,
    sample_time_s: float,
    window_s: float,
    overlap: float = 0.0,
) -> EnergyRegression:
    """Return the equations of the energy model over windows of a motion.

    Parameters
    ----------
    model : a :class:`TorqueModel`; its side is that of the torques.
    q, v : (n, n_joints) uniformly sampled joint angles and velocities [rad, rad/s].
    torque_nm : (n, n_joints) or (n, n_axes) torques [Nm].
    sample_time_s : sample time [s].
    window_s : length of a window [s]. Long windows average noise, short windows give more equations.
    overlap : share of a window that the next one repeats, 0 to below 1.

    Simpson's rule integrates work and friction losses. Raises InputError naming the field, also for
    torque couplings that are not the transpose of the position coupling, because the losses of such
    a gearbox depend on the direction of power.

    """
    _check_coupling(model)
    stored = energy_regressor(model, q, v)
    v = rows("v", v, model.robot.n_joints)
    torque = rows("torque_nm", torque_nm, model.n_rows)
    if len(torque) != len(v):
        raise InputError(f"torque_nm: expected {len(v)} rows as q, got {len(torque)}")
    start, stop = _windows(len(v), sample_time_s, window_s, overlap)
    lost = _integral(_loss_rates(model, v), sample_time_s)
    work = _integral((torque * (v @ _speeds(model).T)).sum(axis=1, keepdims=True), sample_time_s)
    total = stored + lost
    return EnergyRegression(
        matrix=total[stop] - total[start],
        work_j=(work[stop] - work[start])[:, 0],
        start=start,
        stop=stop,
    )


def _speeds(model: TorqueModel) -> Array:
    """Return the speeds on which the rows' torques do work, as combinations of joints."""
    n = model.robot.n_joints
    if model.side == "joint":
        return np.eye(n)
    return model.coupling.position @ np.eye(n)[model.robot.axis_joints]


def _loss_rates(model: TorqueModel, v: Array) -> Array:
    """Return the power lost per unit of each parameter."""
    out = np.zeros((len(v), model.n_parameters))
    for i, column in enumerate(model.columns):
        if column.extra is None:
            continue
        signal, motion, _, dead_band, smoothing = column.extra
        speed = v @ np.array(motion)
        if signal == "velocity":
            out[:, i] = speed**2
        elif signal == "constant":
            out[:, i] = speed
        elif signal == "direction":
            sign = np.tanh(speed / smoothing) if smoothing > 0 else np.sign(speed)
            out[:, i] = np.where(np.abs(speed) > dead_band, sign * speed, 0.0)
    return out


def _integral(rates: Array, sample_time_s: float) -> Array:
    """Return the integral from the start to every sample."""
    if len(rates) < 3:
        out = scipy.integrate.cumulative_trapezoid(rates, dx=sample_time_s, axis=0, initial=0)
    else:
        zero = np.zeros((1, rates.shape[1]))
        out = scipy.integrate.cumulative_simpson(rates, dx=sample_time_s, axis=0, initial=zero)
    return np.asarray(out, dtype=np.float64)


def _windows(
    n: int, sample_time_s: float, window_s: float, overlap: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    for field, value in (("sample_time_s", sample_time_s), ("window_s", window_s)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{field}: expected a positive number, got {value!r}")
    if not 0 <= overlap < 1:
        raise InputError(f"overlap: expected a number from 0 to below 1, got {overlap!r}")
    length = round(window_s / sample_time_s)
    if not 1 <= length < n:
        raise InputError(
            f"window_s: expected {sample_time_s} to {(n - 1) * sample_time_s:g} s for {n} samples, "
            f"got {window_s!r}"
        )
    step = max(1, round(length * (1 - overlap)))
    start = np.arange(0, n - length, step, dtype=np.intp)
    return start, start + length


def _check_coupling(model: TorqueModel) -> None:
    c = model.coupling
    if not np.allclose(c.torque, c.position.T, rtol=1e-9, atol=0.0):
        raise InputError(
            "coupling: expected a torque coupling that is the transpose of the position coupling, "
            "got another one: its gearbox neither stores nor loses as the model says"
        )

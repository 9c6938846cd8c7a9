"""Estimation of base parameters from measured motions and torques (thesis (4.4), (4.5))."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import one_of
from axisight.errors import IdentifiabilityError, IdentificationWarning, InputError
from axisight.rigid_body import checks
from axisight.rigid_body.base import BaseParameters, base_parameters
from axisight.rigid_body.coupling import MotorCoupling
from axisight.rigid_body.data_rank import rank_message, reversal_findings, reversals
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.friction import DriveTerms, ModelSide
from axisight.rigid_body.grouping import group
from axisight.rigid_body.least_squares import (
    Factors,
    Solution,
    block_covariance,
    solve_reweighted,
    solve_total,
    solve_weighted,
    white_covariance,
)
from axisight.rigid_body.regressor import TorqueModel, as_model, rows
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.robot import Robot

Array = NDArray[np.float64]
Method = Literal["ls", "wls", "tls"]

# Smaller singular values are rounding of the data, for columns of unit length.
DATA_TOLERANCE = 1e-9
# Default number of blocks: enough for their scatter, and few enough that blocks are longer than the
# correlation of residuals.
BLOCKS = 30
NOT_NEGATIVE = frozenset(
    {
        *("mass", "motor_inertia", "joint_rotor_inertia", "stiffness", "damping"),
        *("viscous_friction", "joint_viscous_friction"),
        *("coulomb_friction", "joint_coulomb_friction"),
    }
)
"""Quantities that cannot be negative."""


def identify_rigid_body(
    robot: Robot | TorqueModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    torque_nm: ArrayLike,
    *,
    terms: DriveTerms | None = None,
    side: ModelSide | None = None,
    coupling: MotorCoupling | None = None,
    method: Method = "wls",
    base: BaseParameters | None = None,
    known: Mapping[str, float] | None = None,
    sample_weight: ArrayLike | None = None,
    column_noise: Mapping[str, float] | None = None,
    eliminate: float | None = None,
    deficient: Literal["raise", "group"] = "raise",
    blocks: int | None = None,
    threads: int = 0,
) -> RigidBodyEstimate:
    """Return estimated base parameters of a robot, from a motion and its torques.

    Parameters
    ----------
    robot : the robot, or a :class:`TorqueModel`.
    q, v, a : (n, n_joints) joint angles, velocities, accelerations [rad, rad/s, rad/s^2], for example
        from zero-phase filtering and differentiation. Several logs may follow one another.
    torque_nm : (n, n_joints) joint torques or (n, n_axes) motor torques [Nm], by ``side``.
    terms, side, coupling : see :func:`torque_regressor`.
    method : ``"ls"``: least squares with equal rows. ``"wls"``: weighted least squares, each row by
        one over the standard deviation of its residual, iterated. ``"tls"``: total least squares with
        the row weights of ``"wls"``, for regressors with errors.
    base : base parameters with the same known ones; default: computed here.
    known : values to hold parameters at, by name. Negative masses, rotors, frictions and springs are
        refused.
    sample_weight : (n,) or (n, n_rows) weights of the residuals, not negative; zero leaves a
        sample out.
    column_noise : for ``"tls"``: standard deviation of the error of each base parameter's column,
        relative to that of the torque, by name [1 per unit of the parameter]. Columns not named
        are exact. Default: errors in proportion to the rms of each column, with exact columns of
        offsets and Coulomb friction.
    eliminate : largest relative standard error to keep, e.g. 0.3. Parameters above it are set to zero
        one by one, those of unknown error first, then the worst. Default: no elimination.
    deficient : action for data that do not separate all base parameters: ``"raise"`` an
        IdentifiabilityError, or ``"group"`` them further, with a warning.
    blocks : number of blocks of consecutive samples for the standard errors. Blocks should be longer
        than the correlation of residuals. Default 30, at least 20 samples each.
    threads : number of threads, 0 for all cores; the result does not depend on it.

    Returns
    -------
    :class:`RigidBodyEstimate`. The function needs no memory in proportion to the number of samples,
    apart from its arguments. Issues IdentificationWarning for doubts about the estimate.
    Raises InputError for wrong shapes, non-finite values or unknown names, and
    IdentifiabilityError for data that do not determine the parameters.

    """
    one_of("method", method, ("ls", "wls", "tls"))
    one_of("deficient", deficient, ("raise", "group"))
    if eliminate is not None and not (np.isfinite(eliminate) and eliminate > 0):
        raise InputError(f"eliminate: expected a positive number, got {eliminate!r}")
    model = as_model(robot, terms, side, coupling)
    known = known_values(known)
    base = known_base(model, base, known)
    motion = model.motion(q, v, a)
    torque = rows("torque_nm", torque_nm, model.n_rows)
    weight = row_weights(sample_weight, (len(motion[0]), model.n_rows))
    if len(torque) != len(motion[0]):
        raise InputError(f"torque_nm: expected {len(motion[0])} rows as q, got {len(torque)}")
    if not torque.any():
        raise InputError("torque_nm: expected measured torques, got zeros only")
    factors = regression_factors(
        base, motion, torque, known, weight, default_blocks(blocks, len(torque)), threads
    )

    base, factors, findings = _separated(base, factors, motion, deficient)
    floor = 1e-12 * np.sqrt((torque**2).mean()) * np.ones(model.n_rows)
    noise = _column_noise(base, column_noise, factors, torque) if method == "tls" else None
    keep, now, solution, (covariance, freedom) = _eliminated(
        factors, method, floor, noise, eliminate
    )
    if not solution.converged:
        text = "row weights did not settle in 50 iterations: a row may fit exactly; try method=ls"
        findings.append(IdentificationFinding(FindingKind.WEIGHTS, text))
    if len(keep) < len(base):
        dropped = tuple(name for i, name in enumerate(base.names) if i not in keep)
        text = f"set to zero, relative standard error above {eliminate:g}: {', '.join(dropped)}"
        findings.append(IdentificationFinding(FindingKind.ELIMINATED, text, False, dropped))
    result = RigidBodyEstimate.of(
        base=base,
        keep=keep,
        method=method,
        solution=solution,
        covariance=covariance,
        covariance_white=white_covariance(now, solution),
        freedom=freedom,
        known=known,
        torque=torque,
        weight=weight,
        n_blocks=len(factors.blocks),
        findings=tuple(findings),
    )
    findings += [*checks.freedom(result), *checks.condition(result)]
    findings += checks.friction_sign(result)
    findings += checks.gear_sign(result, factors, motion)
    for finding in findings:
        if finding.serious:
            warnings.warn(str(finding), IdentificationWarning, stacklevel=2)
    return result.with_findings(findings)


def _separated(
    base: BaseParameters,
    factors: Factors,
    motion: tuple[Array, Array, Array],
    deficient: Literal["raise", "group"],
) -> tuple[BaseParameters, Factors, list[IdentificationFinding]]:
    """Return the base parameters that the data separate; with ``"group"`` they may be fewer."""
    shares = reversals(base.model, base.columns, motion[1])
    findings = reversal_findings(shares)
    found = group(factors.rows.reshape(-1, factors.k + 1)[:, :-1], DATA_TOLERANCE)
    if len(found.independent) == len(base):
        return base, factors, findings
    message = rank_message(base, found, shares, motion)
    if deficient == "raise":
        raise IdentifiabilityError(message)
    findings.append(IdentificationFinding(FindingKind.RANK, message))
    fewer = regrouped(base, found.independent, found.matrix)
    return fewer, factors.columns(found.independent), findings


def regrouped(base: BaseParameters, independent: NDArray[np.intp], matrix: Array) -> BaseParameters:
    """Return fewer base parameters: combinations that the data separate."""
    return BaseParameters(
        model=base.model,
        columns=base.columns[independent],
        matrix=matrix @ base.matrix,
        no_effect=base.no_effect,
        known=base.known,
        singular_values=base.singular_values,
        rank=base.rank,
        rank_qr=base.rank_qr,
        gap=base.gap,
    )


def _eliminated(
    factors: Factors, method: Method, floor: Array, noise: Array | None, limit: float | None
) -> tuple[NDArray[np.intp], Factors, Solution, tuple[Array, Array]]:
    """Return the solution after eliminating the least certain parameters, one by one.

    The result is: indices of the kept parameters, their factors, their solution, and a pair of
    covariance and degrees of freedom.
    """
    keep = np.arange(factors.k)
    while True:
        now = factors.columns(keep)
        solution = _solve(now, method, floor, None if noise is None else noise[keep])
        spread = block_covariance(now, solution)
        worst = _least_certain(solution, spread[0], limit)
        if worst is None:
            return keep, now, solution, spread
        keep = np.delete(keep, worst)


def _solve(factors: Factors, method: Method, floor: Array, noise: Array | None) -> Solution:
    if method == "ls":
        return solve_weighted(factors, np.ones(len(factors.counts)))
    solution = solve_reweighted(factors, floor)
    if noise is None:
        return solution
    total = solve_total(factors, solution, noise)
    if total is None:
        raise IdentifiabilityError(
            "torque_nm: expected data with a total least squares solution, got a torque that the "
            'noisiest direction of the regressor does not touch; use method="wls"'
        )
    return total


def _least_certain(solution: Solution, covariance: Array, limit: float | None) -> int | None:
    """Return the index of the parameter to eliminate next, None without one."""
    if limit is None or len(solution.values) < 2:
        return None
    error = np.sqrt(np.diag(covariance))
    # The floor avoids a division by zero: a value of zero is the most uncertain.
    excess = error / np.maximum(np.abs(solution.values), 1e-300)
    # A parameter without known scatter is the most uncertain.
    excess[np.isnan(excess)] = np.inf
    worst = int(np.argmax(excess))
    return worst if excess[worst] > limit else None


def known_base(
    model: TorqueModel, base: BaseParameters | None, known: Mapping[str, float]
) -> BaseParameters:
    """Return ``base`` after a check that it fits the model and ``known``, or compute it."""
    if base is None:
        return base_parameters(model, known=known)
    if base.model.names != model.names or base.model.side != model.side:
        raise InputError("base: expected base parameters of the same model, got other parameters")
    if set(base.known) != set(known):
        raise InputError(
            f"base: expected base parameters with known {sorted(known)}, got {sorted(base.known)}"
        )
    return base


def regression_factors(
    base: BaseParameters,
    motion: tuple[Array, Array, Array],
    torque: Array,
    known: Mapping[str, float],
    weight: Array | None,
    blocks: int,
    threads: int,
) -> Factors:
    """Return the triangular factors of a motion and its torques, in blocks of consecutive samples."""
    model = base.model
    order = np.argsort(base.columns)
    held = [float(known.get(name, 0.0)) for name in model.names]
    found, _ = _core.regression_factors(
        model.robot.core,
        *motion,
        torque,
        rows=model.row_map,
        extras=model.extras,
        columns=base.columns[order].tolist(),
        known=held,
        weight=weight,
        blocks=blocks,
        threads=threads,
    )
    counts = np.full(model.n_rows, float(len(torque)))
    if weight is not None:
        counts = np.count_nonzero(weight, axis=0).astype(np.float64)
    if counts.sum() <= len(base):
        raise InputError(
            f"torque_nm: expected more than {len(base)} weighted numbers for as many parameters, "
            f"got {int(counts.sum())}"
        )
    return Factors(found, counts).columns(np.argsort(order))


def _column_noise(
    base: BaseParameters, given: Mapping[str, float] | None, factors: Factors, torque: Array
) -> Array:
    """Return the error of each column, relative to that of the torque."""
    if given is not None:
        given = numbers("column_noise", given)
        unknown = set(given) - set(base.names)
        if unknown or not given or min(given.values()) <= 0:
            raise InputError(
                f"column_noise: expected positive numbers for some of {', '.join(base.names)}, "
                f"got {dict(given)}"
            )
        return np.array([given.get(name, 0.0) for name in base.names])
    stacked = factors.rows.reshape(-1, factors.k + 1)
    size = np.linalg.norm(stacked, axis=0)
    noise = size[:-1] / size[-1]
    for i, column in enumerate(base.columns):
        extra = base.model.columns[column].extra
        if extra is not None and extra[0] in ("direction", "constant"):
            noise[i] = 0.0
    # Errors are per unit of the parameter, so a column twice as large has errors twice as large.
    return np.asarray(noise, dtype=np.float64)


def numbers(field: str, values: Mapping[str, float] | None) -> dict[str, float]:
    """Return named values as finite floats."""
    out = {}
    for name, value in (values or {}).items():
        try:
            out[name] = float(value)
        except (TypeError, ValueError):
            out[name] = float("nan")
        if not np.isfinite(out[name]):
            raise InputError(f"{field}: expected a finite number for {name}, got {value!r}")
    return out


def known_values(values: Mapping[str, float] | None) -> dict[str, float]:
    """Return known parameters as finite floats; raises InputError for negative masses, rotors, springs."""
    known = numbers("known", values)
    for name, value in known.items():
        if value < 0 and name.rpartition(".")[2] in NOT_NEGATIVE:
            raise InputError(f"known: expected no negative {name}, got {value:g}")
    return known


def row_weights(value: ArrayLike | None, shape: tuple[int, int]) -> Array | None:
    """Return checked weights of residuals, (n, n_rows), or None."""
    if value is None:
        return None
    x = np.asarray(value, dtype=np.float64)
    if x.shape not in ((shape[0],), shape):
        raise InputError(f"sample_weight: expected shape ({shape[0]},) or {shape}, got {x.shape}")
    if not np.isfinite(x).all() or x.min() < 0:
        raise InputError("sample_weight: expected finite numbers not below zero")
    full = x[:, None] if x.ndim == 1 else x
    return np.ascontiguousarray(np.broadcast_to(full, shape))


def default_blocks(blocks: int | None, n: int, least: int = 20) -> int:
    """Return ``blocks`` or the default, with blocks of at least ``least`` samples."""
    if blocks is None:
        return max(2, min(BLOCKS, n // least)) if n > 1 else 1
    if isinstance(blocks, bool) or not isinstance(blocks, (int, np.integer)):
        raise InputError(f"blocks: expected an integer, got {blocks!r}")
    if not 2 <= blocks <= n:
        raise InputError(f"blocks: expected 2 to {n}, the number of samples, got {blocks}")
    return int(blocks)

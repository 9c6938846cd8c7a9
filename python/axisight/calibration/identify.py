"""Identification of geometric and elastostatic errors, Wernholt (2004), (4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from axisight.calibration.geometry import (
    GROUPS,
    Array,
    Errors,
    Geometry,
    errors_about,
    nominal_geometry,
)
from axisight.calibration.measurements import Checked, Loads, Measurement, check
from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.statistics.evaluation import last_value

Status = Literal["converged", "max_iterations", "stalled"]

_TYPICAL = 1e-3
"""Typical error of a delivered machine [m and rad]."""
_DETERMINED = 1.0
"""Least whitened, scaled singular value: there the standard error is one typical error."""
_LOOKS = 3
"""How often the identifiable directions are determined again at the solution."""
_NAMED = 0.01
"""Least weight, relative to typical errors, at which a combination names a parameter."""
_ROUNDING = 1e-9
"""A joint torque below this share of the largest is rounding, because the load lies on the axis."""
_STEP = 1e-9
"""The search ends with a step this small relative to the errors found."""
_FALL = 1e-14
"""The search ends when the loss falls by less than this share."""
_LEFT = 1e-3
"""Largest predicted gain, in standard deviations of the residuals, at which a search has converged."""
_ADVICE: dict[str, str] = {
    "converged": "",
    "max_iterations": "still moving: allow more iterations, or start from a better nominal geometry",
    "stalled": (
        "no step lowers the loss any more before the steps are small: look for outliers, wrong "
        "units or axes that count the other way round"
    ),
}


@summarized
@dataclass(frozen=True)
class Combination:
    """A combination of parameters that the measurements determine.

    It holds a parameter and those that the measurements cannot tell from it. ``name`` reads like
    ``tool.x + 1 axis6.origin_x``; it ends in ``+ ...`` if further parameters have a weight below one
    hundredth. ``weights`` has all weights by name. ``value`` and ``standard_error`` are in the
    ``unit`` of the first parameter.
    """

    name: str
    value: float
    standard_error: float
    unit: str
    weights: dict[str, float] = field(repr=False)


@summarized
@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated geometry and how well it is known.

    geometry
        The corrected geometry. Of all that fit equally well, it is the nearest to the nominal one.
    nominal
        The geometry at the start of the search.
    table
        Over ``parameter``: ``deviation``, ``standard_error`` (infinite where only a combination
        is determined) and ``identifiable``; units in the coordinate ``unit``.
    covariance
        (n_parameters, n_parameters), of the deviations in the order of ``table``. Where ``table`` has
        an infinite standard error, the variance is infinite and the covariances are NaN.
    combinations
        The identifiable combinations, as many as ``rank``.
    status, advice, iterations
        How the search ended: ``"converged"``, ``"max_iterations"`` or ``"stalled"``.
    rank, singular_values
        Singular values of the whitened Jacobian at the solution, with columns scaled to typical
        errors (1 mm, 1 mrad, a compliance that gives 1 mrad under the largest load). ``rank`` counts
        those above one, that is, directions known better than a typical error.
    observability
        Geometric mean of the ``rank`` largest singular values, divided by the square root of the
        number of residuals (Borm and Menq 1991); larger is better.
    residual_scale
        Scatter of the residuals in units of the given standard deviations, 1 if these are right.
        Standard errors are multiplied by it.
    errors
        Root mean square and largest error [m or rad] per kind of measurement, over ``when`` (nominal
        or calibrated) and ``of`` (fit, cross_validation or validation); NaN for kinds that were not
        measured. Cross-validation predicts every measurement from a fit without it.
    """

    geometry: Geometry
    nominal: Geometry
    table: xr.Dataset
    covariance: Array
    combinations: tuple[Combination, ...]
    status: Status
    advice: str
    iterations: int
    rank: int
    singular_values: Array
    observability: float
    residual_scale: float
    errors: xr.Dataset

    def _repr_html_(self) -> str:
        """Return the deviations with standard errors, for notebooks."""
        names, units = ([str(x) for x in self.table[key].values] for key in ("parameter", "unit"))
        found = self.table
        return html.page(
            f"calibration: {self.status} after {self.iterations} iterations, "
            f"residual scale {self.residual_scale:.3g}",
            html.values(names, found["deviation"].values, found["standard_error"].values, units),
            html.lines([self.advice] if self.advice else []),
        )


def calibrate(
    robot: Robot,
    measurements: Sequence[Measurement] | Measurement,
    *,
    nominal: Geometry | None = None,
    identify: Sequence[str] = GROUPS,
    loads: Loads | None = None,
    validation: Sequence[Measurement] = (),
    folds: int = 5,
    seed: int = 0,
    max_iterations: int = 30,
) -> Calibration:
    """Return the geometry that best explains measurements of a target on the tool.

    Parameters
    ----------
    robot : the description; its links and payload load the joints.
    measurements : any mixture of absolute (:class:`Positions`, :class:`Poses`) and relative
        (:class:`Distances`, :class:`SamePoint`) measurements.
    nominal : start of the search, with base and tool frames; :func:`nominal_geometry` by default.
    identify : groups of parameters to identify, out of ``"compliance"``, ``"offset"``, ``"tilt"``,
        ``"origin"``, ``"tool"`` and ``"base"``.
    loads : loads that the joints hold; by default gravity on the links of the description.
    validation : measurements kept out of the fit, for the errors only.
    folds : parts of the cross-validation, drawn with ``seed``; 0 for none.
    max_iterations : most steps that the search (Levenberg-Marquardt) tries.

    A direction stays at its nominal value if its standard error, from the given standard deviations,
    is above a typical error. Give the base frame to within some degrees, because the search needs
    such a start. Raises InputError naming the field, and for fewer measurements than combinations; a
    search that does not converge is a status.

    """
    given = measurements if isinstance(measurements, Sequence) else (measurements,)
    if not given:
        raise InputError("measurements: expected at least one, got none")
    unknown = [g for g in identify if g not in GROUPS]
    if unknown or not identify:
        raise InputError(
            f"identify: expected some of {', '.join(GROUPS)}, got {', '.join(unknown) or 'none'}"
        )
    for name, value, least in (("max_iterations", max_iterations, 1), ("folds", folds, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InputError(f"{name}: expected a whole number from {least}, got {value!r}")
    if folds == 1:
        raise InputError("folds: expected 0 or at least 2, got 1")
    held = loads or Loads()
    start = nominal or nominal_geometry(robot)
    if start.joint_names != tuple(robot.joint_names):
        raise InputError(
            f"nominal: expected joints {', '.join(robot.joint_names)}, "
            f"got {', '.join(start.joint_names)}"
        )
    data = [check(m, robot, held, f"measurements[{i}]") for i, m in enumerate(given)]
    outside = [check(m, robot, held, f"validation[{i}]") for i, m in enumerate(validation)]
    errors = errors_about(start, identify, rotation=any(d.kind == "pose" for d in data))
    problem = _Problem(errors, data, _scales(errors, data), max_iterations)
    found = problem.solve()
    dof = sum(d.freedom for d in data) - problem.rank
    if dof <= 0:
        raise InputError(
            f"measurements: expected more than the {problem.rank} combinations that they "
            f"determine, got {dof + problem.rank} numbers: measure more configurations or "
            "identify fewer groups"
        )
    scale = float(np.sqrt(found.loss / dof))
    table, covariance, combinations = _report(problem, found, scale)
    return Calibration(
        geometry=errors.geometry(found.theta),
        nominal=start,
        table=table,
        covariance=covariance,
        combinations=combinations,
        status=found.status,
        advice=_ADVICE[found.status],
        iterations=found.iterations,
        rank=problem.rank,
        singular_values=problem.singular_values,
        observability=problem.observability,
        residual_scale=scale,
        errors=_error_table(problem, found.theta, outside, folds, seed),
    )


@dataclass(frozen=True, eq=False)
class _Found:
    theta: Array
    loss: float
    jacobian: Array
    status: Status
    iterations: int


class _Problem:
    """Whitened residuals of all measurements, over the directions that these determine."""

    def __init__(
        self,
        errors: Errors,
        data: Sequence[Checked],
        scale: Array,
        max_iterations: int,
    ) -> None:
        self.errors, self.data, self.scale = errors, data, scale
        self.max_iterations = max_iterations
        self.look(np.zeros(len(scale)))

    def look(self, theta: Array) -> None:
        """Determine at ``theta`` which directions the measurements can identify."""
        _, jacobian = self.residual(theta)
        _, s, right = np.linalg.svd(jacobian * self.scale, full_matrices=False)
        if s[0] <= _DETERMINED:
            raise InputError(
                "measurements: expected some that see an error of 1 mm or 1 mrad, got none: check "
                "std_m and what to identify"
            )
        self.rank = int(np.sum(s > _DETERMINED))
        self.singular_values = s
        self.seen = right[: self.rank].T
        self.observability = float(np.exp(np.mean(np.log(s[: self.rank]))) / np.sqrt(len(jacobian)))

    def residual(self, theta: Array) -> tuple[Array, Array]:
        parts = [d.residual(self.errors, theta) for d in self.data]
        return np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])

    def solve(self) -> _Found:
        """Search over the directions identifiable at the nominal geometry, then at the solution.

        At a wrong geometry, relative measurements seem to determine some directions that they do
        not; the smaller the error of the geometry, the weaker this effect.
        """
        found = self._search(np.zeros(len(self.scale)), self.max_iterations)
        for _ in range(_LOOKS):
            left = self.max_iterations - found.iterations
            if found.status != "converged" or left < 1:
                break
            before = self.rank
            self.look(found.theta)
            again = self._search(found.theta, left)
            found = replace(again, iterations=found.iterations + again.iterations)
            if self.rank == before:
                break
        return found

    def _search(self, theta: Array, iterations: int) -> _Found:
        """Search over the identifiable directions, from the projection of ``theta`` on them."""
        move = self.scale[:, None] * self.seen
        both = last_value(lambda z: self.residual(move @ z))

        def residual_at(z: Array) -> Array:
            return both(z)[0]

        def jacobian_at(z: Array) -> Array:
            return np.asarray(both(z)[1] @ move)

        ended = scipy.optimize.least_squares(
            residual_at,
            self.seen.T @ (theta / self.scale),
            jacobian_at,
            method="lm",
            x_scale=1.0,
            xtol=_STEP,
            ftol=_FALL,
            gtol=_FALL,
            max_nfev=iterations + 1,
        )
        residual, jacobian = both(ended.x)
        status: Status = "converged"
        # A search has converged if no gain is left, whatever criterion ended it.
        if _promised(jacobian @ move, residual) > _LEFT:
            status = "stalled" if ended.status > 0 else "max_iterations"
        loss = float(residual @ residual)
        return _Found(move @ ended.x, loss, jacobian, status, int(ended.nfev) - 1)

    def without(self, fold: NDArray[np.int64], k: int) -> tuple[_Problem, list[Checked]]:
        """Return the problem without fold ``k``, and the measurements left out."""
        inside: list[Checked] = []
        outside: list[Checked] = []
        at = 0
        for d in self.data:
            mine = fold[at : at + d.rows]
            at += d.rows
            for keep, part in ((mine != k, inside), (mine == k, outside)):
                rows = np.flatnonzero(keep)
                taken = d.take(rows) if len(rows) else None
                if taken is not None and taken.rows:
                    part.append(taken)
        return _Problem(self.errors, inside, self.scale, self.max_iterations), outside


def _promised(slope: Array, residual: Array) -> float:
    """Return the gain that a linear model still predicts, relative to the scatter of the residuals."""
    fitted = slope @ np.linalg.lstsq(slope, residual, rcond=None)[0]
    scatter = max(1.0, float(np.sqrt(np.mean(residual**2))))
    return float(np.linalg.norm(fitted)) / scatter


def _scales(errors: Errors, data: Sequence[Checked]) -> Array:
    """Return typical errors: 1 mrad, 1 mm, or a compliance that gives 1 mrad under the largest load."""
    out = np.full(len(errors.kinds), _TYPICAL)
    torque = np.max([np.abs(d.torque).max(axis=0) for d in data], axis=0)
    for k, (group, joint, _) in enumerate(errors.kinds):
        if group == "compliance":
            # Without load a compliance cannot be identified, whatever its scale.
            holds = torque[joint] > _ROUNDING * torque.max()
            out[k] = _TYPICAL / torque[joint] if holds else 1.0
    return out


def _report(
    problem: _Problem, found: _Found, scatter: float
) -> tuple[xr.Dataset, Array, tuple[Combination, ...]]:
    errors, scale = problem.errors, problem.scale
    # Scaled units; directions that are not identifiable have a zero column.
    r = np.linalg.qr((found.jacobian * scale) @ problem.seen, mode="r")
    spread = np.linalg.solve(r, np.eye(len(r))) * scatter
    seen = (problem.seen**2).sum(axis=1)
    alone = seen > 1.0 - 1e-9
    root = (problem.seen @ spread) * scale[:, None]
    deviation = np.sqrt((root**2).sum(axis=1))
    covariance = np.where(alone[:, None] & alone, root @ root.T, np.nan)
    np.fill_diagonal(covariance, np.where(alone, deviation**2, np.inf))
    table = xr.Dataset(
        {
            "deviation": ("parameter", found.theta),
            "standard_error": ("parameter", np.where(alone, deviation, np.inf)),
            "identifiable": ("parameter", alone),
        },
        coords={"parameter": list(errors.names), "unit": ("parameter", list(errors.units))},
    )
    combinations = []
    for lead, weights in _combinations(problem.seen):
        members = np.flatnonzero(weights)
        # From scaled to real units, with weight one for the leading parameter.
        real = weights * scale[lead] / scale
        terms = [errors.names[lead]]
        for k in members[(members != lead) & (np.abs(weights[members]) >= _NAMED)]:
            sign = "-" if real[k] < 0 else "+"
            terms.append(f"{sign} {abs(real[k]):.4g} {errors.names[k]}")
        if len(terms) < len(members):
            terms.append("+ ...")
        error = np.linalg.norm((weights @ problem.seen) @ spread) * scale[lead]
        combinations.append(
            Combination(
                " ".join(terms),
                float(real @ found.theta),
                float(error),
                errors.units[lead],
                {errors.names[k]: float(real[k]) for k in members},
            )
        )
    return table, covariance, tuple(combinations)


def _combinations(seen: Array) -> list[tuple[int, Array]]:
    """Return the leading parameter and the weights (p,) of each combination.

    Row k of ``seen`` (p, rank) is the identifiable part of parameter k. Each step takes the first row
    whose new part is at least half the largest. That keeps the weights small and names combinations
    in the order of the groups. Every other row is a sum of leading rows, so its parameter joins their
    combinations.
    """
    left = seen.copy()
    leaders: list[int] = []
    for _ in range(seen.shape[1]):
        size = np.linalg.norm(left, axis=1)
        lead = int(np.argmax(size >= 0.5 * size.max()))
        leaders.append(lead)
        along = left[lead] / size[lead]
        left -= np.outer(left @ along, along)
        left[lead] = 0.0
    others = [k for k in range(len(seen)) if k not in leaders]
    # seen[others] = shares @ seen[leaders]
    shares = np.linalg.solve(seen[leaders].T, seen[others].T).T
    out = []
    for i, lead in enumerate(leaders):
        weights = np.zeros(len(seen))
        weights[lead] = 1.0
        # Smaller weights are rounding.
        weights[others] = np.where(np.abs(shares[:, i]) > 1e-9, shares[:, i], 0.0)
        out.append((lead, weights))
    return sorted(out, key=lambda item: item[0])


_KINDS = ("position_m", "rotation_rad", "distance_m", "same_point_m")
_OF = ("fit", "cross_validation", "validation")


def _error_table(
    problem: _Problem, theta: Array, outside: Sequence[Checked], folds: int, seed: int
) -> xr.Dataset:
    rms, worst = np.full((2, 2, 3, len(_KINDS)), np.nan)
    zero = np.zeros_like(theta)

    def note(when: int, of: int, sizes: dict[str, Array]) -> None:
        for kind, values in sizes.items():
            at = (when, of, _KINDS.index(kind))
            rms[at], worst[at] = np.sqrt(np.mean(values**2)), values.max()

    for when, at in enumerate((zero, theta)):
        note(when, 0, _sizes(problem.errors, problem.data, at))
        if outside:
            note(when, 2, _sizes(problem.errors, outside, at))
    if folds:
        count = sum(d.rows for d in problem.data)
        fold = np.random.default_rng(seed).permutation(np.arange(count) % folds)
        found: dict[str, list[Array]] = {}
        before: dict[str, list[Array]] = {}
        for k in range(folds):
            part, left_out = problem.without(fold, k)
            if not left_out:
                continue
            fitted = part.solve().theta
            for into, at in ((found, fitted), (before, zero)):
                for kind, values in _sizes(problem.errors, left_out, at).items():
                    into.setdefault(kind, []).append(values)
        for when, sizes in enumerate((before, found)):
            note(when, 1, {kind: np.concatenate(v) for kind, v in sizes.items()})
    dims = ("when", "of", "kind")
    return xr.Dataset(
        {"rms": (dims, rms), "largest": (dims, worst)},
        coords={"when": ["nominal", "calibrated"], "of": list(_OF), "kind": list(_KINDS)},
        attrs={"units": "m, rotation_rad in rad", "folds": folds, "seed": seed},
    )


def _sizes(errors: Errors, data: Sequence[Checked], theta: Array) -> dict[str, Array]:
    """Return the error of every measurement [m or rad], the length of a vector, by kind."""
    out: dict[str, list[Array]] = {}
    for d in data:
        r, _ = d.residual(errors, theta)
        if d.kind == "pose":
            both = r.reshape(-1, 2, 3) * np.array(d.std)[:, None]
            out.setdefault("position_m", []).append(np.linalg.norm(both[:, 0], axis=1))
            out.setdefault("rotation_rad", []).append(np.linalg.norm(both[:, 1], axis=1))
        elif d.kind == "distance":
            out.setdefault("distance_m", []).append(np.abs(r) * d.std[0])
        else:
            kind = "position_m" if d.kind == "position" else "same_point_m"
            sizes = np.linalg.norm(r.reshape(-1, 3), axis=1) * d.std[0]
            out.setdefault(kind, []).append(sizes)
    return {kind: np.concatenate(values) for kind, values in out.items()}

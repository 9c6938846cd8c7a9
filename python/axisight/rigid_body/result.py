"""The result of a rigid-body identification."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.rigid_body.base import BaseParameters
from axisight.rigid_body.findings import IdentificationFinding
from axisight.rigid_body.least_squares import Solution
from axisight.rigid_body.regressor import TorqueModel, rows
from axisight.statistics.intervals import student_interval
from axisight.statistics.least_squares import condition

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class RigidBodyEstimate:
    """Base parameters with their uncertainty, and the torque errors that they leave.

    base
        Definition of the base parameters.
    method
        ``"ls"``, ``"wls"`` or ``"tls"``.
    values
        Base parameters, shape (n_base,), units ``base.units``; eliminated ones are zero.
    covariance
        From the scatter of blocks, shape (n_base, n_base); valid for residuals that are
        correlated in time and between axes.
    covariance_white
        The covariance for white residuals, with a separate variance for each row.
    degrees_of_freedom
        Degrees of freedom of the block scatter, per parameter, shape (n_base,).
    residual_rms_nm, relative_error
        Per row: rms residual [Nm], and the same relative to the rms torque.
    residual_std_nm
        Per row: standard deviation of the residual [Nm], corrected for degrees of freedom.
    condition_number, condition_number_scaled
        Condition number of the weighted regressor, and the same with columns of unit length.
    known
        Parameters held fixed, with their values.
    eliminated
        Base parameters set to zero.
    iterations, converged
        Iterations of the row weights, and whether they converged.
    n_samples, n_blocks
        Number of samples of the estimate, and of blocks of its scatter.
    findings
        Reasons to doubt the estimate.
    """

    base: BaseParameters
    method: str
    values: Array
    covariance: Array
    covariance_white: Array
    degrees_of_freedom: Array
    residual_rms_nm: Array
    residual_std_nm: Array
    relative_error: Array
    condition_number: float
    condition_number_scaled: float
    known: Mapping[str, float]
    eliminated: tuple[str, ...]
    iterations: int
    converged: bool
    n_samples: int
    n_blocks: int
    findings: tuple[IdentificationFinding, ...]

    @classmethod
    def of(
        cls,
        *,
        base: BaseParameters,
        keep: NDArray[np.intp],
        method: str,
        solution: Solution,
        covariance: Array,
        covariance_white: Array,
        freedom: Array,
        known: Mapping[str, float],
        torque: Array,
        weight: Array | None,
        n_blocks: int,
        findings: tuple[IdentificationFinding, ...],
    ) -> RigidBodyEstimate:
        """Return the result from a solution for the base parameters ``keep``."""
        n = len(base)
        values, degrees = np.zeros(n), np.full(n, np.inf)
        values[keep], degrees[keep] = solution.values, freedom
        at = np.ix_(keep, keep)
        full, full_white = np.zeros((n, n)), np.zeros((n, n))
        full[at], full_white[at] = covariance, covariance_white
        w = np.ones_like(torque) if weight is None else weight
        total = np.maximum((w**2).sum(axis=0), 1e-300)
        rms = np.sqrt(solution.loss / total)
        size = np.sqrt(((w * torque) ** 2).sum(axis=0) / total)
        r = solution.normal
        return cls(
            base=base,
            method=method,
            values=values,
            covariance=full,
            covariance_white=full_white,
            degrees_of_freedom=degrees,
            residual_rms_nm=rms,
            residual_std_nm=solution.sigma,
            relative_error=np.divide(rms, size, out=np.full_like(rms, np.nan), where=size > 0),
            condition_number=float(np.linalg.cond(r)),
            condition_number_scaled=condition(r),
            known=dict(known),
            eliminated=tuple(name for i, name in enumerate(base.names) if i not in keep),
            iterations=solution.iterations,
            converged=solution.converged,
            n_samples=len(torque),
            n_blocks=n_blocks,
            findings=findings,
        )

    def with_findings(self, findings: Iterable[IdentificationFinding]) -> RigidBodyEstimate:
        """Return the estimate with these findings."""
        return replace(self, findings=tuple(findings))

    @property
    def model(self) -> TorqueModel:
        """The torque model."""
        return self.base.model

    @property
    def names(self) -> list[str]:
        """Names of the base parameters."""
        return self.base.names

    def _repr_html_(self) -> str:
        """Return base parameters with standard errors, for notebooks."""
        return html.page(
            f"base parameters by {self.method}, {self.n_samples} samples",
            html.values(self.names, self.values, self.standard_error, self.base.units),
            html.lines(str(finding) for finding in self.findings),
        )

    @property
    def standard_error(self) -> Array:
        """Standard errors from the scatter of blocks, shape (n_base,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def relative_standard_error(self) -> Array:
        """Standard errors over absolute values; infinite where the value is zero."""
        size = np.abs(self.values)
        out = np.full_like(size, np.inf)
        return np.divide(self.standard_error, size, out=out, where=size > 0)

    def interval(self, level: float = 0.95) -> tuple[Array, Array]:
        """Return lower and upper bounds of confidence intervals with probability ``level``, by Student."""
        return student_interval(self.values, self.standard_error, self.degrees_of_freedom, level)

    def standard(self, prior: ArrayLike | None = None) -> Array:
        """Return standard parameters (model order) nearest to ``prior`` with these base parameters.

        See :meth:`BaseParameters.to_standard`. Known parameters have their known values.
        """
        start = self.model.nominal if prior is None else np.array(prior, dtype=np.float64)
        for name, value in self.known.items():
            start[self.model.names.index(name)] = value
        return self.base.to_standard(self.values, start)

    def predict(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Return the torques of a motion, shape (n, n_rows) [Nm], on the side of the model.

        ``q``, ``v``, ``a``: (n, n_joints) angles, velocities, accelerations of the joints.
        """
        matrix = self.model.matrix(q, v, a)
        held = np.array([self.known.get(name, 0.0) for name in self.model.names])
        held[self.base.columns] += self.values
        return np.asarray(matrix @ held, dtype=np.float64)

    def torque_error(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, torque_nm: ArrayLike
    ) -> xr.Dataset:
        """Return the torque error on a motion ``q``, ``v``, ``a``, e.g. one that was held out.

        The motion is (n, n_joints) and ``torque_nm`` (n, n_rows) [Nm]. Returns a Dataset over rows:
        ``rms_nm`` [Nm] and ``relative_error``, rms(model - measured) over rms(measured). Raises
        InputError for wrong shapes.
        """
        predicted = self.predict(q, v, a)
        torque = rows("torque_nm", torque_nm, self.model.n_rows)
        if len(torque) != len(predicted):
            raise InputError(f"torque_nm: expected {len(predicted)} rows as q, got {len(torque)}")
        rms = np.sqrt(((predicted - torque) ** 2).mean(axis=0))
        size = np.sqrt((torque**2).mean(axis=0))
        relative = np.divide(rms, size, out=np.full_like(rms, np.nan), where=size > 0)
        dim = self.model.row_dim
        return xr.Dataset(
            {"rms_nm": (dim, rms, {"units": "Nm"}), "relative_error": (dim, relative)},
            coords={dim: self.model.row_labels},
        )

    def table(self) -> xr.Dataset:
        """Return values, standard errors and 95 % intervals by parameter."""
        lower, upper = self.interval()
        columns = {
            "value": self.values,
            "standard_error": self.standard_error,
            "relative_standard_error": self.relative_standard_error,
            "standard_error_white": np.sqrt(np.diag(self.covariance_white)),
            "lower": lower,
            "upper": upper,
        }
        return xr.Dataset(
            {name: ("parameter", x) for name, x in columns.items()},
            coords={
                "parameter": self.names,
                "unit": ("parameter", self.base.units),
                "combination": ("parameter", self.base.combinations),
            },
            attrs={
                "method": self.method,
                "n_samples": self.n_samples,
                "n_blocks": self.n_blocks,
                "condition_number": self.condition_number,
                "condition_number_scaled": self.condition_number_scaled,
            },
        )

    def __str__(self) -> str:
        """Return the estimate as a table of text."""
        lines = [f"{'parameter':34}{'value':>12}{'std. error':>12}{'rel.':>8}  unit"]
        rows_of = zip(
            self.names,
            self.values,
            self.standard_error,
            self.relative_standard_error,
            self.base.units,
            strict=True,
        )
        for name, value, error, relative, unit in rows_of:
            rel = f"{100 * relative:7.1f}%" if np.isfinite(relative) else "       -"
            lines.append(f"{name:34}{value:12.5g}{error:12.2g}{rel}  {unit}")
        for name, rms, relative in zip(
            self.model.row_names, self.residual_rms_nm, self.relative_error, strict=True
        ):
            lines.append(f"{name}: residual {rms:.3g} Nm rms, {100 * relative:.2g} % of the torque")
        lines += [f"note: {finding}" for finding in self.findings]
        return "\n".join(lines)

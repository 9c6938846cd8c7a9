"""Fits a remainder to what a simulator lacks along measured motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import counted
from axisight.errors import InputError
from axisight.remainder.candidates import Candidate, candidates, periodic
from axisight.remainder.folds import Folds, folds_of
from axisight.remainder.hints import hint_of
from axisight.remainder.model import Remainder
from axisight.remainder.penalised import Block, Joint, block, correlated, orthonormal
from axisight.remainder.records import Record
from axisight.remainder.selection import Chosen, Limits, select
from axisight.remainder.splines import basis
from axisight.remainder.terms import Term
from axisight.remainder.variables import CORNER

Array = NDArray[np.float64]

# Most samples of all records together that are used.
_SAMPLES = 6000
# Highest frequency at which a period may show, as a share of the rate of the samples that are used.
_SHOWS = 0.2


def fit_remainder(
    records: Sequence[Record],
    *,
    most_terms: int = 5,
    smallest_gain: float = 0.02,
    significance: float = 3.0,
) -> Remainder:
    """Fit smooth functions of speed, direction, angle, load and further variables to a residual torque.

    Terms are chosen one after another by the error of held-out logs (of a single log: of held-out quarters). Their
    functions are penalised B-splines, orthogonal to the protected columns of the records.

    Parameters
    ----------
    records : motions with residual, one for each log; all with the same axes.
    most_terms : most terms of an axis.
    smallest_gain : smallest share of the squared residual of its axis that a term removes on held-out data [1].
    significance : smallest gain over its standard error [1].

    Returns
    -------
    The remainder; without terms on an axis where nothing repeats on held-out data.

    Raises
    ------
    InputError if there is no record, if records differ in axes, or if a limit is out of its range.

    """
    given = list(records)
    _check(given, most_terms, smallest_gain, significance)
    limits = Limits(most_terms, smallest_gain, significance)
    steps = max(1, sum(len(r.motion.time_s) for r in given) // _SAMPLES)
    folds = folds_of(given, steps)
    axes = [_Axis(given, axis, steps, folds) for axis in range(given[0].motion.n_axes)]
    fitted = [axis.fitted(limits) for axis in axes]
    return Remainder(
        tuple(term for axis in fitted for term in axis.terms),
        np.array([axis.limit_nm for axis in fitted]),
        np.array([axis.held_out_nm for axis in fitted]),
    )


def _check(
    records: Sequence[Record], most_terms: int, smallest_gain: float, significance: float
) -> None:
    if not records:
        raise InputError("records: expected at least one record, got none")
    axes = records[0].motion.n_axes
    for record in records:
        if record.motion.n_axes != axes:
            got = counted(record.motion.n_axes, "axis", "axes")
            raise InputError(f"records: expected {axes} axes in each, got {got}")
        if record.lowpass is None and not np.all(np.isfinite(record.residual_nm)):
            raise InputError(f"residual_nm: expected finite numbers in {record.motion.name}")
    if most_terms < 0:
        raise InputError(f"most_terms: expected a number of at least 0, got {most_terms}")
    if not 0 <= smallest_gain < 1:
        raise InputError(f"smallest_gain: expected a share from 0 to 1, got {smallest_gain}")
    if not significance > 0:
        raise InputError(f"significance: expected a positive number, got {significance}")


@dataclass(frozen=True)
class _Fitted:
    """The terms of an axis, the largest torque of their sum along the records, and the rms held-out error [Nm]."""

    terms: list[Term]
    limit_nm: float
    held_out_nm: float


@dataclass(eq=False)
class _Axis:
    """The data of one axis (from 0): every ``steps``-th sample, weighted."""

    records: Sequence[Record]
    axis: int
    steps: int
    folds: Folds

    def __post_init__(self) -> None:
        k = self.axis
        self.weight = self._joined([r.weight for r in self.records])
        own = [r.certainty if r.certainty is not None else r.weight for r in self.records]
        self.certainty = self._joined(own)
        residual = np.concatenate([r.residual_nm[:: self.steps, k] for r in self.records])
        self.residual = self.weight * residual
        top = max(float(np.abs(r.motion.velocity_rad_s[:, k]).max()) for r in self.records)
        self.corner = CORNER * top
        self.protected = self._protected()

    def fitted(self, limits: Limits) -> _Fitted:
        """Return the terms of the axis."""
        if not np.any(self.residual):
            return _Fitted([], 0.0, 0.0)
        fixed = self._blocks(candidates(self.records, self.axis))

        def offered(left: Array) -> list[tuple[Candidate, Block]]:
            step_s = float(np.median(np.diff(self.records[0].motion.time_s))) * self.steps
            waves = periodic(self._thinned(), self.axis, self.weight * left, _SHOWS / step_s)
            return [*fixed, *self._blocks(waves)]

        chosen, squares = select(self.residual, self.folds, offered, limits)
        held_out = float(np.sqrt(np.mean(squares)))
        if not chosen:
            return _Fitted([], 0.0, held_out)
        terms = self._terms(chosen)
        torque = np.concatenate([sum(t.torque(r.motion) for t in terms) for r in self.records])
        return _Fitted(terms, float(np.abs(torque).max()), held_out)

    def _thinned(self) -> list[Record]:
        """Return the records with the samples that are used, for positions and speeds."""
        out = []
        for record in self.records:
            motion = record.motion
            arrays = {
                name: getattr(motion, name)[:: self.steps]
                for name in (
                    "time_s",
                    "position_rad",
                    "velocity_rad_s",
                    "acceleration_rad_s2",
                    "load_nm",
                )
            }
            out.append(
                Record(
                    motion=replace(motion, **arrays, temperature_c=None),
                    residual_nm=record.residual_nm[:: self.steps],
                )
            )
        return out

    def _joined(self, arrays: Sequence[Array | None]) -> Array:
        """Return weights (n,) of the samples that are used; 1 where a record has none."""
        parts = []
        for record, array in zip(self.records, arrays, strict=True):
            every = np.ones(record.residual_nm.shape) if array is None else array
            parts.append(every[:: self.steps, self.axis])
        return np.concatenate(parts)

    def _protected(self) -> Array:
        """Return an orthonormal basis (n, r) of the protected torques, with the weights of their own fit."""
        parts = [r.protected for r in self.records]
        if any(p is None for p in parts):
            return np.zeros((len(self.residual), 0))
        columns = np.concatenate([p[:: self.steps, self.axis] for p in parts if p is not None])
        return orthonormal(self.certainty[:, None] * columns)

    def _blocks(self, offered: object) -> list[tuple[Candidate, Block]]:
        out = []
        for candidate in offered:  # type: ignore[attr-defined]
            columns = np.concatenate(
                [
                    r.filtered(candidate.columns(r.motion, self.axis, self.corner))[:: self.steps]
                    for r in self.records
                ]
            )
            shared = self.protected.T @ (self.certainty[:, None] * columns)
            made = block(self.weight[:, None] * columns, candidate.penalty(), shared)
            if made is not None:
                out.append((candidate, made))
        return out

    def _terms(self, chosen: Sequence[Chosen]) -> list[Term]:
        joint = Joint.of([c.block for c in chosen])
        found = joint.solved(self.residual)
        error = self.residual - joint.columns @ found
        alike = correlated(error, self.folds.parts)
        variance = float(np.mean(error**2)) * alike
        covariance = joint.covariance(variance)
        ends = np.cumsum([0, *(c.block.columns.shape[1] for c in chosen)])
        return [
            self._term(one, found[a:b], covariance[a:b, a:b])
            for one, a, b in zip(chosen, ends[:-1], ends[1:], strict=True)
        ]

    def _term(self, one: Chosen, found: Array, covariance: Array) -> Term:
        scale = one.candidate.scale
        x = np.zeros(1) if scale is None else scale.points()
        at = np.ones((1, 1)) if scale is None else basis(scale, x)
        rows = at @ one.block.free
        variance = np.einsum("ij,jk,ik->i", rows, covariance, rows)
        return hint_of(
            Term(
                axis=self.axis + 1,
                acts=one.candidate.acts,
                variable=one.candidate.variable,
                of_axis=one.candidate.of_axis + 1,
                x=x,
                value=rows @ found,
                standard_error=np.sqrt(np.maximum(variance, 0.0)),
                corner_rad_s=self.corner,
                gain=one.gain,
                significance=one.significance,
                period=None if scale is None else scale.period,
            )
        )

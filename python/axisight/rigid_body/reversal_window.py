"""Samples around reversals of a motor, which a fit leaves out because the filter distorts them.

The filter smears the step of Coulomb friction in the torque over some periods of its cutoff, while
the step in the regressor is sharp.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.motion import MotionEstimate

Array = NDArray[np.float64]

LEAST_KEPT = 0.05
"""Least share of an axis's samples that must be left."""
USUAL_PERIODS = (2.0, 1.5, 1.0, 0.5)
"""Periods of the cutoff to leave out by default; the first entry that leaves enough samples applies."""
USUAL_KEPT = 0.2
"""Share of an axis's samples that counts as enough."""


def reversal_weight(
    motions: Sequence[MotionEstimate],
    reversal_s: float | None,
    cutoff_hz: float,
    moving: NDArray[np.bool_] | None = None,
) -> tuple[Array, list[IdentificationFinding]]:
    """Return weights (n, n_axes) for all motions, one or zero around reversals, and findings.

    ``reversal_s`` [s] is the time before and after a reversal in which samples are left out. By default
    it is two periods of the cutoff, or less, with a serious finding, on axes that reverse too often.
    Samples where an axis is not ``moving`` (n, n_axes) are left out and do not count in the shares.
    Raises InputError if too few samples are left.
    """
    given = reversal_s
    if given is not None and (isinstance(given, bool) or not (np.isfinite(given) and given >= 0)):
        raise InputError(f"reversal_s: expected a number not below zero, got {given!r}")
    choices = [periods / cutoff_hz for periods in USUAL_PERIODS] if given is None else [given]
    weights = [np.concatenate([_away(m, s) for m in motions]) for s in choices]
    moves = np.ones(weights[0].shape, dtype=bool) if moving is None else moving
    _refuse_standing(moves)
    weights = [weight * moves for weight in weights]
    whole = np.maximum(moves.sum(axis=0), 1)
    kept = np.array([weight.sum(axis=0) / whole for weight in weights])
    chosen = np.full(kept.shape[1], len(choices) - 1)
    enough = kept >= USUAL_KEPT
    chosen[enough.any(axis=0)] = enough.argmax(axis=0)[enough.any(axis=0)]
    axes = np.arange(len(chosen))
    margin, share = np.array(choices)[chosen], kept[chosen, axes]
    _refuse_little(share, margin)
    weight = np.stack([weights[k][:, axis] for axis, k in enumerate(chosen)], axis=1)
    found = _findings(margin, share, moves.sum(axis=0), cutoff_hz, short=bool(chosen.any()))
    return weight, found


def _away(motion: MotionEstimate, margin_s: float) -> Array:
    """Return weights (n, n_axes): zero within ``margin_s`` of a reversal of the motor, else one."""
    out = np.ones_like(motion.velocity_rad_s)
    if margin_s > 0:
        reach = int(np.ceil(margin_s / motion.sample_time_s))
        turns = np.diff(np.sign(motion.velocity_rad_s), axis=0) != 0
        for row, axis in zip(*np.nonzero(turns), strict=True):
            out[max(row + 1 - reach, 0) : row + 1 + reach, axis] = 0.0
    return out


def _refuse_standing(moves: NDArray[np.bool_]) -> None:
    still = np.flatnonzero(~moves.any(axis=0)) + 1
    if len(still):
        named = ", ".join(str(axis) for axis in still)
        raise InputError(
            f"logs: expected every axis to move in one of those fitted, axis {named} stands still in "
            "all: its friction and inertia do not show; record it moving too"
        )


def _refuse_little(kept: Array, margin_s: Array) -> None:
    worst = int(kept.argmin())
    if kept[worst] < LEAST_KEPT:
        raise InputError(
            f"reversal_s: expected less, got {margin_s[worst]:g} s: axis {worst + 1} turns back "
            f"so often, or stands still, that {100 * kept[worst]:.2g} % of its samples are left; take a "
            "longer log or a higher cutoff, or keep all with 0"
        )


def _findings(
    margin_s: Array, kept: Array, n: NDArray[np.intp], cutoff_hz: float, *, short: bool
) -> list[IdentificationFinding]:
    if not (kept < 1).any():
        return []
    parts = [
        f"{100 * (1 - share):.3g} % of axis {axis} (within {margin:.3g} s)"
        for axis, (share, margin) in enumerate(zip(kept, margin_s, strict=True), 1)
    ]
    counts = ", ".join(f"{k * share:.0f}" for k, share in zip(n, kept, strict=True))
    whole = ", ".join(str(k) for k in n) if np.ptp(n) else str(n[0])
    text = f"samples left out around reversals: {', '.join(parts)}; {counts} of {whole} are kept"
    if short:
        usual = USUAL_PERIODS[0] / cutoff_hz
        text += (
            f"; the usual {usual:.3g} s would leave too little where it is less: Coulomb friction "
            "is off by more than its standard error there, take slower motions or a higher cutoff"
        )
    return [IdentificationFinding(FindingKind.LEFT_OUT, text, short)]

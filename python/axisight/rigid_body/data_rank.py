"""Check whether the data determine the base parameters, and advice if they do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.rigid_body.base import BaseParameters
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.grouping import Grouping
from axisight.rigid_body.regressor import TorqueModel

Array = NDArray[np.float64]

# Least share of samples in the rarer direction for Coulomb friction to show.
LEAST_REVERSED = 0.01


def reversals(model: TorqueModel, columns: NDArray[np.intp], v: Array) -> dict[str, float]:
    """Return, for every Coulomb parameter, the share of the samples in its rarer direction."""
    out: dict[str, float] = {}
    for i in columns:
        extra = model.columns[i].extra
        if extra is None or extra[0] != "direction":
            continue
        speed = v @ np.array(extra[1])
        moving = np.abs(speed) > max(extra[3], 1e-9 * np.abs(speed).max(initial=0.0))
        forward = int(np.count_nonzero(speed[moving] > 0))
        rarer = min(forward, int(moving.sum()) - forward)
        out[model.names[i]] = rarer / len(speed)
    return out


def reversal_findings(shares: dict[str, float]) -> list[IdentificationFinding]:
    """Return a finding for each axis that hardly reverses."""
    return [
        IdentificationFinding(
            FindingKind.REVERSAL,
            f"{name}: {100 * share:.2g} % of the samples run against the others, so that Coulomb "
            f"friction is hardly told from gravity and offsets; move {name.split('.')[0]} both ways",
            names=(name,),
        )
        for name, share in shares.items()
        if share < LEAST_REVERSED
    ]


def rank_message(
    base: BaseParameters, found: Grouping, shares: dict[str, float], motion: tuple[Array, ...]
) -> str:
    """Return a message on combinations that the data do not determine, with advice."""
    names = base.names
    groups = []
    for j in np.flatnonzero(~np.isin(np.arange(len(names)), found.independent)):
        # Columns of unit length make the weights comparable.
        weight = np.linalg.lstsq(
            found.scaled[:, found.independent], found.scaled[:, j], rcond=None
        )[0]
        if not np.any(found.scaled[:, j]):
            groups.append(f"{names[j]} (its column is zero)")
            continue
        order = found.independent[np.argsort(-np.abs(weight))]
        count = int((np.abs(weight) > 1e-3 * np.abs(weight).max()).sum())
        shown = ", ".join(names[i] for i in order[: min(count, 3)])
        more = f" and {count - 3} more" if count > 3 else ""
        groups.append(f"{names[j]} from {shown}{more}")
    listed = "; ".join(groups[:6]) + (f"; and {len(groups) - 6} more" if len(groups) > 6 else "")
    return (
        f"motion: expected data of rank {len(names)}, got {found.rank}; it does not separate "
        f"{listed}. {_advice(base, shares, motion)}"
    )


def _advice(base: BaseParameters, shares: dict[str, float], motion: tuple[Array, ...]) -> str:
    """Return advice on how to change the experiment."""
    _, v, a = motion
    names = base.model.coordinate_names
    advice = []
    # The advice names driven joints only, because others cannot be moved.
    driven = base.model.axis_coordinates
    still = [names[j] for j in driven if np.ptp(v[:, j]) == 0]
    if still:
        advice.append(f"move {', '.join(still)} at changing speeds")
    one_way = [name.split(".")[0] for name, share in shares.items() if share < LEAST_REVERSED]
    one_way = sorted(set(one_way) - set(still))
    if one_way:
        advice.append(f"move {', '.join(one_way)} both ways")
    if not advice and not a.any():
        advice.append("accelerate: at constant speed inertia does not show")
    if not advice:
        advice.append("move all axes at once, through more of their range")
    return (
        f"To separate them, {'; '.join(advice)}; or fix some with `known`, "
        f'or take what the data give with deficient="group"'
    )

"""Comparison of further experiments by the parameters that they would separate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from axisight.errors import InputError
from axisight.identifiability.assessment import (
    POOR,
    Identifiability,
    decomposed,
    identifiability,
    percent,
)
from axisight.identifiability.information import Information


def compare_experiments(
    base: Information, candidates: Sequence[Information], *, limit: float = POOR
) -> xr.Dataset:
    """Return the gain of each candidate when it is added to the present experiments.

    base
        Information of planned or finished experiments.
    candidates
        Information of possible further experiments, each with a ``name``.
    limit
        As in `identifiability`.

    Variables over ``candidate``, in the given order:

    - ``rank``, ``condition``: those with the candidate
    - ``worst_std``: largest relative standard deviation with the candidate
    - ``log_det_gain``: gain of log det of the information, infinite for a gain in rank
    - ``separates``: names of parameters that become known to the limit, separated by commas
    - ``words``: a sentence on the candidate

    ``attrs["best"]`` is the name of the candidate that leaves the fewest directions unknown, empty if
    none helps. Raises InputError without candidates and for other parameters.
    """
    if not candidates:
        raise InputError("candidates: expected at least one experiment, got none")
    before = identifiability(base, limit=limit)
    rows = []
    for k, candidate in enumerate(candidates, 1):
        label = candidate.name or f"candidate {k}"
        joint = base + candidate
        after = identifiability(joint, limit=limit)
        gained = [
            n
            for n, old, new in zip(base.names, before.relative_std, after.relative_std, strict=True)
            if old > limit >= new
        ]
        gain = np.inf if after.rank > before.rank else _log_det(joint) - _log_det(base)
        rows.append(
            (label, after, gained, gain, _sentence(candidate, label, after, gained, before))
        )
    # Fewest unknown directions first, then the smallest worst deviation, then most information.
    order = [
        (_unknown(a), -int(np.sum(a.relative_std <= limit)), float(np.max(a.relative_std)), -gain)
        for _, a, _, gain, _ in rows
    ]
    best = min(range(len(rows)), key=order.__getitem__)
    helps = _unknown(rows[best][1]) < _unknown(before) or before.identifiable
    return xr.Dataset(
        {
            "rank": ("candidate", [a.rank for _, a, *_ in rows]),
            "condition": ("candidate", [a.condition for _, a, *_ in rows]),
            "worst_std": ("candidate", [float(np.max(a.relative_std)) for _, a, *_ in rows]),
            "log_det_gain": ("candidate", [gain for *_, gain, _ in rows]),
            "separates": ("candidate", [", ".join(g) for _, _, g, _, _ in rows]),
            "words": ("candidate", [words for *_, words in rows]),
        },
        coords={"candidate": [label for label, *_ in rows]},
        attrs={"best": rows[best][0] if helps else "", "rank_before": before.rank},
    )


def _unknown(found: Identifiability) -> int:
    """Return the number of directions that are not known to the limit."""
    return sum(len(c.directions) for c in found.combinations)


def _sentence(
    candidate: Information,
    label: str,
    after: Identifiability,
    gained: Sequence[str],
    before: Identifiability,
) -> str:
    what = candidate.advice or f"add {label}"
    if gained:
        worst = max(after.relative_std[after.names.index(n)] for n in gained)
        left = "" if after.identifiable else f"; what stays: {'; '.join(after.words())}"
        return f"{what}: separates {', '.join(gained)} (to {percent(float(worst))} or better){left}"
    more = _unknown(before) - _unknown(after)
    if more > 0:
        plural = "combination is" if more == 1 else "combinations are"
        return f"{what}: {more} more {plural} known, no parameter by itself"
    return f"{what}: separates nothing"


def recommend_experiments(
    base: Information, candidates: Sequence[Information], *, limit: float = POOR, most: int = 5
) -> tuple[str, ...]:
    """Return one sentence per candidate to add, one after the other, until all parameters are known.

    ``base``, ``candidates`` and ``limit`` are those of `compare_experiments`. At most ``most``
    candidates are added, each the best after the earlier ones. The result is empty if all parameters
    are known or no candidate helps. Raises InputError for names that are not unique, and for ``most``
    below 1.
    """
    if most < 1:
        raise InputError(f"most: expected a whole number from 1 on, got {most}")
    left = {c.name or f"candidate {k}": c for k, c in enumerate(candidates, 1)}
    if len(left) < len(candidates):
        raise InputError("candidates: expected names that differ")
    present = base
    words: list[str] = []
    while left and len(words) < most and not identifiability(present, limit=limit).identifiable:
        table = compare_experiments(
            present, [replace(c, name=n) for n, c in left.items()], limit=limit
        )
        best = table.attrs["best"]
        if not best:
            break
        words.append(str(table["words"].sel(candidate=best).values))
        present = present + left.pop(best)
    return tuple(words)


def _log_det(experiment: Information) -> float:
    s, _, rank = decomposed(experiment)
    return float(2 * np.sum(np.log(s[:rank])))

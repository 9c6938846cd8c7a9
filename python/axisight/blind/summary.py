"""A benchmark's score as plain values: for files, pages and other programs."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from axisight.blind.calibration import calibration_bins, calibration_error, carried_over
from axisight.blind.score import SETTING, Judged, Share, figures
from axisight.effects import effect_info, effect_table

SCHEMA = "axisight.score/1"
# Rms torque change over noise: bin edges of the detection curve.
_SEVERITIES = (0.0, 0.3, 1.0, 3.0, 10.0, 30.0, float("inf"))


def summary(judged: Sequence[Judged]) -> dict[str, Any]:
    """Return figures, classes, confusion, calibration, detection curve and wrong cases of a benchmark.

    ``settings``: figures by engine, arm, motions and references. ``confusion``: counts of the first named
    cause, for cases with one effect or none; a verdict without a cause counts by its word. Twins count as
    one. Shares have Wilson's interval.
    """
    single = [j for j in judged if j.kind == "single"]
    off = [abs(r - 1) for j in judged for r in j.ratios]
    return {
        "schema": SCHEMA,
        "cases": len(judged),
        "figures": {name: _share(share) for name, share in figures(judged).items()},
        "unknown": _share(Share(sum(j.verdict == "unknown" for j in judged), len(judged))),
        "parameters_median_error": float(np.median(off)) if off else None,
        "calibration": {
            "error": _number(calibration_error(judged)),
            "bins": calibration_bins(judged),
            "carried_over": carried_over(judged),
        },
        "effects": _by_class(single, _effect),
        "families": _by_class(single, _family),
        "confusion": _confusion([j for j in judged if len(j.truth) < 2]),
        "detection": _detection(single),
        "settings": {key: _by_setting(judged, key) for key in SETTING},
        "misses": [
            {
                "case": j.name,
                "severity": j.severity,
                "truth": list(j.truth),
                "verdict": j.verdict,
                "named": list(j.named),
                "over_limit": {k: _number(v) for k, v in j.missed.items()},
            }
            for j in judged
            if not j.right
        ],
    }


def _share(share: Share) -> dict[str, Any]:
    low, high = share.interval()
    return {"hits": share.hits, "of": share.of, "low": low, "high": high}


def _number(x: float) -> float | None:
    return None if np.isnan(x) else x


def _first(j: Judged) -> bool:
    return j.named[:1] == j.truth


def _effect(label: str) -> str:
    return label.partition("@")[0]


def _family(label: str) -> str:
    name = _effect(label)
    return effect_info(name).family if name in effect_table() else "not in the library"


def _by_class(single: Sequence[Judged], of: Callable[[str], str]) -> dict[str, Any]:
    """Return by class how often the effect came first, among all cases and among severe ones."""
    out = {}
    for name in sorted({of(j.truth[0]) for j in single}):
        mine = [j for j in single if of(j.truth[0]) == name]
        severe = [j for j in mine if j.severe]
        out[name] = {
            "all": _share(Share(sum(map(_first, mine)), len(mine))),
            "severe": _share(Share(sum(map(_first, severe)), len(severe))),
        }
    return out


def _by_setting(judged: Sequence[Judged], key: str) -> dict[str, Any]:
    """Return the figures by one property of the cases, such as engine or arm."""
    out = {}
    for value in sorted({j.setting[key] for j in judged}):
        mine = [j for j in judged if j.setting[key] == value]
        shares = {name: _share(share) for name, share in figures(mine).items()}
        out[value] = {"cases": len(mine), "figures": shares}
    return out


def _confusion(judged: Sequence[Judged]) -> dict[str, dict[str, int]]:
    pairs = Counter(
        (
            _effect(j.truth[0]) if j.truth else "nothing",
            _effect(j.named[0]) if j.named else j.verdict,
        )
        for j in judged
    )
    rows: dict[str, dict[str, int]] = {}
    for (truth, named), count in sorted(pairs.items()):
        rows.setdefault(truth, {})[named] = count
    return rows


def _detection(single: Sequence[Judged]) -> list[dict[str, Any]]:
    """Return by severity how often a single library effect came first."""
    out = []
    for low, high in itertools.pairwise(_SEVERITIES):
        mine = [j for j in single if low <= j.severity < high]
        share = _share(Share(sum(map(_first, mine)), len(mine)))
        out.append({"from": low, "to": _number(high) if np.isfinite(high) else None, **share})
    return out

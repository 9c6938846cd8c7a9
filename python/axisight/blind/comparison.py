"""Several methods on the same cases: their scores beside one another."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from axisight.blind.score import Judged, Share, figures, judged_cases
from axisight.errors import InputError

SCHEMA = "axisight.comparison/1"
_RIGHT = "right: the truth and nothing else"
# Figures that say how well a method names causes, whatever else it states.
_COMPARED = (
    "effect first, severity 3 and more",
    "axis",
    "verdict set holds the truth",
    "false alarms on nothing withheld",
    "out of the library: unknown",
    "wrong cause explained",
    "pairs: both",
)


def comparison(cases: Path, truths: Path, entries: Mapping[str, Path]) -> dict[str, Any]:
    """Return the figures of several methods on all cases of a folder; a missing entry counts as wrong.

    ``entries``: folder of entries (one JSON per case) by the name of the method. Shares have Wilson's interval.
    ``seconds``: median time per case [s], as the entries state it. Raises InputError as `judged_cases`.
    """
    if not entries:
        raise InputError("entries: expected at least one method, got none")
    methods = {name: judged_cases(cases, truths, at, every=True) for name, at in entries.items()}
    return {
        "schema": SCHEMA,
        "cases": len(next(iter(methods.values()))),
        "methods": {name: _method(judged) for name, judged in methods.items()},
    }


def comparison_table(found: Mapping[str, Any]) -> str:
    """Return a comparison as a Markdown table: one row per figure, one column per method."""
    methods = found["methods"]
    lines = [
        f"| {found['cases']} cases | {' | '.join(methods)} |",
        "|" + "---|" * (1 + len(methods)),
    ]
    for figure in (_RIGHT, *_COMPARED):
        cells = (_words(m["figures"][figure]) for m in methods.values())
        lines.append(f"| {figure} | {' | '.join(cells)} |")
    times = ("-" if m["seconds"] is None else f"{m['seconds']:.3g} s" for m in methods.values())
    lines.append(f"| median time per case | {' | '.join(times)} |")
    lines.append(f"| no entry | {' | '.join(str(m['missing']) for m in methods.values())} |")
    return "\n".join(lines) + "\n"


def _method(judged: list[Judged]) -> dict[str, Any]:
    shares = {_RIGHT: Share(sum(j.right for j in judged), len(judged))}
    shares |= {name: share for name, share in figures(judged).items() if name in _COMPARED}
    times = [j.seconds for j in judged if np.isfinite(j.seconds)]
    return {
        "missing": sum(j.verdict == "failed" for j in judged),
        "seconds": float(np.median(times)) if times else None,
        "figures": {name: _share(share) for name, share in shares.items()},
    }


def _share(share: Share) -> dict[str, Any]:
    low, high = share.interval()
    return {"hits": share.hits, "of": share.of, "low": low, "high": high}


def _words(share: Mapping[str, Any]) -> str:
    return str(Share(share["hits"], share["of"]))

"""A diagnosis as one self-contained page, which opens from disk without a network and prints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from axisight.effects import effect_table
from axisight.gap.facts.axis_names import axis_label, in_words
from axisight.gap.facts.compared_quantity import MOTION_HEAD, motion_words, torque_of
from axisight.gap.facts.faults import by_kind
from axisight.gap.facts.result import (
    Candidate,
    Cause,
    Diagnosis,
    Gap,
    Interval,
    Pooled,
    Remainder,
    VerdictKind,
    Where,
)
from axisight.gap.facts.wording import removed_in_words
from axisight.gap.verdict.headline import NO_VERDICT, in_order, within_tolerances
from axisight.report.account import account
from axisight.report.colors import shade
from axisight.report.figures import TOP, overlays_by_log, ranking_bars
from axisight.report.limits import limit_table
from axisight.report.remainder_figures import modelled_remainder
from axisight.report.template import rendered
from axisight.report.wording import (
    NO_VALUE,
    GapMap,
    after_words,
    cell_percent,
    filter_words,
    fit_words,
    gap_maps,
    interval_texts,
    number,
    percent,
    place,
    plain_name,
    probability,
    ranked,
    share_limit,
    standard_errors,
    title_of,
    title_of_label,
    where_text,
)
from axisight.storage import write_whole

_VERDICTS: dict[VerdictKind, tuple[str, str]] = {
    "none": ("None", "The simulator has no gap above the floor."),
    "explained": ("Explained", "The causes below remove the gap on the validation logs."),
    "explained_in_part": (
        "Explained in part",
        "The causes below are sure. Beside them a gap remains that no effect of the library explains.",
    ),
    "unknown": ("Unknown", "A gap remains that no effect of the library explains."),
    "undecidable": ("Undecidable", "Two or more causes explain these logs equally well."),
}
_WITHIN = (
    "None, once re-fitted",
    "The re-fit of the simulator's own parameters within their tolerances removes the gap. The rest is at the floor.",
)
_NO_VERDICT = (
    NO_VERDICT,
    "The estimated noise is larger than the gap, so the logs cannot show what the simulator lacks.",
)
# Default names of a diagnosis, which tell the reader nothing.
_NO_CASE = "logs"
# Most values beside the headline: the height of a few causes, or of friction on all axes of a six-axis arm.
_MOST_VALUES = 12
_MODES = {
    "closed_loop": "Closed loop: robot and controller are simulated together, from the logged references.",
    "inverse_dynamics": "Inverse dynamics: the torque is computed from the measured motion.",
}

_COMPARED = {
    "torques": "measured and simulated motor torque",
    "positions": "measured and simulated positions, as the torque that the stated gains command",
}


def render_report(diagnosis: Diagnosis) -> str:
    """Return the diagnosis as one self-contained HTML page.

    The same diagnosis gives the same text. All names and sentences are escaped.
    """
    return rendered("report.html.j2", _page(diagnosis), styles=("figures.css",), script="report.js")


def save_report(diagnosis: Diagnosis, path: Path | str) -> None:
    """Write the page to ``path``; the file appears whole or not at all."""
    write_whole(Path(path), render_report(diagnosis))


def _page(diagnosis: Diagnosis) -> dict[str, Any]:
    badge, meaning = _VERDICTS[diagnosis.verdict]
    if diagnosis.verdict == "none" and within_tolerances(diagnosis.gap):
        badge, meaning = _WITHIN
    if diagnosis.headline.startswith(NO_VERDICT):
        badge, meaning = _NO_VERDICT
    logs, left_out = overlays_by_log(diagnosis)
    ranking = ranked(diagnosis)
    measured = "measured" if diagnosis.gap.compared == "torques" else ""
    remainder = diagnosis.remainder
    robot = str(diagnosis.provenance.get("robot") or diagnosis.name)
    return {
        "robot": robot,
        "case": diagnosis.name if diagnosis.name not in (robot, _NO_CASE) else "",
        "headline": diagnosis.headline,
        "verdict": diagnosis.verdict,
        "badge": badge,
        "meaning": meaning,
        "mode": _MODES[diagnosis.mode],
        "compared": _COMPARED[diagnosis.gap.compared],
        "torque": f"{measured} {torque_of(diagnosis.gap.compared)}".strip(),
        "filter": _filter(diagnosis),
        "drawn": torque_of(diagnosis.gap.compared),
        "uncounted": any(figure["uncounted"] for log in logs for figure in log["figures"]),
        "numbers": _numbers(diagnosis),
        "gap_rows": _gap_rows(diagnosis),
        "pooled": diagnosis.gap.pooled is not None,
        "motion": _motion(diagnosis.gap),
        "values": _values(diagnosis.causes),
        "findings": [[str(x) for x in same] for same in by_kind(diagnosis.findings)],
        "where": _places(diagnosis.where),
        "remainder": None
        if remainder is None
        else _remainder(remainder, torque_of(diagnosis.gap.compared)),
        "limits": limit_table(diagnosis.detection_limits, len(diagnosis.gap.before_per_axis)),
        "maps": _maps(gap_maps(diagnosis)),
        "causes": [_cause(cause) for cause in in_order(diagnosis.causes)],
        "ranking": [_candidate(c) for c in ranking],
        "top": TOP,
        "bars": ranking_bars(diagnosis),
        "logs": logs,
        "overlays_left_out": left_out,
        "alternatives": [_candidate(c) for c in diagnosis.alternatives],
        "equivalent": [[title_of_label(label) for label in g] for g in diagnosis.equivalent],
        "next_experiment": diagnosis.next_experiment,
        "checks": diagnosis.checks,
        "account": account(diagnosis.trace),
        "refit": _refit(diagnosis.refit),
        "provenance": _flat(diagnosis.provenance),
        "settings": _flat(diagnosis.settings),
    }


def _filter(diagnosis: Diagnosis) -> str:
    """Return the name of the filter on both sides of the comparison; empty without a log."""
    if not diagnosis.overlays:
        return ""
    return filter_words(diagnosis.gap.compared, diagnosis.overlays[0].lowpass_hz)


def _numbers(diagnosis: Diagnosis) -> list[dict[str, str]]:
    gap = diagnosis.gap
    added = after_words(diagnosis).removeprefix("after, ")
    rows = (
        ("before", "Gap before", gap.before, "The simulator as given."),
        ("refitted", "Re-fitted", gap.refitted, "Own parameters fitted within their tolerances."),
        ("after", "After", gap.after, f"{added[:1].upper()}{added[1:]}."),
        ("floor", "Floor", gap.floor, "A perfect simulator would leave this: sensor noise."),
    )
    largest = max((x for _, _, x, _ in rows if math.isfinite(x)), default=0.0)
    return [
        {
            "kind": kind,
            "title": title,
            "value": percent(value, 3 if value >= 1 else 2),
            "why": why,
            "width": f"{100 * value / largest:.1f}%" if math.isfinite(value) and largest else "0",
        }
        for kind, title, value, why in rows
    ]


def _gap_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return rows of axis, verdict and the gap at each stage: per axis, over all axes, and pooled."""
    gap = diagnosis.gap
    joints = diagnosis.joints
    rows = [
        [axis_label(i, joints), verdict or NO_VALUE, *(percent(x) for x in row)]
        for i, verdict, row in diagnosis.axis_rows()
    ]
    wholes: list[tuple[str, str, Gap | Pooled | None]] = [
        ("all", in_words(diagnosis.verdict), gap),
        ("pooled", NO_VALUE, gap.pooled),
    ]
    for name, verdict, whole in wholes:
        if whole is not None:
            figures = (whole.before, whole.refitted, whole.after, whole.floor)
            rows.append([name, verdict, *(percent(x) for x in figures)])
    return rows


def _motion(gap: Gap) -> dict[str, Any] | None:
    """Return the errors of position and velocity by axis; None unless positions are compared."""
    if gap.motion is None:
        return None
    rows = [[str(i), *map(number, row)] for i, row in enumerate(gap.motion.rows(), 1)]
    return {"head": [*MOTION_HEAD], "rows": rows, "words": motion_words(gap.motion.velocity_from)}


def _places(places: Sequence[Where]) -> list[dict[str, str]]:
    return [
        {"title": where_text(w), "share": percent(w.share), "evidence": w.evidence} for w in places
    ]


def _remainder(remainder: Remainder, torque: str) -> dict[str, Any]:
    if not remainder.where:
        text = "With the causes in, nothing stands out from the floor on the validation logs."
    else:
        varies = remainder.varies_with
        text = (
            f"With the causes in, {percent(remainder.gap)} of the {torque} on the validation logs remain above the "
            f"floor.{'' if varies is None else f' The remainder varies with {varies}.'}"
        )
    return {
        "text": text,
        "where": _places(remainder.where),
        "modelled": modelled_remainder(remainder.modelled),
    }


def _values(causes: Sequence[Cause]) -> dict[str, Any]:
    """Return the sizes of the causes for the place beside the headline, and how many did not fit."""
    rows: list[dict[str, Any]] = []
    title, group = "", 0
    for cause in in_order(causes):
        parameters = _cause(cause)["parameters"]
        shapes = _shapes(cause.effect)
        for row in [r for r in parameters if r["name"] not in shapes] or parameters:
            effect = plain_name(cause.effect)
            unit = "" if row["unit"] == NO_VALUE else row["unit"]
            group += effect != title
            title = effect
            at = place(cause.axis, cause.axes)
            rows.append({**row, "title": title, "group": group, "place": at, "unit": unit})
    return {"rows": rows[:_MOST_VALUES], "left_out": max(0, len(rows) - _MOST_VALUES)}


def _shapes(effect: str) -> set[str]:
    """Return the shape parameters of an effect; empty for an unknown effect."""
    info = effect_table().get(effect)
    return set() if info is None else {p.name for p in info.parameters if p.role == "shape"}


def _maps(maps: list[GapMap]) -> dict[str, Any]:
    limit = share_limit(maps)
    ticks = [limit * i / 4 for i in range(5)]
    return {
        "threshold": number(maps[0].threshold, 2) if maps else NO_VALUE,
        "scale": [{"shade": shade(tick, limit), "label": percent(tick, 2)} for tick in ticks],
        "shown": [
            {"title": m.title, "columns": m.columns, "rows": _map_rows(m, limit)} for m in maps
        ],
    }


def _map_rows(m: GapMap, limit: float) -> list[dict[str, Any]]:
    rows = []
    for i, axis in enumerate(m.axes):
        cells = []
        for j, column in enumerate(m.columns):
            share, errors = float(m.share[i, j]), float(m.significance[i, j])
            kind = "absent" if math.isnan(share) else "counts" if m.significant[i, j] else "muted"
            told = (
                "no data"
                if kind == "absent"
                else f"{percent(share)} of the axis's gap, {standard_errors(errors)} standard "
                f"errors, squared error {number(float(m.excess[i, j]))} times the floor"
            )
            cells.append(
                {
                    "kind": f"{kind} {shade(share, limit)}" if kind == "counts" else kind,
                    "share": cell_percent(share),
                    "errors": "" if kind == "absent" else f"{standard_errors(errors)}σ",
                    "told": f"Axis {axis}, {column}: {told}",
                }
            )
        rows.append({"axis": axis, "cells": cells})
    return rows


def _cause(cause: Cause) -> dict[str, Any]:
    reduction, reduction_range = interval_texts(cause.gap_reduction, 100.0)
    parameters = []
    for name, interval in cause.parameters.items():
        value, span = interval_texts(interval)
        unit = cause.units.get(name, "1")
        parameters.append(
            {"name": name, "value": value, "range": span, "unit": NO_VALUE if unit == "1" else unit}
        )
    return {
        "title": title_of(cause),
        "probability": probability(cause.probability),
        "reduction": reduction,
        "reduction_range": reduction_range,
        "parameters": parameters,
    }


def _candidate(candidate: Candidate) -> dict[str, str]:
    return {
        "effect": plain_name(candidate.effect),
        "place": place(candidate.axis, candidate.axes),
        "probability": probability(candidate.probability),
        "score": removed_in_words(candidate.score),
        "significance": standard_errors(candidate.significance),
        "status": fit_words(candidate.status),
    }


def _refit(refit: Mapping[str, Interval]) -> list[dict[str, Any]]:
    def size(item: tuple[str, Interval]) -> float:
        return -abs(item[1].value) if math.isfinite(item[1].value) else math.inf

    rows = []
    for name, interval in sorted(refit.items(), key=size):
        value, span = interval_texts(interval, 100.0)
        rows.append({"name": name, "value": value, "range": span})
    return rows


def _flat(data: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for key, value in data.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            rows += _flat(value, f"{name}.")
        else:
            rows.append((name, _plain(value)))
    return rows


def _plain(value: Any) -> str:
    """Return a value of a document in readable form."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, 4)
    if isinstance(value, list | tuple):
        return ", ".join(map(_plain, value)) or "none"
    return str(value)

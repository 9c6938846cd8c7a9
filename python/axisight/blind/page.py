"""A benchmark's score as one self-contained page."""

from __future__ import annotations

from typing import Any

from axisight.effects import effect_table
from axisight.report.template import rendered
from axisight.report.wording import NO_VALUE, plain_name

_WORDS = {"none": "none", "unknown": "unknown", "nothing": "nothing"}


def render_score(name: str, score: dict[str, Any]) -> str:
    """Return a score (`axisight.blind.summary`) as an HTML page; equal scores give equal text."""
    named = sorted({n for row in score["confusion"].values() for n in row})
    page = {
        "name": name,
        "cases": score["cases"],
        "figures": [{"name": k, **_share(v)} for k, v in score["figures"].items()],
        "unknown": _share(score["unknown"]),
        "median": _percent(score["parameters_median_error"]),
        "calibration_error": _digits(score["calibration"]["error"]),
        "carried_over": _carried_over(score["calibration"]["carried_over"]),
        "bins": [
            {
                "range": f"{b['from']:.1f} to {b['to']:.1f}",
                "count": b["count"],
                "said": _digits(b["probability"]),
                "right": _digits(b["right"]),
            }
            for b in score["calibration"]["bins"]
        ],
        "classes": [
            {"title": title, "rows": [_class(k, v) for k, v in score[key].items()]}
            for title, key in (("By family", "families"), ("By effect", "effects"))
        ],
        "settings": [_setting(key, values) for key, values in score["settings"].items()],
        "columns": [_word(n) for n in named],
        "confusion": [
            {"truth": _word(t), "cells": [_cell(t, n, row.get(n, 0)) for n in named]}
            for t, row in score["confusion"].items()
        ],
        "detection": [
            {"range": _range(d["from"], d["to"]), **_share(d)} for d in score["detection"]
        ],
        "misses": [
            {
                "case": m["case"],
                "severity": f"{m['severity']:.1f}",
                "truth": _listed(m["truth"]) or "nothing",
                "verdict": m["verdict"],
                "named": _listed(m["named"]) or NO_VALUE,
                "over": ", ".join(
                    NO_VALUE if v is None else f"{v:.2g}" for v in m["over_limit"].values()
                )
                or NO_VALUE,
            }
            for m in score["misses"]
        ],
    }
    return rendered("score.html.j2", page, styles=("score.css",))


def _carried_over(found: dict[str, Any] | None) -> list[dict[str, str]]:
    """Return a row per engine: losses there with the temperature and priors of the fitted engine."""
    if found is None:
        return []
    rows = {
        f"temperature that fits {found['fitted_on']}, {found['causes']} causes": f"{found['temperature']:.2f}"
    }
    for engine, x in found["judged_on"].items():
        rows[f"calibration error on {engine}"] = _digits(x["error"])
        rows[f"calibration error on {engine}, with that temperature"] = _digits(x["error_scaled"])
        rows[f"calibration error on {engine}, with priors by family too"] = _digits(
            x["error_priors"]
        )
    return [{"name": name, "value": value} for name, value in rows.items()]


def _setting(key: str, values: dict[str, Any]) -> dict[str, Any]:
    """Return figures as rows, with engines, arms or motions as columns."""
    names = list(next(iter(values.values()))["figures"])
    return {
        "title": f"By {key}",
        "columns": [f"{name}, {row['cases']} cases" for name, row in values.items()],
        "rows": [
            {"name": n, "shares": [_share(row["figures"][n])["count"] for row in values.values()]}
            for n in names
        ],
    }


def _share(share: dict[str, Any]) -> dict[str, str]:
    if not share["of"]:
        return {"count": NO_VALUE, "share": NO_VALUE, "interval": NO_VALUE}
    return {
        "count": f"{share['hits']} of {share['of']}",
        "share": f"{100 * share['hits'] / share['of']:.0f} %",
        "interval": f"{100 * share['low']:.0f} to {100 * share['high']:.0f} %",
    }


def _class(name: str, row: dict[str, Any]) -> dict[str, Any]:
    return {"name": _word(name), "all": _share(row["all"]), "severe": _share(row["severe"])}


def _cell(truth: str, named: str, count: int) -> dict[str, Any]:
    wanted = "none" if truth == "nothing" else truth if truth in effect_table() else "unknown"
    right = named == wanted
    return {"count": count or "", "right": right and count > 0, "wrong": not right and count > 0}


def _word(name: str) -> str:
    return _WORDS.get(name) or plain_name(name)


def _listed(labels: list[str]) -> str:
    return ", ".join(
        _word(n) + (f" (axis {a})" if a else "") for n, _, a in (x.partition("@") for x in labels)
    )


def _range(low: float, high: float | None) -> str:
    return f"{low:g} and more" if high is None else f"{low:g} to {high:g}"


def _percent(x: float | None) -> str:
    return NO_VALUE if x is None else f"{100 * x:.2g} %"


def _digits(x: float | None) -> str:
    return NO_VALUE if x is None else f"{x:.3f}"

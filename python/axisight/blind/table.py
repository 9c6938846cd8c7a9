"""A benchmark's score as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from axisight.blind.score import Share

# Short names of the figures by setting.
_BRIEF = {
    "effect first, severity 3 and more": "effect first",
    "axis": "axis",
    "false alarms on nothing withheld": "false alarms",
    "out of the library: unknown": "unknown",
    "wrong cause explained": "wrong",
    "pairs: both": "pairs",
    "parameters within 10 %": "parameters",
}


def markdown(score: Mapping[str, Any]) -> str:
    """Return a score (`axisight.blind.summary`) as Markdown: figures, their parts and every wrong case."""
    figures = [[name, _words(share)] for name, share in score["figures"].items()]
    error, off = score["calibration"]["error"], score["parameters_median_error"]
    figures += [
        ["verdict unknown, of all cases", _words(score["unknown"])],
        ["parameters, median error", "-" if off is None else f"{100 * off:.2g} %"],
        ["expected calibration error", "-" if error is None else f"{error:.3f}"],
    ]
    figures += _carried_over(score["calibration"]["carried_over"])
    lines = _table(["figure", "measured"], figures)
    for key, values in score["settings"].items():
        rows = [
            [value, str(row["cases"]), *(_count(row["figures"][name]) for name in _BRIEF)]
            for value, row in values.items()
        ]
        lines += ["", *_table([key, "cases", *_BRIEF.values()], rows)]
    families = [
        [name, _count(row["severe"]), _count(row["all"])] for name, row in score["families"].items()
    ]
    lines += ["", *_table(["family", "first, severity 3 and more", "any severity"], families)]
    severities = [
        [f"{d['from']:g} to {d['to'] or 'more'}", _words(d)] for d in score["detection"] if d["of"]
    ]
    lines += ["", *_table(["severity", "effect first"], severities)]
    misses = [
        [
            m["case"],
            f"{m['severity']:.1f}",
            ", ".join(m["truth"]) or "nothing",
            m["verdict"],
            ", ".join(m["named"]) or "-",
            ", ".join("-" if v is None else f"{v:.2g}" for v in m["over_limit"].values()) or "-",
        ]
        for m in score["misses"]
    ]
    lines += [
        "",
        *_table(
            ["case", "severity", "truth", "verdict", "named", "missed: size over limit"], misses
        ),
    ]
    return "\n".join(lines) + "\n"


def _carried_over(found: Mapping[str, Any] | None) -> list[list[str]]:
    """Return a row per engine: losses there with the temperature and priors of the fitted engine."""
    if found is None:
        return []
    own, hot = found["fitted_on"], found["temperature"]
    rows = [[f"temperature that fits {own} ({found['causes']} causes)", f"{hot:.2f}"]]
    for engine, x in found["judged_on"].items():
        errors, losses = (
            f"{x[name]:.3f}, with it {x[f'{name}_scaled']:.3f}, "
            f"with priors by family too {x[f'{name}_priors']:.3f}"
            for name in ("error", "log_loss")
        )
        rows.append([f"calibration error on {engine}", f"{errors}; log-loss {losses}"])
    return rows


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [_row(head), "|" + "---|" * len(head), *map(_row, rows)]


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _words(share: Mapping[str, Any]) -> str:
    return str(Share(share["hits"], share["of"]))


def _count(share: Mapping[str, Any]) -> str:
    return f"{share['hits']}/{share['of']}" if share["of"] else "-"

"""Write a guess as TOML: every choice with its reason, and the columns left out."""

from __future__ import annotations

import json
from collections.abc import Iterable

from axisight.logs.columns import CsvOptions
from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.incomplete import still_needed
from axisight.logs.guessing.series import Series

_FIELDS = (
    "position",
    "torque",
    "position_ref",
    "velocity_ref",
    "velocity",
    "joint_position",
    "temperature",
)


def text_of(draft: Draft) -> str:
    """Return the map of a draft as TOML."""
    missing = still_needed(draft)
    lines = [
        f"# Proposed from names and numbers of {draft.path.name}: look at every reason before use.",
        *_comments("not complete yet: ", [] if missing is None else [missing]),
        *_comments("doubtful: ", draft.doubts),
        'schema = "axisight.columns/1"',
        "",
        *_comments("", [draft.why["side"]]),
        f'side = "{draft.side}"',
    ]
    if draft.rate_name is not None:
        lines += [f"sample_rate_hz = {json.dumps(draft.rate_name)}"]
    lines += ["", *_comments("", [draft.why["time"]])]
    if draft.time is not None:
        lines += ["[time]", *(f"{key} = {value}" for key, value in _address(draft.time).items())]
        lines += [f'unit = "{draft.time_unit}"']
        if draft.resample:
            lines += ['resample_hz = "mean"  # stamps are not uniform']
        if draft.bridge_hz is not None:
            rate = f"{draft.bridge_hz:.6g}"
            lines += [
                f"# resample_hz = {rate}  # take off the # to bridge the hole by a straight line"
            ]
    lines += ["", *_comments("axes: ", [draft.why.get("axes", "one")])]
    lines += _comments("", [f"{name}: {draft.why[name]}" for name in _FIELDS if name in draft.why])
    check = "  # proposed, check: no name says so" if draft.by_numbers else ""
    for axis in range(len(draft.axes)):
        lines += ["", "[[axis]]"]
        for name in _FIELDS:
            if name in draft.fields:
                lines.append(f"{name} = {_inline(*draft.fields[name][axis])}{check}")
        for signals in draft.targets:
            lines.append(f"# position_ref = {_inline(*signals[axis])}")
        for signals in draft.torques:
            series, unit = signals[axis]
            scale = ", scale = ..." if unit in "AV" or draft.scaled else ""
            lines.append(f"# torque = {_inline(series, unit, scale)}")
    lines += _csv(draft.csv)
    if draft.unused:
        lines += ["", "# Not used:"]
        lines += _comments("  ", [f"{name}: {why}" for name, why in draft.unused.items()])
    return "\n".join(lines) + "\n"


def _address(series: Series) -> dict[str, str]:
    out = {"name": json.dumps(series.name, ensure_ascii=False)}
    if series.index is not None:
        out["index"] = json.dumps(series.index)
    return out


def _inline(series: Series, unit: str, more: str = "") -> str:
    parts = [*(f"{key} = {value}" for key, value in _address(series).items()), f'unit = "{unit}"']
    return f"{{ {', '.join(parts)}{more} }}"


def _csv(options: CsvOptions) -> list[str]:
    said = options.model_dump(exclude_defaults=True)
    return ["", "[csv]", *(f"{k} = {json.dumps(v)}" for k, v in said.items())] if said else []


def _comments(mark: str, lines: Iterable[str]) -> list[str]:
    # Names come from a file: a line break in one must not end the comment.
    return [f"# {mark}{' '.join(line.split())}" for line in lines]

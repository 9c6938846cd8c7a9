"""Add, change and remove tables ``[[effect]]`` in the text of a robot file.

The edits work on whole lines, so that comments and all other text stay. Line edits can fail on unusual TOML,
so `stated` parses its result and compares it with what was wanted.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from axisight.effects import Effect, effect_info
from axisight.errors import RobotError

_EFFECT = re.compile(r"[ \t]*\[\[[ \t]*effect[ \t]*\]\]")
_HEADER = re.compile(r"[ \t]*\[")
_EMPTY = re.compile(r"[ \t]*(#.*)?$")
_SCHEMA = re.compile(r"""^([ \t]*["']?schema["']?[ \t]*=[ \t]*["']axisight\.robot/)1(["'])""", re.M)


def stated(text: str, effects: Sequence[Effect]) -> str:
    """Return the text of a robot file that states exactly these ``effects``.

    Existing tables keep their order and their text, except for values that differ: `changed_numbers` lists
    those to replace. Missing parameters are added below the others, new effects after the last one. A text
    with nothing to add or remove is returned unchanged; every other becomes ``axisight.robot/2``.

    Raises RobotError if effects cannot be added or removed, because the text does not state them as tables
    ``[[effect]]``.
    """
    present = stated_effects(tomllib.loads(text))
    wanted = {effect.label: effect for effect in effects}
    new = [effect for effect in effects if effect.label not in {e.label for e in present}]
    more = [_missing(e, wanted[e.label]) if e.label in wanted else None for e in present]
    if not new and not any(lines is None or lines for lines in more):
        return text
    lines = _SCHEMA.sub(r"\g<1>2\g<2>", text, count=1).splitlines(keepends=True)
    end = "\r\n" if "\r\n" in text else "\n"
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += end
    places = list(_places(lines))
    if len(places) != len(present):
        raise RobotError("source: expected effects in tables [[effect]] with a line for each value")
    last = places[-1][1] if places else len(lines)
    # Upwards, so that the line numbers of earlier tables stay valid.
    added = [line + end for effect in new for line in ("", *_table(effect))]
    lines[last:last] = added
    for (first, after), below in reversed(list(zip(places, more, strict=True))):
        if below is None:
            rest = (i for i in range(after, len(lines)) if lines[i].strip())
            del lines[first : next(rest, len(lines))]
        else:
            lines[after:after] = [line + end for line in below]
    out = "".join(lines)
    labels = [e.label for e in present if e.label in wanted] + [e.label for e in new]
    document = tomllib.loads(out)
    if _others(document) != _others(tomllib.loads(text)) or labels != [
        e.label for e in stated_effects(document)
    ]:
        raise RobotError("source: its effects cannot be edited; write them in plain TOML tables")
    return out


def stated_effects(document: Mapping[str, Any]) -> list[Effect]:
    """Return the effects that the document of a robot file states."""
    out = []
    for entry in document.get("effect", []):
        parameters = {k: v for k, v in entry.items() if k not in ("name", "axis", "axes")}
        # Whole numbers may be written as 2.0.
        axis = int(entry["axis"]) if "axis" in entry else None
        axes = (int(entry["axes"][0]), int(entry["axes"][1])) if "axes" in entry else None
        out.append(Effect(entry["name"], axis, parameters, axes))
    return out


def changed_numbers(
    document: Mapping[str, Any], effects: Sequence[Effect]
) -> dict[tuple[str | int, ...], float]:
    """Return the effect parameters to replace, by their place in the document of a text from `stated`."""
    wanted = {effect.label: effect for effect in effects}
    out: dict[tuple[str | int, ...], float] = {}
    for i, effect in enumerate(stated_effects(document)):
        values = _values(wanted[effect.label])
        for name, value in (effect.parameters or {}).items():
            if values[name] != value:
                out["effect", i, name] = values[name]
    return out


def _others(document: Mapping[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in document.items() if k not in ("schema", "effect")}


def _places(lines: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Yield, for every table of an effect, the first line and the line after its last value."""
    first = None
    after = 0
    for i, line in enumerate(lines):
        if first is not None and _HEADER.match(line):
            yield first, after
            first = None
        if _EFFECT.match(line):
            first = i
        if first is not None and not _EMPTY.match(line.rstrip("\r\n")):
            after = i + 1
    if first is not None:
        yield first, after


def _values(effect: Effect) -> dict[str, float]:
    names = (p.name for p in effect_info(effect.name).parameters)
    return dict(zip(names, map(float, effect.values()), strict=True))


def _table(effect: Effect) -> list[str]:
    lines = ["[[effect]]", f'name = "{effect.name}"']
    if effect.axis is not None:
        lines.append(f"axis = {effect.axis}")
    if effect.axes is not None:
        lines.append(f"axes = [{effect.axes[0]}, {effect.axes[1]}]")
    return lines + [f"{name} = {float(v)!r}" for name, v in (effect.parameters or {}).items()]


def _missing(present: Effect, wanted: Effect) -> list[str]:
    """Return lines for the parameters that are not neutral and that a table leaves out."""
    neutral = {p.name: p.neutral for p in effect_info(wanted.name).parameters}
    return [
        f"{name} = {value!r}"
        for name, value in _values(wanted).items()
        if name not in (present.parameters or {}) and value != neutral[name]
    ]

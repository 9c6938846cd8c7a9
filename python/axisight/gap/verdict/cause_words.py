"""Causes in sentences: what the simulator lacks, what it has with a wrong value, and where."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.effects import Effect, article, effect_info, noun
from axisight.gap.facts.axis_names import always_there
from axisight.gap.facts.result import Cause, Interval
from axisight.gap.facts.wording import listed

# Numbers of axes in words.
_COUNTS = {2: "both", 3: "all three", 4: "all four", 5: "all five", 6: "all six", 7: "all seven"}
_Places = tuple[tuple[int, ...], ...]
MOST = 4
"""Items of a list that a sentence tells: effects, wrong values, changes of the re-fit. More are counted."""


def in_order(causes: Sequence[Cause]) -> list[Cause]:
    """Return causes by effect, in the order in which effects first come, then by axis."""
    first = {c.effect: i for i, c in reversed(list(enumerate(causes)))}
    return sorted(causes, key=lambda c: (first[c.effect], c.axis or 0))


def named(causes: Sequence[Cause], n_axes: int = 0) -> str:
    """Return causes in words, one phrase an effect: "Coulomb friction on axes 1, 2 and 5".

    ``n_axes``: of the robot. Effects that differ by an adjective and have the same axes share a phrase:
    "Coulomb and viscous friction".
    """
    return listed(told(_phrases(causes, n_axes)))


def labels_in_words(labels: Sequence[str], n_axes: int) -> str:
    """Return labels ``effect@axis`` in words, as `named` does causes."""
    out = []
    for label in labels:
        effect, _, axes = label.partition("@")
        first, *second = (int(a) for a in axes.split(",") if a) if axes else (None,)
        both = (first, second[0]) if first is not None and second else None
        out.append(Cause(effect, first, 1.0, {}, {}, Interval(0.0, 0.0, 0.0), axes=both))
    return named(out, n_axes)


def sure(causes: Sequence[Cause], own: Sequence[Effect], n_axes: int) -> str:
    """Return what the simulator lacks, then what it has with a wrong value, in a sentence each.

    ``own``: effects of the simulator. An effect that it has with another value is wrong, and not lacking.
    """
    wrong = [c for c in in_order(causes) if _is_wrong(c, own)]
    lacking = [c for c in in_order(causes) if c not in wrong]
    out = [f"The simulator lacks {named(lacking, n_axes)}."] if lacking else []
    if wrong:
        text = listed(told(_wrong(wrong, own, n_axes)))
        out.append(f"{text[:1].upper()}{text[1:]}.")
    return " ".join(out)


def deed(
    causes: Sequence[Cause], own: Sequence[Effect], every: Sequence[Cause], n_axes: int
) -> str:
    """Return what to do about causes, of ``every`` cause that was named: "Adding it", "Correcting them"."""
    wrong = [_is_wrong(c, own) for c in causes]
    verb = "Correcting" if all(wrong) else "Changing" if any(wrong) else "Adding"
    if len(causes) < len(every):
        return f"{verb} {named(causes, n_axes)}"
    return f"{verb} {'it' if len(causes) == 1 else 'them'}"


def axes_of(cause: Cause) -> tuple[int, ...]:
    """Return the axes (from 1) of a cause, none of the whole arm."""
    return cause.axes or (() if cause.axis is None else (cause.axis,))


def place(axes: Sequence[int], n_axes: int) -> str:
    """Return axes in words, without a preposition: "axis 2", "axes 1 and 2", "all six axes"; empty of none."""
    if not axes:
        return ""
    if 1 < len(axes) == n_axes:
        return f"{_COUNTS.get(n_axes, f'all {n_axes}')} axes"
    return f"{'axis' if len(axes) == 1 else 'axes'} {listed([str(a) for a in axes])}"


def _is_wrong(cause: Cause, own: Sequence[Effect]) -> bool:
    """Whether every simulator has what the effect changes, or this one has the effect."""
    return always_there(cause.effect) or _of_simulator(cause, own) is not None


def _of_simulator(cause: Cause, own: Sequence[Effect]) -> Effect | None:
    """Return the effect of the simulator that a cause gives other values."""
    same = (e for e in own if e.acts and e.label == cause.label)
    return next(same, None)


def told(phrases: Sequence[str], rest: str = "more effects") -> list[str]:
    """Return phrases as far as a sentence bears them, and how many are the ``rest``."""
    if len(phrases) <= MOST:
        return list(phrases)
    return [*phrases[: MOST - 1], f"{len(phrases) - MOST + 1} {rest}"]


def _phrases(causes: Sequence[Cause], n_axes: int) -> list[str]:
    by_effect: dict[str, list[Cause]] = {}
    for c in in_order(causes):
        by_effect.setdefault(c.effect, []).append(c)
    phrases: dict[tuple[str, str, _Places], list[str]] = {}
    for effect, mine in by_effect.items():
        start = article(effect)
        start = start if start in ("a", "an") else ""
        adjective, _, head = noun(effect).rpartition(" ")
        # Two delays are two things; friction of two kinds is one.
        shared = noun(effect) if start else head
        key = (start, shared, _places(mine))
        phrases.setdefault(key, []).append(adjective if shared == head else "")
    places: dict[_Places, list[str]] = {}
    for (start, head, where), adjectives in phrases.items():
        text = " ".join(x for x in (start, listed(adjectives), head) if x)
        places.setdefault(where, []).append(text)
    return [
        f"{listed(texts)} {_at(where, 'on', n_axes)}".strip() for where, texts in places.items()
    ]


def _places(causes: Sequence[Cause]) -> _Places:
    """Return where causes of one effect act: all single axes together, and each pair of axes by itself."""
    single = tuple(dict.fromkeys(a for c in causes if c.axes is None for a in axes_of(c)))
    pairs = dict.fromkeys(c.axes for c in causes if c.axes is not None)
    return (*((single,) if single else ()), *pairs)


def _at(places: _Places, preposition: str, n_axes: int) -> str:
    """Return places in words: "on axes 1 and 2", "on axes 1 and 2 and on axes 2 and 3"; empty of none."""
    return listed([f"{preposition} {place(axes, n_axes)}" for axes in places] or [""])


def _wrong(causes: Sequence[Cause], own: Sequence[Effect], n_axes: int) -> list[str]:
    """Return a phrase for each effect with a wrong value: "the motor inertia of axis 3 is wrong in the simulator".

    The machine's value stands behind it where the effect is one number on few axes.
    """
    out = []
    for effect in dict.fromkeys(c.effect for c in causes):
        mine = [c for c in causes if c.effect == effect]
        where = _at(_places(mine), "of", n_axes)
        numbers = [text for c in mine if (text := _of_machine(c, _of_simulator(c, own)))]
        few = 0 < len(numbers) == len(mine) <= MOST
        machine = f" (machine: {listed(numbers)})" if few else ""
        out.append(
            f"the {noun(effect)}{f' {where}' if where else ''} is wrong in the simulator{machine}"
        )
    return out


def _of_machine(cause: Cause, simulator: Effect | None) -> str:
    """Return what the machine has, of an effect that is one number: "+45 %", or "0.61 Nm, simulator: 0.5 Nm"."""
    sizes = [p.name for p in effect_info(cause.effect).parameters if p.role == "amplitude"]
    name = sizes[0]
    if len(sizes) != 1 or name not in cause.parameters:
        return ""
    value = cause.parameters[name].value
    if name.startswith("relative_"):
        return f"{100 * value:+.2g} %"
    given = None if simulator is None else (simulator.parameters or {}).get(name)
    unit = cause.units.get(name, "1").partition(" (")[0]
    unit = "" if unit == "1" else f" {unit}"
    return "" if given is None else f"{value:.3g}{unit}, simulator: {given:.3g}{unit}"

"""The verdict in words: first what is sure, then what is open, then where the rest of the gap lies.

`headline` makes the words from `Facts` alone, so that the same facts give the same text.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from axisight.effects import Effect, effect_info
from axisight.gap.facts.axis_names import at_floor, hides_all, placed, removed_by_refit, with_joints
from axisight.gap.facts.compared_quantity import gap_of, torque_of
from axisight.gap.facts.result import (
    AxisVerdict,
    Cause,
    Gap,
    Interval,
    Mode,
    Remainder,
    VerdictKind,
    Where,
)
from axisight.gap.facts.trace import Stop
from axisight.gap.facts.withdrawal import Withdrawal
from axisight.gap.facts.wording import listed, percent
from axisight.gap.verdict.cause_words import (
    MOST,
    axes_of,
    deed,
    in_order,
    labels_in_words,
    named,
    place,
    sure,
    told,
)

__all__ = [
    "NO_VERDICT",
    "Facts",
    "clear_changes",
    "headline",
    "in_order",
    "named",
    "within_tolerances",
]

_Groups = tuple[tuple[str, ...], ...]
NO_VERDICT = "No verdict"
"""Start of the headline where the data have a fault that hides the gap."""
# Stands for the name of a log until joints are named: the name may hold "axis 3" itself.
_LOG = "\0"
_UNFELT = "A torque predicted from the measured motion does not feel this."


@dataclass(frozen=True)
class Facts:
    """What the words are made of.

    ``verdict`` of the arm, ``axes`` of each axis; ``gap`` on the validation logs; ``causes`` as they are named.
    ``open``: groups of labels that the data cannot tell apart, the cause first; ``twins``: groups that give
    the same logs; ``withdrawn``: how the validation logs contradict the estimation logs. ``where`` the gap
    lies and the ``remainder`` with the causes in. ``own``: effects of the simulator; ``refit``: relative change
    of its own parameters [1]; ``joints``: names of its axes. ``mode``: how torques were predicted. ``apart``: by how
    much two runs of a machine that chatters differ [1]. ``stopped``: where the time limit ended the search.
    """

    verdict: VerdictKind
    gap: Gap
    axes: tuple[AxisVerdict, ...] = ()
    causes: tuple[Cause, ...] = ()
    open: _Groups = ()
    twins: _Groups = ()
    withdrawn: Withdrawal | None = None
    where: tuple[Where, ...] = ()
    remainder: Remainder | None = None
    own: tuple[Effect, ...] = ()
    refit: Mapping[str, Interval] = field(default_factory=dict)
    joints: Sequence[str] = ()
    mode: Mode = "closed_loop"
    apart: float | None = None
    stopped: Stop | None = None

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return len(self.gap.before_per_axis)


def headline(facts: Facts) -> str:
    """Return the verdict in a few plain sentences, axes with the names of their joints."""
    why = None if facts.withdrawn is None else facts.withdrawn.why
    if why in ("noise", "loud"):
        said = _no_verdict(facts, loud=why == "loud")
    elif facts.verdict == "none":
        said = _none(facts)
    elif facts.verdict == "unknown":
        said = _unknown(facts)
    else:
        said = _explained(facts)
    said = said if facts.stopped is None else [facts.stopped.words, *said]
    said = [*said, _not_judged(facts)]
    text = with_joints(" ".join(x for x in said if x), facts.joints)
    log = "" if facts.withdrawn is None else facts.withdrawn.log or ""
    return text.replace(_LOG, log)


def _not_judged(facts: Facts) -> str:
    """Return which axes are not judged; empty without one."""
    axes = [a.axis for a in facts.axes if a.verdict == "not_judged"]
    if not axes:
        return ""
    are, carry, its = (
        ("are", "carry", "their torques") if len(axes) > 1 else ("is", "carries", "its torque")
    )
    return f"{_capital(place(axes, 0))} {are} not judged: {its} {carry} nothing."


def within_tolerances(gap: Gap) -> list[int]:
    """Return the axes (from 1) whose gap as given is clear and gone once re-fitted, the largest first."""
    stages = (gap.before_per_axis, gap.refitted_per_axis, gap.floor_per_axis)
    return removed_by_refit(*(stage.tolist() for stage in stages))


def clear_changes(refit: Mapping[str, Interval]) -> list[str]:
    """Return re-fitted parameters with their change, the largest first, where its 95 % interval leaves out zero."""
    clear = {k: p for k, p in refit.items() if p.low > 0 or p.high < 0}
    largest = sorted(clear.items(), key=lambda item: -abs(item[1].value))
    changes = [f"{k} {100 * p.value:+.2g} %" for k, p in largest[:MOST]]
    return changes if len(largest) <= MOST else [*changes, f"and {len(largest) - MOST} more"]


def _no_verdict(facts: Facts, *, loud: bool) -> list[str]:
    """Of noise that is larger than the gap, a fault of the data, or as large as the torque."""
    gap = facts.gap
    if loud:
        return [
            f"{NO_VERDICT}: noise alone is {percent(gap.floor)} of the {_torque(facts)}.",
            "No effect would show above it.",
        ]
    return [
        f"{NO_VERDICT}: the noise estimated from the logs, {percent(gap.floor)} of the {_torque(facts)}, is larger "
        f"than the gap of {percent(gap.refitted)}.",
        "Look for glitches and for frozen or missing samples with `axisight check`.",
    ]


def _none(facts: Facts) -> list[str]:
    gap = facts.gap
    moved = within_tolerances(gap)
    out = ["No unmodelled effect found."]
    if moved:
        first, *others = moved
        before, left, noise = (
            percent(float(x[first - 1]))
            for x in (gap.before_per_axis, gap.refitted_per_axis, gap.floor_per_axis)
        )
        also = f", like that of {place(others, 0)}," if others else ""
        changes = clear_changes(facts.refit)
        how = f" ({', '.join(changes)})" if changes else ""
        out += [
            f"The gap of {before} of the {_torque(facts)} on axis {first}{also} lies within the tolerances of the "
            "simulator's own parameters.",
            f"Re-fitted{how}, they leave {left} there (noise alone: {noise}).",
        ]
    else:
        out.append(_refitted(facts))
    loud = [i for i, x in enumerate(gap.floor_per_axis.tolist(), start=1) if hides_all(x)]
    if loud:
        most = percent(float(max(gap.floor_per_axis[i - 1] for i in loud)))
        out.append(
            f"Noise hides much on {place(loud, facts.n_axes)}: it is {most} of the {_torque(facts)} there."
            if len(loud) == 1
            else f"Noise hides much on {place(loud, facts.n_axes)}: it is up to {most} of the {_torque(facts)} there."
        )
    return out


def _refitted(facts: Facts) -> str:
    gap = facts.gap
    return (
        f"The re-fitted simulator leaves {percent(gap.refitted)} of the {_torque(facts)} on validation logs "
        f"(noise alone: {percent(gap.floor)})."
    )


def _explained(facts: Facts) -> list[str]:
    """Of causes: those that are sure, those that stay open, what they do to the gap, what is left."""
    out = [_sure(facts), _open(facts), _effect(facts), _chance(facts), _twins(facts), _rest(facts)]
    unknown = any(a.verdict == "unknown" for a in facts.axes)
    return [*out, _gap_left(facts)] if unknown else out


def _chance(facts: Facts) -> str:
    """Return that a machine with its causes chatters."""
    if facts.apart is None:
        return ""
    return f"The motion is then chaotic: two runs differ by {percent(facts.apart)}, whatever the simulator."


def _sure(facts: Facts) -> str:
    certain = _certain(facts, facts.causes)
    return sure(certain, facts.own, facts.n_axes) if certain else ""


def _certain(facts: Facts, causes: Sequence[Cause]) -> list[Cause]:
    """Return those of the causes that do not stay open."""
    still_open = {label for group in _open_groups(facts) for label in group}
    return [c for c in causes if c.label not in still_open]


def _open_groups(facts: Facts) -> _Groups:
    """Return what stays open: as the verdict has it, and of an *unknown* arm by the rivals of each cause."""
    if facts.open or facts.verdict != "unknown":
        return facts.open
    twins = {group[0]: group for group in facts.twins}
    groups = (
        (c.label, *(x for x in c.rivals if x not in twins.get(c.label, ()))) for c in facts.causes
    )
    return tuple(group for group in groups if len(group) > 1)


def _open(facts: Facts) -> str:
    groups = _open_groups(facts)
    if not groups:
        return ""
    choices = [listed(told([placed(label) for label in group], "others"), "or") for group in groups]
    return (
        f"Open: {'; '.join(told(choices, 'more such choices'))}. These logs cannot tell them apart."
    )


def _with(facts: Facts, causes: Sequence[Cause]) -> str:
    """Return what is in the simulator with ``causes``, some of them open: the sure ones, and one of each choice."""
    first = f"the first of {'each' if len(_open_groups(facts)) > 1 else 'them'}"
    certain = _certain(facts, causes)
    if not certain:
        return f"With {first}"
    if len(certain) < len(_certain(facts, facts.causes)):
        return f"With {named(certain, facts.n_axes)} and {first}"
    return f"With {'this cause' if len(certain) == 1 else 'these'} and {first}"


def _effect(facts: Facts) -> str:
    """Return what the causes do to the gap; logs show some by themselves, and the gap does not feel them."""
    gap, causes = facts.gap, facts.causes
    figures = f"of the {_torque(facts)}"
    what = gap_of(gap.compared)
    felt = _felt(facts)
    steps = [c for c in felt if effect_info(c.effect).unrepeatable]
    others = [c for c in felt if c not in steps]
    if not felt:
        return f"{_UNFELT} The gap is {percent(gap.refitted)} {figures} (noise alone: {percent(gap.floor)})."
    if not others:
        return (
            f"The steps of the encoders set the floor: the {what} is {percent(gap.refitted)} {figures} "
            f"(noise and steps: {percent(gap.floor)})."
        )
    noise = f"(noise{' and steps' if steps else ''} alone: {percent(gap.floor)})"
    change = _Change(gap.before, gap.after, f"{what} on validation logs", f" {figures} {noise}", "")
    if facts.open:
        return change.when(_with(facts, others))
    cuts = "takes" if gap.after >= gap.before else "cuts"
    return change.by(deed(others, facts.own, causes, facts.n_axes), cuts)


@dataclass(frozen=True)
class _Change:
    """The ``gap`` in words ``before`` and ``after`` causes [1], ``of`` what and beside which noise, ``there``.

    Shares are not finite where a simulation broke off.
    """

    before: float
    after: float
    gap: str
    of: str
    there: str

    def when(self, given: str) -> str:
        """Return the change where causes are ``given``: "With the first of them"; empty for "the causes"."""
        if math.isfinite(self.before) and math.isfinite(self.after):
            start = f"{given} the" if given else "The"
            return f"{start} {self.gap} goes from {percent(self.before)} to {percent(self.after)}{self.of}."
        start = given or "With the causes"
        if math.isfinite(self.before):
            return f"{start} the simulation breaks off{self.there}."
        broke = f"The simulation as given broke off{self.there}."
        if math.isfinite(self.after):
            return f"{broke} {start} the {self.gap} is {percent(self.after)}{self.of}."
        return f"{broke} {start} it does too."

    def by(self, act: str, verb: str) -> str:
        """Return the change by what is done about causes: "Adding it", which "cuts" or "takes" the gap."""
        if math.isfinite(self.before) and math.isfinite(self.after):
            return f"{act} {verb} the {self.gap} from {percent(self.before)} to {percent(self.after)}{self.of}."
        if math.isfinite(self.before):
            return f"{act} makes the simulation break off{self.there}."
        broke = f"The simulation as given broke off{self.there}."
        if math.isfinite(self.after):
            return f"{broke} {act} leaves a {self.gap} of {percent(self.after)}{self.of}."
        return f"{broke} {act} does not change that."


def _felt(facts: Facts) -> list[Cause]:
    """Return the causes that the gap feels: by inverse dynamics those off the machine may make none of it."""
    if facts.mode != "inverse_dynamics":
        return list(facts.causes)
    return [
        c
        for c in facts.causes
        if effect_info(c.effect).acts not in ("controller", "sensor")
        or not c.gap_reduction.low == c.gap_reduction.high == 0.0
    ]


def _twins(facts: Facts) -> str:
    """Return which other effect would give the same logs, where that is one; the checks have more."""
    if len(facts.twins) != 1 or facts.open:
        return ""
    cause, *others = facts.twins[0]
    return f"{_capital(listed([placed(x) for x in others], 'or'))} would give the same logs as {placed(cause)}."


def _rest(facts: Facts) -> str:
    """Return what is left: of axes that are *explained in part*, else where the remainder is largest."""
    left = facts.remainder
    parts = [a.axis for a in facts.axes if a.verdict == "explained_in_part"]
    if left is None or not (left.where or parts):
        return ""
    places = [w for w in left.where if w.axis in parts or not parts]
    axis = places[0].axis if places else parts[0]
    value = percent(float(left.per_axis[axis - 1]))
    regime = _regime(places[0]) if places else ""
    keeps = f"Axis {axis} keeps {value} of its {_torque(facts)} above noise{regime}"
    if not parts:
        return f"{keeps}."
    rest = [x for x in parts if x != axis]
    return " ".join(
        filter(None, (f"{keeps}; no known effect explains that.", _too(rest, "such a rest")))
    )


def _unknown(facts: Facts) -> list[str]:
    out = []
    if facts.causes:
        out = [_sure(facts), _open(facts), _effect_in_part(facts)]
    if facts.stopped is not None:
        # Nobody knows yet what explains the rest.
        return [*out, "" if facts.causes else _refitted(facts), _contradiction(facts)]
    if facts.withdrawn is not None and facts.withdrawn.why == "gear":
        return [*out, _contradiction(facts)]
    return [*out, _gap_left(facts), _contradiction(facts)]


def _gap_left(facts: Facts) -> str:
    """Return which axis has a gap that nothing explains, the largest first."""
    gap = facts.gap
    left = gap.after_per_axis if facts.causes else gap.refitted_per_axis
    axes = _unknown_axes(facts, left.tolist())
    if not axes:
        explains = f"No known effect explains the {gap_of(gap.compared)}"
        if not math.isfinite(gap.before):
            return f"{explains}: the simulation as given broke off."
        return (
            f"{explains} of {percent(gap.before)} of the "
            f"{_torque(facts)} (noise alone: {percent(gap.floor)})."
        )
    quiet = [x for x in axes if at_floor(float(left[x - 1]), float(gap.floor_per_axis[x - 1]))]
    if facts.withdrawn is not None and facts.withdrawn.why == "none":
        # The estimation logs lack nothing, so what is at the floor of the validation logs has no gap at all.
        axes, quiet = [x for x in axes if x not in quiet], []
        if not axes:
            return ""
    first, *others = axes
    value, floor = float(left[first - 1]), float(gap.floor_per_axis[first - 1])
    figures = f"{percent(value)} of the {_torque(facts)} (noise alone: {percent(floor)})"
    where = next((_regime(w) for w in facts.where if w.axis == first), "")
    if first in quiet:
        if facts.withdrawn is not None:
            text = f"Axis {first} has a gap on the estimation logs{where}, but not on the validation logs: {figures}."
        else:
            text = (
                f"Axis {first} has an error on the estimation logs that no known effect explains{where}. "
                f"On validation logs it does not stand out: {figures}."
            )
        return f"{text} {_too(others, 'one too')}".strip()
    if math.isfinite(value):
        text = f"Axis {first} has a {gap_of(gap.compared)} that no known effect explains: {figures}{where}."
    else:
        text = (
            f"Axis {first} has a gap that no known effect explains: the simulation broke off there."
        )
    clear = _too([x for x in others if x not in quiet], "one too")
    return " ".join(x for x in (text, clear, _too(quiet, "one on the estimation logs alone")) if x)


def _too(axes: Sequence[int], what: str) -> str:
    """Return that other axes have a gap as well; empty of none."""
    if not axes:
        return ""
    return f"{_capital(place(sorted(axes), 0))} {'have' if len(axes) > 1 else 'has'} {what}."


def _unknown_axes(facts: Facts, left: Sequence[float]) -> list[int]:
    """Return the axes that are unknown, the one to be told first.

    Axes at their floor come last. Of the others that of the first place leads, then they go by how far they
    stand above the floor.
    """
    floor = facts.gap.floor_per_axis.tolist()
    leads = facts.where[0].axis if facts.where else 0

    def order(axis: int) -> tuple[bool, bool, float]:
        value, noise = left[axis - 1], floor[axis - 1]
        above = value**2 - noise**2
        size = -above if math.isfinite(above) else -math.inf
        return at_floor(value, noise), axis != leads, size

    return sorted((a.axis for a in facts.axes if a.verdict == "unknown"), key=order)


def _effect_in_part(facts: Facts) -> str:
    """Return what the causes of other axes do there."""
    gap, felt = facts.gap, _felt(facts)
    if not felt:
        return _UNFELT
    given = _with(facts, felt) if _open_groups(facts) else ""
    axes = sorted({a for c in felt for a in axes_of(c)})
    if len(axes) != 1:
        of = f" of the {_torque(facts)} (noise alone: {percent(gap.floor)})"
        what = f"{gap_of(gap.compared)} on validation logs"
        return _Change(gap.before, gap.after, what, of, "").when(given)
    axis = axes[0]
    before, after, floor = (
        float(x[axis - 1]) for x in (gap.before_per_axis, gap.after_per_axis, gap.floor_per_axis)
    )
    noise = f" (noise alone: {percent(floor)})"
    change = _Change(before, after, f"gap of axis {axis}", noise, f" on axis {axis}")
    if given:
        return change.when(given)
    return change.by(deed(felt, facts.own, facts.causes, facts.n_axes), "takes")


def _contradiction(facts: Facts) -> str:
    """Return why causes are not named that explain the estimation logs."""
    seen = facts.withdrawn
    if seen is None:
        return ""
    there = "" if seen.axis is None else f" on axis {seen.axis} of {_LOG}"
    if seen.why == "none":
        left = f"{percent(seen.after)} of the {_torque(facts)} is left{there} (noise alone: {percent(seen.floor)})"
        if not math.isfinite(seen.after):
            left = f"the simulation broke off{there}"
        return f"The estimation logs lack no effect, but that does not carry over to the validation logs: {left}."
    if seen.why == "gear":
        return (
            f"Encoders of motor and joint show that the gear of axis {seen.axis} deflects otherwise than the "
            f"simulator's, by {seen.share:.1f} standard deviations. No known effect explains it."
        )
    if seen.why == "bent":
        return (
            f"{_tried(seen, facts.n_axes)} would explain it only with {100 * seen.share:.0f} % of the simulator's "
            "own parameters at the edge of their tolerance."
        )
    return _not_carried(seen, facts, there)


def _not_carried(seen: Withdrawal, facts: Facts, there: str) -> str:
    """Return what causes of the estimation logs do to the gap on the validation logs, ``there``."""
    of = f"of the {_torque(facts)}"
    before, after = percent(seen.before), percent(seen.after)
    several = len(seen.causes) > 1
    tried, it = _tried(seen, facts.n_axes), "them" if several else "it"
    not_carried = f"{tried} {'do' if several else 'does'} not carry over to the validation logs"
    if not math.isfinite(seen.after):
        return f"{not_carried}: with {it} the simulation breaks off{there}."
    if not math.isfinite(seen.before):
        return f"{not_carried}: with {it} the gap{there} is {after} {of}, and without {it} the simulation broke off."
    if seen.why == "part":
        only = f"{tried} {'explain' if several else 'explains'} only a part"
        return f"{only}: with {it} the gap on validation logs goes from {before} to {after} {of}."
    if seen.why == "refit":
        return (
            f"{not_carried}: the gap is {after} {of} with {it}, and {before} with the re-fit alone."
        )
    return f"{not_carried}: with {it} the gap{there} goes from {before} to {after} {of}."


def _tried(seen: Withdrawal, n_axes: int) -> str:
    """Return the causes that were withdrawn, as the subject of a sentence."""
    return _capital(labels_in_words(seen.causes, n_axes)) if seen.causes else "The causes found"


def _regime(where: Where) -> str:
    """Return where on its axis a gap lies: ``, mostly at 0.5-6 Hz (speed: slow)``; empty where nothing stands out."""
    band = (
        "" if where.band_hz is None else f", mostly at {where.band_hz[0]:g}-{where.band_hz[1]:g} Hz"
    )
    return band if where.regime is None else f"{band} ({where.regime})"


def _torque(facts: Facts) -> str:
    return torque_of(facts.gap.compared)


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"

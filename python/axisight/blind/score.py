"""Verdicts against truths: how often a cause was named, missed or invented, and with what confidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from axisight.arguments import short
from axisight.blind.entries import (
    COUNTED_ALTERNATIVE,
    NO_ENTRY,
    as_verdict,
    entries_in,
    read_stated,
)
from axisight.blind.sealed import SEAL, seal_of
from axisight.documents import parse_json
from axisight.effects import effect_table
from axisight.errors import InputError
from axisight.gap.ranking.twins import TWIN_SHARE, twins_of

SEVERE = 3.0
"""Rms torque change over noise above which an effect counts as severe, that is as detectable."""
SETTING = ("engine", "arm", "motions", "references")
"""Properties of a case's draw, as named in its truth."""
# For truths that do not state every property.
# Verdicts that name causes as sure.
_SURE = ("explained", "explained_in_part")
_ALWAYS = {"references": "logged"}
# Error of the gap's reduction that still counts as right.
_POINTS = 0.05


@dataclass(frozen=True)
class Judged:
    """One verdict and its truth.

    - Labels are ``effect@axis``.
    - ``allowed``: causes, equivalents and likely alternatives.
    - ``where``: the axis with most of the gap; ``n_axes``: axes of the arm, 0 if unknown.
    - ``ratios``: named over true value of the parameters that both state; ``covered``: whether their
      intervals contain the true value.
    - ``setting``: engine, arm and motions by name, and whether references were logged.
    - ``missed``: true size over stated detection limit, for each library effect that is not named; 0 if the
      verdict says that no size would show, NaN if it states no limit.
    - ``reduction``: `gap_reduction` of the first cause. A true cause that is the only one removes the whole
      gap.
    - ``seconds``: time of the diagnosis [s], NaN if it is not stated.
    """

    name: str
    truth: tuple[str, ...]
    in_library: bool
    severity: float
    verdict: str
    named: tuple[str, ...]
    probabilities: tuple[float, ...]
    allowed: frozenset[str]
    where: frozenset[int]
    ratios: tuple[float, ...]
    covered: tuple[bool, ...]
    setting: Mapping[str, str]
    missed: Mapping[str, float] = field(default_factory=dict)
    reduction: float = float("nan")
    n_axes: int = 0
    seconds: float = float("nan")

    @property
    def kind(self) -> str:
        """``nothing``, ``unknown`` (outside the library), ``single`` or ``pair``."""
        if not self.truth:
            return "nothing"
        if not self.in_library:
            return "unknown"
        return "single" if len(self.truth) == 1 else "pair"

    @property
    def severe(self) -> bool:
        """Whether the effect is large enough to be found."""
        return self.severity >= SEVERE

    @property
    def right(self) -> bool:
        """Whether the verdict states the truth and nothing else."""
        if self.kind in ("nothing", "unknown"):
            wanted = "none" if self.kind == "nothing" else "unknown"
            return self.verdict == wanted and not self.named
        return set(self.named) == set(self.truth)


@dataclass(frozen=True)
class Share:
    """A count of a total, with Wilson's interval at 95 %."""

    hits: int
    of: int

    def interval(self) -> tuple[float, float]:
        """Return the interval (Wilson 1927); 0 to 1 for a total of zero."""
        if self.of == 0:
            return 0.0, 1.0
        found = scipy.stats.binomtest(self.hits, self.of).proportion_ci(method="wilson")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        """Return the share as text for a table."""
        if self.of == 0:
            return "-"
        low, high = self.interval()
        return f"{self.hits}/{self.of} = {100 * self.hits / self.of:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def judged_cases(cases: Path, truths: Path, verdicts: Path, *, every: bool = False) -> list[Judged]:
    """Return every verdict with its truth.

    ``cases`` and ``truths`` are folders; ``verdicts`` may be entries, in a folder or in one file, see `as_verdict` and
    `entries_in`. With ``every``, each case counts: one without a verdict as failed. Raises InputError for a missing
    truth, for one that differs from the truth its case was sealed with, for a damaged verdict, and for no verdicts.
    """
    said: dict[str, tuple[str, str] | None] = dict(entries_in(verdicts))
    if every:
        sealed = sorted(seal.parent.name for seal in cases.glob(f"*/{SEAL}"))
        said = {name: said.get(name) for name in sealed}
    return [_judged_case(cases, truths, name, entry) for name, entry in said.items()]


def _judged_case(cases: Path, truths: Path, name: str, entry: tuple[str, str] | None) -> Judged:
    held = truths / f"{name}.json"
    text = read_stated(held, "the truth of a verdict")
    seal = read_stated(cases / name / SEAL, "the seal of a case").strip()
    if seal_of(text) != seal:
        raise InputError(f"{held}: expected the truth its case was sealed with")
    truth = _parsed(held, text)
    if entry is None:
        return _judged(name, truth, NO_ENTRY)
    said, where = entry
    verdict = as_verdict(_parsed(where, said), where)
    try:
        return _judged(name, truth, verdict)
    except InputError:
        raise
    except Exception as error:  # a damaged file may lack any field or hold any type
        raise InputError(
            f"{where}: expected a verdict as axisight writes it, and its truth, got one that is damaged "
            f"({short(repr(error))})"
        ) from error


def _parsed(path: Path | str, text: str) -> dict[str, Any]:
    try:
        found = parse_json(text)
    except ValueError as error:
        raise InputError(f"{path}: expected JSON: {error}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected an object, got {short(text)}")
    return found


def _label(entry: dict[str, Any]) -> str:
    return entry["effect"] if entry["axis"] is None else f"{entry['effect']}@{entry['axis']}"


def sizes(true: dict[str, float]) -> dict[str, float]:
    """Return the comparable values of a truth: parameters, and wave amplitudes by order.

    A truth states a wave by its amplitude, or by cosine and sine as an effect does. A wave without a size is left out.
    """
    orders = {key[5:]: order for key, order in true.items() if key.startswith("order")}
    waves = {
        number: [
            v
            for k, v in true.items()
            if k.startswith((f"amplitude{number}_", f"cosine{number}_", f"sine{number}_"))
        ]
        for number in orders
    }
    parts = ("order", "amplitude", *(f"{p}{n}_" for n in orders for p in ("cosine", "sine")))
    out = {k: v for k, v in true.items() if not k.startswith(parts)}
    sized = {
        f"amplitude of order {orders[n]:g}": float(np.linalg.norm(v)) for n, v in waves.items() if v
    }
    return {**out, **sized}


def comparable(found: dict[str, Any]) -> dict[str, tuple[float, float, float]]:
    """Return value and interval of each found parameter; cosine and sine of one order become an amplitude."""
    out = {k: (v["value"], *v["ci95"]) for k, v in found.items()}
    for key, order in found.items():
        if not key.startswith("order"):
            continue
        waves = [
            v for k, v in found.items() if k.startswith((f"cosine{key[5:]}_", f"sine{key[5:]}_"))
        ]
        if len(waves) != 2 or any(None in w["ci95"] for w in waves):
            continue
        size = float(np.hypot(*(w["value"] for w in waves)))
        half = max(w["ci95"][1] - w["value"] for w in waves)
        out[f"amplitude of order {order['value']:g}"] = (size, size - half, size + half)
    return out


_FAILED: dict[str, Any] = {
    "verdict": "failed",
    "causes": [],
    "alternatives": [],
    "equivalent": [],
    "where": [],
    "detection_limits": [],
}


def _as_named(effect: dict[str, Any], named: set[str], n_axes: int) -> dict[str, Any]:
    """Return a withheld effect under its twin's name if the verdict names the twin: same logs."""
    kind = effect["effect"]
    twins = twins_of(kind, n_axes) if kind in effect_table() else ()
    as_twins = [{**effect, "effect": name} for name in twins]
    return next((t for t in as_twins if _label(t) in named), effect)


def _setting(name: str, truth: dict[str, Any]) -> dict[str, str]:
    known = _ALWAYS | truth
    absent = [key for key in SETTING if key not in known]
    if absent:
        raise InputError(f"{name}.json: expected {', '.join(absent)} of the case")
    return {key: known[key] for key in SETTING}


def _missed(
    withheld: Sequence[dict[str, Any]],
    named: set[str],
    limits: Sequence[dict[str, Any]],
    n_axes: int,
) -> dict[str, float]:
    """Return the effects that are not named, with their size over the stated detection limit."""
    stated = {_label(limit): limit for limit in limits}
    out = {}
    for effect in withheld:
        label, kind = _label(effect), effect["effect"]
        if label not in named and kind in effect_table():
            # A twin's limit is that of the effect too.
            twins = ({**effect, "effect": name} for name in (kind, *twins_of(kind, n_axes)))
            limit = next((stated[_label(t)] for t in twins if _label(t) in stated), None)
            out[label] = float("nan") if limit is None else _over(effect["parameters"], limit)
    return out


def _over(true: dict[str, float], limit: dict[str, Any]) -> float:
    """Return a size over its limit; for waves, whose limits are per cosine or sine, over the largest.

    A size under another formula's name comes first.
    """
    waves = [v for k, v in true.items() if k.startswith("amplitude")]
    size = true.get(limit["parameter"], max(waves, default=next(iter(true.values()), 0.0)))
    return 0.0 if limit["value"] is None else abs(size) / float(limit["value"])


def _said(cause: dict[str, Any], n_axes: int) -> float:
    """Return the stated probability of a cause or of its twin: twins count as one."""
    twins = twins_of(cause["effect"], n_axes)
    return float(cause["probability"] / (1 - TWIN_SHARE * len(twins)))


def _judged(name: str, truth: dict[str, Any], verdict: dict[str, Any]) -> Judged:
    if "error" in verdict:
        # A failed diagnosis counts, as wrong.
        verdict = _FAILED
    causes, n_axes = verdict["causes"], len(truth["severity"])
    withheld = [_as_named(e, {_label(c) for c in causes}, n_axes) for e in truth["effects"]]
    likely = [a for a in verdict["alternatives"] if a["probability"] >= COUNTED_ALTERNATIVE]
    allowed = {_label(x) for x in (*causes, *likely)}
    allowed |= {label for group in verdict["equivalent"] for label in group}
    by_label = {_label(c): c["parameters"] for c in causes}
    ratios, covered = [], []
    for effect in withheld:
        found = comparable(by_label.get(_label(effect), {}))
        for key, value in sizes(effect["parameters"]).items():
            if key in found and value:
                here, low, high = found[key]
                ratios.append(here / value)
                # Without a stated interval the value is not covered.
                stated = low is not None and high is not None
                covered.append(stated and low <= value <= high)
    return Judged(
        name=name,
        truth=tuple(_label(e) for e in withheld),
        in_library=all(e["effect"] in effect_table() for e in withheld),
        setting=_setting(name, truth),
        reduction=causes[0]["gap_reduction"]["value"] if causes else float("nan"),
        missed=_missed(withheld, {_label(c) for c in causes}, verdict["detection_limits"], n_axes),
        severity=max(truth["severity"]),
        verdict=verdict["verdict"],
        named=tuple(_label(c) for c in causes),
        probabilities=tuple(_said(c, n_axes) for c in causes),
        allowed=frozenset(allowed),
        where=frozenset(w["axis"] for w in verdict["where"][:1]),
        n_axes=n_axes,
        ratios=tuple(ratios),
        covered=tuple(covered),
        seconds=_seconds(verdict),
    )


def _seconds(verdict: dict[str, Any]) -> float:
    stated = verdict.get("provenance", {}).get("seconds")
    return float("nan") if stated is None else float(stated)


def figures(judged: Sequence[Judged]) -> dict[str, Share]:
    """Return the shares of a benchmark, by the name of the figure."""

    def share(among: Sequence[Judged], good: Sequence[bool]) -> Share:
        return Share(sum(good), len(among))

    severe = [j for j in judged if j.severe]
    single = [j for j in severe if j.kind == "single"]
    pairs = [j for j in severe if j.kind == "pair"]
    nothing = [j for j in judged if j.kind == "nothing"]
    unknown = [j for j in severe if j.kind == "unknown"]
    arms = [j for j in (*single, *unknown) if "@" in j.truth[0]]
    return {
        "effect first, severity 3 and more": share(
            single, [j.named[:1] == j.truth for j in single]
        ),
        "axis": share(arms, [_axis_named(j) for j in arms]),
        "verdict set holds the truth": share(single, [set(j.truth) <= j.allowed for j in single]),
        "false alarms on nothing withheld": share(nothing, [bool(j.named) for j in nothing]),
        "out of the library: unknown": share(unknown, [j.right for j in unknown]),
        "wrong cause explained": share(
            judged, [j.verdict in _SURE and not set(j.named) <= set(j.truth) for j in judged]
        ),
        "missed at twice the detection limit said of it": Share(
            sum(over >= 2 for j in judged for over in j.missed.values()),
            sum(_with_a_limit(j) for j in judged if j.in_library),
        ),
        "pairs: both": share(pairs, [set(j.truth) <= set(j.named) for j in pairs]),
        "pairs: spurious third": share(pairs, [bool(set(j.named) - set(j.truth)) for j in pairs]),
        "gap_reduction within 5 points of the true one": share(
            found := [j for j in single if j.named == j.truth],
            [abs(j.reduction - 1.0) <= _POINTS for j in found],
        ),
        "parameters within 10 %": Share(
            sum(abs(r - 1) <= 0.1 for j in judged for r in j.ratios),
            sum(len(j.ratios) for j in judged),
        ),
        "intervals hold the true value": Share(
            sum(sum(j.covered) for j in judged), sum(len(j.covered) for j in judged)
        ),
    }


def _with_a_limit(judged: Judged) -> int:
    """Return how many effects the verdict named, or missed with a stated limit."""
    said = sum(not np.isnan(over) for over in judged.missed.values())
    return len(judged.truth) - len(judged.missed) + said


def _axis_named(judged: Judged) -> bool:
    axis = int(judged.truth[0].partition("@")[2])
    if not judged.named:
        return axis in judged.where
    # An arm with one axis has only effects of that axis.
    said = judged.named[0].partition("@")[2] or ("1" if judged.n_axes == 1 else "")
    return said == str(axis)

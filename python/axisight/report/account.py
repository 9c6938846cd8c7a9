"""The course of a diagnosis in words: the comparisons, why rivals lost, what each move did."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from axisight.gap.facts.trace import (
    MOVES,
    NONE,
    RULES,
    UNKNOWN,
    Adjustment,
    Comparison,
    Step,
    Trace,
    Work,
)
from axisight.gap.facts.wording import LARGEST, percent

# Most rivals of the leader that are reported, beside none and unknown.
_RIVALS = 3
# Smallest change [nat] by a rule that is reported.
_TOLD = 0.05
# Odds of 10^9 : 1 [nat]; larger odds tell the reader nothing more.
_HOPELESS = 20.7


@dataclass(frozen=True)
class Account:
    """The lines of an account.

    - ``comparisons``: per axis and round, a line on the leader and lines on its rivals.
    - ``moves``: of the search, in order, and where its time limit stopped it.
    - ``named``: changes of probability after a cause was named.
    - ``rules``: the rules that the lines name, each with its reason.
    - ``work``: the computing effort.
    """

    comparisons: tuple[tuple[str, tuple[str, ...]], ...]
    moves: tuple[str, ...]
    named: tuple[str, ...]
    rules: tuple[str, ...]
    work: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """Yield the account line by line, with rivals indented."""
        for first, rivals in self.comparisons:
            yield first
            yield from (f"  {line}" for line in rivals)
        yield from self.moves
        yield from self.named
        yield from self.rules
        yield from self.work


def account(trace: Trace) -> Account:
    """Return the account of a trace: of axes with a cause, or of all axes if there is no cause."""
    taken = [c for c in trace.comparisons if c.taken]
    told = taken or list(trace.comparisons)
    entries = [entry for c in told for entry in c.ledger] + list(trace.named)
    used = dict.fromkeys(entry.rule for entry in entries)
    return Account(
        tuple((_first(c), tuple(_rivals(c))) for c in told),
        (
            *(f"move {k}, {_move(step)}" for k, step in enumerate(trace.steps, start=1)),
            *(() if trace.stopped is None else (trace.stopped.words,)),
        ),
        tuple(f"{x.hypothesis}, once named: {_entry(x.rule, x.nats)}." for x in trace.named),
        tuple(f"{_plain(rule)}: {RULES[rule]}" for rule in used),
        _work(trace.work),
    )


def _first(one: Comparison) -> str:
    beside = f" beside {', '.join(one.causes)}" if one.causes else ""
    count = len(one.hypotheses)
    head = f"round {one.round}, axis {one.axis}{beside}"
    if not one.hypotheses:
        return f"{head}: nothing to compare."
    best = one.hypotheses[0]
    end = f"taken in: {', '.join(one.taken)}" if one.taken else "nothing taken in"
    explains = (
        "where the axis is at its floor"
        if best.score > LARGEST
        else f"explains {percent(best.score)} of the gap there on left-out data"
    )
    return f"{head}: first of {count} is {best.hypothesis}, p = {best.probability:.3f}, {explains}; {end}."


def _rivals(one: Comparison) -> Iterator[str]:
    """Yield a line for each rival, for none and for unknown: by how much it lost, and through which rules."""
    if not one.hypotheses:
        return
    best, others = one.hypotheses[0], one.hypotheses[1 : 1 + _RIVALS]
    terms = _by_hypothesis(one.ledger)
    rest = [(NONE, one.p_none), (UNKNOWN, one.p_unknown)]
    for label, p in [*((x.hypothesis, x.probability) for x in others), *rest]:
        yield _lost(label, p, best.probability, terms[label], terms[best.hypothesis])
    out = [x for x in one.ledger if math.isinf(x.nats)]
    yield from (f"{x.hypothesis} taken out: {RULES[x.rule]}" for x in out)


def _by_hypothesis(ledger: tuple[Adjustment, ...]) -> defaultdict[str, dict[str, float]]:
    """Return the contribution of each rule to each hypothesis [nat]."""
    out: defaultdict[str, dict[str, float]] = defaultdict(dict)
    for entry in ledger:
        mine = out[entry.hypothesis]
        mine[entry.rule] = mine.get(entry.rule, 0.0) + entry.nats
    return out


def _lost(
    label: str, p: float, best: float, mine: Mapping[str, float], first: Mapping[str, float]
) -> str:
    apart = {
        rule: mine.get(rule, 0.0) - first.get(rule, 0.0) for rule in dict.fromkeys([*first, *mine])
    }
    clear = ", ".join(_entry(rule, x) for rule, x in apart.items() if abs(x) >= _TOLD)
    behind = math.log(best / p) if p > 0 else math.inf
    by = f"{behind:.1f} nats" if behind < _HOPELESS else f"more than {_HOPELESS:.0f} nats"
    lead = "ties" if abs(behind) < _TOLD else f"behind by {by}"
    return f"{label} {lead}: {clear or 'nothing tells them apart'}."


def _entry(rule: str, nats: float) -> str:
    return f"{_plain(rule)} {nats:+.1f}"


def _work(work: Work) -> tuple[str, ...]:
    if work == Work():
        return ()
    return (
        f"work: {work.fits} fits with {work.steps} steps and {work.evaluations} evaluations; "
        f"{work.linearizations} linearizations.",
    )


def _plain(rule: str) -> str:
    return rule.replace("_", " ")


def _move(step: Step) -> str:
    gone = [x for x in step.before if x not in step.after]
    new = [x for x in step.after if x not in step.before]
    change = ", ".join([*(f"+ {x}" for x in new), *(f"- {x}" for x in gone)]) or "same causes"
    return (
        f"{_plain(step.move)}: {change}; loss {step.loss_before:.4g} to {step.loss_after:.4g}. "
        f"{MOVES[step.move]}"
    )

"""How a verdict came about: what was compared, what each rule added, what each move did. Data alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

NONE = "none"
"""The hypothesis that nothing is missing on an axis."""
UNKNOWN = "unknown"
"""The hypothesis that something is missing which no effect of the library stands for."""

RULES: Mapping[str, str] = MappingProxyType(
    {
        "likelihood": "How well it predicts data that were left out of its fit.",
        "cost": "What its fitted numbers cost (Schwarz 1978).",
        "own_parameters": "It takes the simulator's own parameters further off their nominal values.",
        "formula_error": "Formulas of its kind differ by less than those of most effects.",
        "better_fit": "It fits better with no more numbers and predicts nearly as well: neither is surer.",
        "plainer_law": "What it adds to a plainer law is not there.",
        "look_alike": "It is met more often than the leader, which it looks like.",
        "play_of_gear": "The leader is a gear without stiffness in its middle: that is play.",
        "not_a_cause": "It is too small, unsure, or no hypothesis any more.",
        "other_axes": "It explains less than the leader on another axis that the leader explains.",
        "rival_leads": "A rival of the same axis explains another axis for certain.",
        "composite": "A composite and its part are one hypothesis: the part has the probability of both.",
        "simplest_first": "It explains as much with less: it is named first.",
        "reported_torque": "The controller's gains ask for this torque constant.",
        "as_entered": "It was not fitted again beside later causes: its odds against the leader are those of before.",
        "beside_causes": "Other causes of the model are no rivals of it.",
        "either": "Another cause does the same to the logs, and is as likely.",
        "twins": "Other effects give the very same logs, and have a share of its probability.",
    }
)
"""Every rule that changes a log-weight, with its reason in one sentence."""

MOVES: Mapping[str, str] = MappingProxyType(
    {
        "add": "Took in what leads an axis and is a cause there.",
        "drop": "Dropped a cause that the others had made needless, or that stood in for an effect of the whole arm.",
        "merge": "Put one effect in the place of several that it does as well as.",
        "exchange": "Put a rival in the place of a cause that was judged beside others, or with a bent simulator.",
        "withdraw": "Took out causes that are less likely than none and something unknown together.",
        "finish": "Fitted on where a step still promised more than noise.",
        "reported_torque": "Put in the torque constant that the controller's gains ask for.",
        "own_axes": "Kept the causes of those axes alone that they explain.",
    }
)
"""Every move of the search, with what it does in one sentence."""


def log_odds(times: float) -> float:
    """Return the nats of what is so many times as probable; minus infinity for zero."""
    return math.log(times) if times > 0 else -math.inf


@dataclass(frozen=True)
class Adjustment:
    """An entry of the ledger: a rule of `RULES` changed the log-weight of a hypothesis by ``nats``.

    ``hypothesis``: its label, `NONE` or `UNKNOWN`. Minus infinity where it was taken out.
    """

    rule: str
    hypothesis: str
    nats: float


@dataclass(frozen=True)
class ComparedHypothesis:
    """A hypothesis as it stood on an axis: probability, share of the gap explained there, fitted numbers."""

    hypothesis: str
    probability: float
    score: float
    numbers: float


@dataclass(frozen=True)
class Comparison:
    """The hypotheses compared on an axis (from 1) in a round (from 1), beside ``causes`` taken in before.

    ``taken``: what was taken in there. ``ledger``: what each rule added, in order.
    """

    round: int
    axis: int
    causes: tuple[str, ...]
    hypotheses: tuple[ComparedHypothesis, ...]
    p_none: float
    p_unknown: float
    taken: tuple[str, ...]
    ledger: tuple[Adjustment, ...]


@dataclass(frozen=True)
class Step:
    """A move of `MOVES`: the causes before and after it, and the loss of the fit before and after."""

    move: str
    before: tuple[str, ...]
    after: tuple[str, ...]
    loss_before: float
    loss_after: float


@dataclass(frozen=True)
class Work:
    """What a search cost, whatever the machine.

    ``fits``, their accepted ``steps`` and the ``evaluations`` of the model in them; ``linearizations``:
    models evaluated with their sensitivities and not fitted.
    """

    fits: int = 0
    steps: int = 0
    evaluations: int = 0
    linearizations: int = 0


@dataclass(frozen=True)
class Trace:
    """Comparisons and moves in the order in which the search made them.

    ``named``: what changed the probability of a cause once it was named. ``work``: what it cost.
    """

    comparisons: tuple[Comparison, ...] = ()
    steps: tuple[Step, ...] = ()
    named: tuple[Adjustment, ...] = ()
    work: Work = Work()

    def to_dict(self) -> dict[str, Any]:
        """Return the trace as the verdict's JSON has it; what was taken out has null for nats."""
        return asdict(self)

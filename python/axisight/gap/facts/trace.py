"""How a verdict came about: what was compared, what each rule added, what each move did. Data alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any

from pydantic import TypeAdapter

from axisight.arguments import counted
from axisight.display.summary import summarized

NONE = "none"
"""The hypothesis that nothing is missing on an axis."""
UNKNOWN = "unknown"
"""The hypothesis that an effect is missing which the library does not have."""

RULES: Mapping[str, str] = MappingProxyType(
    {
        "likelihood": "How well the hypothesis predicts data that were left out of its fit.",
        "cost": "A price for each number that was fitted (Schwarz 1978).",
        "own_parameters": "A price for moving the simulator's own parameters away from their stated values.",
        "size": "A price for an effect whose torque is many times the largest torque of the motor.",
        "formula_error": "Effects of this kind have one accepted formula, so small differences count.",
        "better_fit": "It fits as well as the leader or better and predicts nearly as well: both are equally likely.",
        "plainer_law": "The logs do not show what this law adds to a plainer one, so it is less likely than that.",
        "look_alike": "It resembles the leader and is more common, so its prior odds are higher.",
        "play_of_gear": "The leader is a gear without stiffness in its middle, which is backlash.",
        "not_a_cause": "It is too small or too uncertain, or it is no longer a hypothesis.",
        "other_axes": "The leader also leads another axis, where this hypothesis explains less.",
        "rival_leads": "A rival of the same axis clearly leads another axis, so the odds there count here too.",
        "composite": "A composite effect and its part count as one hypothesis: the part has the probability of both.",
        "simplest_first": "It explains nearly as much with fewer numbers, so it is named first.",
        "reported_torque": "The controller's gains, as the logs show them, imply this torque constant.",
        "beside_causes": "Other causes of the axis are no rivals, so their probability does not count.",
        "either": "Another cause gives the same logs and is equally likely.",
        "verdict": "The verdict also counts the validation logs and the scatter of simulators.",
        "twins": "Other effects give exactly the same logs and take a share of its probability.",
    }
)
"""Every rule that changes a log-weight, with the reason in one sentence."""

MOVES: Mapping[str, str] = MappingProxyType(
    {
        "add": "Added the effect that leads an axis and passes all tests of a cause.",
        "drop": "Removed a cause that the other causes make needless, or that imitated an effect of the whole arm.",
        "merge": "Replaced several causes by one effect that explains as much.",
        "unsure": "Replaced or removed a cause whose size is not sure: its interval includes nothing.",
        "exchange": "Replaced a cause by a rival that is likelier beside the causes found later.",
        "withdraw": "Removed causes that are less likely than none and unknown together.",
        "finish": "Continued the last fit while a step promised a gain above noise.",
        "reported_torque": "Set the torque constant that the controller's gains imply.",
        "own_axes": "Kept only causes on axes where they explain the gap well enough.",
    }
)
"""Every move of the search, with what it does in one sentence."""

STAGES: Mapping[str, str] = MappingProxyType(
    {
        "refit": "Re-fits the simulator without effects.",
        "screening": "Predicts the gain of every candidate by one linear step.",
        "fitting": "Fits the promising candidates.",
        "refining": "Fits the leaders of each axis again, and their rivals from where the leaders ended.",
        "judging": "Compares leaders with their parts and with pairs of effects.",
        "adding": "Fits the model with the causes of a round.",
        "moves": "Tries to change the set of causes.",
        "measuring": "Fits the final values and measures what each cause does.",
    }
)
"""Every stage of a diagnosis that fits models, with what it does in one sentence."""


def log_odds(times: float) -> float:
    """Return the nats of a factor on the odds; minus infinity for zero."""
    return math.log(times) if times > 0 else -math.inf


@dataclass(frozen=True)
class Adjustment:
    """An entry of the ledger: a rule of `RULES` changed the log-weight of a hypothesis by ``nats``.

    ``hypothesis``: its label, `NONE` or `UNKNOWN`. Minus infinity if the hypothesis was removed.
    """

    rule: str
    hypothesis: str
    nats: float


@dataclass(frozen=True)
class ComparedHypothesis:
    """A hypothesis on an axis: its probability, the share of the gap that it explains there, its fitted numbers."""

    hypothesis: str
    probability: float
    score: float
    numbers: float


@dataclass(frozen=True)
class Comparison:
    """The hypotheses compared on an axis (from 1) in a round (from 1), beside the ``causes`` added before.

    ``taken``: labels added in this round. ``ledger``: what each rule added to the log-weights, in order.
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
    """Amount of work of a search, independent of the computer.

    ``fits``, their accepted ``steps`` and the ``evaluations`` of the model in them; ``linearizations``:
    models evaluated with their sensitivities and not fitted.
    """

    fits: int = 0
    steps: int = 0
    evaluations: int = 0
    linearizations: int = 0

    def __add__(self, other: Work) -> Work:
        """Return the sum of two amounts."""
        return Work(
            self.fits + other.fits,
            self.steps + other.steps,
            self.evaluations + other.evaluations,
            self.linearizations + other.linearizations,
        )


@dataclass(frozen=True)
class Stop:
    """The time limit ended a search: after ``limit_s`` seconds, in a ``round`` (from 1) and a stage of `STAGES`.

    ``causes``: labels of what had been found by then.
    """

    limit_s: float
    round: int
    stage: str
    causes: tuple[str, ...]

    @property
    def words(self) -> str:
        """One sentence for a reader of the verdict."""
        return (
            f"The search stopped at its time limit of {self.limit_s:g} s, in round {self.round} ({self.stage}), with "
            f"{counted(len(self.causes), 'cause')} found: what else may be missing was not tried."
        )


@summarized
@dataclass(frozen=True)
class Trace:
    """Comparisons and moves in the order in which the search made them.

    ``named``: what changed the probability of a cause once it was named. ``work``: what it cost, ``work_by_stage``: by
    the stages of `STAGES`. ``stopped``: where the time limit ended the search; None if it ended by itself.
    """

    comparisons: tuple[Comparison, ...] = ()
    steps: tuple[Step, ...] = ()
    named: tuple[Adjustment, ...] = ()
    work: Work = Work()
    work_by_stage: Mapping[str, Work] = field(default_factory=dict)
    stopped: Stop | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the trace as the verdict's JSON has it; removed hypotheses have null for nats."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Trace:
        """Return a trace from the verdict's JSON, without keys that it does not know.

        Raises ValueError, with the place, for any other document.
        """
        return TypeAdapter(cls).validate_python(_with_numbers(document))


# Numbers that JSON cannot express, by the key that has null in their place.
_NOT_FINITE = {"nats": -math.inf, "loss_before": math.nan, "loss_after": math.nan}


def _with_numbers(value: Any, key: str = "") -> Any:
    """Return a document with numbers in place of the nulls that stand for them."""
    if isinstance(value, Mapping):
        return {k: _with_numbers(v, k) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_with_numbers(v) for v in value]
    return _NOT_FINITE.get(key) if value is None else value

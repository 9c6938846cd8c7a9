"""A designed experiment: what to run, why, and how much sooner it decides."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.excitation import References, write_references
from axisight.gap.facts.axis_names import placed
from axisight.storage import write_whole

# Log-likelihood ratio at which the wrong rival has a probability below 5 %.
ENOUGH = float(np.log(19.0))
# Size, relative to the detection limit, at which an effect is also named, with 90 % probability.
NAMED = 2.0
# Up to the first a multisine counts as equally long, from the second as too long to be of use.
_AS_WELL, _NEVER = 1.5, 90.0


@summarized
@dataclass(frozen=True, eq=False)
class Plan:
    """A motion, and how often to run it.

    ``motion``: what moves, in words; ``axes`` (from 1) that move; ``references``: one period of it,
    motor side; ``repeats``: how often to run it. ``times_shorter``: how many times as long a standard
    multisine on all axes would have to be to tell as much, may be infinite.
    """

    motion: str
    axes: tuple[int, ...]
    references: References
    repeats: int
    times_shorter: float

    def __str__(self) -> str:
        """What moves, where and how long."""
        moved = ", ".join(str(a) for a in self.axes)
        where = f"axis {moved} alone" if len(self.axes) == 1 else f"axes {moved}"
        often = "" if self.repeats == 1 else f", {self.repeats} times"
        return f"{self.motion}, {where}, {self.references.period_s:g} s{often}"

    def beside_a_multisine(self) -> str:
        """Return how a multisine compares, in a sentence."""
        if self.times_shorter > _NEVER:
            return "A multisine on all axes would not show it."
        if self.times_shorter < _AS_WELL:
            return "A multisine on all axes is as good."
        return f"A multisine on all axes would need {self.times_shorter:.2g} times the time."


@summarized
@dataclass(frozen=True, eq=False)
class Experiment(ABC):
    """References that answer a question: `SeparatingExperiment` or `ShowingExperiment`."""

    plan: Plan

    @property
    def references(self) -> References:
        """One period of the motion, (1, n_samples, n_axes) [rad/s], motor side."""
        return self.plan.references

    @property
    def repeats(self) -> int:
        """How often to run it."""
        return self.plan.repeats

    @property
    @abstractmethod
    def decides(self) -> bool:
        """Whether it answers the question."""

    @abstractmethod
    def __str__(self) -> str:
        """What to do and what it tells, in a sentence or two."""

    def write(self, folder: Path | str) -> list[Path]:
        """Write ``references.parquet`` and ``experiment.txt`` into a folder; return their paths.

        Raises InputError where they cannot be written.
        """
        samples, text = experiment_files(folder)
        write_references(self.references, samples)
        write_whole(text, f"{self}\n")
        return [samples, text]


@summarized
@dataclass(frozen=True, eq=False)
class SeparatingExperiment(Experiment):
    """References that tell two rivals apart.

    ``rivals``: labels ``effect@axis``; ``log_ratio``: log-likelihood ratio of the true rival to the other
    to expect, whichever is true.
    """

    rivals: tuple[str, str]
    log_ratio: float

    @property
    def decides(self) -> bool:
        """Whether the wrong rival would be seen to be wrong."""
        return self.log_ratio >= ENOUGH

    def __str__(self) -> str:
        """What to do and what it tells, in a sentence or two."""
        one, other = (placed(label) for label in self.rivals)
        if not self.decides:
            return (
                f"No motion within the limits of speed, travel and torque tells {one} from {other}. "
                f"The best one tried ({_begun_small(self.plan)}) makes the true one "
                f"{np.exp(self.log_ratio):.2g} times as likely."
            )
        return (
            f"{self.plan}: tells {one} from {other}. The true one is then at least "
            f"{min(np.exp(self.log_ratio), 1e6):.2g} times as likely. {self.plan.beside_a_multisine()}"
        )


@summarized
@dataclass(frozen=True, eq=False)
class ShowingExperiment(Experiment):
    """References that show an effect of a given size, if the machine has it.

    ``effect``: as it was asked for; ``share``: its size relative to the smallest that shows with 95 % probability.
    """

    effect: Effect
    share: float

    @property
    def decides(self) -> bool:
        """Whether the size asked for would show."""
        return self.share >= 1.0

    def __str__(self) -> str:
        """What to do and what it tells, in a sentence or two."""
        sizes = ", ".join(f"{k} = {v:.4g}" for k, v in (self.effect.parameters or {}).items())
        what = f"{placed(self.effect.label)} ({sizes})"
        if not self.decides:
            larger = (
                f"would have to be {1 / self.share:.2g} times as large"
                if self.share
                else "never shows"
            )
            return (
                f"No motion within the limits of speed, travel and torque shows {what}. With the "
                f"best one tried ({_begun_small(self.plan)}) it {larger}."
            )
        named = "" if self.share >= NAMED else " It may be seen without being named."
        return (
            f"{self.plan}: shows {what} if it is there. The smallest size that would show with 95 % "
            f"probability is {100 / self.share:.0f} % of it.{named} {self.plan.beside_a_multisine()}"
        )


def experiment_files(folder: Path | str) -> tuple[Path, Path]:
    """Return what `Experiment.write` writes into a folder: the references, and what they are for."""
    return Path(folder) / "references.parquet", Path(folder) / "experiment.txt"


def _begun_small(plan: Plan) -> str:
    words = str(plan)
    return words[0].lower() + words[1:]

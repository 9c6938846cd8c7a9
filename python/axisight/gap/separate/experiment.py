"""A designed experiment: what to run, why, and how much sooner it decides."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from axisight.effects import phrase
from axisight.excitation import References, write_references
from axisight.storage import write_whole

# Log-likelihood ratio at which the wrong rival is less likely than one in twenty.
ENOUGH = float(np.log(19.0))
# How many times longer is as long, and how many are for ever.
_AS_WELL, _NEVER = 1.5, 90.0


@dataclass(frozen=True, eq=False)
class Experiment:
    """References that tell two rivals apart.

    ``rivals``: labels ``effect@axis``; ``motion``: what moves, in words; ``axes`` (from 1) that move;
    ``repeats``: how often to run it; ``log_ratio``: log-likelihood ratio of the true rival to the other to
    expect once these runs are among the logs, of the worse of the two; ``times_shorter``: how many times
    as long a standard multisine on all axes would have to be.
    """

    rivals: tuple[str, str]
    motion: str
    axes: tuple[int, ...]
    references: References
    repeats: int
    log_ratio: float
    times_shorter: float

    @property
    def decides(self) -> bool:
        """Whether the wrong rival would be seen to be wrong."""
        return self.log_ratio >= ENOUGH

    def __str__(self) -> str:
        """What to do, in a sentence or two."""
        one, other = (_placed(label) for label in self.rivals)
        moved = ", ".join(str(a) for a in self.axes)
        where = f"axis {moved} alone" if len(self.axes) == 1 else f"axes {moved}"
        often = "" if self.repeats == 1 else f", {self.repeats} times"
        what = f"{self.motion}, {where}, {self.references.period_s:g} s{often}"
        if not self.decides:
            return (
                f"No motion within the speeds, travel and torques of these logs tells {one} from {other}: "
                f"the best of those tried ({what[0].lower()}{what[1:]}) makes the true one "
                f"{np.exp(self.log_ratio):.2g} times as likely."
            )
        return (
            f"{what}, tells {one} from {other}: the true one is then at least "
            f"{min(np.exp(self.log_ratio), 1e6):.2g} times as likely. {self._beside_a_multisine()}"
        )

    def _beside_a_multisine(self) -> str:
        if self.times_shorter > _NEVER:
            return "A multisine on all axes would not show it."
        if self.times_shorter < _AS_WELL:
            return "A multisine on all axes does as well."
        return f"A multisine on all axes would have to be {self.times_shorter:.2g} times as long."

    def write(self, folder: Path | str) -> list[Path]:
        """Write ``references.parquet`` and ``experiment.txt`` into a folder; return their paths.

        Raises InputError where they cannot be written.
        """
        samples, text = experiment_files(folder)
        write_references(self.references, samples)
        write_whole(text, f"{self}\n")
        return [samples, text]


def experiment_files(folder: Path | str) -> tuple[Path, Path]:
    """Return what `Experiment.write` writes into a folder: the references, and what they are for."""
    return Path(folder) / "references.parquet", Path(folder) / "experiment.txt"


def _placed(label: str) -> str:
    effect, _, axis = label.partition("@")
    return f"{phrase(effect)} on axis {axis}" if axis else phrase(effect)

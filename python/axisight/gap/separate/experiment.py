"""A designed experiment: what to run, why, and how much sooner it decides."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from axisight.effects import phrase
from axisight.excitation import References, write_references
from axisight.storage import write_whole

# A mean square left by the wrong rival that makes it less likely than one in twenty, by the sixty
# independent blocks that a diagnosis counts.
_ENOUGH = 0.1


@dataclass(frozen=True, eq=False)
class Experiment:
    """References that tell two rivals apart.

    ``rivals``: labels ``effect@axis``; ``motion``: what moves, in words; ``axes`` (from 1) that move.
    ``evidence``: what the worse of the two would leave of the other's run, re-fitted within what the
    logs allow, as a mean square of the weighted residual (1 is noise and model error) on the axis where
    it leaves most; ``standard``: the same of a multisine of that length on all axes.
    """

    rivals: tuple[str, str]
    motion: str
    axes: tuple[int, ...]
    references: References
    evidence: float
    standard: float

    @property
    def times_shorter(self) -> float:
        """How many times as long a standard multisine would have to be for as much."""
        return self.evidence / max(self.standard, 1e-300)

    @property
    def decides(self) -> bool:
        """Whether the wrong rival would be seen to be wrong."""
        return self.evidence > _ENOUGH

    def __str__(self) -> str:
        """What to do, in a sentence."""
        one, other = (_placed(label) for label in self.rivals)
        if not self.decides:
            return (
                f"No motion within the speeds, travel and torques of these logs tells {one} from {other}: "
                f"the best of those tried leaves {self.evidence:.2g} of the noise between them."
            )
        moved = ", ".join(str(a) for a in self.axes)
        where = f"axis {moved} alone" if len(self.axes) == 1 else f"axes {moved}"
        longer = (
            f"a multisine on all axes would have to be {self.times_shorter:.3g} times as long"
            if self.times_shorter > 1.5
            else "a multisine on all axes does as well"
        )
        return (
            f"{self.motion}, {where}, {self.references.period_s:g} s: it leaves {self.evidence:.3g} times the "
            f"noise between {one} and {other}; {longer}."
        )

    def write(self, folder: Path | str) -> list[Path]:
        """Write ``references.parquet`` and ``experiment.txt`` into a folder; return their paths.

        Raises InputError where they cannot be written.
        """
        target = Path(folder)
        files = write_references(self.references, target / "references.parquet")
        text = target / "experiment.txt"
        write_whole(text, f"{self}\n")
        return [*files, text]


def _placed(label: str) -> str:
    effect, _, axis = label.partition("@")
    return f"{phrase(effect)} on axis {axis}" if axis else phrase(effect)

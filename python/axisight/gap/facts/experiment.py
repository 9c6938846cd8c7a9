"""A designed experiment: what to run, why, and how much sooner it decides."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.excitation import References, write_references
from axisight.gap.facts.axis_names import placed
from axisight.gap.facts.wording import listed
from axisight.logs import Load
from axisight.paths import JointTrajectory, write_joint_trajectory
from axisight.storage import write_whole

Array = NDArray[np.float64]
Source = Literal["given", "model", "logs"]

# Log-likelihood ratio at which the wrong rival has a probability below 5 %.
ENOUGH = float(np.log(19.0))
# Size, relative to the detection limit, at which an effect is also named, with 90 % probability.
NAMED = 2.0
# Up to the first a multisine counts as equally long, from the second as too long to be of use.
_AS_WELL, _NEVER = 1.5, 90.0

_WORDS: dict[Source, str] = {"given": "as given", "model": "robot's model", "logs": "logs"}


@summarized
@dataclass(frozen=True, eq=False)
class MotionLimit:
    """Limit of one quantity of the motors.

    - ``quantity``: speed, acceleration, travel or torque; ``unit``.
    - ``low``, ``high`` (n_axes,): smallest and largest value, infinite without a limit. Travel counts from the start of
      the motion.
    - ``source``: of each axis: ``given`` by the user, stated by the robot's ``model``, or what the ``logs`` reach.
    """

    quantity: str
    unit: str
    low: Array
    high: Array
    source: tuple[Source, ...]

    def __str__(self) -> str:
        """The values with their source; axes of the same source stand together."""
        groups = [
            (source, [k for k, one in enumerate(self.source) if one == source])
            for source in dict.fromkeys(self.source)
        ]
        parts = [self._part(source, axes, len(groups) == 1) for source, axes in groups]
        return f"{self.quantity}: {'; '.join(parts)}"

    def _part(self, source: Source, axes: list[int], alone: bool) -> str:
        values = [self._value(k) for k in axes]
        # One value where all axes have the same.
        values = values[:1] if len(set(values)) == 1 else values
        free = bool(np.isinf(self.high[axes]).all())
        said = "no limit" if free else f"{', '.join(values)} {self.unit}"
        where = "" if alone else f"axis {', '.join(str(k + 1) for k in axes)}: "
        return f"{where}{said} ({_WORDS[source]})"

    def _value(self, axis: int) -> str:
        low, high = float(self.low[axis]), float(self.high[axis])
        return f"{high:.3g}" if low == -high else f"{low:.3g} to {high:.3g}"


@summarized
@dataclass(frozen=True, eq=False)
class Plan:
    """A motion, and how often to run it.

    - ``motion``: what moves, in words; ``axes`` (from 1) that move; ``repeats``: how often to run it.
    - ``references``: velocity references of the motors, from rest to rest; ``trajectory``: the same motion as positions
      of the joints.
    - ``times_shorter``: how many times as long the motion ``usual`` would have to be to tell as much, may be infinite.
    - ``limits``: what the motors may do in it, and where each limit comes from.
    """

    motion: str
    axes: tuple[int, ...]
    references: References
    trajectory: JointTrajectory
    repeats: int
    times_shorter: float
    usual: str = "A multisine on all axes"
    limits: tuple[MotionLimit, ...] = ()

    def __str__(self) -> str:
        """What moves, where and how long."""
        moved = ", ".join(str(a) for a in self.axes)
        where = f"axis {moved} alone" if len(self.axes) == 1 else f"axes {moved}"
        often = "" if self.repeats == 1 else f", {self.repeats} times"
        return f"{self.motion}, {where}, {self.references.period_s:g} s{often}"

    def beside_the_usual(self) -> str:
        """Return how the usual motion compares, in a sentence."""
        if self.times_shorter > _NEVER:
            return f"{self.usual} would not show it."
        if self.times_shorter < _AS_WELL:
            return f"{self.usual} is as good."
        return f"{self.usual} would need {self.times_shorter:.2g} times the time."

    def write(self, folder: Path | str, prefix: str = "") -> list[Path]:
        """Write references and trajectory into a folder, and return the paths."""
        parquet, csv, ros = motion_files(folder, prefix)
        write_references(self.references, parquet)
        return [parquet, *(write_joint_trajectory(self.trajectory, path) for path in (csv, ros))]


@summarized
@dataclass(frozen=True, eq=False)
class Experiment(ABC):
    """Motions that answer a question: `SeparatingExperiment`, `ShowingExperiment` or `RecordExperiment`."""

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
        """Write the motion and ``experiment.txt`` into a folder; return their paths.

        The motion stands in ``references.parquet`` as velocity references of the motors, and in ``trajectory.csv`` and
        ``trajectory.yaml`` (a ROS 2 JointTrajectory) as positions of the joints. Raises InputError where they cannot
        be written.
        """
        return [*self._write_motions(folder), self._write_text(folder)]

    def _write_motions(self, folder: Path | str) -> list[Path]:
        return self.plan.write(folder)

    def _write_text(self, folder: Path | str) -> Path:
        text = Path(folder) / _TEXT
        limits = [_LIMITS, *(f"- {limit}" for limit in self.plan.limits)]
        write_whole(text, "\n".join([str(self), *(limits if self.plan.limits else [])]) + "\n")
        return text


@summarized
@dataclass(frozen=True, eq=False)
class SeparatingExperiment(Experiment):
    """Motions that tell rivals apart.

    ``rivals``: labels ``effect@axis``, the named cause first; ``log_ratio``: log-likelihood ratio of the true rival to
    any other to expect, whichever is true, but for ``alike``: pairs of rivals that this motion does not tell apart.
    """

    rivals: tuple[str, ...]
    log_ratio: float
    alike: tuple[tuple[str, ...], ...] = ()

    @property
    def decides(self) -> bool:
        """Whether the wrong rivals would be seen to be wrong."""
        return self.log_ratio >= ENOUGH

    def __str__(self) -> str:
        """What to do and what it tells, in a sentence or two."""
        one, other = self._told()
        if not self.decides:
            return (
                f"No motion within the limits of speed, travel and torque tells {one} from {other}. "
                f"The best one tried ({_begun_small(self.plan)}) makes the true one "
                f"{np.exp(self.log_ratio):.2g} times as likely.{_within(self.plan)}"
            )
        still = "".join(
            f" It does not tell {listed([placed(x) for x in pair], 'from')}." for pair in self.alike
        )
        return (
            f"{self.plan}: tells {one} from {other}. The true one is then at least "
            f"{min(np.exp(self.log_ratio), 1e6):.2g} times as likely.{still} {self.plan.beside_the_usual()}"
        )

    def _told(self) -> tuple[str, str]:
        """Return the first rival that the motion tells from others, and these, in words."""
        pairs = [p for p in combinations(self.rivals, 2) if p not in self.alike]
        one = pairs[0][0]
        return placed(one), listed([placed(b) for a, b in pairs if a == one], "and")


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
                f"best one tried ({_begun_small(self.plan)}) it {larger}.{_within(self.plan)}"
            )
        named = "" if self.share >= NAMED else " It may be seen without being named."
        return (
            f"{self.plan}: shows {what} if it is there. The smallest size that would show with 95 % "
            f"probability is {100 / self.share:.0f} % of it.{named} {self.plan.beside_the_usual()}"
        )


@summarized
@dataclass(frozen=True, eq=False)
class RecordExperiment(Experiment):
    """A record with what a diagnosis needs if no hypothesis fits, or if its detection limits are too coarse.

    - ``plan``: a rich motion that is run several times. The differences between the runs are the noise.
    - ``slow``: triangles of position, which show friction in both directions over the whole travel.
    - ``loaded``: the rich motion with ``load``, which tells the torque's scale from masses.
    """

    slow: Plan
    loaded: Plan
    load: Load | None

    @property
    def decides(self) -> bool:
        """True: a record is worth running whatever it shows."""
        return True

    def __str__(self) -> str:
        """What to do and what it tells, in a few sentences."""
        parts = [
            f"A record of three motions. Repeat ({_begun_small(self.plan)}): what differs between the runs is noise.",
            f"Slow ({_begun_small(self.slow)}): friction in both directions.",
        ]
        if self.load is None:
            parts.append(
                f"Loaded ({_begun_small(self.loaded)}): fix a load that you have weighed. These limits of torque leave "
                f"room for a small one only."
            )
        else:
            x, y, z = self.load.centre_m
            parts.append(
                f"Loaded ({_begun_small(self.loaded)}): fix a load that you have weighed, near {self.load.mass_kg:.2g} "
                f"kg with its centre at ({x:.3g}, {y:.3g}, {z:.3g}) m of the last link. Diagnose this log by itself, "
                f"with --payload."
            )
        return " ".join(parts)

    def _write_motions(self, folder: Path | str) -> list[Path]:
        plans = zip(_RECORD, (self.plan, self.slow, self.loaded), strict=True)
        return [path for prefix, plan in plans for path in plan.write(folder, prefix)]


# Text of an experiment; prefixes of the three motions of a record, and all prefixes.
_TEXT = "experiment.txt"
_LIMITS = "Limits of the motors, with their source; nothing here knows obstacles, cables or the other links:"
_RECORD = ("repeat_", "slow_", "loaded_")


def motion_files(folder: Path | str, prefix: str = "") -> tuple[Path, Path, Path]:
    """Return what `Plan.write` writes: velocity references, joint positions as CSV, the same as a ROS message."""
    names = ("references.parquet", "trajectory.csv", "trajectory.yaml")
    first, second, third = (Path(folder) / f"{prefix}{name}" for name in names)
    return first, second, third


def experiment_files(folder: Path | str) -> list[Path]:
    """Return all files that `Experiment.write` may write into a folder."""
    motions = (path for prefix in ("", *_RECORD) for path in motion_files(folder, prefix))
    return [*motions, Path(folder) / _TEXT]


def _within(plan: Plan) -> str:
    """Return the limits of a motion that was not enough, as a sentence."""
    return f" Limits of the motors: {'; '.join(map(str, plan.limits))}." if plan.limits else ""


def _begun_small(plan: Plan) -> str:
    words = str(plan)
    return words[0].lower() + words[1:]

"""How an experiment is run and compared: what differs between closed loop, position targets and inverse dynamics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from axisight.excitation import References
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.separate.limits import Range
from axisight.gap.separate.waves import Motion
from axisight.gap.views.view import View
from axisight.paths import JointTrajectory, joint_trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Runs:
    """Simulated runs of a machine along motions, and which of them stay within the limits.

    ``records``: what the fitter of the route compares, for each motion; ``torques`` (n, n_axes) [Nm] of each;
    ``possible`` (n_motions,).
    """

    records: list[Any]
    torques: list[Array]
    possible: NDArray[np.bool_]


class Route(ABC):
    """A kind of comparison, as far as experiments are concerned.

    ``view``: the comparison of the logs; ``limits``: what the motors may do, from ``start_rad`` (n_axes,), the motors
    at the start of the experiment; ``step_s``: time between samples of a motion.
    """

    usual: ClassVar[str]
    """The motion that a designed one is compared with, in words."""
    offers_usual: ClassVar[bool]
    """Whether that motion may be the designed one, too."""
    hypotheses: ClassVar[tuple[int, ...]]
    """Numbers of hypotheses that one experiment tells apart: a larger one where no motion decides for the one before.

    Each pair of hypotheses costs two fits of every motion."""

    view: View
    limits: Range
    start_rad: Array
    step_s: float

    @abstractmethod
    def usual_motions(self) -> list[Motion]:
        """Return the motions that a user would record without a design."""

    @abstractmethod
    def motions(self, axes: Sequence[int]) -> list[Motion]:
        """Return the motions to try on ``axes`` (from 1)."""

    @abstractmethod
    def rich_motions(self) -> list[Motion]:
        """Return motions of all axes, of which one is to tell as much as possible about the whole arm."""

    @abstractmethod
    def slow_motion(self) -> Motion:
        """Return slow triangles of all axes."""

    def improved(self, best: Motion, round_of: int) -> list[Motion]:
        """Return motions like the best one so far; none if this kind of motion has no variants."""
        del best, round_of
        return []

    @abstractmethod
    def runs(self, machine: FittedModel, tried: Sequence[Motion]) -> Runs:
        """Return simulated runs of a machine along motions."""

    @abstractmethod
    def fitter(self, runs: Runs, which: Sequence[int], *, alone: bool) -> ModelFitter:
        """Return the fitter of the comparison for some of the runs.

        ``alone``: with the weights that the first of these runs gives beside the logs.
        """

    def begins_at(self, motion: Motion) -> Array:
        """Return the motors at the start of a motion (n_axes,) [rad]."""
        return self.start_rad if motion.start is None else motion.start

    def references(self, motion: Motion) -> References:
        """Return a motion as velocity references of the motors."""
        design = {"motion": motion.words, "seed": self.view.settings.seed}
        return References(self.step_s, motion.reference[None], design=design)

    def trajectory(self, motion: Motion) -> JointTrajectory:
        """Return a motion as positions of the joints."""
        begin = self.begins_at(motion)
        return joint_trajectory(self.references(motion), self.view.robot, begin)

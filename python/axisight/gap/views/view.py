"""What a way of comparing simulator and logs has to say; `axisight.gap.views.choice` chooses one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.compared_quantity import Compared
from axisight.gap.facts.result import Mode
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.hypotheses.candidates import all_candidates, situation
from axisight.gap.hypotheses.ripple_orders import Turning
from axisight.gap.prepare.currents import unknown_axes
from axisight.gap.search.state import SearchState
from axisight.gap.signals.noise import Floor
from axisight.gap.simulator.natural_sizes import NaturalSizes
from axisight.gap.simulator.own_parameters import absorbed, unknown_constants
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass
class View(ABC):
    """One way of comparing simulator and logs: what to fit, what error it leaves, what floor."""

    by_targets: ClassVar[bool] = False
    """Whether positions are compared under the same targets, not torques."""
    compared: ClassVar[Compared] = "torques"
    feels_steps: ClassVar[bool] = True
    """Whether steps of measured positions make the torque that is compared another one."""

    mode: Mode
    robot: Robot
    logs: list[Log]
    settings: Settings
    fitter: ModelFitter
    floor: Floor
    cutoff_hz: float | None = None
    """Of the low-pass on both sides; None where there is none."""
    shown: tuple[AlgebraicCause, ...] = ()
    """Causes that the logs show by themselves."""
    unfelt: tuple[AlgebraicCause, ...] = ()
    """The same that the torques that are compared do not feel."""
    not_offered: frozenset[str] = frozenset()
    """Labels of effects that the logs settle by themselves: no candidates."""

    @property
    def lowpass_hz(self) -> float | None:
        """Cutoff of the low-pass that both sides of a comparison pass [Hz]; None where neither is filtered."""
        return self.cutoff_hz

    def __post_init__(self) -> None:
        """Tell the fitter what is large on this robot."""
        self.fitter.natural = NaturalSizes(self.robot, self.logs)
        self.fitter.own += unknown_constants(self.robot, unknown_axes(self.logs))
        self._turned: Sequence[Sequence[Turning]] = ()

    def candidates(
        self, model: FittedModel, *, axes: Collection[int] | None = None
    ) -> list[Hypothesis]:
        """Return the candidates, with start values from the residual of a model.

        On ``axes`` (from 1), by default those where it leaves something worth a cause: of the logs that it
        was fitted to, or in closed loop of each as the others predict it. By inverse dynamics what filters smear
        around reversals is predicted badly, too.
        """
        enough = self.floor.expected + self.settings.smallest_gain
        # A square is more than less than nothing, and less than infinity.
        if axes is not None:
            enough = np.where(np.isin(self.robot.axis_numbers(), list(axes)), -1.0, np.inf)
        elif self.mode == "closed_loop":
            layout = layout_of(model)
            predicted = layout.by_axis(held_out_loss(model)) / layout.samples()
            enough = np.where(predicted > enough, -1.0, enough)
        at = situation(
            self.logs,
            model,
            self.fitter.weighting.decimation,
            self._weighted_response,
            enough,
            self._turned,
        )
        self._turned = at.turning
        found = all_candidates(
            self.robot,
            self.logs,
            at,
            inverse_dynamics=self.mode == "inverse_dynamics",
            by_targets=self.by_targets,
            threads=self.settings.threads,
        )
        none = self.not_offered | absorbed(self.robot, self.fitter.own)
        return [f for f in found if f.effect.label not in none]

    def _weighted_response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        weighting = self.fitter.weighting
        weight = np.interp(frequency_hz, weighting.frequency_hz, weighting.weight[axis])
        return np.asarray(weight * self.response(effect, axis, frequency_hz))

    def response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        """Return how an effect that repeats with the motor angle shows in the error of its axis.

        From its torque or angle to the torque error, (n_freq,); ``axis`` from 0. By default the effect
        is a torque that is missing as it is.
        """
        del effect, axis
        return np.ones(len(frequency_hz), dtype=np.complex128)

    def remarks(self) -> tuple[str, ...]:
        """Say what was done to the logs."""
        return ()

    @abstractmethod
    def measured(self, log: Log) -> Array:
        """Return the torque errors are taken from (n, n_axes) [Nm]."""

    @abstractmethod
    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the torque of a simulator on each log (n, n_axes) [Nm]."""

    def counted(self, log: Log) -> Array:
        """Return what the error of every sample of a log counts for (n, 1), of mean square one."""
        return np.ones((log.n_samples, 1))

    def errors(self, torques: Sequence[Array], logs: Sequence[Log]) -> list[Array]:
        """Return the errors of predicted torques on logs, each (n, n_axes) [Nm], as far as they count."""
        return [
            self.counted(log) * (torque - self.measured(log))
            for torque, log in zip(torques, logs, strict=True)
        ]

    def taken_off(self, log: Log, off_nm: Array) -> Array:
        """Return what the torque of a log is off the model's, as it is taken off others (n, n_axes) [Nm].

        ``off_nm``: the same as it is compared.
        """
        del log
        return off_nm

    def apart(self, logs: Sequence[Log], others: Sequence[Log]) -> Array:
        """Return how far motions that torques are predicted from lie apart (n_axes,) [1], zero where none are."""
        del logs, others
        return np.zeros(self.robot.n_axes)

    def run(self, variant: Variant, log: Log) -> tuple[Array, Array | None]:
        """Return torque [Nm] and motor position [rad] of a simulator on one log, (n, n_axes) each.

        The torque is that of `torques`; no position where the simulator takes the measured one.
        """
        return self.torques(variant, [log])[0], None

    @abstractmethod
    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the torque error of noise alone on each log (n, n_axes) [Nm].

        The noise of log ``i`` is that of run ``first_run + i``. ``variant``: the machine that it acts on,
        where it goes round a loop.
        """

    def left_open(self, logs: Sequence[Log]) -> list[Array] | None:
        """Return what a torque may differ by from the predicted one without anything missing, on each log.

        Standard deviation in every sample (n, n_axes) [Nm]. None where nothing is left open.
        """
        del logs
        return None

    def sensor_noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the same of the noise that the robot file states, whatever the logs have."""
        return self.noises(logs, first_run)

    def removed_there(self, found: SearchState, logs: Sequence[Log]) -> float | None:
        """Return the share of what weighted residuals have above noise on ``logs`` that the causes remove.

        None where it is not known: plain torques say little of what is small and slow.
        """
        del found, logs
        return None

    def followed(self, found: SearchState, logs: Sequence[Log]) -> float:
        """Return the share of the explainable error that causes remove on ``logs`` that they are kept on.

        1 where all of it is, 0 where nothing keeps a simulator on a log.
        """
        del found, logs
        return 0.0

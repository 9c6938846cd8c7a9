"""The interface of a comparison between simulator and machine; `axisight.gap.views.choice` chooses one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
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
from axisight.gap.simulator.gear_readings import gear_readings
from axisight.gap.simulator.natural_sizes import NaturalSizes
from axisight.gap.simulator.own_parameters import absorbed, unknown_constants
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass
class View(ABC):
    """A comparison between simulator and machine: its fitter, its error and its floor."""

    by_targets: ClassVar[bool] = False
    """Whether positions are compared under the same targets, not torques."""
    compared: ClassVar[Compared] = "torques"
    feels_steps: ClassVar[bool] = True
    """Whether steps of measured positions change the compared torque."""

    mode: Mode
    robot: Robot
    logs: list[Log]
    settings: Settings
    fitter: ModelFitter
    floor: Floor
    cutoff_hz: float | None = None
    """Cutoff of the low-pass on both sides [Hz]; None without one."""
    shown: tuple[AlgebraicCause, ...] = ()
    """Causes that the logs show without a fit."""
    unfelt: tuple[AlgebraicCause, ...] = ()
    """Causes that the logs show without a fit, and that do not change the compared torque."""
    not_offered: frozenset[str] = frozenset()
    """Labels of effects that the logs decide without a fit; they are no candidates."""
    silent: tuple[int, ...] = ()
    """Axes (from 0) whose torque carries nothing: they have no error, no candidates and no verdict."""

    @property
    def lowpass_hz(self) -> float | None:
        """Cutoff of the low-pass on both sides of the comparison [Hz]; None without one."""
        return self.cutoff_hz

    def __post_init__(self) -> None:
        """Give the fitter the natural sizes of effects, the readings of gears and the unknown torque constants."""
        self._sizes = NaturalSizes(self.robot, self.logs)
        self.fitter.natural = self._sizes
        if self.mode == "closed_loop":
            self.fitter.gears = gear_readings(self.robot, self.logs, self.settings.model_error)
        self.fitter.own += unknown_constants(self.robot, unknown_axes(self.logs))
        self._turned: Sequence[Sequence[Turning]] = ()

    def candidates(
        self, model: FittedModel, *, axes: Collection[int] | None = None
    ) -> list[Hypothesis]:
        """Return the candidates, with start values from the residual of a model.

        They act on ``axes`` (from 1); by default on axes whose residual leaves room for a cause. That is the
        residual of the fitted logs, or in closed loop also of each log predicted from the others. Inverse
        dynamics does not use the latter: it predicts badly what filters smear around reversals.
        """
        enough = self.floor.expected + self.settings.smallest_gain
        # Limits that all axes exceed (-1), or none (infinity).
        if axes is not None:
            enough = np.where(np.isin(self.robot.axis_numbers(), list(axes)), -1.0, np.inf)
        elif self.mode == "closed_loop":
            layout = layout_of(model)
            predicted = layout.by_axis(held_out_loss(model)) / layout.samples()
            enough = np.where(predicted > enough, -1.0, enough)
        enough[list(self.silent)] = np.inf
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
        return [
            replace(f, largest=self._sizes.largest(f.effect))
            for f in found
            if f.effect.label not in none
        ]

    def _weighted_response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        weighting = self.fitter.weighting
        weight = np.interp(frequency_hz, weighting.frequency_hz, weighting.weight[axis])
        return np.asarray(weight * self.response(effect, axis, frequency_hz))

    def response(self, effect: str, axis: int, frequency_hz: Array) -> Complex:
        """Return the response of an axis' torque error (n_freq,) to an effect that is periodic in the motor angle.

        The input is the torque or angle of the effect; ``axis`` from 0. By default the effect is a missing
        torque that shows unchanged.
        """
        del effect, axis
        return np.ones(len(frequency_hz), dtype=np.complex128)

    def remarks(self) -> tuple[str, ...]:
        """Return sentences about the treatment of the logs."""
        return ()

    @abstractmethod
    def measured(self, log: Log) -> Array:
        """Return the torque from which errors are taken (n, n_axes) [Nm]."""

    @abstractmethod
    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the torque of a simulator on each log (n, n_axes) [Nm]."""

    def counted(self, log: Log) -> Array:
        """Return the weight of the error of each sample of a log (n, 1), with mean square one."""
        return np.ones((log.n_samples, 1))

    def errors(self, torques: Sequence[Array], logs: Sequence[Log]) -> list[Array]:
        """Return the weighted errors of predicted torques on logs, (n, n_axes) [Nm] each; zero on silent axes."""
        judged = np.ones(self.robot.n_axes)
        judged[list(self.silent)] = 0.0
        return [
            judged * self.counted(log) * (torque - self.measured(log))
            for torque, log in zip(torques, logs, strict=True)
        ]

    def taken_off(self, log: Log, off_nm: Array) -> Array:
        """Return measured minus predicted torque of a log (n, n_axes) [Nm], to be subtracted from other logs.

        ``off_nm``: the same difference as compared.
        """
        del log
        return off_nm

    def apart(self, logs: Sequence[Log], others: Sequence[Log]) -> Array:
        """Return the relative difference between the motions of two sets of logs (n_axes,) [1].

        Zero if torques are not predicted from measured motions.
        """
        del logs, others
        return np.zeros(self.robot.n_axes)

    def run(self, variant: Variant, log: Log) -> tuple[Array, Array | None]:
        """Return torque [Nm] and motor position [rad] of a simulator on one log, (n, n_axes) each.

        The torque is as in `torques`. The position is None if the simulator uses the measured one.
        """
        return self.torques(variant, [log])[0], None

    @abstractmethod
    def noises(
        self, logs: Sequence[Log], first_run: int, variant: Variant = AS_GIVEN
    ) -> list[Array]:
        """Return the torque error that noise alone causes on each log (n, n_axes) [Nm].

        Log ``i`` has the noise of run ``first_run + i``. ``variant``: the machine in whose loop the noise acts.
        """

    def left_open(self, logs: Sequence[Log]) -> list[Array] | None:
        """Return the scatter of a torque that needs no cause, for each log; None if nothing is left open.

        Standard deviation of each sample (n, n_axes) [Nm]: a torque may differ by it although no effect is
        missing.
        """
        del logs
        return None

    def sensor_noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the torque error of the noise that the robot file states, for each log (n, n_axes) [Nm]."""
        return self.noises(logs, first_run)

    def removed_there(self, found: SearchState, logs: Sequence[Log]) -> float | None:
        """Return the share of the weighted residuals above noise on ``logs`` that the causes remove.

        None if it is unknown: plain torques show little of small and slow effects.
        """
        del found, logs
        return None

    def followed(self, found: SearchState, logs: Sequence[Log]) -> float:
        """Return the share of the explainable error that causes remove in a simulator kept on ``logs``.

        1 if they remove all of it, 0 for a comparison without such a simulator.
        """
        del found, logs
        return 0.0

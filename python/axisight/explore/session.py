"""Numbers of the explorer for one log and one set of causes: curves, residual, gap. No page code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.explore.choices import in_bounds
from axisight.explore.measured import measured_gains
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant, combine
from axisight.gap.intake.prepared_logs import behind_gate
from axisight.gap.measure.gap_figures import stage
from axisight.gap.measure.where import BAND_EDGES_HZ
from axisight.gap.prepare.currents import unknown_axes
from axisight.gap.simulator.own_parameters import nominal_values, with_values
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.report.wording import filter_words
from axisight.robot import Robot

Array = NDArray[np.float64]

# Most cached runs: enough for pins and the last few steps.
_KEPT = 24


@dataclass(frozen=True)
class Version:
    """A simulator version: effects of the machine and parameter values [SI].

    ``effects`` come on top of the robot's own; they replace own effects of the same name and axis.
    """

    effects: tuple[Effect, ...] = ()
    robot_values: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, effects: Sequence[Effect], values: Mapping[str, float] | None = None) -> Version:
        """Return the version with these effects, each clipped to the bounds of the table."""
        return cls(tuple(map(in_bounds, effects)), tuple(sorted((values or {}).items())))

    def variant(self) -> Variant:
        """Return the version as an argument of simulations."""
        return Variant(dict(self.robot_values), self.effects)


AS_GIVEN = Version()


@dataclass(frozen=True)
class Seen:
    """A simulator on one log; torques (n, n_axes) [Nm, N on a prismatic axis], motor side.

    - ``residual``: simulated minus measured torque.
    - ``position_rad``: simulated motor position (n, n_axes) [rad, m]; None if the simulator takes the
      measured one.
    - ``gap`` (n_axes,): rms of the residual over the standard deviation of the measured torque [1]; NaN on axes that
      are not judged.
    - ``bands`` (n_axes, n_bands): the gap in each of `Session.bands`; the squares sum to that of the gap.
    - ``broken_at_s``: time at which the simulation broke off, with NaN from there on; None for a whole run.
    """

    measured: Array
    simulated: Array
    residual: Array
    position_rad: Array | None
    gap: Array
    bands: Array
    broken_at_s: float | None


class Session:
    """A robot and its logs, to be simulated with any causes, one log at a time.

    Logs are compared as `axisight.diagnose` compares them: the gap of `AS_GIVEN` over the validation logs
    equals ``gap.before_per_axis``.
    """

    def __init__(
        self,
        name: str,
        robot: Robot,
        estimation: Sequence[Log],
        validation: Sequence[Log],
        settings: Settings | None = None,
        simulated: Sequence[Log] = (),
    ) -> None:
        """Prepare what does not change; raises as `axisight.diagnose` does for refused logs and robots.

        ``simulated``: logs of the user's own simulator, which are then compared instead. Raises InputError
        for logs with currents of unknown scale.
        """
        self.name, self.given = name, robot
        self.estimation, self.validation = tuple(estimation), tuple(validation)
        self.settings = settings or Settings()
        if unknown_axes([*estimation, *validation]):
            raise InputError(
                'explore: expected torques, got currents of scale = "unknown": their constant is found by '
                "`axisight diagnose`, and is a scale in the column map then"
            )
        inputs = behind_gate(robot, estimation, validation, self.settings.despite, simulated)
        self.view: View
        inputs, self.view = inputs.compared(self.settings)
        self.robot = inputs.robot
        self.logs: tuple[Log, ...] = (*inputs.estimation, *inputs.validation)
        self.roles = ("estimation",) * len(estimation) + ("validation",) * len(validation)
        self._held = list(inputs.validation)
        self._measured: dict[int, Array] = {}
        self._counts: dict[int, NDArray[np.bool_]] = {}
        self._seen: Callable[[int, Version], Seen] = lru_cache(_KEPT)(self._simulate)

    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
        return self.robot.n_axes

    def largest_gap(self) -> tuple[int, int]:
        """Return the validation log and the axis (both from 0) with the largest gap as given.

        The axis has the largest gap above the floor over all validation logs, of those that are judged. A
        simulation that broke off counts as the largest gap.
        """
        above = np.nan_to_num(self.held_given**2 - self.held_floor**2, nan=np.inf)
        above[list(self.view.silent)] = -np.inf
        axis = int(np.argmax(above))
        first = len(self.logs) - len(self._held)
        gaps = [self.see(first + i).gap[axis] for i in range(len(self._held))]
        return first + int(np.argmax(np.nan_to_num(gaps, nan=np.inf))), axis

    def counts(self, log: int) -> NDArray[np.bool_]:
        """Return which samples of a log (by number) count in the gap (n,): all but filter transients."""
        if log not in self._counts:
            self._counts[log] = self.view.counted(self.logs[log])[:, 0] > 0
        return self._counts[log]

    @property
    def filter_words(self) -> str:
        """Name of the filter that measured and simulated torque passed."""
        return filter_words(self.view.compared, self.view.lowpass_hz)

    @property
    def bands(self) -> list[tuple[float, float]]:
        """Frequency bands [Hz] of `Seen.bands`, the same as in a diagnosis."""
        nyquist = 0.5 / self.logs[0].sample_time_s
        return list(pairwise([*(e for e in BAND_EDGES_HZ if e < nyquist), nyquist]))

    def measured(self, log: int) -> Array:
        """Return the measured torque with which a log (by number) is compared, (n, n_axes) [Nm]."""
        if log not in self._measured:
            self._measured[log] = self.view.measured(self.logs[log])
        return self._measured[log]

    def check(self, version: Version) -> None:
        """Raise InputError for effects or values that the robot cannot have."""
        own = {e.label: e for e in (*self.robot.effects, *version.effects)}
        changed = with_values(self.robot, dict(version.robot_values))
        changed.with_effects({e.label: e for e in (*changed.effects, *own.values())}.values())

    def see(self, log: int, version: Version = AS_GIVEN) -> Seen:
        """Return a simulator on one log (by number); a cached result is the same object.

        Raises InputError as `check` does.
        """
        return self._seen(log, version)

    def _simulate(self, log: int, version: Version) -> Seen:
        # Effects that the robot cannot have must fail before any simulation.
        self.check(version)
        simulated, position = self.view.run(version.variant(), self.logs[log])
        measured = self.measured(log)
        residual = simulated - measured
        item = self.logs[log]
        known = np.isfinite(residual).all(axis=1)
        broken = None if known.all() else float(item.time_s[int(np.argmin(known))])
        counted = self.view.counted(item) * residual
        gap = self._gap([item], [counted], [measured])
        variance = np.maximum(np.var(item.torque_nm, axis=0), 1e-300)
        bands = self._by_band(counted, variance, item.sample_time_s)
        bands[list(self.view.silent)] = np.nan
        return Seen(measured, simulated, residual, position, gap, bands, broken)

    def held_gap(self, version: Version = AS_GIVEN) -> Array:
        """Return the gap per axis over all validation logs (n_axes,) [1]."""
        torques = self.view.torques(version.variant(), self._held)
        errors = self.view.errors(torques, self._held)
        return self._gap(self._held, errors, self._held_measured())

    @cached_property
    def held_floor(self) -> Array:
        """Return the gap per axis that noise alone causes over all validation logs (n_axes,) [1]."""
        noise = self.view.noises(self._held, len(self.view.logs))
        return self._gap(self._held, noise, self._held_measured())

    @cached_property
    def held_given(self) -> Array:
        """Return `held_gap` of the simulator as given (n_axes,) [1]."""
        return self.held_gap()

    @cached_property
    def measured_gains(self) -> tuple[Array, Array] | None:
        """Measured frequencies and gains from motor torques to motor angles, of all logs; None if unknown."""
        return measured_gains(self.logs)

    def _held_measured(self) -> list[Array]:
        first = len(self.logs) - len(self._held)
        return [self.measured(first + i) for i in range(len(self._held))]

    def _gap(self, logs: list[Log], errors: list[Array], measured: list[Array]) -> Array:
        with np.errstate(invalid="ignore"):
            found = stage(logs, errors, self.settings.block_s, measured, self.view.silent)
        return combine(found.per_log())

    def _by_band(self, residual: Array, variance: Array, sample_time_s: float) -> Array:
        if not np.isfinite(residual).all():
            return np.full((self.n_axes, len(self.bands)), np.nan)
        lines = dct(residual, axis=0, norm="ortho") ** 2 / len(residual) / variance
        frequency_hz = np.arange(len(residual)) * 0.5 / sample_time_s / len(residual)
        at = np.digitize(frequency_hz, [low for low, _ in self.bands]) - 1
        squares = [lines[at == b].sum(axis=0) for b in range(len(self.bands))]
        return np.asarray(np.sqrt(np.transpose(squares)))

    def known_parameters(self, relative: Mapping[str, float]) -> dict[str, float]:
        """Return parameters [SI] from their relative changes [1], as a verdict's ``refit`` states them.

        Raises InputError for a parameter that the robot does not have.
        """
        own = nominal_values(self.robot)
        unknown = sorted(set(relative) - set(own))
        if unknown:
            raise InputError(f"refit: expected parameters of this robot, got {unknown[0]!r}")
        return {n: own[n] + change * (abs(own[n]) or 1.0) for n, change in relative.items()}

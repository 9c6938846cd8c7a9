"""Puts torques on the clock of the motion, where those of a rigid arm are compared by inverse dynamics.

A command is held from one sample to the next: on average it acts half a sample later than it is logged. A measured
torque may be logged late. By inverse dynamics a shift s acts like viscous friction, of about -w^2 M s for an inertia M
at an angular frequency w. Unlike friction it follows the rate of the torque, and is the same on all axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.gate.by_dynamics.inverse_checks import thinned
from axisight.gap.gate.by_dynamics.small_errors import MOST_S
from axisight.gap.gate.by_dynamics.torque_fit import ALIKE, PARTS, SIGNIFICANT, nuisance
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.logs import Log
from axisight.logs.quality import is_constant
from axisight.robot import Robot

Array = NDArray[np.float64]

# Range of the time [samples] by which a held command acts later than it is logged. A drive's delay is another one. Late
# torques count from the same part of a sample.
_SAMPLES = (0.3, 0.7)


@dataclass(frozen=True)
class TorqueClock:
    """How much later torques act than they are logged [s], on all axes; negative if they are logged late.

    ``sample_time_s`` of the logs [s].
    """

    acts_later_s: float
    sample_time_s: float

    @property
    def samples(self) -> float:
        """The shift in samples."""
        return self.acts_later_s / self.sample_time_s

    def says(self) -> str:
        """Return the sentence for the checks of a verdict."""
        size = f"{abs(1e3 * self.acts_later_s):.3g} ms ({abs(self.samples):.2g} samples)"
        if self.acts_later_s < 0:
            said = f"torques are logged {size} later than they act, as measured or filtered torques are"
        else:
            said = f"torques act {size} later than they are logged, as commands do that are held for a sample"
        return f"On all axes, {said}. They are compared where they act."


def torque_clock(robot: Robot, logs: Sequence[Log]) -> TorqueClock | None:
    """Return by how much the torques of a rigid arm act later than logged; None where no such time is seen.

    ``logs``: of one sample time. At least two axes must tell, and those that do must agree: on a single axis the
    time cannot be told from an effect that the simulator lacks.
    """
    rigid = all(robot.axis_is_rigid) and robot.n_axes > 1
    if not rigid or not all(log.has_torque for log in logs):
        return None
    step_s = logs[0].sample_time_s
    found, moved = TorqueClock(0.0, step_s), list(logs)
    more_s, last_s = _common_shift(robot, moved), np.inf
    # Friction of the regression takes a part of the shift. Each further estimate adds what the last one left.
    while more_s is not None and abs(more_s) < last_s:
        found, last_s = TorqueClock(found.acts_later_s + more_s, step_s), abs(more_s)
        moved = where_they_act(logs, found)
        more_s = _common_shift(robot, moved)
    least, most = (x * step_s for x in _SAMPLES)
    plausible = least <= found.acts_later_s <= most or -MOST_S <= found.acts_later_s <= -least
    return found if plausible else None


def where_they_act(logs: Sequence[Log], clock: TorqueClock) -> list[Log]:
    """Return the logs with the torques that act at each sample."""
    return [replace(log, torque_nm=_delayed(log.torque_nm, clock.samples)) for log in logs]


def _common_shift(robot: Robot, logs: Sequence[Log]) -> float | None:
    """Return the time by which torques act later [s]; None if it is not significant, or if axes disagree."""
    cells = np.array([cell for log in logs for cell in _cells(robot, log)])
    shifts = [_slope(cells[:, axis]) for axis in range(robot.n_axes)]
    own_s, error_s = (np.array(x) for x in zip(*shifts, strict=True))
    weight = np.where(error_s > 0.0, 1.0 / np.maximum(error_s, 1e-12) ** 2, 0.0)
    if not weight.any():
        return None
    later_s = float(weight @ own_s / weight.sum())
    if abs(later_s) < SIGNIFICANT / float(np.sqrt(weight.sum())):
        return None
    # An axis that tells needs half of the significance of all. An effect that the simulator lacks on some axes seems
    # to shift these axes alone.
    tell = (error_s > 0.0) & (abs(later_s) >= 0.5 * SIGNIFICANT * error_s)
    alike = (own_s / later_s > ALIKE[0]) & (own_s / later_s < ALIKE[1])
    return later_s if tell.sum() > 1 and alike[tell].all() else None


def _delayed(x: Array, samples: float) -> Array:
    """Return signals (n, n_axes) that come so many ``samples`` later, with the spectrum of their noise.

    A line between samples would take noise off the upper part of the band, from which the floor is estimated.
    Between its ends, joined by a line, a signal is continued as an odd one: values and rates have no jump there.
    """
    n = len(x)
    place = np.linspace(0.0, 1.0, n)[:, None]
    slope = x[-1] - x[0]
    odd = x - x[0] - slope * place
    periodic = np.concatenate([odd, -odd[-2:0:-1]])
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(periodic))[:, None] * samples)
    moved = np.fft.irfft(np.fft.rfft(periodic, axis=0) * turn, len(periodic), axis=0)[:n]
    return np.asarray(moved + x[0] + slope * (place - samples / (n - 1)))


def _cells(robot: Robot, log: Log) -> list[Array]:
    """Return product and energy of the torques' rate on what the simulator leaves, (n_axes, 2) for each part.

    Zero for a constant torque, of which only rounding would vary.
    """
    varies = [not is_constant(x) for x in log.torque_nm.T]
    sample_time_s, at = thinned(replace(log, torque_nm=log.torque_nm * varies))
    base = predict(robot, at)
    pairs = [_rate_and_left(at, base, axis, sample_time_s) for axis in range(robot.n_axes)]
    rates, lefts = (np.column_stack(x) for x in zip(*pairs, strict=True))
    parts = zip(np.array_split(rates, PARTS), np.array_split(lefts, PARTS), strict=True)
    return [np.column_stack([(c * x).sum(axis=0), (c * c).sum(axis=0)]) for c, x in parts]


def _rate_and_left(at: Motion, base: Array, axis: int, sample_time_s: float) -> tuple[Array, Array]:
    """Return the rate of an axis' torque, and what is left of it, over the torque's scatter, (n,) each.

    The torque is fitted by a share of the prediction, friction and an offset. The rate is that of the fitted torque:
    noise of the measured one would make the shift seem smaller.
    """
    torque = at[3][:, axis]
    basis, _ = np.linalg.qr(np.column_stack([base[:, axis], nuisance(at[1][:, axis])]))
    fitted = basis @ (basis.T @ torque)
    rate = np.gradient(fitted, sample_time_s)
    scale = max(float(torque.std()), 1e-300)
    return (rate - basis @ (basis.T @ rate)) / scale, (torque - fitted) / scale


def _slope(cells: Array) -> tuple[float, float]:
    """Return a shift and its standard error [s] from products and energies (..., 2), by their scatter."""
    product, energy = cells[..., 0], cells[..., 1]
    total = float(energy.sum())
    if not total > 0.0:
        return 0.0, 0.0
    slope = float(product.sum()) / total
    return slope, float(np.sqrt(((product - slope * energy) ** 2).sum())) / total

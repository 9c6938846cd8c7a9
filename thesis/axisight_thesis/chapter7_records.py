"""Simulated records of chapter 7 and the estimates from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.errors import ConvergenceError
from axisight.frf import right_divide
from axisight.simulation import simulate_batch
from axisight_thesis.chapter7_machine import REAL, Machine
from axisight_thesis.chapter7_setting import (
    PERIOD_S,
    WAITING_S,
    Design,
    references,
)
from axisight_thesis.context import Context

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Lines = NDArray[np.int64]

# A tolerance 2^10 times smaller changes no response by more than a millionth.
_TOLERANCE = 1e-5


@dataclass(frozen=True)
class Records:
    """Spectra of records, (realization, record, n_freq, channel, experiment).

    Commanded torque U [Nm] and motor acceleration Y [rad/s^2].
    """

    frequency_hz: Real
    input: Complex
    output: Complex

    def responses(self) -> Complex:
        """Return an estimate per record, (realization, record, n_freq, output, input)."""
        return right_divide(self.output, self.input)[0]

    def averaged(self) -> Complex:
        """Return estimates of the spectra averaged over records (3.53), (realization, ...)."""
        return right_divide(self.output.mean(axis=1), self.input.mean(axis=1))[0]


def periods(count: int) -> tuple[float, ...]:
    """Return the starts [s] of ``count`` records in a row after the waiting time."""
    return tuple(WAITING_S + k * PERIOD_S for k in range(count))


def records(
    context: Context,
    design: Design,
    realizations: Sequence[int] = (0,),
    starts_s: Sequence[float] = (WAITING_S,),
    machine: Machine = REAL,
) -> Records:
    """Return records of one period from each of ``starts_s`` [s], simulated once per context.

    Every entry of ``realizations`` stands for three separate experiments with the multisine of that
    number. The same number twice gives the same multisine with different noise. Raises
    ConvergenceError if a simulation does not complete.
    """
    key = ("chapter7", design, tuple(realizations), tuple(starts_s), machine)
    return context.shared(key, lambda: _simulate(context, design, realizations, starts_s, machine))


def _simulate(
    context: Context,
    design: Design,
    realizations: Sequence[int],
    starts_s: Sequence[float],
    machine: Machine,
) -> Records:
    robot = context.robot
    n = round(PERIOD_S / robot.sample_time_s)
    starts = [round(s / robot.sample_time_s) for s in starts_s]
    # One sample more, the first of the next record.
    total = max(starts) + n + 1
    refs = np.concatenate([references(robot, design, context.seed, k) for k in realizations])
    simulated = simulate_batch(
        robot,
        np.tile(refs, (1, -(-total // n), 1))[:, :total],
        effects=machine.effects(robot),
        noise_seed=context.seed if machine.noise else None,
        tolerance=_TOLERANCE,
        threads=context.threads,
    )
    failed = [str(s) for s in simulated["status"].values if s != "completed"]
    if failed:
        raise ConvergenceError(f"chapter 7: {len(failed)} simulations ended as {failed[0]}")
    u, x = simulated["torque_cmd_nm"].values, simulated["position_rad"].values
    torque = np.stack([u[:, s : s + n] for s in starts], axis=1)
    angle = np.stack([_without_drift(x[:, s : s + n + 1]) for s in starts], axis=1)
    lines = design.lines()
    frequency = lines / PERIOD_S
    iw = 2j * np.pi * frequency[:, None, None]
    return Records(frequency, _spectra(torque, lines), iw**2 * _spectra(angle, lines))


def _spectra(signal: Real, lines: Lines) -> Complex:
    """Return the lines of (3 realizations, record, sample, channel) as :class:`Records` has them."""
    at_lines = np.fft.rfft(signal, axis=2)[:, :, lines]
    by_realization = at_lines.reshape(-1, 3, *at_lines.shape[1:])
    return np.moveaxis(by_realization, 1, -1)


def _without_drift(position: Real) -> Real:
    """Return a record minus the straight line from its first sample to that of the next record.

    This removes the mean velocity, which the integral of the velocity's transform leaves out.
    """
    n = position.shape[1] - 1
    slope = (position[:, -1] - position[:, 0]) / n
    return np.asarray(position[:, :-1] - slope[:, None] * np.arange(n)[:, None])

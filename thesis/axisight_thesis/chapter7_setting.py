"""Excitations of section 7.1 and their variations in section 7.2."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight import excitation
from axisight.excitation import Multisine, PeriodicSignal, chirp, multisine, square
from axisight.robot import Robot
from axisight_thesis.chapter8_setting import clipped

Real = NDArray[np.float64]
Lines = NDArray[np.int64]

PERIOD_S = 5.0
FIRST_LINE, LAST_LINE = 5, 200  # 1 to 40 Hz
PEAK_RAD_S = 12.0
SQUARE_RAD_S = 14.0
SMOOTHING_SAMPLES = 40
WAITING_S = 5.0
"""Waiting time before the first record; transients are shorter (figure 7.2)."""
PERIODS = 4

# Split and share of the peak of the multisine with more power at low frequencies.
_LOW_LINE, _LOW_SHARE = 25, 0.6

Broadband = Literal["multisine", "odd", "low", "chirp", "centred chirp"]


@dataclass(frozen=True)
class Design:
    """References ``T r_bb + r_sq`` of three experiments (7.1), times ``scale``.

    ``broadband`` is the multisine (7.5) on all lines, on odd lines, or with 60 % of its peak
    below 5 Hz; or it is the chirp (5.4) from 40 to 1 Hz, or that chirp with the phase of zero mean.
    ``sinusoid_hz`` replaces it by one sinusoid. ``drift_rad_s`` is added on all axes.
    """

    broadband: Broadband = "multisine"
    directions: Literal["T1", "T2"] = "T1"
    square: bool = True
    scale: float = 1.0
    drift_rad_s: float = 0.0
    sinusoid_hz: float | None = None

    def lines(self) -> Lines:
        """Return the lines k of the broadband signal, at k / 5 s."""
        if self.sinusoid_hz is not None:
            return np.array([round(self.sinusoid_hz * PERIOD_S)])
        step = 2 if self.broadband == "odd" else 1
        return np.arange(FIRST_LINE, LAST_LINE + 1, step)


def references(robot: Robot, design: Design, seed: int, realization: int) -> Real:
    """Return one period of velocity references [rad/s], (experiment, sample, axis)."""
    step = robot.sample_time_s
    wave = square(
        PERIOD_S,
        step,
        amplitude=design.scale * SQUARE_RAD_S,
        smoothing_samples=SMOOTHING_SAMPLES,
    )
    return excitation.references(
        broadband(design, step, seed, realization).scaled(peak=design.scale * PEAK_RAD_S),
        robot.n_axes,
        directions=design.directions.lower(),
        square=wave if design.square else None,
        dc_level=design.drift_rad_s,
    ).period


def broadband(
    design: Design, step: float, seed: int, realization: int
) -> Multisine | PeriodicSignal:
    """Return the broadband signal of peak one, sampled at ``step`` [s].

    Phases of multisines are a function of (seed, realization).
    """
    if design.sinusoid_hz is not None:
        return multisine(PERIOD_S, step, lines=design.lines(), phases=[0.0])
    if design.broadband in ("chirp", "centred chirp"):
        down = LAST_LINE / PERIOD_S, FIRST_LINE / PERIOD_S
        start = 0.0
        if design.broadband == "centred chirp":
            ends = (
                chirp(PERIOD_S, step, band_hz=down, phase_rad=p).period for p in (0.0, np.pi / 2)
            )
            start = -float(np.arctan2(*(x.sum() for x in ends)))
        return chirp(PERIOD_S, step, band_hz=down, phase_rad=start)
    full = multisine(PERIOD_S, step, lines=design.lines(), seed=seed, run=realization)
    if design.broadband != "low":
        return clipped(full).scaled(peak=1.0)
    below = full.lines <= _LOW_LINE
    low, high = (
        clipped(_part(full, which)).scaled(peak=share)
        for which, share in ((below, _LOW_SHARE), (~below, 1 - _LOW_SHARE))
    )
    both = replace(
        full,
        amplitude=np.concatenate([low.amplitude, high.amplitude]),
        phase_rad=np.concatenate([low.phase_rad, high.phase_rad]),
    )
    return both.scaled(peak=1.0)


def _part(signal: Multisine, which: NDArray[np.bool_]) -> Multisine:
    """Return the multisine of some of the lines."""
    return replace(
        signal,
        lines=signal.lines[which],
        amplitude=signal.amplitude[which],
        phase_rad=signal.phase_rad[which],
    )

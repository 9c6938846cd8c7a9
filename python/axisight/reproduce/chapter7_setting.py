"""Excitations of section 7.1 and their variations in section 7.2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.reproduce._multisine import clipped_multisine
from axisight.reproduce.chapter8_setting import DIRECTIONS
from axisight.robot import Robot

Real = NDArray[np.float64]
Lines = NDArray[np.int64]

PERIOD_S = 5.0
FIRST_LINE, LAST_LINE = 5, 200  # 1 to 40 Hz
PEAK_RAD_S = 12.0
SQUARE_RAD_S = 14.0
SMOOTHING_SAMPLES = 40
WAITING_S = 5.0
"""Before the first record; transients take less (figure 7.2)."""
PERIODS = 4

# Split and share of the peak of the multisine with more power at low frequencies.
_LOW_LINE, _LOW_SHARE = 25, 0.6

Broadband = Literal["multisine", "odd", "low", "chirp", "centred chirp"]


@dataclass(frozen=True)
class Design:
    """References ``T r_bb + r_sq`` of three experiments (7.1), times ``scale``.

    ``broadband`` is the multisine (7.5) on all lines, on odd lines, or with 60 % of its peak
    below 5 Hz; the chirp (5.4) from 40 to 1 Hz, or that chirp with the phase that leaves no
    mean. ``sinusoid_hz`` puts one sinusoid in its place. ``drift_rad_s`` is added on all axes.
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
    n = period_samples(robot)
    wave = broadband(design, n, seed, realization)
    out = PEAK_RAD_S * np.einsum("ie,t->eti", DIRECTIONS[design.directions], wave)
    if design.square:
        out = out + SQUARE_RAD_S * smoothed_square(n)[None, :, None]
    return np.asarray(design.scale * out + design.drift_rad_s)


def period_samples(robot: Robot) -> int:
    """Return the samples of a period."""
    return round(PERIOD_S / robot.sample_time_s)


def broadband(design: Design, n: int, seed: int, realization: int) -> Real:
    """Return one period (n,) of the broadband signal, largest sample one.

    Phases of multisines are a function of (seed, realization).
    """
    phase = 2 * np.pi * np.arange(n) / n  # one turn per period
    if design.sinusoid_hz is not None:
        return np.asarray(np.sin(design.lines()[0] * phase))
    if design.broadband in ("chirp", "centred chirp"):
        turns = LAST_LINE * phase + (FIRST_LINE - LAST_LINE) * phase**2 / (4 * np.pi)
        start = 0.0
        if design.broadband == "centred chirp":
            start = -np.arctan2(np.sin(turns).sum(), np.cos(turns).sum())
        return np.asarray(np.sin(turns + start))
    rng = np.random.default_rng([seed, 7, realization])
    if design.broadband != "low":
        return clipped_multisine(design.lines(), n, rng)
    lines = design.lines()
    low = clipped_multisine(lines[lines <= _LOW_LINE], n, rng)
    high = clipped_multisine(lines[lines > _LOW_LINE], n, rng)
    both = _LOW_SHARE * low + (1 - _LOW_SHARE) * high
    return np.asarray(both / np.abs(both).max())


def smoothed_square(n: int) -> Real:
    """Return one period (n,) of the square wave of (7.3), of amplitude one."""
    reach = SMOOTHING_SAMPLES
    level = np.where(np.arange(n) < n // 2, 1.0, -1.0)
    weights = (reach + 1 - np.abs(np.arange(-reach, reach + 1))) / (reach + 1) ** 2
    return np.convolve(np.pad(level, reach, mode="wrap"), weights, mode="valid")

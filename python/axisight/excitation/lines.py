"""Excited lines of a band, and lines left free to detect distortion."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from axisight.arguments import Lines, one_of, seed_of, whole
from axisight.errors import InputError
from axisight.excitation.checks import band_of, whole_samples

Grid = Literal["full", "odd", "odd_odd", "odd_random"]


def line_set(
    period_s: float,
    sample_time_s: float,
    *,
    band_hz: tuple[float, float],
    grid: Grid = "full",
    group: int = 4,
    seed: int = 0,
    run: int = 0,
) -> tuple[Lines, Lines]:
    """Return the excited lines and the detection lines of a band, as multiples of 1/period.

    Parameters
    ----------
    period_s : period [s], a whole number of samples.
    sample_time_s : sample time [s]; it sets the Nyquist frequency.
    band_hz : lowest and highest frequency [Hz]; both belong to the band.
    grid : ``"full"`` excites every line. ``"odd"`` keeps even distortion off the excited lines.
        ``"odd_odd"``, k = 1, 5, 9, ..., leaves odd lines free as well. ``"odd_random"`` leaves out
        one of every ``group`` successive odd lines at random.
    group, seed, run : for ``"odd_random"``; the choice is a function of (seed, run).

    Lines of the band that are not excited are detection lines. Even ones show even distortion,
    odd ones odd distortion (Pintelon and Schoukens 2012, section 4.3). Raises InputError for a
    period that is no whole number of samples, and for a band that is empty or reaches the Nyquist
    frequency.

    """
    n = whole_samples("period_s", period_s, sample_time_s)
    low, high = band_of("band_hz", band_hz)
    one_of("grid", grid, get_args(Grid))
    nyquist = 0.5 / sample_time_s
    if not low <= high < nyquist:
        raise InputError(
            f"band_hz: expected 0 < low <= high < {nyquist:g} Hz (Nyquist), got {low:g} to {high:g}"
        )
    near = 1e-9 * high * period_s
    first, last = np.ceil(low * period_s - near), np.floor(high * period_s + near)
    band = np.arange(max(first, 1), min(last, (n - 1) // 2) + 1, dtype=np.int64)
    if grid == "full":
        lines = band
    elif grid == "odd_odd":
        lines = band[band % 4 == 1]
    else:
        lines = band[band % 2 == 1]
    if grid == "odd_random":
        lines = _thinned(lines, whole("group", group, 2), seed, run)
    if not lines.size:
        raise InputError(
            f"band_hz: expected a band that holds lines of 1/{period_s:g} Hz ({grid}), "
            f"got {low:g} to {high:g}"
        )
    return lines, np.setdiff1d(band, lines)


def _thinned(odd: Lines, group: int, seed: int, run: int) -> Lines:
    """Return the lines without one random line of every full group."""
    rng = np.random.default_rng([seed_of("seed", seed), seed_of("run", run)])
    count = len(odd) // group
    left_out = np.arange(count) * group + rng.integers(0, group, count)
    return np.delete(odd, left_out)

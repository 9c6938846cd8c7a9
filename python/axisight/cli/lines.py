"""Excited lines from the options ``--band-hz`` and ``--period-s``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.cli.identify_common import band
from axisight.errors import InputError


def lines_of_band(band_hz: str | None, period_s: float | None) -> NDArray[np.int64] | None:
    """Return the lines of a band LOW,HIGH [Hz], None without one; raise InputError for other texts."""
    limits = band("--band-hz", band_hz)
    if limits is None:
        return None
    if period_s is None:
        raise InputError("--band-hz: expected --period-s SECONDS beside it, got none")
    low, high = (round(frequency * period_s) for frequency in limits)
    if not 1 <= low <= high:
        raise InputError(f"--band-hz: expected 0 < LOW <= HIGH, got {band_hz!r}")
    return np.arange(low, high + 1, dtype=np.int64)

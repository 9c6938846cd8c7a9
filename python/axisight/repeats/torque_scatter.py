"""Torque of repeats: scatter within and between days, the floor, and where along the motion the days differ."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from axisight.gap.measure.where import BAND_EDGES_HZ
from axisight.repeats.alignment import AlignedRuns
from axisight.repeats.motions import RunMotions
from axisight.statistics.curve_test import curve_test, independent_values
from axisight.statistics.one_way import OneWay

Array = NDArray[np.float64]
Whole = NDArray[np.intp]

# Speed above which an axis counts as fast, and below which it rests, as shares of its top speed.
_FAST, _RESTS = 0.5, 0.02
_QUARTERS = ("first quarter", "second quarter", "third quarter", "last quarter")


def torque_table(aligned: AlignedRuns, motions: RunMotions, day: Whole, level: float) -> xr.Dataset:
    """Return scatter, floor and test of the torque by axis.

    ``within_nm`` and ``between_nm`` are standard deviations (rms over the motion) of runs of one day and of
    day means. ``floor`` is the first as a share of the rms torque about its mean, with its interval
    ``floor_lower`` to ``floor_upper``; ``floor_any_day`` that of a model that does not know the day. ``p_value``
    belongs to the torque that :func:`run_motions` low-passes. ``day`` (n_runs,) numbers the days from 0.
    """
    raw = aligned.signal("torque_nm")
    units = ["Nm" if kind == "revolute" else "N" for kind in aligned.logs[0].axis_kinds]
    smooth = motions.torque
    rows = []
    for axis in range(raw.shape[2]):
        runs = OneWay(raw[:, :, axis], day)
        test = curve_test(OneWay(smooth[:, :, axis], day))
        between, within = runs.rms()
        size = max(float(raw[:, :, axis].std(axis=1).mean()), 1e-300)
        low, high = _bounds(runs, level)
        rows.append(
            {
                "within_nm": within,
                "between_nm": between,
                "torque_nm": size,
                "floor": within / size,
                "floor_lower": low * within / size,
                "floor_upper": high * within / size,
                "floor_any_day": float(np.hypot(within, between)) / size,
                "smooth_within_nm": test.within,
                "smooth_between_nm": test.between,
                "p_value": test.p_value,
            }
        )
    return xr.Dataset(
        {name: ("axis", [row[name] for row in rows]) for name in rows[0]},
        coords={"axis": np.arange(1, raw.shape[2] + 1), "unit": ("axis", units)},
    )


def _bounds(runs: OneWay, level: float) -> tuple[float, float]:
    """Return the interval of a standard deviation within groups, as factors of the estimate."""
    if runs.freedom[1] < 1:
        return float("nan"), float("nan")
    n = runs.freedom[1] * independent_values(runs)
    ends = scipy.special.chdtri(n, [0.5 * level, 1.0 - 0.5 * level])
    low, high = np.sqrt(n / ends)
    return float(low), float(high)


def place_table(aligned: AlignedRuns, motions: RunMotions, day: Whole) -> xr.Dataset:
    """Return the scatter within and between days by axis and place of the motion [Nm].

    Places are directions, speeds, quarters of the time (of the low-passed torque) and frequency bands (of the
    torque as logged).
    """
    places: dict[str, list[tuple[float, float]]] = {}
    for axis in range(motions.weight.shape[1]):
        runs = OneWay(motions.torque[:, :, axis], day)
        for name, mask in _masks(motions, axis):
            places.setdefault(name, []).append(_scatter(runs, mask))
        logged = OneWay(aligned.signal("torque_nm")[:, :, axis], day)
        for name, pair in _bands(logged, 1.0 / aligned.sample_time_s):
            places.setdefault(name, []).append(pair)
    values = np.array(list(places.values()))
    return xr.Dataset(
        {
            "within_nm": (("place", "axis"), values[..., 0], {"units": "Nm"}),
            "between_nm": (("place", "axis"), values[..., 1], {"units": "Nm"}),
        },
        coords={"place": list(places), "axis": np.arange(1, values.shape[1] + 1)},
    )


def _masks(motions: RunMotions, axis: int) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    speed = motions.runs[0].velocity_rad_s[:, axis]
    top = max(float(np.abs(speed).max()), 1e-300)
    yield "forward", speed > _RESTS * top
    yield "backward", speed < -_RESTS * top
    yield "slow", (np.abs(speed) > _RESTS * top) & (np.abs(speed) <= _FAST * top)
    yield "fast", np.abs(speed) > _FAST * top
    quarter = np.arange(len(speed)) * 4 // len(speed)
    for i, name in enumerate(_QUARTERS):
        yield name, quarter == i


def _scatter(runs: OneWay, mask: NDArray[np.bool_]) -> tuple[float, float]:
    """Return standard deviations within and between days, rms over the samples in ``mask``."""
    if not mask.any():
        return float("nan"), float("nan")
    between, within = OneWay(runs.values[:, mask], runs.group).rms()
    return within, between


def _bands(runs: OneWay, rate_hz: float) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield frequency bands with the standard deviations within and between days, by Parseval's theorem."""
    n = runs.values.shape[1]
    # Orthonormal, so that squares of the lines add up to those of the samples.
    lines = scipy.fft.dct(runs.values, axis=1, norm="ortho")
    frequency = np.arange(n) * rate_hz / (2 * n)
    edges = [e for e in BAND_EDGES_HZ if e < rate_hz / 2] + [rate_hz / 2]
    for low, high in pairwise(edges):
        mask = (frequency >= low) & (frequency < high)
        between, within = OneWay(lines[:, mask], runs.group).rms()
        share = float(np.sqrt(np.count_nonzero(mask) / n))
        yield f"{low:g}-{high:g} Hz", (within * share, between * share)

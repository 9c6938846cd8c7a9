"""Finds where the gap lies: by axis, frequency band and regime, each against the floor."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.fft import dct

from axisight.gap.facts.result import Where
from axisight.gap.facts.simulator_variant import relative_squares
from axisight.logs import Log, lowpass

Array = NDArray[np.float64]

# Edges of the frequency bands of the gap [Hz]: rigid motion, its harmonics, modes of the arm, of gears and of drives.
BAND_EDGES_HZ = (0.0, 0.5, 2.0, 6.0, 15.0, 40.0, 125.0)
# Smallest share of the gap for which an axis is reported.
_SMALLEST_SHARE = 0.1


@dataclass(frozen=True)
class ErrorLog:
    """Torque error of the re-fitted simulator along one log, and noise alone; (n, n_axes) [Nm]."""

    log: Log
    error: Array
    noise: Array


# Torque error, relative to the rms torque, from which it stands out above noise. Noise of an unexpected spectrum also
# exceeds the floor in some band, but not in the whole torque.
_SEEN = 0.02


def stands_out(logs: Sequence[ErrorLog]) -> bool:
    """Whether the unweighted torque error exceeds the noise on some axis."""
    error = np.mean([relative_squares(x.log, x.error).mean(axis=0) for x in logs], axis=0)
    noise = np.mean([relative_squares(x.log, x.noise).mean(axis=0) for x in logs], axis=0)
    return bool(np.any(error > 1.05 * noise + _SEEN**2))


def band_map(logs: Sequence[ErrorLog], block_s: float) -> xr.Dataset:
    """Return share, excess and significance by axis and frequency band.

    Spectra are cosine transforms of blocks. The excess of a block is its squared error in a band minus the mean noise.
    The scatter over blocks gives the significance.
    """
    rate = 1.0 / logs[0].log.sample_time_s
    edges = [e for e in BAND_EDGES_HZ if e < rate / 2] + [rate / 2]
    labels = [f"{a:g}-{b:g} Hz" for a, b in pairwise(edges)]
    # At least two seconds, so that the lowest band has frequency lines.
    length = int(max(block_s, 2.0) * rate)
    cells = [_spectra(item, length, edges, rate) for item in logs]
    error = np.concatenate([c[0] for c in cells])
    noise = np.concatenate([c[1] for c in cells])
    bounds = np.array([edges[:-1], edges[1:]])
    out = _summary(error, noise, labels, "band")
    return out.assign_coords(low_hz=("band", bounds[0]), high_hz=("band", bounds[1]))


def _spectra(
    item: ErrorLog, length: int, edges: Sequence[float], rate: float
) -> tuple[Array, Array]:
    """Return band powers (n_blocks, n_axes, n_bands) of error and noise, relative to the torque variance."""
    variance = np.maximum(np.var(item.log.torque_nm, axis=0), 1e-300)
    out = []
    for x in (item.error, item.noise):
        count = max(1, len(x) // length)
        powers = []
        for part in np.array_split(x, count):
            lines = dct(part, axis=0, norm="ortho") ** 2 / len(part) / variance
            f = np.arange(len(part)) * rate / 2 / len(part)
            place = np.digitize(f, edges) - 1
            powers.append([lines[place == b].sum(axis=0) for b in range(len(edges) - 1)])
        out.append(np.transpose(np.array(powers), (0, 2, 1)))
    return out[0], out[1]


def regime_maps(
    logs: Sequence[ErrorLog], bandwidth_hz: float, block_s: float
) -> dict[str, xr.Dataset]:
    """Return one map for each regime variable, by axis and bin."""
    prepared = [_prepared(item, bandwidth_hz) for item in logs]
    maps = {}
    for name, labels in _REGIMES.items():
        error = []
        noise = []
        edges = _edges(name, prepared)
        for p in prepared:
            e, n = _binned(p, name, edges, len(labels), block_s)
            error.append(e)
            noise.append(n)
        maps[name] = _summary(np.concatenate(error), np.concatenate(noise), labels, "bin")
    return maps


AT_REVERSALS = ("direction: around reversals", "speed: slow", "speed: standstill")
"""Regimes around a change of sign of the speed."""

_REGIMES: dict[str, list[str]] = {
    "speed": ["standstill", "slow", "medium", "fast"],
    "direction": ["backward", "around reversals", "forward"],
    "position": ["low", "middle", "high"],
    "acceleration": ["low", "medium", "high"],
    "load": ["low", "medium", "high"],
    "time": ["first third", "second third", "last third"],
}


@dataclass(frozen=True)
class _Prepared:
    squares: Array
    noise: Array
    speed: Array
    position: Array
    acceleration: Array
    load: Array
    time: Array
    sample_time_s: float


def _prepared(item: ErrorLog, bandwidth_hz: float) -> _Prepared:
    log = item.log
    step = max(1, int(1 / log.sample_time_s / (2 * bandwidth_hz)))
    cutoff = min(bandwidth_hz, 0.4 / log.sample_time_s)
    variance = np.maximum(np.var(log.torque_nm, axis=0), 1e-300)
    smooth = lowpass(log.position_rad, log.sample_time_s, min(20.0, cutoff))
    speed = np.gradient(smooth, log.sample_time_s, axis=0)
    acceleration = np.gradient(speed, log.sample_time_s, axis=0)
    return _Prepared(
        (lowpass(item.error, log.sample_time_s, cutoff) ** 2 / variance)[::step],
        (lowpass(item.noise, log.sample_time_s, cutoff) ** 2 / variance)[::step],
        speed[::step],
        smooth[::step],
        np.abs(acceleration)[::step],
        np.abs(lowpass(log.torque_nm, log.sample_time_s, min(20.0, cutoff)))[::step],
        log.time_s[::step],
        log.sample_time_s * step,
    )


def _edges(name: str, prepared: Sequence[_Prepared]) -> Array:
    """Return the inner edges of the bins by axis, (n_axes, n_edges)."""
    n_axes = prepared[0].squares.shape[1]
    if name == "speed":
        top = np.array([max(np.abs(p.speed[:, i]).max() for p in prepared) for i in range(n_axes)])
        return np.stack([0.01 * top, 0.15 * top, 0.5 * top], axis=1)
    if name in ("direction", "time"):
        return np.zeros((n_axes, 2))
    pooled = np.concatenate([getattr(p, name) for p in prepared])
    return np.asarray(np.quantile(pooled, [1 / 3, 2 / 3], axis=0).T)


def _place(p: _Prepared, name: str, edges: Array, axis: int) -> NDArray[np.int64]:
    if name == "speed":
        return np.asarray(np.digitize(np.abs(p.speed[:, axis]), edges[axis]))
    if name == "time":
        return np.asarray(np.minimum((3 * np.arange(len(p.time))) // max(len(p.time), 1), 2))
    if name == "direction":
        return _direction(p, axis)
    return np.asarray(np.digitize(getattr(p, name)[:, axis], edges[axis]))


def _direction(p: _Prepared, axis: int) -> NDArray[np.int64]:
    """Return, for each sample (n,), 0 backward, 1 within 50 ms of a change of sign, 2 forward."""
    speed = p.speed[:, axis]
    sign = np.where(speed > 0, 2, 0)
    changes = np.flatnonzero(np.diff(sign) != 0)
    reach = max(1, int(0.05 / p.sample_time_s))
    for c in changes:
        sign[max(0, c - reach) : c + reach + 1] = 1
    return sign


def _binned(
    p: _Prepared, name: str, edges: Array, n_bins: int, block_s: float
) -> tuple[Array, Array]:
    """Return mean squares of error and noise (n_blocks, n_axes, n_bins): sums in the bin over the block's length."""
    n, n_axes = p.squares.shape
    count = max(1, int(n * p.sample_time_s / block_s))
    blocks = np.array_split(np.arange(n), count)
    error = np.zeros((count, n_axes, n_bins))
    noise = np.zeros_like(error)
    for axis in range(n_axes):
        place = _place(p, name, edges, axis)
        for b, rows in enumerate(blocks):
            where = place[rows]
            for out, values in ((error, p.squares), (noise, p.noise)):
                sums = np.bincount(where, values[rows, axis], minlength=n_bins)[:n_bins]
                out[b, axis] = sums / len(rows)
    return error, noise


def _summary(error: Array, noise: Array, labels: list[str], dim: str) -> xr.Dataset:
    """Return share, excess and significance from mean squares of error and noise (n_blocks, n_axes, n_bins)."""
    excess = error - noise.mean(axis=0)
    mean = excess.mean(axis=0)
    # A single block has no scatter, so nothing is significant.
    standard_error = np.full_like(mean, np.inf)
    if len(excess) > 1:
        scatter = np.hypot(excess.std(axis=0, ddof=1), noise.std(axis=0, ddof=1))
        standard_error = scatter / np.sqrt(len(excess))
    positive = np.maximum(mean, 0.0)
    total = positive.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(total > 0, positive / total, 0.0)
        ratio = error.mean(axis=0) / noise.mean(axis=0)
        significance = np.where(standard_error > 0, mean / standard_error, 0.0)
    dims = ("axis", dim)
    return xr.Dataset(
        {
            "share": (dims, share),
            "excess": (dims, ratio),
            "significance": (dims, significance),
            "square": (dims, mean),
        },
        coords={"axis": np.arange(1, error.shape[1] + 1), dim: labels},
    )


OF_GAP = "of the squared gap above the floor"
"""The quantity of which shares are given, in words."""


def of_axes(bands: xr.Dataset, axes: Collection[int]) -> xr.Dataset:
    """Return the map of the bands with only the gap of some ``axes`` (from 1); that of the others is zero."""
    among = np.isin(bands["axis"].values, list(axes))
    return bands.assign(square=bands["square"] * xr.DataArray(among.astype(float), dims="axis"))


def findings(
    bands: xr.Dataset, regimes: dict[str, xr.Dataset], significance: float, of: str = OF_GAP
) -> tuple[Where, ...]:
    """Return the places that hold the gap, largest share first.

    An axis counts if its excess is significant. Its band is the shortest run of significant bands that holds at least
    70 % of it. Its regime is the bin whose share exceeds an even spread the most. ``of``: the quantity of which shares
    are given, in words.
    """
    held = _held(bands, significance)
    total = held.sum()
    out = []
    for i in range(len(held)):
        # Sums in another order may exceed the whole by rounding.
        share = min(float(held[i].sum() / total), 1.0) if total > 0 else 0.0
        if share >= _SMALLEST_SHARE:
            out.append(placed(bands, regimes, i, share, significance, of))
    return tuple(sorted(out, key=lambda w: -w.share))


# Ratio of weighted residuals from which an axis takes the lead over the axis with the largest plain error.
_BY_FAR = 3.0


def led_by_weight(
    places: Sequence[Where],
    bands: xr.Dataset,
    regimes: dict[str, xr.Dataset],
    significance: float,
    excess: Array,
    of: str = OF_GAP,
) -> tuple[Where, ...]:
    """Return the places led by the axis with the largest weighted residual above noise, if it is larger by far.

    Slow drifts dominate plain torque errors. They can hide an error that is small beside the torque but far above its
    noise. ``excess`` (n_axes,): mean square of the weighted residual above the floor, in units of the noise; ``of``:
    the quantity of which shares are given, in words.
    """
    i = int(np.argmax(excess))
    axis = int(bands["axis"].values[i])
    first = places[0].axis if places else None
    if first == axis or (first is not None and excess[i] < _BY_FAR * excess[first - 1]):
        return tuple(places)
    held = _held(bands, significance).sum(axis=1)
    if held[i] == 0:
        # The error is there, but in no band steadily.
        held[i] = np.maximum(bands["square"].values[i], 0.0).sum()
    shares = held / max(held.sum(), 1e-300)
    others = [k for k in np.argsort(-shares) if k != i and shares[k] >= _SMALLEST_SHARE]
    leader, *rest = (
        placed(bands, regimes, int(k), float(shares[k]), significance, of) for k in (i, *others)
    )
    told = ""
    if excess[i] >= _BY_FAR:
        told = f"; largest residual of all axes against noise, {excess[i]:.3g} times the floor"
    return (replace(leader, evidence=leader.evidence + told), *rest)


def placed(
    bands: xr.Dataset,
    regimes: dict[str, xr.Dataset],
    i: int,
    share: float,
    significance: float,
    of: str = OF_GAP,
) -> Where:
    """Return the place on axis ``i`` (from 0) of an error that holds ``share`` of the whole.

    Band and regime are None if none is significant: the error shows in a few stretches of time only.
    """
    axis = int(bands["axis"].values[i])
    regime, text = _main_regime(regimes, i, significance)
    held = _held(bands, significance)[i]
    told = f"{100 * share:.0f} % {of}"
    if not held.any():
        return Where(axis, share, None, regime, f"{told}, in no band steadily{text}")
    low, high = _main_band(held)
    band = (float(bands["low_hz"][low]), float(bands["high_hz"][high]))
    z = float(bands["significance"].values[i, low : high + 1].max())
    evidence = (
        f"{told}, {100 * held[low : high + 1].sum() / held.sum():.0f} % of that in "
        f"{band[0]:g}-{band[1]:g} Hz ({z:.0f} standard errors){text}"
    )
    return Where(axis, share, band, regime, evidence)


def _held(bands: xr.Dataset, significance: float) -> Array:
    """Return the squared error above the floor (n_axes, n_bands) where it is significant, else 0."""
    squares = np.maximum(bands["square"].values, 0.0)
    return np.where(bands["significance"].values > significance, squares, 0.0)


def _main_band(held: Array) -> tuple[int, int]:
    """Return the first and last band of the shortest run of bands with at least 70 % of the error."""
    n = len(held)
    for width in range(1, n + 1):
        sums = [held[k : k + width].sum() for k in range(n - width + 1)]
        best = int(np.argmax(sums))
        if sums[best] >= 0.7 * held.sum():
            return best, best + width - 1
    return 0, n - 1


def _main_regime(
    regimes: dict[str, xr.Dataset], axis: int, significance: float
) -> tuple[str | None, str]:
    best: tuple[float, str, str] | None = None
    for name, data in regimes.items():
        share = data["share"].values[axis]
        counts = np.where(data["significance"].values[axis] > significance, share, 0.0)
        k = int(np.argmax(counts))
        lift = counts[k] * len(share)
        if counts[k] > 0 and (best is None or lift > best[0]):
            label = str(data["bin"].values[k])
            best = (lift, f"{name}: {label}", f"; {100 * counts[k]:.0f} % at {name} '{label}'")
    if best is None or best[0] < 1.5:
        return None, ""
    return best[1], best[2]

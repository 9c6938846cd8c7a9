"""What is noise, what is distortion, and which lines are weak, by frequency band and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import Real, counted
from axisight.display.summary import summarized
from axisight.frf import Flag, confidence_radius, h1
from axisight.records import ArbitraryRecords, PeriodicRecords

_MOST_BANDS = 4
# Smallest ratio of the variances of distortion and noise at which one of them decides.
_DOMINATES = 2.0
# Relative standard deviation beyond which a response is worth a better experiment.
_POOR = 0.05
# Multiple coherence below which an output holds much that its inputs do not explain.
_LOW_COHERENCE = 0.9


@summarized
@dataclass(frozen=True, eq=False)
class Account:
    """Quality of a response.

    bands
        One row a frequency band: ``low_hz``, ``high_hz``, ``lines``; ``noise`` and ``distortion``, the median
        standard deviations of the diagonal elements relative to their magnitude [1]; ``off_diagonal``, the
        same of all other elements, both causes together; ``coherence``, the multiple coherence of the worst
        output, median over the lines [1]; ``weak``, the number of lines where the 95 % disc of an element of
        the diagonal contains zero; ``lost``, lines without an estimate. NaN is unknown.
    sentences
        The same in words, and what to do next.
    """

    bands: pd.DataFrame
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Setting:
    """What an estimate can show: whether distortion is seen, and whether realizations have the same phases."""

    distortion_seen: bool
    realizations: int
    same_phases: bool


def account_of(
    response: xr.Dataset, records: PeriodicRecords | ArbitraryRecords, setting: Setting
) -> Account:
    """Return the account of a response estimated from ``records``."""
    quality = _Quality.of(response, records, setting)
    return Account(quality.bands(), tuple(quality.sentences(setting)))


@dataclass(frozen=True)
class _Quality:
    """Relative standard deviations by (line, output, input), and the rest by line; NaN where unknown."""

    frequency_hz: Real
    axes: tuple[int, ...]
    noise: Real
    distortion: Real
    total: Real
    weak: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    coherence: Real

    @classmethod
    def of(
        cls, response: xr.Dataset, records: PeriodicRecords | ArbitraryRecords, setting: Setting
    ) -> _Quality:
        size = np.abs(response["response"].values)
        variance = response["variance"].values
        unknown = np.full(size.shape, np.nan)
        noise = response["noise_variance"].values if "noise_variance" in response else unknown
        distortion = np.maximum(variance - noise, 0.0) if setting.distortion_seen else unknown
        with np.errstate(invalid="ignore", divide="ignore"):
            noise, distortion, total = (
                np.asarray(np.sqrt(part) / size) for part in (noise, distortion, variance)
            )
        radius = confidence_radius(response).values
        lost = np.isin(response["flag"].values, (Flag.RANK_DEFICIENT, Flag.NO_EXCITATION))
        return cls(
            response["frequency_hz"].values,
            tuple(int(a) for a in response["input"].values),
            noise,
            distortion,
            total,
            np.asarray(radius >= size),
            lost,
            _coherence(response, records),
        )

    def bands(self) -> pd.DataFrame:
        """Return the table of `Account`."""
        low, high = self.frequency_hz[[0, -1]]
        count = max(1, min(_MOST_BANDS, round(math.log2(high / low)), len(self.frequency_hz)))
        edges = np.geomspace(low, high, count + 1)
        edges[-1] = np.inf
        band = np.searchsorted(edges, self.frequency_hz * (1 + 1e-12), side="right") - 1
        rows = [self._row(band == k) for k in range(count) if (band == k).any()]
        return pd.DataFrame(rows)

    def _row(self, at: NDArray[np.bool_]) -> dict[str, float]:
        diagonal = np.eye(len(self.axes), dtype=bool)
        return {
            "low_hz": float(self.frequency_hz[at][0]),
            "high_hz": float(self.frequency_hz[at][-1]),
            "lines": int(at.sum()),
            "noise": _median(self.noise[at][:, diagonal]),
            "distortion": _median(self.distortion[at][:, diagonal]),
            "off_diagonal": _median(self.total[at][:, ~diagonal]),
            "coherence": _worst(self.coherence[at]),
            "weak": int(self.weak[at][:, diagonal].any(axis=1).sum()),
            "lost": int(self.lost[at].sum()),
        }

    def sentences(self, setting: Setting) -> list[str]:
        """Return noise, distortion and weak lines in words, with what to do next."""
        return [*self._levels(setting), *self._weak(), *self._lost(), *self._unexplained()]

    def _levels(self, setting: Setting) -> list[str]:
        diagonal = np.eye(len(self.axes), dtype=bool)
        noise, total = (_median(x[:, diagonal]) for x in (self.noise, self.total))
        distortion = _median(self.distortion[:, diagonal])
        out = []
        if math.isnan(total):
            return [
                "variance unknown: one period of one realization shows none; record more periods, or use an "
                "unweighted criterion in 'identify elastic'"
            ]
        if not math.isnan(noise):
            out.append(f"noise: {_percent(noise)} of the response (median over lines, diagonal)")
        if not setting.distortion_seen:
            why = "all realizations have the same phases" if setting.same_phases else "it repeats"
            out.append(
                f"distortion: not seen ({why}); 'axisight excite --realizations 4' makes references that show "
                "it, --grid odd_random shows it in one realization"
            )
            return [*out, *_advice_on_noise(noise if not math.isnan(noise) else total)]
        if math.isnan(noise):
            out.append(f"noise and distortion together: {_percent(total)} of the response")
            return [*out, *_advice_on_noise(total)]
        out.append(f"distortion: {_percent(distortion)} of the response, in the estimate as given")
        if distortion**2 > _DOMINATES * noise**2:
            out.append(
                "distortion dominates: more periods do not help; more realizations, or a lower amplitude, do"
            )
        else:
            out += _advice_on_noise(noise)
        return out

    def _weak(self) -> list[str]:
        """Return a sentence for each output with lines where a disc contains zero, the most first."""
        counts = self.weak.sum(axis=0)
        total = int(self.weak.any(axis=(1, 2)).sum())
        if not total:
            return []
        o, i = np.unravel_index(int(np.argmax(counts)), counts.shape)
        at = self.frequency_hz[self.weak[:, o, i]]
        return [
            f"weak: at {counted(total, 'line')} of {len(self.frequency_hz)} the 95 % disc of an element contains "
            f"zero; most often motion of axis {self.axes[o]} by torque of axis {self.axes[i]} "
            f"({counted(int(counts[o, i]), 'line')}, {_span(at)}). A weighted fit gives them little weight; for "
            "more, raise the amplitude there"
        ]

    def _lost(self) -> list[str]:
        count = int(self.lost.sum())
        if not count:
            return []
        at = self.frequency_hz[self.lost]
        return [
            f"no estimate at {counted(count, 'line')}, {_span(at)}: the experiments do not excite all axes "
            "there; 'identify elastic' leaves them out"
        ]

    def _unexplained(self) -> list[str]:
        if np.isnan(self.coherence).all():
            return []
        median = np.nanmedian(self.coherence, axis=0)
        worst = int(np.argmin(median))
        low = self.coherence[:, worst] < _LOW_COHERENCE
        text = (
            f"coherence: median {median[worst]:.4f} on the worst output, axis {self.axes[worst]}; below "
            f"{_LOW_COHERENCE:g} at {counted(int(low.sum()), 'line')}"
        )
        return [text]


def _coherence(response: xr.Dataset, records: PeriodicRecords | ArbitraryRecords) -> Real:
    """Return the multiple coherence (line, output), of the response itself or of H1; NaN if unknown."""
    if "coherence" in response:
        return np.asarray(response["coherence"].values)
    shape = response["response"].shape[:2]
    if isinstance(records, PeriodicRecords):
        freedom = records.n_experiments * records.n_periods - records.n_inputs
        if records.n_experiments >= records.n_inputs and freedom > 0:
            return np.asarray(h1(records)["coherence"].values)
    return np.full(shape, np.nan)


def _advice_on_noise(level: float) -> list[str]:
    if not level > _POOR:
        return []
    return [
        f"noise is above {_percent(_POOR)}: record more periods (four times as many halve it), or raise the "
        "amplitude"
    ]


def _median(values: Real) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else math.nan


def _worst(coherence: Real) -> float:
    """Return the median over the lines of the output where it is lowest."""
    medians = [_median(column) for column in coherence.T]
    return float(np.nanmin(medians)) if np.isfinite(medians).any() else math.nan


def _span(frequency_hz: Real) -> str:
    low, high = f"{frequency_hz[0]:.3g}", f"{frequency_hz[-1]:.3g}"
    return f"{low} Hz" if low == high else f"{low} to {high} Hz"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.995 else f"{100 * share:.2g} %"

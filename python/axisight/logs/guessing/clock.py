"""Find the column of the time and its unit."""

from __future__ import annotations

import math

import numpy as np

from axisight.errors import LogError
from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.evidence import increases, time_units
from axisight.logs.guessing.families import of_quantity
from axisight.logs.guessing.series import Series
from axisight.logs.mean_rate import mean_rate_hz, whole_rate, without_holes_s
from axisight.logs.sources import Arrays
from axisight.logs.units import si_factor

_RATE_NAMES = {
    "fs",
    "fps",
    "samplerate",
    "samplingrate",
    "rate",
    "ratehz",
    "sampleratehz",
    "fsample",
}
# If two units make sense, the one whose rate is nearer to this typical rate wins.
_USUAL_HZ = 250.0


def take_time(draft: Draft, arrays: Arrays) -> None:
    """Put the time into a draft that has positions; raise LogError, listing the columns, if there is none."""
    draft.rate_name = _rate_name(arrays)
    rate = rate_of(arrays)
    found = _candidates(draft)
    if not found and rate is None:
        raise draft.refusal(
            "time: expected a column whose name says so and that increases, got none"
        )
    if not found:
        assert rate is not None
        draft.sample_time_s = 1.0 / rate
        draft.why["time"] = f"no column of time; {draft.rate_name} is the rate, {rate:g} Hz"
        return
    draft.time = _best(draft, found)
    unit, why = _unit(draft, draft.time, rate)
    draft.time_unit = unit
    steps = np.diff(draft.time.values) * si_factor(unit)
    # Of stamps that jitter, the mean is the step over which positions differ.
    draft.sample_time_s = without_holes_s(steps)
    draft.why["time"] = f"{why}: a sample every {draft.sample_time_s:.6g} s"
    if rate is not None and abs(draft.sample_time_s * rate - 1.0) > 0.01:
        draft.rate_name = None
    draft.resample = _irregular(draft, draft.time.values * si_factor(unit))


def rate_of(arrays: Arrays) -> float | None:
    """Return the sample rate that a scalar in the file states [Hz]; None if there is none."""
    name = _rate_name(arrays)
    return None if name is None else float(arrays[name].reshape(-1)[0])


def _rate_name(arrays: Arrays) -> str | None:
    for name, values in arrays.items():
        plain = "".join(c for c in name.lower() if c.isalpha())
        if plain in _RATE_NAMES and values.size == 1 and values.dtype.kind in "iuf":
            return name if float(values.reshape(-1)[0]) > 0.0 else None
    return None


def _candidates(draft: Draft) -> list[Series]:
    found = []
    for family in of_quantity(draft.families, "time"):
        for series in family.signals.values():
            if increases(series.values):
                found.append(series)
            else:
                draft.unused[series.label] = (
                    "called a time, but it does not increase with every sample"
                )
    return found


def _best(draft: Draft, found: list[Series]) -> Series:
    """Return the time column in the folder of the positions; raise LogError for several that differ."""
    beside = _folder(draft.signals("position")[0].name)
    if not all(_counts(one) for one in found):
        found = [one for one in found if not _counts(one)]
    near = [one for one in found if _folder(one.name) == beside] or found
    usable = [one for one in near if _has_unit(draft, one)] or near
    first = usable[0]
    step = float(np.median(np.diff(first.values)))
    for other in usable[1:]:
        if abs(float(np.median(np.diff(other.values))) / step - 1.0) > 1e-6:
            listed = ", ".join(one.label for one in usable)
            raise draft.refusal(f"time: expected one column that is the time, got {listed}")
    for other in found:
        if other is not first:
            draft.unused[other.label] = f"another time; {first.label} is taken"
    return first


def _counts(series: Series) -> bool:
    """Whether a time column only counts samples; it loses to any other time column."""
    return bool((np.diff(series.values) == 1.0).all())


def _folder(name: str) -> str:
    return name[: max(name.rfind("."), name.rfind("/")) + 1]


def _named_unit(draft: Draft, series: Series) -> str | None:
    for family in draft.families:
        if any(one is series for one in family.signals.values()):
            unit = family.meaning.unit
            return unit if unit in ("s", "ms", "us", "ns") else None
    return None


def _has_unit(draft: Draft, series: Series) -> bool:
    return bool(time_units(series.values)) or _named_unit(draft, series) is not None


def _unit(draft: Draft, series: Series, rate_hz: float | None) -> tuple[str, str]:
    """Return the unit of a time column and the reason; raise LogError if no unit gives a plausible rate."""
    step = float(np.median(np.diff(series.values)))
    named = _named_unit(draft, series)
    possible = time_units(series.values)
    if named is not None:
        if named not in possible:
            draft.doubts.append(
                f"time: {series.label} says {named}, which makes {1 / (step * si_factor(named)):.4g} Hz"
            )
        return named, f"its name says {named}"
    by_rate = [u for u in possible if rate_hz and abs(step * si_factor(u) * rate_hz - 1) < 0.01]
    if by_rate:
        return by_rate[0], f"{by_rate[0]}, as the file says {rate_hz:g} Hz"
    if not possible:
        raise draft.refusal(
            f"time: expected steps of a unit from s to ns, got steps of {step:.4g} in {series.label}"
        )
    rates = {u: 1.0 / (step * si_factor(u)) for u in possible}
    unit = min(rates, key=lambda u: abs(math.log(rates[u] / _USUAL_HZ)))
    if len(rates) > 1:
        others = ", ".join(f"{u} would be {hz:.4g} Hz" for u, hz in rates.items() if u != unit)
        draft.doubts.append(f"time: {unit} by {rates[unit]:.4g} Hz; {others}")
    return unit, f"steps of {step:.6g} are {unit}"


def _irregular(draft: Draft, time_s: np.ndarray[tuple[int], np.dtype[np.float64]]) -> bool:
    """Whether stamps must be resampled onto a grid; a hole in them becomes a doubt."""
    try:
        return mean_rate_hz(time_s, draft.path.name) is not None
    except LogError as error:
        draft.doubts.append(f"time: {error}")
        draft.bridge_hz = whole_rate(1.0 / draft.sample_time_s)
        return False

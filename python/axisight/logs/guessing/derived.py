"""Find positions and velocities without telling names: one column follows the derivative of another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.errors import InputError
from axisight.logs.filters import differentiate, lowpass
from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.evidence import increases, time_units
from axisight.logs.guessing.families import Axis, Family, of_quantity
from axisight.logs.guessing.names import Meaning
from axisight.logs.guessing.series import Series
from axisight.logs.log import Floats
from axisight.logs.units import si_factor

# A column is the derivative of another from this correlation on, below 20 Hz or a fifth of the sample rate.
_ALIKE, _BAND_HZ = 0.99, 20.0
# Of two candidates, one wins if its correlation is ten times nearer to 1 than that of the other.
_CLEARLY = 10.0
_MOST_COLUMNS, _MOST_SAMPLES = 64, 100_000
# Largest range of the steps of a time column without a name, as a share of the median step.
_EVEN = 0.1
_RATE_WITHOUT_TIME_HZ = 250.0


def name_by_derivatives(draft: Draft, rate_hz: float | None) -> None:
    """Mark nameless columns as positions and velocities by their derivatives, if no name says position.

    ``rate_hz``: the sample rate that the file states, None without one. A column stays nameless if its
    derivative correlates with no other column. Raises LogError if two columns are equally likely to be the
    position of one velocity.
    """
    if any(family.meaning.quantity == "position" for family in draft.families):
        return
    nameless = [f for f in draft.families if f.meaning.quantity == ""]
    time, step = _time(draft, nameless, rate_hz)
    signals = [s for f in nameless for s in f.signals.values() if s is not time and _moves(s)]
    signals.sort(key=lambda s: (draft.names.index(s.name), s.row or 0))
    if step is None or not 2 <= len(signals) <= _MOST_COLUMNS:
        return
    alike = _derivatives(signals, step)
    pairs = _pairs(draft, signals, alike)
    if not pairs:
        return
    positions: dict[Axis, Series] = {}
    velocities: dict[Axis, Series] = {}
    for p, v in pairs:
        label = signals[p].label
        positions[label] = signals[p]
        if v is not None:
            velocities[label] = signals[v]
            draft.doubts.append(
                f"position: {label}, for its derivative goes with {signals[v].label} (correlation "
                f"{alike[p, v]:.4f}); no name says so: proposed, check, an axis that slides would be in m"
            )
    named = {id(s) for s in (*positions.values(), *velocities.values(), time) if s is not None}
    draft.families = [
        family
        for family in draft.families
        if not any(id(one) in named for one in family.signals.values())
    ] + [
        Family(_meaning(""), {"": s})
        for f in nameless
        if any(id(one) in named for one in f.signals.values())
        for s in f.signals.values()
        if id(s) not in named
    ]
    draft.families.append(Family(_meaning("position"), positions))
    if velocities:
        draft.families.append(Family(_meaning("velocity"), velocities))
    if time is not None:
        draft.families.append(Family(_meaning("time"), {"": time}))
        draft.doubts.append(
            f"time: {time.label}, for it alone goes on in even steps; no name says so: proposed, check"
        )
    draft.by_numbers = True
    _say_third(draft, signals, alike, [v for _, v in pairs if v is not None], named)


def _meaning(quantity: str) -> Meaning:
    return Meaning(quantity, None, None, None, "", f"{quantity} by numbers")


def _time(
    draft: Draft, nameless: Sequence[Family], rate_hz: float | None
) -> tuple[Series | None, float | None]:
    """Return the nameless time column, or None, and the sample time [s], or None if no column shows it."""
    named = [s for f in of_quantity(draft.families, "time") for s in f.signals.values()]
    found = [s for s in named if increases(s.values)]
    time = None
    if not found and rate_hz is not None:
        return None, 1.0 / rate_hz
    if not found:
        even = [s for f in nameless for s in f.signals.values() if _is_even(s.values)]
        if len(even) != 1:
            return None, None
        found = even
        time = even[0]
    units = time_units(found[0].values)
    if not units:
        return None, None
    steps = [float(np.median(np.diff(found[0].values))) * si_factor(unit) for unit in units]
    return time, min(steps, key=lambda step: abs(np.log(step * _RATE_WITHOUT_TIME_HZ)))


def _is_even(values: Floats) -> bool:
    """Whether values increase in even steps and do not merely count the samples."""
    if not increases(values):
        return False
    steps = np.diff(values)
    return bool(np.ptp(steps) <= _EVEN * np.median(steps) and not (steps == 1.0).all())


def _moves(series: Series) -> bool:
    return bool(np.isfinite(series.values).all() and np.ptp(series.values) > 0.0)


def _derivatives(signals: Sequence[Series], step_s: float) -> Floats:
    """Return the correlations (n, n) of the derivative of each signal (rows) with each signal (columns)."""
    cutoff = min(_BAND_HZ, 0.2 / step_s)
    size = signals[0].values.size
    start = max(0, (size - _MOST_SAMPLES) // 2)
    part = slice(start, start + _MOST_SAMPLES)
    try:
        smooth = np.array([lowpass(s.values[part], step_s, cutoff) for s in signals])
        rates = np.array([differentiate(s.values[part], step_s, cutoff)[0] for s in signals])
    except InputError:  # too short for a filter
        return np.zeros((len(signals), len(signals)))
    norms = np.outer(np.linalg.norm(rates, axis=1), np.linalg.norm(smooth, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.nan_to_num(rates @ smooth.T / norms)
    np.fill_diagonal(found, 0.0)
    return np.asarray(found)


def _pairs(draft: Draft, signals: Sequence[Series], alike: Floats) -> list[tuple[int, int | None]]:
    """Return (position, velocity) indices of every axis in file order; None for an open velocity.

    Raises LogError if two columns are equally likely to be the position of one velocity.
    """
    like = alike > _ALIKE
    heads = [p for p in range(len(signals)) if like[p].any() and not like[:, p].any()]
    pairs: list[tuple[int, int | None]] = []
    for p in heads:
        best = _best(alike[p], np.flatnonzero(like[p]))
        if best is not None:
            rivals = [h for h in heads if like[h, best]]
            first = _best(alike[:, best], np.array(rivals))
            if first is None:
                listed = " or ".join(signals[h].label for h in rivals)
                raise draft.refusal(
                    f"position: expected columns whose names say so, or one whose derivative goes with "
                    f"{signals[best].label}, got {listed}, which are as likely"
                )
            if first != p:
                draft.unused[signals[p].label] = f"goes with {signals[first].label}, less closely"
                continue
        else:
            listed = " or ".join(signals[v].label for v in np.flatnonzero(like[p]).tolist())
            draft.doubts.append(
                f"position: {signals[p].label}, for its derivative goes with {listed}, of which none is "
                f"clearly the velocity; no name says so: proposed, check"
            )
        pairs.append((p, best))
    return pairs


def _best(alike: Floats, among: np.ndarray[tuple[int], np.dtype[np.int64]]) -> int | None:
    """Return the index with the highest correlation, None if the second one is about as high."""
    lacks = 1.0 - alike[among]
    order = np.argsort(lacks)
    if len(order) > 1 and lacks[order[1]] < _CLEARLY * max(lacks[order[0]], 1e-12):
        return None
    return int(among[order[0]])


def _say_third(
    draft: Draft, signals: Sequence[Series], alike: Floats, velocities: list[int], named: set[int]
) -> None:
    """Note as unused the columns that correlate with the derivative of a velocity."""
    for k, series in enumerate(signals):
        for v in velocities:
            if id(series) not in named and alike[v, k] > _ALIKE:
                why = (
                    f"goes with the derivative of {signals[v].label}: an acceleration, or a torque"
                )
                draft.unused.setdefault(series.label, why)

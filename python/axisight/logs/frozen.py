"""Samples that repeat where a machine in motion cannot: frozen channels, rows given twice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from axisight.logs.findings import Finding
from axisight.logs.gather import Channel
from axisight.logs.log import Floats
from axisight.logs.resolution import ROUNDING

Mask = NDArray[np.bool_]

# Equal neighbours that make a frozen stretch. Where fewer than one neighbour in twenty is equal by
# chance, nine equal samples have a probability of 0.05^8 = 4e-11 at each sample.
_FROZEN = 8
_CHANCE = 0.05
# A channel that comes back to life jumps by what it missed; a sensor at rest goes on by a step of
# its resolution, and an axis that breaks away by less than a tenth of its usual step.
_RESOLUTIONS = 3.0
_SHARE_OF_STEP = 0.1
_AROUND = 50
# Mean speed over a frozen stretch of torque, as a share of the top speed, that is a motion.
_TRAVEL = 0.05
# A moving axis makes steps of several resolutions before and after a row that was given twice.
_MOVING_STEPS = 5.0


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Return (first, one past the last) of every run of true entries of `mask` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def frozen_stretches(values: Floats, *, limited: bool = False) -> list[tuple[int, int]]:
    """Return (first, last) sample of stretches over which a live channel (n,) stood still.

    A stretch counts if equal neighbours are rare elsewhere and the value jumps at its end by more
    than a sensor at rest would; the start and the end of a log are rest. With `limited`, stretches
    at the largest and the smallest value are those of a limit, not counted.
    """
    step = np.diff(values)
    still = step == 0.0
    long = [(a, b) for a, b in runs(still) if b - a >= _FROZEN]
    inner = [(a, b) for a, b in long if a > 0 and b < len(step)]
    moves = np.abs(step[~still])
    if not inner or moves.size < _FROZEN:
        return []
    elsewhere = int(still.sum()) - sum(b - a for a, b in long)
    if elsewhere > _CHANCE * (len(step) - sum(b - a for a, b in long)):
        return []
    least = _SHARE_OF_STEP * float(np.median(moves))
    rounding = ROUNDING * float(np.abs(values).max())
    extremes = (values.min(), values.max()) if limited else ()
    return [
        (a, b)
        for a, b in inner
        if abs(step[b]) > max(least, _RESOLUTIONS * _resolution(step, a, b, rounding))
        and values[a] not in extremes
    ]


def _resolution(step: Floats, first: int, last: int, rounding: float) -> float:
    """Return the smallest step around a stretch, but rounding: numbers of five digits differ in theirs."""
    around = np.abs(
        np.concatenate((step[max(0, first - _AROUND) : first], step[last + 1 : last + _AROUND]))
    )
    around = around[around > rounding]
    return float(around.min()) if around.size else 0.0


def check_frozen(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return a finding per measured channel that stood still while the machine was in motion.

    `signals` are finite, (n,) each. A torque counts as frozen only while a position moves: at
    standstill a drive may hold the same torque for long.
    """
    findings = []
    for channel, values in signals.items():
        field, axis = channel
        if field not in ("position", "torque", "velocity"):
            continue
        found = frozen_stretches(values, limited=field == "torque")
        position = signals.get(("position", axis))
        if field != "position" and position is not None:
            found = [(a, b) for a, b in found if _moves(position, a, b)]
        if not found:
            continue
        first, last = max(found, key=lambda one: one[1] - one[0])
        more = f" and {len(found) - 1} more stretches" if len(found) > 1 else ""
        message = (
            f"expected values that go on, got the same value for {(last - first) * sample_time_s:.4g} s "
            f"from {first * sample_time_s:.4g} s on{more}, then a jump of "
            f"{abs(values[last + 1] - values[last]):.4g}: the channel stood still; cut the log there"
        )
        findings.append(Finding("error", labels[channel], message, "samples_frozen", axis + 1))
    return findings


def _moves(position: Floats, first: int, last: int) -> bool:
    """Whether a position travels over a stretch: a drive at standstill may hold its torque for long."""
    top = float(np.quantile(np.abs(np.diff(position)), 0.99))
    # Where position and torque are frozen together, what it missed shows at the end.
    travel = float(np.ptp(position[first : last + 2]))
    if travel <= _TRAVEL * top * (last - first):
        return False
    # To the last step of a coarse encoder the same speed: a loop has nothing to answer.
    steps = np.diff(position[first : last + 1])
    return not (steps[0] != 0.0 and np.ptp(steps) <= ROUNDING * float(np.abs(position).max()))


def check_repeated_rows(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return a finding where whole rows were given twice while an axis was in motion."""
    measured = [v for (field, _), v in signals.items() if field in ("position", "torque")]
    positions = [(c, v) for c, v in signals.items() if c[0] == "position"]
    if not positions or len(measured[0]) < 4:
        return []
    equal = np.all([np.diff(v) == 0.0 for v in measured], axis=0)
    in_motion = np.zeros(len(equal), dtype=bool)
    for _, values in positions:
        size = np.abs(np.diff(values))
        nonzero = size[size > 0.0]
        if nonzero.size:
            fast = size > _MOVING_STEPS * nonzero.min()
            in_motion |= _touched_on_both_sides(equal, fast)
    short = [(a, b) for a, b in runs(equal) if b - a < _FROZEN and in_motion[a]]
    if not short:
        return []
    count = sum(b - a for a, b in short)
    message = (
        f"expected a new row every {sample_time_s:.4g} s, got {count} rows equal to the one before "
        f"while the machine moved, first at index {short[0][0] + 1}: rows were given twice; export "
        "the log again, with its own time stamps"
    )
    return [Finding("error", labels[positions[0][0]], message, "rows_repeated")]


def _touched_on_both_sides(equal: Mask, fast: Mask) -> Mask:
    """Mark the first entry of every run in `equal` whose neighbours on both sides are `fast`."""
    out = np.zeros(len(equal), dtype=bool)
    for a, b in runs(equal):
        if a > 0 and b < len(equal) and fast[a - 1] and fast[b]:
            out[a] = True
    return out

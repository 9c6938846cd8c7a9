"""Find samples that repeat while the machine moves: frozen channels and repeated rows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from axisight.logs.findings import Finding, Severity
from axisight.logs.gather import Channel
from axisight.logs.harm import LITTLE, deviations, is_harmless
from axisight.logs.log import Floats
from axisight.logs.resolution import ROUNDING

Mask = NDArray[np.bool_]

# Pairs of equal neighbours that make a frozen stretch. If at most one pair in twenty is equal by chance,
# nine equal samples have a probability of 0.05^8 = 4e-11 at each sample.
_FROZEN = 8
_CHANCE = 0.05
# When a frozen channel recovers, it jumps by the motion that it missed. A sensor at rest changes by one step
# of its resolution, and an axis that breaks away changes by less than a tenth of its usual step.
_RESOLUTIONS = 3.0
_SHARE_OF_STEP = 0.1
_AROUND = 50
# An axis moves during a frozen stretch of torque if its mean speed exceeds this share of the top speed.
_TRAVEL = 0.05
# A moving axis makes steps of several resolutions before and after a repeated row.
_MOVING_STEPS = 5.0
# Largest share of old readings among rows with uneven stamps that does no harm.
_OLD_READINGS = 0.1
SHARE_OF_JUMP = 0.4
"""Share of a jump from which a step beside it in the same direction makes it part of a motion.

Lost rows, resets, glitches and the motion that a frozen channel missed show in one step alone."""


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Return (first, one past the last) of every run of true entries of `mask` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def frozen_stretches(
    values: Floats, *, limited: bool = False, smooth: bool = False
) -> list[tuple[int, int]]:
    """Return (first, last) sample of every stretch over which a channel (n,) is frozen.

    A stretch counts if equal neighbours are rare elsewhere and the value jumps at its end by more
    than a sensor at rest would. Stretches at the start and the end of a log count as rest. With `limited`,
    stretches at the largest and the smallest value count as saturation, not as frozen. With `smooth`, as for
    a position, the axis stood where it goes on from the stretch with steps of the same size: it missed no motion.
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
        and not (smooth and _starts(step, b))
    ]


def _starts(step: Floats, last: int) -> bool:
    """Whether the steps after the stretch that ends at `last` are those of an axis that starts to move."""
    after = step[last + 1 : last + 2]
    return bool(np.any(after * np.sign(step[last]) > SHARE_OF_JUMP * abs(step[last])))


def _resolution(step: Floats, first: int, last: int, rounding: float) -> float:
    """Return the smallest step around a stretch that exceeds ``rounding``; 0 if there is none."""
    around = np.abs(
        np.concatenate((step[max(0, first - _AROUND) : first], step[last + 1 : last + _AROUND]))
    )
    around = around[around > rounding]
    return float(around.min()) if around.size else 0.0


def check_frozen(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return a finding for each measured channel that is frozen while the machine moves.

    `signals` are finite, (n,) each. A torque or velocity counts as frozen only while the position of its axis
    moves: at standstill a drive may hold the same torque for long.
    """
    findings = []
    for channel, values in signals.items():
        field, axis = channel
        if field not in ("position", "torque", "velocity"):
            continue
        found = frozen_stretches(values, limited=field == "torque", smooth=field == "position")
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
        little = field == "position" and _missed_little(values, found, sample_time_s)
        severity: Severity = "warning" if little else "error"
        end = LITTLE if little else ""
        findings.append(
            Finding(severity, labels[channel], message + end, "samples_frozen", axis + 1)
        )
    return findings


def _missed_little(values: Floats, stretches: list[tuple[int, int]], sample_time_s: float) -> bool:
    """Whether a position that had moved evenly during its frozen stretches would be nearly the same motion."""
    step = np.diff(values)
    wrong = np.zeros_like(step)
    for first, last in stretches:
        part = slice(first, last + 1)
        wrong[part] = step[part] - step[part].mean()
    return is_harmless(values, wrong, sample_time_s)


def _moves(position: Floats, first: int, last: int) -> bool:
    """Whether a position moves during a stretch, other than at constant speed."""
    top = float(np.quantile(np.abs(np.diff(position)), 0.99))
    # One sample more: if the position is frozen too, the missed motion shows as a jump behind the stretch.
    travel = float(np.ptp(position[first : last + 2]))
    if travel <= _TRAVEL * top * (last - first):
        return False
    # At a speed that is constant to the encoder step, the controller may hold its torque.
    steps = np.diff(position[first : last + 1])
    return not (steps[0] != 0.0 and np.ptp(steps) <= ROUNDING * float(np.abs(position).max()))


def repeated_rows(signals: Mapping[Channel, Floats]) -> list[tuple[int, int]]:
    """Return (first, one past the last) step of every short run of whole rows that repeat while an axis moves."""
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
    return [(a, b) for a, b in runs(equal) if b - a < _FROZEN and in_motion[a]]


def check_repeated_rows(
    signals: Mapping[Channel, Floats],
    labels: Mapping[Channel, str],
    sample_time_s: float,
    *,
    uneven: bool = False,
) -> list[Finding]:
    """Return a finding if whole rows repeat while an axis moves.

    With stamps that are `uneven`, a row that repeats is an old reading, as late as a stamp may be.
    """
    short = repeated_rows(signals)
    if not short:
        return []
    count = sum(b - a for a, b in short)
    message = (
        f"expected a new row every {sample_time_s:.4g} s, got {count} rows equal to the one before "
        f"while the machine moved, first at index {short[0][0] + 1}: rows were given twice; export "
        "the log again, with its own time stamps"
    )
    positions = [(c, v) for c, v in signals.items() if c[0] == "position"]
    places = np.concatenate([np.arange(a, b) for a, b in short])
    little = (
        count <= _OLD_READINGS * len(positions[0][1])
        if uneven
        else all(is_harmless(x, deviations(x, places), sample_time_s) for _, x in positions)
    )
    severity: Severity = "warning" if little else "error"
    end = LITTLE if little else ""
    return [Finding(severity, labels[positions[0][0]], message + end, "rows_repeated")]


def _touched_on_both_sides(equal: Mask, fast: Mask) -> Mask:
    """Mark the first entry of every run in `equal` whose neighbours on both sides are `fast`."""
    out = np.zeros(len(equal), dtype=bool)
    for a, b in runs(equal):
        if a > 0 and b < len(equal) and fast[a - 1] and fast[b]:
            out[a] = True
    return out

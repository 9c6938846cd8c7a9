"""Find jumps of positions that no machine makes: missing or shuffled rows, wrapped turns, glitches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.logs.findings import Finding, Severity
from axisight.logs.frozen import SHARE_OF_JUMP, frozen_stretches, repeated_rows
from axisight.logs.gather import Channel
from axisight.logs.harm import LITTLE, deviations, is_harmless
from axisight.logs.log import Floats
from axisight.logs.resolution import steps_around
from axisight.logs.spikes import isolated_spikes

Ints = NDArray[np.int64]

# A speed is compared with the median of seven neighbours. If a log resolves the motion, no drive changes
# the speed of an axis by three tenths of its top speed within one sample. For coarse logs and for noise,
# the limit is twenty times the median deviation (13 standard deviations). The jitter of a clock shows in the fastest
# quarter of the steps alone, and moves a reading by less than the top step.
NEIGHBOURS = 7
_SHARE_OF_TOP = 0.3
_USUAL = 20.0
_FASTEST = 0.75
# On a slow axis, a coarse encoder or numbers with few digits make the speed jump by one or two steps.
_RESOLUTIONS = 3.0
# Jumps within so many samples are one event; from four places on, an event means rows out of order.
_EVENT_SAMPLES = 15
_OUT_OF_ORDER = 4
# Relative tolerance of a full turn, for the motion within one sample.
_TURN_TOLERANCE = 0.05
# Largest size of a spike, as a share of the step beside it, that is a reading early or late by less than a sample.
_EARLY_OR_LATE = 0.5


@dataclass(frozen=True)
class Jump:
    """A step of a position after sample `index` that its speed does not explain; `axis` counts from 0.

    `size` is the step minus the median step around it, in the unit of the position.
    """

    axis: int
    index: int
    size: float
    speed: float
    """Median step per sample around the jump."""


def check_jumps(
    signals: Mapping[Channel, Floats],
    labels: Mapping[Channel, str],
    sample_time_s: float,
    *,
    stamps_late: float = 0.0,
) -> list[Finding]:
    """Return findings about jumps of positions, and about single wrong samples of position and torque.

    `signals` are finite, (n,) each. A jump at the end of a frozen stretch or of repeated rows is not
    reported again. `stamps_late`: how
    far stamps may be off, in steps; the motion in that time is no jump.
    """
    findings = []
    jumps: list[Jump] = []
    repeated = [end for run in repeated_rows(signals) for end in run]
    tops: dict[int, float] = {}
    for channel, values in signals.items():
        field, axis = channel
        if field not in ("position", "torque"):
            continue
        spikes = isolated_spikes(values)
        if field == "position":
            spikes = spikes[_early_or_late(values, spikes) > stamps_late]
        if len(spikes):
            findings.append(_spiked(channel, labels[channel], values, spikes, sample_time_s))
        if field == "position":
            known = [end for _, end in frozen_stretches(values, smooth=True)]
            skipped = [*spikes.tolist(), *known, *repeated]
            own, tops[axis] = position_jumps(values, axis, skipped, stamps_late)
            jumps += own
    return findings + _explained(jumps, tops, signals, labels, sample_time_s)


def _spiked(
    channel: Channel, label: str, values: Floats, spikes: Ints, sample_time_s: float
) -> Finding:
    field, axis = channel
    k = int(spikes[0])
    size = abs(values[k] - 0.5 * (values[k - 1] + values[k + 1]))
    message = (
        f"expected a signal without spikes, got {len(spikes)} single samples far off, first at "
        f"{k * sample_time_s:.4g} s by {size:.4g}: replace them by their neighbours' mean, or cut "
        "the log there"
    )
    if field != "position":
        return Finding("warning", label, message, "torque_spike", axis + 1)
    little = _between_neighbours(values, spikes, sample_time_s)
    severity: Severity = "warning" if little else "error"
    end = LITTLE if little else ""
    return Finding(severity, label, message + end, "position_spike", axis + 1)


def _between_neighbours(values: Floats, spikes: Ints, sample_time_s: float) -> bool:
    """Whether spikes of a position are readings early or late by less than a sample, and do no harm."""
    within = bool(np.all(_early_or_late(values, spikes) <= _EARLY_OR_LATE))
    return within and is_harmless(values, deviations(values, spikes), sample_time_s)


def _early_or_late(values: Floats, spikes: Ints) -> Floats:
    """Return how early or late the readings at `spikes` would be [steps], if the position was sound."""
    off = np.abs(values[spikes] - 0.5 * (values[spikes - 1] + values[spikes + 1]))
    step = 0.5 * np.abs(values[spikes + 1] - values[spikes - 1])
    return np.asarray(off / np.maximum(step, 1e-300))


def position_jumps(
    values: Floats, axis: int, known: list[int], stamps_late: float = 0.0
) -> tuple[list[Jump], float]:
    """Return the jumps of a position (n,) that are not near the samples `known`, and its top step.

    `stamps_late` as in `check_jumps`.
    """
    step = np.diff(values)
    usual = scipy.ndimage.median_filter(step, NEIGHBOURS, mode="nearest")
    off = step - usual
    top = float(np.quantile(np.abs(usual), 0.999))
    size = np.abs(usual)
    noise, jitter = (
        _USUAL * float(np.median(np.abs(off[size >= np.quantile(size, q)])))
        for q in (0.0, _FASTEST)
    )
    least = max(_SHARE_OF_TOP * top, noise, min(jitter, top), 1e-9 * np.ptp(values))
    found = np.flatnonzero(np.abs(off) > np.maximum(least, stamps_late * size))
    if known:
        near = np.abs(found[:, None] - np.array(known)[None]).min(axis=1) <= 2
        found = found[~near]
    found = found[np.abs(off[found]) > _RESOLUTIONS * steps_around(values, found)]
    found = found[~_in_a_motion(off, found)]
    return [Jump(axis, int(k), float(off[k]), float(usual[k])) for k in found], top


def _in_a_motion(off: Floats, found: Ints) -> NDArray[np.bool_]:
    """Return a mask of the jumps whose speed rises or falls over several samples."""
    padded = np.pad(off, 1)
    beside = np.stack([padded[found], padded[found + 2]])
    return np.asarray(
        np.any(beside * np.sign(off[found]) > SHARE_OF_JUMP * np.abs(off[found]), axis=0)
    )


def _explained(
    jumps: list[Jump],
    tops: Mapping[int, float],
    signals: Mapping[Channel, Floats],
    labels: Mapping[Channel, str],
    sample_time_s: float,
) -> list[Finding]:
    wrapped = {a for a in tops if _wraps(signals["position", a], [j for j in jumps if j.axis == a])}
    findings = [_wrapped(a, labels["position", a], signals["position", a]) for a in sorted(wrapped)]
    positions = {a: signals["position", a] for a in tops if a not in wrapped}
    named: dict[str, list[list[Jump]]] = {}
    for event in _events([j for j in jumps if j.axis not in wrapped]):
        named.setdefault(_name_of(event, tops, positions), []).append(event)
    for name, members in named.items():
        first = members[0][0]
        lost = [round(abs(j.size / j.speed)) for e in members for j in e[:1] if j.speed]
        words = {
            "rows_missing": (
                f"got {len(members)} jumps that take about {sum(lost)} rows: rows are missing that "
                "the time stamps do not show; export the log again, with its own time stamps"
            ),
            "rows_shuffled": "got rows out of order; sort them by the time they were taken at",
            "position_spike": (
                f"got {_count_spikes(members)} single samples far off; replace them by their neighbours' mean, or "
                "record one source alone if two write to this channel"
            ),
            "position_jumps": (
                f"got {len(members)} jumps of this axis alone, of {abs(first.size):.4g}: a counter "
                "was reset or lost steps; cut the log there"
            ),
        }[name]
        message = (
            f"expected a motion, {words} (first at {first.index * sample_time_s:.4g} s on "
            f"axis {first.axis + 1})"
        )
        axis = first.axis + 1 if name.startswith("position_") else None
        little = _of_little_effect(members, positions, sample_time_s)
        severity: Severity = "warning" if little else "error"
        end = LITTLE if little else ""
        label = labels["position", first.axis]
        findings.append(Finding(severity, label, message + end, name, axis))
    return findings


def _of_little_effect(
    events: list[list[Jump]], positions: Mapping[int, Floats], sample_time_s: float
) -> bool:
    """Whether the jumps of all events do no harm on any axis."""
    places: dict[int, list[int]] = {}
    for jump in (j for event in events for j in event):
        places.setdefault(jump.axis, []).append(jump.index)
    return all(
        is_harmless(positions[axis], deviations(positions[axis], np.array(own)), sample_time_s)
        for axis, own in places.items()
    )


def _wraps(values: Floats, jumps: list[Jump]) -> bool:
    """Whether all jumps of a position that stays within a turn are full turns."""
    if not jumps or np.ptp(values) > 2 * np.pi * (1 + _TURN_TOLERANCE):
        return False
    sizes = np.abs([j.size for j in jumps])
    return bool(np.all(np.abs(sizes / (2 * np.pi) - 1) < _TURN_TOLERANCE))


def _wrapped(axis: int, label: str, values: Floats) -> Finding:
    message = (
        f"expected a position that counts turns, got one that stays within {values.min():.4g} and "
        f"{values.max():.4g} rad and jumps by whole turns: unwrap it (numpy.unwrap)"
    )
    return Finding("error", label, message, "position_wrapped", axis + 1)


def _events(jumps: list[Jump]) -> list[list[Jump]]:
    """Return the jumps grouped by time, in order."""
    out: list[list[Jump]] = []
    for jump in sorted(jumps, key=lambda j: (j.index, -abs(j.size))):
        if out and jump.index - out[-1][-1].index <= _EVENT_SAMPLES:
            out[-1].append(jump)
        else:
            out.append([jump])
    return out


def _name_of(event: list[Jump], tops: Mapping[int, float], positions: Mapping[int, Floats]) -> str:
    places = {j.index for j in event}
    axes = {j.axis for j in event}
    signs = {np.sign(j.size) for j in event if j.axis == event[0].axis}
    if all(_there_and_back([j for j in event if j.axis == axis]) for axis in axes):
        return "position_spike"
    if len(places) >= _OUT_OF_ORDER and len(signs) == 2:
        return "rows_shuffled"
    if all(j.size * j.speed < 0 for j in event):
        # A jump against the motion: the following rows were recorded earlier.
        return "rows_shuffled" if len(axes) > 1 else "position_jumps"
    return (
        "position_jumps" if len(axes) == 1 and _alone(event[0], tops, positions) else "rows_missing"
    )


def _there_and_back(jumps: list[Jump]) -> bool:
    """Whether jumps of one axis come in pairs, from one sample to the next, of which the second undoes the first."""
    pairs = list(zip(jumps[::2], jumps[1::2], strict=False))
    return len(jumps) % 2 == 0 and all(
        b.index == a.index + 1 and abs(a.size + b.size) < SHARE_OF_JUMP * abs(a.size)
        for a, b in pairs
    )


def _count_spikes(events: list[list[Jump]]) -> int:
    return sum(len({j.index for j in event}) // 2 for event in events)


def _alone(jump: Jump, tops: Mapping[int, float], positions: Mapping[int, Floats]) -> bool:
    """Whether missing rows are ruled out, because they would also have made another axis jump."""
    rows = abs(jump.size) / max(abs(jump.speed), 1e-3 * tops[jump.axis])
    around = slice(max(0, jump.index - NEIGHBOURS), jump.index + NEIGHBOURS)
    return any(
        rows * abs(float(np.median(np.diff(values[around])))) > 2 * _SHARE_OF_TOP * tops[axis]
        for axis, values in positions.items()
        if axis != jump.axis
    )

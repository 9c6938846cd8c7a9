"""Check the rows of a log, independently of the machine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy

from axisight.logs.findings import Finding
from axisight.logs.frozen import check_frozen, check_repeated_rows
from axisight.logs.gather import Channel
from axisight.logs.jumps import NEIGHBOURS, check_jumps
from axisight.logs.log import Floats
from axisight.logs.recorded import RecordedRows

# Shortest time between two stamps that counts, in usual steps.
_SHORTEST = 0.1
# Largest travel of an axis that stands, as a share of that of the axis that travels most.
_STANDS = 0.01
# Share of steps with the sign of the step before: all but the reversals of a motion, a third of noise.
_GOES_ON = 0.5
# How far uneven stamps may be off, in steps: a reading that is a step old, with half a step of jitter.
_STAMPS_LATE = 1.5


def check_rows(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return findings about frozen, repeated, missing and shuffled rows and about single wrong samples.

    `signals` are finite and (n,) each, by field (`position`, `torque`, `velocity`, ...) and axis
    from 0; `labels` name their columns. References are not checked, because they may take any form.
    """
    return _findings(signals, labels, sample_time_s)


def _findings(
    signals: Mapping[Channel, Floats],
    labels: Mapping[Channel, str],
    sample_time_s: float,
    stamps_late: float = 0.0,
) -> list[Finding]:
    uneven = stamps_late > 0.0
    moving = _of_axes_that_move(signals)
    return [
        *check_frozen(moving, labels, sample_time_s),
        *check_repeated_rows(signals, labels, sample_time_s, uneven=uneven),
        *check_jumps(moving, labels, sample_time_s, stamps_late=stamps_late),
    ]


def _of_axes_that_move(signals: Mapping[Channel, Floats]) -> dict[Channel, Floats]:
    """Return the signals without those of axes that stand beside others that move.

    What shakes an axis that stands, or its encoder, makes jumps and rests that say nothing of the rows. Its travel is
    small beside that of others, and it goes on nowhere: a slide in metres travels less than a joint in radians.
    """
    positions = {axis: x for (field, axis), x in signals.items() if field == "position"}
    travel = {axis: float(np.ptp(x)) for axis, x in positions.items()}
    least = _STANDS * max(travel.values(), default=0.0)
    stands = {axis for axis, x in positions.items() if travel[axis] <= least and not _goes_on(x)}
    return {c: x for c, x in signals.items() if c[1] not in stands}


def _goes_on(values: Floats) -> bool:
    """Whether most steps of a signal (n,) have the sign of the step before, as in a motion and not in noise."""
    step = np.diff(values)
    return bool(np.mean(step[1:] * step[:-1] > 0) >= _GOES_ON) if len(step) > 1 else False


def check_recorded(rows: RecordedRows) -> list[Finding]:
    """Return findings as `check_rows` about rows with uneven stamps; times count rows at the usual step.

    A stamp can be late although its sample was taken in time, and a sample can be late as its stamp says. Therefore
    each step of a position counts as it is or as if it had taken the usual time, whichever is nearer to its
    neighbours: neither a late stamp nor a row that the stamps show to be missing makes a jump.
    A reader that is not in step with its source reads some rows twice and skips others: its stamps may be a step off.
    """
    if len(rows.stamps_s) < 2:
        return []
    took_s = np.diff(rows.stamps_s)
    usual_s = float(np.median(took_s))
    # Two stamps may fall together where messages queue; their step is no faster for that.
    factor = usual_s / np.maximum(took_s, _SHORTEST * usual_s)
    signals = {
        channel: _paced(values, factor) if channel[0] == "position" else values
        for channel, values in rows.signals.items()
    }
    return _findings(signals, rows.labels, usual_s, _STAMPS_LATE)


def _paced(values: Floats, factor: Floats) -> Floats:
    """Return a position (n,) with its steps multiplied by factors (n - 1,) where that makes them more like others."""
    step = np.diff(values)
    paced = step * factor
    usual = scipy.ndimage.median_filter(paced, NEIGHBOURS, mode="nearest")
    nearer = np.abs(paced - usual) < np.abs(step - usual)
    return np.concatenate([values[:1], values[0] + np.cumsum(np.where(nearer, paced, step))])

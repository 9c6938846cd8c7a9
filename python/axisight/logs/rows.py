"""Check the rows of a log, independently of the machine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from axisight.logs.findings import Finding
from axisight.logs.frozen import check_frozen, check_repeated_rows
from axisight.logs.gather import Channel
from axisight.logs.jumps import check_jumps
from axisight.logs.log import Floats
from axisight.logs.recorded import RecordedRows


def check_rows(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return findings about frozen, repeated, missing and shuffled rows and about single wrong samples.

    `signals` are finite and (n,) each, by field (`position`, `torque`, `velocity`, ...) and axis
    from 0; `labels` name their columns. References are not checked, because they may take any form.
    """
    return [
        *check_frozen(signals, labels, sample_time_s),
        *check_repeated_rows(signals, labels, sample_time_s),
        *check_jumps(signals, labels, sample_time_s),
    ]


def check_recorded(rows: RecordedRows) -> list[Finding]:
    """Return findings as `check_rows` about rows with uneven stamps; times count rows at the usual step."""
    if len(rows.stamps_s) < 2:
        return []
    usual_s = float(np.median(np.diff(rows.stamps_s)))
    return check_rows(rows.signals, rows.labels, usual_s)

"""What is wrong with the rows of a log, whatever machine they are of."""

from __future__ import annotations

from collections.abc import Mapping

from axisight.logs.findings import Finding
from axisight.logs.frozen import check_frozen, check_repeated_rows
from axisight.logs.gather import Channel
from axisight.logs.jumps import check_jumps
from axisight.logs.log import Floats


def check_rows(
    signals: Mapping[Channel, Floats], labels: Mapping[Channel, str], sample_time_s: float
) -> list[Finding]:
    """Return findings about rows frozen, given twice, missing, out of order, and single wrong samples.

    `signals` are finite and (n,) each, by field (`position`, `torque`, `velocity`, ...) and axis
    from 0; `labels` name their columns. References are not judged: they may be anything.
    """
    return [
        *check_frozen(signals, labels, sample_time_s),
        *check_repeated_rows(signals, labels, sample_time_s),
        *check_jumps(signals, labels, sample_time_s),
    ]

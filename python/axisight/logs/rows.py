"""Check the rows of a log, independently of the machine."""

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
    """Return findings about frozen, repeated, missing and shuffled rows and about single wrong samples.

    `signals` are finite and (n,) each, by field (`position`, `torque`, `velocity`, ...) and axis
    from 0; `labels` name their columns. References are not checked, because they may take any form.
    """
    return [
        *check_frozen(signals, labels, sample_time_s),
        *check_repeated_rows(signals, labels, sample_time_s),
        *check_jumps(signals, labels, sample_time_s),
    ]

"""The result of an estimate from logs: the response, what was chosen, and what was seen."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from axisight.display.summary import summarized
from axisight.records import ArbitraryRecords, PeriodicRecords, RecordFinding
from axisight.responses.account import Account


@summarized
@dataclass(frozen=True, eq=False)
class LogResponse:
    """A frequency response from logs.

    response
        Dataset of :func:`axisight.frf.frequency_response`. ``output`` and ``input`` are numbers of axes. The
        attribute ``joint_angle_rad`` is the operating point, if it is known.
    records
        The records of the estimate: whole periods in steady state, or logs without a period.
    choices
        What was chosen and why, one sentence each.
    findings
        What the preparation of the records found, see :func:`axisight.records.prepare_records`.
    account
        Noise, distortion and weak lines by frequency band, and advice.
    """

    response: xr.Dataset
    records: PeriodicRecords | ArbitraryRecords
    choices: tuple[str, ...]
    findings: tuple[RecordFinding, ...]
    account: Account

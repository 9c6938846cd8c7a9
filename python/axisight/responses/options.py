"""The options of an estimate, and what an estimator hands back."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from axisight.excitation import References
from axisight.frf.quantity import Quantity
from axisight.records import ArbitraryRecords, PeriodicRecords, RecordFinding
from axisight.responses.account import Setting


@dataclass(frozen=True)
class Options:
    """The options of `response_of_logs`, checked."""

    design: References | None
    estimator: str
    average: str | None
    quantity: Quantity
    period_s: float | None
    band_hz: tuple[float, float] | None
    bandwidth_hz: float | None
    drop_periods: int | None


@dataclass(frozen=True)
class Estimated:
    """A response and how it came about."""

    response: xr.Dataset
    records: PeriodicRecords | ArbitraryRecords
    choices: list[str]
    findings: tuple[RecordFinding, ...]
    setting: Setting

"""Measured or simulated records of experiments, as the estimators take them."""

from axisight.records.arbitrary import ArbitraryRecords
from axisight.records.periodic import PeriodicRecords

__all__ = ["ArbitraryRecords", "PeriodicRecords"]

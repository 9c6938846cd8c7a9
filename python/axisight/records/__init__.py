"""Measured or simulated records of experiments, as the estimators take them."""

from axisight.records.arbitrary import ArbitraryRecords
from axisight.records.clipping import clipped_samples
from axisight.records.delays import Delay, estimate_delay, reference_delays, synchronise
from axisight.records.drift import drift_per_period, remove_drift
from axisight.records.experiment import Experiment, experiment_of_log
from axisight.records.findings import FindingKind, RecordFinding
from axisight.records.lines import ExcitedLines, excited_lines, repeating_lines
from axisight.records.period import Period, find_period
from axisight.records.periodic import PeriodicRecords
from axisight.records.prepare import Prepared, prepare_records
from axisight.records.transients import (
    SteadyState,
    mode_time_constant_s,
    steady_state,
    waiting_time_s,
)

__all__ = [
    "ArbitraryRecords",
    "Delay",
    "ExcitedLines",
    "Experiment",
    "FindingKind",
    "Period",
    "PeriodicRecords",
    "Prepared",
    "RecordFinding",
    "SteadyState",
    "clipped_samples",
    "drift_per_period",
    "estimate_delay",
    "excited_lines",
    "experiment_of_log",
    "find_period",
    "mode_time_constant_s",
    "prepare_records",
    "reference_delays",
    "remove_drift",
    "repeating_lines",
    "steady_state",
    "synchronise",
    "waiting_time_s",
]

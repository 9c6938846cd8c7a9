"""Measured logs: reading, checking, filtering, and the case folders that list them."""

from axisight.logs.case import Case, read_case
from axisight.logs.checking import LogReport, check_log
from axisight.logs.columns import (
    AxisColumns,
    ColumnMap,
    CsvOptions,
    PositionColumn,
    TemperatureColumn,
    TimeColumn,
    TorqueColumn,
    VelocityColumn,
    load_column_map,
    parse_column_map,
)
from axisight.logs.filters import decimate_zero_phase, differentiate, lowpass
from axisight.logs.findings import Finding
from axisight.logs.log import AxisKind, Log
from axisight.logs.reading import read_log
from axisight.logs.render import render
from axisight.logs.validate import check_same_rate

__all__ = [
    "AxisColumns",
    "AxisKind",
    "Case",
    "ColumnMap",
    "CsvOptions",
    "Finding",
    "Log",
    "LogReport",
    "PositionColumn",
    "TemperatureColumn",
    "TimeColumn",
    "TorqueColumn",
    "VelocityColumn",
    "check_log",
    "check_same_rate",
    "decimate_zero_phase",
    "differentiate",
    "load_column_map",
    "lowpass",
    "parse_column_map",
    "read_case",
    "read_log",
    "render",
]

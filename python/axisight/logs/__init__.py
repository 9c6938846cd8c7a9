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
)
from axisight.logs.filters import decimate_zero_phase, differentiate, lowpass
from axisight.logs.findings import Finding
from axisight.logs.load import Load
from axisight.logs.log import AxisKind, Log
from axisight.logs.map_files import AnyMap, load_column_map, named_map_text, parse_column_map
from axisight.logs.maps import MAPS
from axisight.logs.patterns import AxisPattern, ColumnPattern
from axisight.logs.reading import read_log
from axisight.logs.render import render
from axisight.logs.run_up import RunUp
from axisight.logs.tables import log_of_table
from axisight.logs.validate import check_same_rate

__all__ = [
    "MAPS",
    "AnyMap",
    "AxisColumns",
    "AxisKind",
    "AxisPattern",
    "Case",
    "ColumnMap",
    "ColumnPattern",
    "CsvOptions",
    "Finding",
    "Load",
    "Log",
    "LogReport",
    "PositionColumn",
    "RunUp",
    "TemperatureColumn",
    "TimeColumn",
    "TorqueColumn",
    "VelocityColumn",
    "check_log",
    "check_same_rate",
    "decimate_zero_phase",
    "differentiate",
    "load_column_map",
    "log_of_table",
    "lowpass",
    "named_map_text",
    "parse_column_map",
    "read_case",
    "read_log",
    "render",
]

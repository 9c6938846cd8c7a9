"""Diagnosis of many robots over many days: all cases of a folder in one table and on one page."""

from axisight.fleet.cases import FleetCase, fleet_cases
from axisight.fleet.page import render_fleet
from axisight.fleet.solve import diagnose_fleet
from axisight.fleet.table import fleet_table
from axisight.fleet.trends import Trend, trends

__all__ = [
    "FleetCase",
    "Trend",
    "diagnose_fleet",
    "fleet_cases",
    "fleet_table",
    "render_fleet",
    "trends",
]

"""Frequency responses of a robot from its logs, with the choices that an estimate needs."""

from axisight.responses.account import Account
from axisight.responses.estimators import ESTIMATORS, MEANS, Estimator, Mean
from axisight.responses.of_logs import response_of_logs
from axisight.responses.operating_point import OPERATING_POINT
from axisight.responses.plots import plot_levels
from axisight.responses.result import LogResponse

__all__ = [
    "ESTIMATORS",
    "MEANS",
    "OPERATING_POINT",
    "Account",
    "Estimator",
    "LogResponse",
    "Mean",
    "plot_levels",
    "response_of_logs",
]

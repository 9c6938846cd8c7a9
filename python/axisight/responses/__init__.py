"""Frequency responses of a robot from its logs, with the choices that an estimate needs."""

from axisight.responses.account import Account
from axisight.responses.estimators import ESTIMATORS, MEANS, Estimator, Mean
from axisight.responses.of_logs import response_of_logs
from axisight.responses.operating_point import (
    GEAR_ANGLE,
    GEAR_TORQUE,
    OPERATING_POINT,
    joint_angles,
)
from axisight.responses.plots import plot_levels
from axisight.responses.result import LogResponse

__all__ = [
    "ESTIMATORS",
    "GEAR_ANGLE",
    "GEAR_TORQUE",
    "MEANS",
    "OPERATING_POINT",
    "Account",
    "Estimator",
    "LogResponse",
    "Mean",
    "joint_angles",
    "plot_levels",
    "response_of_logs",
]

"""Frequency responses: estimators, their uncertainty and their errors."""

from axisight.frf import errors
from axisight.frf.loop import Loop, robot_loop
from axisight.frf.planning import averaged_relative_error, compare_designs, predict_errors
from axisight.frf.response import Flag, frequency_response

__all__ = [
    "Flag",
    "Loop",
    "averaged_relative_error",
    "compare_designs",
    "errors",
    "frequency_response",
    "predict_errors",
    "robot_loop",
]

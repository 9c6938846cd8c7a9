"""Frequency responses: estimators, their uncertainty and their errors."""

from axisight.frf.fast import FastMethod, fast_method
from axisight.frf.local_polynomial import local_polynomial
from axisight.frf.local_rational import local_rational
from axisight.frf.response import Flag, frequency_response
from axisight.frf.robust import robust_method

__all__ = [
    "FastMethod",
    "Flag",
    "fast_method",
    "frequency_response",
    "local_polynomial",
    "local_rational",
    "robust_method",
]

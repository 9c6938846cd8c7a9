"""Frequency responses: estimators, their uncertainty and their errors."""

from axisight.frf.response import Flag, frequency_response

__all__ = ["Flag", "frequency_response"]

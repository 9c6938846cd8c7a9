"""Repeats of one motion on several days: which parameter moved, and what is chance."""

from axisight.repeats.alignment import AlignedRuns, align
from axisight.repeats.comparison import compare_days
from axisight.repeats.days import days_of
from axisight.repeats.plots import plot_days
from axisight.repeats.result import DayComparison

__all__ = ["AlignedRuns", "DayComparison", "align", "compare_days", "days_of", "plot_days"]

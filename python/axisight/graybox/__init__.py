"""Gray-box identification: physical parameters from motor-side data."""

from axisight.graybox.axis_model import AxisData, AxisModel, AxisParameter
from axisight.graybox.axis_result import AxisFit, NoiseModel
from axisight.graybox.prediction_error import FitSettings, fit_axis

__all__ = [
    "AxisData",
    "AxisFit",
    "AxisModel",
    "AxisParameter",
    "FitSettings",
    "NoiseModel",
    "fit_axis",
]

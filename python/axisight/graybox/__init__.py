"""Gray-box identification: physical parameters from motor-side data."""

from axisight.graybox.axis_model import AxisData, AxisModel, AxisParameter
from axisight.graybox.axis_result import AxisFit, NoiseModel
from axisight.graybox.axis_search import FitSettings
from axisight.graybox.multistart import AxisMultistart, multistart_axis
from axisight.graybox.prediction_error import fit_axis

__all__ = [
    "AxisData",
    "AxisFit",
    "AxisModel",
    "AxisMultistart",
    "AxisParameter",
    "FitSettings",
    "NoiseModel",
    "fit_axis",
    "multistart_axis",
]

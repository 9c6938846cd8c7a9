"""Fit the linearized robot to frequency responses at several operating points."""

from axisight.frequency_fit.fit import FrequencyFitOptions, fit_responses
from axisight.frequency_fit.line_information import LineInformation, line_information
from axisight.frequency_fit.measured import MeasuredResponse, model_response
from axisight.frequency_fit.planned import planned_information
from axisight.frequency_fit.poses import PoseChoice, choose_poses
from axisight.frequency_fit.result import FrequencyFit
from axisight.frequency_fit.robot_values import identified_responses

__all__ = [
    "FrequencyFit",
    "FrequencyFitOptions",
    "LineInformation",
    "MeasuredResponse",
    "PoseChoice",
    "choose_poses",
    "fit_responses",
    "identified_responses",
    "line_information",
    "model_response",
    "planned_information",
]

"""Fitting robot and effect parameters to logs."""

from axisight.fitting.parameters import (
    PRIOR_REACH,
    Parameter,
    effect_parameter,
    robot_parameter,
    robot_parameters,
)
from axisight.fitting.residuals import simulation_residuals
from axisight.fitting.simulation_error import FitOptions, Fitted, fit
from axisight.fitting.spectral_weighting import spectral_weighting
from axisight.fitting.weighting import Weighting

__all__ = [
    "PRIOR_REACH",
    "FitOptions",
    "Fitted",
    "Parameter",
    "Weighting",
    "effect_parameter",
    "fit",
    "robot_parameter",
    "robot_parameters",
    "simulation_residuals",
    "spectral_weighting",
]

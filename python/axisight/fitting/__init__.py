"""Fitting robot and effect parameters to logs."""

from axisight.fitting.simulation_error import (
    PRIOR_REACH,
    FitOptions,
    Fitted,
    Parameter,
    Weighting,
    effect_parameter,
    fit,
    robot_parameter,
    robot_parameters,
)

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
]

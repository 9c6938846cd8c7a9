"""Kinematic calibration: where the joints really are, and how they give way under load."""

from axisight.calibration.geometry import Geometry, nominal_geometry
from axisight.calibration.identify import Calibration, Combination, calibrate
from axisight.calibration.measurements import (
    Distances,
    Loads,
    Measurement,
    Poses,
    Positions,
    SamePoint,
    load_torque,
)
from axisight.calibration.robot_values import identified_geometry

__all__ = [
    "Calibration",
    "Combination",
    "Distances",
    "Geometry",
    "Loads",
    "Measurement",
    "Poses",
    "Positions",
    "SamePoint",
    "calibrate",
    "identified_geometry",
    "load_torque",
    "nominal_geometry",
]

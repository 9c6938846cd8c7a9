"""Axisight: identify industrial robots, simulate them, and explain the sim-to-real gap."""

from axisight import calibration, excitation, frf, montecarlo, records, rigid_body
from axisight import excitation, frequency_fit, frf, montecarlo, records
from axisight.effects import Effect, EffectInfo, effect_info, effect_table
from axisight.errors import (
    AxisightError,
    BackendError,
    CaseError,
    ConvergenceError,
    InputError,
    LogError,
    RobotError,
    StoreError,
    StudyError,
)
from axisight.fitting import (
    FitOptions,
    Fitted,
    Parameter,
    Weighting,
    effect_parameter,
    fit,
    robot_parameter,
    robot_parameters,
)
from axisight.frf.plots import plot_bode, plot_response_matrix
from axisight.gap import Diagnosis, Settings, diagnose
from axisight.logs import Case, Log, check_log, read_case, read_log
from axisight.plots import plot_gap_map, plot_log, plot_overlay, plot_ranking, plot_simulation
from axisight.robot import Robot, load_robot
from axisight.simulation import simulate, simulate_batch

__all__ = [
    "AxisightError",
    "BackendError",
    "Case",
    "CaseError",
    "ConvergenceError",
    "Diagnosis",
    "Effect",
    "EffectInfo",
    "FitOptions",
    "Fitted",
    "InputError",
    "Log",
    "LogError",
    "Parameter",
    "Robot",
    "RobotError",
    "Settings",
    "StoreError",
    "StudyError",
    "Weighting",
    "calibration",
    "check_log",
    "diagnose",
    "effect_info",
    "effect_parameter",
    "effect_table",
    "excitation",
    "fit",
    "frequency_fit",
    "frf",
    "load_robot",
    "montecarlo",
    "plot_bode",
    "plot_gap_map",
    "plot_log",
    "plot_overlay",
    "plot_ranking",
    "plot_response_matrix",
    "plot_simulation",
    "read_case",
    "read_log",
    "records",
    "rigid_body",
    "robot_parameter",
    "robot_parameters",
    "simulate",
    "simulate_batch",
]

"""Axisight: identify industrial robots, simulate them, and explain the sim-to-real gap."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from axisight import excitation, frf, montecarlo, records
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
from axisight.report.plots import (
    plot_gap_map,
    plot_log,
    plot_overlay,
    plot_ranking,
    plot_simulation,
)
from axisight.robot import Robot, load_robot
from axisight.simulation import simulate, simulate_batch

if TYPE_CHECKING:
    from axisight import (
        blackbox,
        calibration,
        frequency_fit,
        graybox,
        identifiability,
        rigid_body,
        robot_file,
    )

# Packages with slow imports of their own, loaded when they are first named.
_LATER = (
    "blackbox",
    "calibration",
    "frequency_fit",
    "graybox",
    "identifiability",
    "rigid_body",
    "robot_file",
)

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
    "blackbox",
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
    "graybox",
    "identifiability",
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
    "robot_file",
    "robot_parameter",
    "robot_parameters",
    "simulate",
    "simulate_batch",
]


def __getattr__(name: str) -> Any:
    if name in _LATER:
        return import_module(f"axisight.{name}")
    if name == "reproduce":  # an installation of its own, see thesis/
        return import_module("axisight_thesis")
    raise AttributeError(f"module 'axisight' has no attribute {name!r}")

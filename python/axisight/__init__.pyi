"""What the package offers and where it lives: each is loaded when it is first named."""

from . import (
    blackbox,
    calibration,
    excitation,
    frequency_fit,
    frf,
    graybox,
    identifiability,
    montecarlo,
    mujoco,
    paths,
    records,
    responses,
    rigid_body,
    robot_export,
    robot_file,
    robot_import,
    signal_files,
    write_back,
)
from .display.bars import (
    progress_bars,
)
from .effects import (
    Effect,
    EffectInfo,
    Harmonic,
    effect_info,
    effect_table,
    resolver_ripple,
    torque_ripple,
)
from .errors import (
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
from .fitting import (
    FitOptions,
    Fitted,
    Parameter,
    Weighting,
    effect_parameter,
    fit,
    robot_parameter,
    robot_parameters,
    simulation_residuals,
    spectral_weighting,
)
from .frf.plots import (
    plot_bode,
    plot_response_matrix,
)
from .gap import (
    Diagnosis,
    Settings,
    diagnose,
)
from .logs import (
    Case,
    Load,
    Log,
    check_log,
    read_case,
    read_log,
)
from .report.forest import (
    plot_parameters,
)
from .report.plots import (
    plot_gap_map,
    plot_log,
    plot_overlay,
    plot_ranking,
    plot_simulation,
)
from .robot import (
    Robot,
    load_robot,
)
from .robot_export import (
    to_mujoco,
    to_pinocchio,
)
from .simulation import (
    simulate,
    simulate_batch,
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
    "Load",
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
    "mujoco",
    "plot_bode",
    "plot_gap_map",
    "plot_log",
    "plot_overlay",
    "plot_parameters",
    "plot_ranking",
    "plot_response_matrix",
    "plot_simulation",
    "progress_bars",
    "read_case",
    "read_log",
    "records",
    "responses",
    "rigid_body",
    "robot_export",
    "robot_file",
    "robot_import",
    "robot_parameter",
    "robot_parameters",
    "signal_files",
    "simulate",
    "simulate_batch",
    "simulation_residuals",
    "spectral_weighting",
    "to_mujoco",
    "to_pinocchio",
    "write_back",
]

__version__: str

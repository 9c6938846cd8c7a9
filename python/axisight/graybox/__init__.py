"""Gray-box identification: physical parameters from motor-side data."""

from axisight.graybox.against_robot import Comparison, compare_with_robot
from axisight.graybox.axis_model import AxisData, AxisModel, AxisParameter
from axisight.graybox.axis_records import axis_data
from axisight.graybox.axis_result import AxisFit, NoiseModel
from axisight.graybox.axis_search import FitSettings
from axisight.graybox.chain_fit import ChainFit, fit_chain
from axisight.graybox.collocated import Collocated, collocated
from axisight.graybox.first_steps import InitialModel, initial_model
from axisight.graybox.flexibilities import (
    CubicSpring,
    Flexibility,
    cubic_spring,
    initial_flexibility,
    simulate_deflection,
)
from axisight.graybox.landmarks import (
    HighFrequencyGain,
    Landmark,
    find_notch,
    find_resonance,
    high_frequency_gain,
)
from axisight.graybox.multiaxis import (
    ElasticStep,
    JointStep,
    OperatingPoint,
    RigidStep,
    RobotIdentification,
    identified_robot,
    identify_robot,
)
from axisight.graybox.multistart import AxisMultistart, multistart_axis
from axisight.graybox.prediction_error import fit_axis
from axisight.graybox.procedure import AxisIdentification, identify_axis
from axisight.graybox.robot_values import identified_axis
from axisight.graybox.sensitivity import sensitivity_table
from axisight.graybox.spring_masses import SpringMassChain, reconstruct_chain
from axisight.graybox.step_one import RigidBodyFriction, rigid_body_friction
from axisight.graybox.validation import (
    ResidualTests,
    cross_validation,
    fit_percent,
    fit_table,
    residual_tests,
)

__all__ = [
    "AxisData",
    "AxisFit",
    "AxisIdentification",
    "AxisModel",
    "AxisMultistart",
    "AxisParameter",
    "ChainFit",
    "Collocated",
    "Comparison",
    "CubicSpring",
    "ElasticStep",
    "FitSettings",
    "Flexibility",
    "HighFrequencyGain",
    "InitialModel",
    "JointStep",
    "Landmark",
    "NoiseModel",
    "OperatingPoint",
    "ResidualTests",
    "RigidBodyFriction",
    "RigidStep",
    "RobotIdentification",
    "SpringMassChain",
    "axis_data",
    "collocated",
    "compare_with_robot",
    "cross_validation",
    "cubic_spring",
    "find_notch",
    "find_resonance",
    "fit_axis",
    "fit_chain",
    "fit_percent",
    "fit_table",
    "high_frequency_gain",
    "identified_axis",
    "identified_robot",
    "identify_axis",
    "identify_robot",
    "initial_flexibility",
    "initial_model",
    "multistart_axis",
    "reconstruct_chain",
    "residual_tests",
    "rigid_body_friction",
    "sensitivity_table",
    "simulate_deflection",
]

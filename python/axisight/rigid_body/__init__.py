"""Rigid-body identification: torques linear in masses, inertias and friction (thesis 4.3)."""

from axisight.rigid_body.base import BaseParameters, base_parameters
from axisight.rigid_body.base_record import FloatingRecord, record_of_imu, record_of_pose
from axisight.rigid_body.consistent import (
    ConsistentParameters,
    consistent_parameters,
    identify_consistent,
    prior_spread,
    pseudo_inertia,
)
from axisight.rigid_body.contact import ContactCheck, contact_check
from axisight.rigid_body.coordinates import floating_motion
from axisight.rigid_body.coupling import MotorCoupling, gear_coupling
from axisight.rigid_body.drifting import track_parameters
from axisight.rigid_body.energy import (
    EnergyEstimate,
    EnergyRegression,
    energy_regression,
    energy_regressor,
    identify_by_energy,
)
from axisight.rigid_body.estimate import identify_rigid_body
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.floating import identify_floating
from axisight.rigid_body.fourier import FourierTrajectory
from axisight.rigid_body.friction import USUAL_TERMS, DriveTerms
from axisight.rigid_body.from_logs import LogIdentification, identify_logs
from axisight.rigid_body.motion import MotionEstimate, estimate_motion
from axisight.rigid_body.regressor import TorqueModel, torque_regressor
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.rigid_body.robot_values import identified_bodies
from axisight.rigid_body.trajectories import MotionLimits, TrajectoryDesign, optimize_trajectory

__all__ = [
    "USUAL_TERMS",
    "BaseParameters",
    "ConsistentParameters",
    "ContactCheck",
    "DriveTerms",
    "EnergyEstimate",
    "EnergyRegression",
    "FindingKind",
    "FloatingRecord",
    "FourierTrajectory",
    "IdentificationFinding",
    "LogIdentification",
    "MotionEstimate",
    "MotionLimits",
    "MotorCoupling",
    "RigidBodyEstimate",
    "TorqueModel",
    "TrajectoryDesign",
    "base_parameters",
    "consistent_parameters",
    "contact_check",
    "energy_regression",
    "energy_regressor",
    "estimate_motion",
    "floating_motion",
    "gear_coupling",
    "identified_bodies",
    "identify_by_energy",
    "identify_consistent",
    "identify_floating",
    "identify_logs",
    "identify_rigid_body",
    "optimize_trajectory",
    "prior_spread",
    "pseudo_inertia",
    "record_of_imu",
    "record_of_pose",
    "torque_regressor",
    "track_parameters",
]

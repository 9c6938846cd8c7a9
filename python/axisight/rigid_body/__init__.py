"""Rigid-body identification: torques linear in masses, inertias and friction (thesis 4.3)."""

from axisight.rigid_body.base import BaseParameters, base_parameters
from axisight.rigid_body.coupling import MotorCoupling, gear_coupling
from axisight.rigid_body.energy import (
    EnergyEstimate,
    EnergyRegression,
    energy_regression,
    energy_regressor,
    identify_by_energy,
)
from axisight.rigid_body.estimate import identify_rigid_body
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.friction import USUAL_TERMS, DriveTerms
from axisight.rigid_body.regressor import TorqueModel, torque_regressor
from axisight.rigid_body.result import RigidBodyEstimate

__all__ = [
    "USUAL_TERMS",
    "BaseParameters",
    "DriveTerms",
    "EnergyEstimate",
    "EnergyRegression",
    "FindingKind",
    "IdentificationFinding",
    "MotorCoupling",
    "RigidBodyEstimate",
    "TorqueModel",
    "base_parameters",
    "energy_regression",
    "energy_regressor",
    "gear_coupling",
    "identify_by_energy",
    "identify_rigid_body",
    "torque_regressor",
]

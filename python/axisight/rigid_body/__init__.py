"""Rigid-body identification: torques linear in masses, inertias and friction (thesis 4.3)."""

from axisight.rigid_body.coupling import MotorCoupling, gear_coupling
from axisight.rigid_body.friction import USUAL_TERMS, DriveTerms
from axisight.rigid_body.regressor import TorqueModel, torque_regressor

__all__ = [
    "USUAL_TERMS",
    "DriveTerms",
    "MotorCoupling",
    "TorqueModel",
    "gear_coupling",
    "torque_regressor",
]

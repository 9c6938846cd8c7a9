"""Gray-box identification of all axes of an arm together."""

from axisight.graybox.multiaxis.elastic_step import ElasticStep
from axisight.graybox.multiaxis.joint_step import JointStep
from axisight.graybox.multiaxis.operating_points import OperatingPoint
from axisight.graybox.multiaxis.procedure import RobotIdentification, identify_robot
from axisight.graybox.multiaxis.rigid_step import RigidStep

__all__ = [
    "ElasticStep",
    "JointStep",
    "OperatingPoint",
    "RigidStep",
    "RobotIdentification",
    "identify_robot",
]

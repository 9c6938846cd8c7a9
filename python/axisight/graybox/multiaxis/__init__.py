"""Gray-box identification of all axes of an arm together."""

from axisight.graybox.multiaxis.elastic_step import ElasticStep
from axisight.graybox.multiaxis.joint_step import JointStep
from axisight.graybox.multiaxis.operating_points import OperatingPoint
from axisight.graybox.multiaxis.procedure import RobotIdentification, identify_robot
from axisight.graybox.multiaxis.rigid_step import RigidStep
from axisight.graybox.multiaxis.robot_values import identified_robot

__all__ = [
    "ElasticStep",
    "JointStep",
    "OperatingPoint",
    "RigidStep",
    "RobotIdentification",
    "identified_robot",
    "identify_robot",
]

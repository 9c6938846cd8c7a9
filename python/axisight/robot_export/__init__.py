"""Export robots as models of Pinocchio and MuJoCo; each function lists what the model cannot state."""

from axisight.robot_export.mujoco_model import mjcf, to_mujoco
from axisight.robot_export.pinocchio_model import to_pinocchio

__all__ = ["mjcf", "to_mujoco", "to_pinocchio"]

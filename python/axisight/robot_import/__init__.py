"""Robots out of the model files that people have: URDF, MJCF, tables of Denavit and Hartenberg.

Apart from `axisight.robot`, which reads them by `load_robot` with what stands here.
"""

from axisight.robot.sources import is_model_file
from axisight.robot_import.load import import_robot

__all__ = ["import_robot", "is_model_file"]

"""Robots out of the model files that people have: URDF, MJCF, tables of Denavit and Hartenberg.

Apart from `axisight.robot`, which reads them by `load_robot` with what stands here.
"""

from axisight.robot_import.load import import_robot, is_model_file

__all__ = ["import_robot", "is_model_file"]

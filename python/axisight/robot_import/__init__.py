"""Import robots from model files: URDF, MJCF, and tables of Denavit and Hartenberg (DH).

`axisight.robot.load_robot` uses this package for model files.
"""

from axisight.robot.sources import is_model_file
from axisight.robot_import.load import import_robot

__all__ = ["import_robot", "is_model_file"]

"""Import of MJCF files, which MuJoCo itself compiles."""

from axisight.robot_import.mjcf.reader import read_mjcf

__all__ = ["read_mjcf"]

"""Read USD stages with articulations: bodies, joints, and the attributes of PhysX, Newton and MuJoCo."""

from axisight.robot_import.usd.reader import UsdModel, read_usd, usd_model

__all__ = ["UsdModel", "read_usd", "usd_model"]

"""Causes back into the user's own model: what a diagnosis found, in URDF, MJCF or a robot file."""

from axisight.write_back.model import Written, check_target, write_model

__all__ = ["Written", "check_target", "write_model"]

"""What a diagnosis found in a MuJoCo simulation: effects that an MJCF has no place for, at every step."""

from axisight.mujoco.applied import apply

__all__ = ["apply"]

"""Effects in a MuJoCo simulation that an MJCF cannot express, applied at every step."""

from axisight.mujoco.applied import apply

__all__ = ["apply"]

"""Effects and remainders in a MuJoCo simulation that an MJCF cannot express, applied at every step."""

from axisight.mujoco.applied import apply
from axisight.mujoco.remainder import apply_remainder

__all__ = ["apply", "apply_remainder"]

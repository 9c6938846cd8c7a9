"""Compensation of gravity in a compiled MJCF: `gravcomp` of bodies, `actuatorgravcomp` of joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Compensation:
    """A compensation of gravity that is the same for all bodies.

    ``gravity_share``: share of gravity that is left [1]. ``by_actuators``: the actuators carry what is
    compensated, else nothing does.
    """

    gravity_share: float = 1.0
    by_actuators: bool = False

    def notes(self) -> list[str]:
        """Return what the import made of it."""
        if self.by_actuators:
            return [
                "actuatorgravcomp: forces of actuators contain the weight of the arm, and a controller of position "
                "servos has gravity_compensation"
            ]
        if self.gravity_share != 1.0:
            return [
                f"gravcomp of all bodies: gravity is {self.gravity_share:g} times that of the file"
            ]
        return []


def compensation(model: Any) -> Compensation | None:
    """Return the compensation of gravity of a model; None if it differs between bodies or joints."""
    moves = (np.asarray(model.body_weldid) != 0) & (model.body_mass > 0)
    shares, joints = model.body_gravcomp[moves], np.asarray(model.jnt_actgravcomp, dtype=bool)
    if not np.any(model.body_gravcomp):
        return Compensation()
    if not len(shares) or np.any(shares != shares[0]) or joints.any() != joints.all():
        return None
    if joints.any():
        return Compensation(by_actuators=True) if shares[0] == 1.0 else None
    return Compensation(gravity_share=1.0 - float(shares[0]))

"""The machine that replaces the real robot of chapter 7: effects and their levels.

It is the preset robot with effects that its linear model lacks. Levels are those of the thesis, if it
gives them:

Coulomb friction
    0.644 Nm on axis 1 (Table 9.1, model m3). Section 7.2.3 says that axis 1 has less friction than
    the others; axes 2 and 3 get three times and two and a half times as much. That is 7 to 8 % of
    the torque that their motors hold against gravity. The sign is smoothed over 0.1 rad/s, one
    hundredth of the excitation.
Cubic gear stiffness
    Model m3 has k3 = 3.7e10 Nm/rad^3, which has little effect there. Section 9.5 finds this puzzling,
    because measured frequency responses stiffen by 15 % from one amplitude to the next.
    Axis 1 gets 1e11, between both. Axes 2 and 3 get 1e10: they carry the arm, and the static load
    deflects their springs to a stiffer region.
Ripple
    Table 8.1 on every axis, as in chapter 8.
Sensor noise
    That of the preset, variance 1.5e-10 rad^2 (section 8.1).

Two more nonlinearities follow without a setting: the static deflection of axes 2 and 3, and the motion
of the arm, which swings by 9 degrees with the square wave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.robot import Robot
from axisight_thesis.chapter8_setting import ripple
from axisight_thesis.context import Context

Complex = NDArray[np.complex128]

SMOOTHING_RAD_S = 0.1


@dataclass(frozen=True)
class Machine:
    """Levels of the effects on axes 1 to 3; the defaults are the standard machine."""

    coulomb_nm: tuple[float, float, float] = (0.644, 2.0, 1.6)
    cubic_nm_rad3: tuple[float, float, float] = (1e11, 1e10, 1e10)
    ripple: bool = True
    noise: bool = True

    def effects(self, robot: Robot) -> list[Effect]:
        """Return the effects on a robot of three axes."""
        out = self.springs()
        for axis, torque in enumerate(self.coulomb_nm, 1):
            levels = {"coulomb_nm": torque, "smoothing_rad_s": SMOOTHING_RAD_S}
            out.append(Effect("coulomb_friction", axis, levels))
        return out + (ripple(robot) if self.ripple else [])

    def springs(self) -> list[Effect]:
        """Return the cubic springs alone."""
        return [
            Effect("nonlinear_stiffness", axis, {"cubic_nm_rad3": level})
            for axis, level in enumerate(self.cubic_nm_rad3, 1)
        ]


REAL = Machine()
"""The stand-in for the real robot."""


def small_signal_response(
    context: Context,
    frequency_hz: NDArray[np.float64],
    joint_angle_rad: Sequence[float] | None = None,
    machine: Machine = REAL,
) -> Complex:
    """Return the response from torque to acceleration about rest without dry friction, (n_freq, 3, 3).

    It is the linear part of the machine: springs have their slope under the static load.
    """
    iw = 2j * np.pi * frequency_hz[:, None, None]
    position = context.robot.zoh_response(frequency_hz, joint_angle_rad, effects=machine.springs())
    return np.asarray(iw**2 * position.values)

"""The machine that replaces axis 1 of chapter 9: model m3 of Table 9.1 with a divided arm, and ripple.

The thesis fitted a two-mass model to a system with more masses: "to capture the two resonance peaks
around 60 and 80 rad/s, (at least) a three-mass model would be needed". The machine here keeps motor
inertia, total inertia, cubic spring and friction of m3, and divides its arm so that the small motion
has

=============================  ==========  =====================================
notch of m3, sqrt(k1 / J_a)    35.9 rad/s  kept
peaks                          58, 80      the spring stiffens the first towards 60
second notch                   76.4        follows: notches over peaks are fixed by
                                           the inertias, J_m / (J_m + r^2 J_a)
=============================  ==========  =====================================

Two notches and two peaks determine the chain (:func:`axisight.graybox.reconstruct_chain`). The gear
has the damping of m3; the arm's spring has the same ratio of damping to stiffness.
The ripple is that of Table 8.1, and the sensor that of section 8.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from axisight.effects import Effect
from axisight.graybox.spring_masses import SpringMassChain, reconstruct_chain
from axisight.robot import Robot
from axisight_thesis.chapter8_setting import ripple

M3 = {
    "motor_inertia": 0.0121,
    "arm_inertia": 1130.0,
    "stiffness": 1.46e6,
    "cubic_stiffness": 3.72e10,
    "damping": 2.63e3,
    "viscous_friction": 0.013,
    "coulomb_friction": 0.644,
}
"""Model m3 of Table 9.1."""

GEAR_RATIO = 1 / 224.3
PEAKS_RAD_S = (58.0, 80.0)
SMOOTHING_RAD_S = 0.01


@dataclass(frozen=True)
class Machine:
    """The machine; the defaults are the standard one."""

    cubic_nm_rad3: float = M3["cubic_stiffness"]
    coulomb_nm: float = M3["coulomb_friction"]
    third_mass: bool = True
    ripple: bool = True
    noise: bool = True

    def effects(self, robot: Robot) -> list[Effect]:
        """Return the effects on the axis, in addition to the chain."""
        found = [
            Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": self.cubic_nm_rad3}),
            Effect(
                "coulomb_friction",
                1,
                {"coulomb_nm": self.coulomb_nm, "smoothing_rad_s": SMOOTHING_RAD_S},
            ),
        ]
        return found + (ripple(robot) if self.ripple else [])

    def robot(self) -> Robot:
        """Return the chain with its controller and sensor."""
        return _robot(self.third_mass, self.noise)


@lru_cache(maxsize=2)
def chain(third_mass: bool = True) -> SpringMassChain:
    """Return the springs and masses of small motion, on the joint side of the gear."""
    motor = M3["motor_inertia"] / GEAR_RATIO**2
    if not third_mass:
        return SpringMassChain(
            inertia_kg_m2=np.array([motor, M3["arm_inertia"]]),
            stiffness_nm_rad=np.array([M3["stiffness"]]),
            damping_nm_s_rad=np.array([M3["damping"]]),
        )
    notch = float(np.sqrt(M3["stiffness"] / M3["arm_inertia"]))
    share = motor / (motor + M3["arm_inertia"])
    second = float(np.sqrt(share) * np.prod(PEAKS_RAD_S) / notch)
    made = reconstruct_chain(PEAKS_RAD_S, (notch, second), motor_inertia_kg_m2=motor)
    ratio = M3["damping"] / made.stiffness_nm_rad[0]
    return SpringMassChain(made.inertia_kg_m2, made.stiffness_nm_rad, ratio * made.stiffness_nm_rad)


_HEAD = """schema = "axisight.robot/1"
name = "axis 1 of chapter 9"
gravity = [0.0, 0.0, -9.81]
sample_time = 5.0e-4

[controller]
kind = "pi_velocity"
kp = [7.0]
ki = [180.0]

[sensor]
position_noise_std = {noise}

[operating_point]
joint_angle = [0.0]
"""

_JOINT = """
[[joint]]
name = "joint{number}"
kind = "{kind}"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
stiffness = {stiffness!r}
damping = {damping!r}
[joint.link]
mass = 100.0
com = [0.0, 0.0, 0.0]
inertia = [{inertia!r}, {inertia!r}, {inertia!r}, 0.0, 0.0, 0.0]
"""

_DRIVE = """[joint.drive]
gear_ratio = {ratio!r}
motor_inertia = {inertia!r}
viscous_friction = {viscous!r}
"""


@lru_cache(maxsize=4)
def _robot(third_mass: bool, noise: bool) -> Robot:
    links = chain(third_mass)
    text = _HEAD.format(noise=1.2e-5 if noise else 0.0)
    drive = _DRIVE.format(
        ratio=GEAR_RATIO, inertia=M3["motor_inertia"], viscous=M3["viscous_friction"]
    )
    parts = zip(
        links.inertia_kg_m2[1:], links.stiffness_nm_rad, links.damping_nm_s_rad, strict=True
    )
    for number, (inertia, stiffness, damping) in enumerate(parts, 1):
        text += _JOINT.format(
            number=number,
            kind="driven" if number == 1 else "elastic",
            stiffness=float(stiffness),
            damping=float(damping),
            inertia=float(inertia),
        )
        text += drive if number == 1 else ""
    return Robot.from_toml(text)

"""The arms in Jiminy: two elastic ones, two rigid ones."""

from __future__ import annotations

import numpy as np

from .arms import Arm, Joint, body


def elastic_palletizer() -> Arm:
    """Return a palletizer of four axes for 40 kg: soft gears, a drive cascade, a forearm that twists."""
    joints = (
        Joint("turn", (0.0, 0.0, 0.55), "z", body(240.0, (0.06, -0.03, 0.3), 20.0, 22.0, 16.0),
              2.2e6, 1.8e3, 1 / 175, 4.2e-3, 4.5e-3),
        Joint("lift", (0.28, 0.0, 0.45), "y", body(145.0, (0.05, 0.07, 0.55), 16.0, 16.0, 2.2),
              2.8e6, 2.2e3, 1 / 195, 4.2e-3, 5e-3),
        Joint("reach", (0.0, 0.0, 1.15), "y", None, 1.5e6, 1.2e3, 1 / 165, 2.9e-3, 3.2e-3),
        Joint("twist", (0.2, 0.0, 0.0), "x",
              body(95.0, (0.4, -0.04, 0.09), 2.4, 11.0, 11.0, 0.1, -0.2, 0.05), 4.5e5, 360.0),
        Joint("wrist", (1.0, 0.0, -0.1), "z",
              body(52.0, (0.11, 0.04, -0.2), 2.6, 2.7, 2.4, 0.05, 0.1, 0.03),
              6.0e4, 45.0, 1 / 90, 5e-4, 9e-4),
    )  # fmt: skip
    return Arm(
        "elastic palletizer", "jiminy", 1e-3, joints, "cascade",
        kp=np.array([0.75, 0.75, 0.4, 0.045]), ki=np.array([6.8, 6.8, 3.6, 0.4]),
        kv=np.array([9.0, 9.0, 9.0, 10.0]),
        noise_std_rad=5e-5, pose_rad=np.array([-0.1, 0.2, 0.1, 0.3]),
        top_speed_rad_s=np.array([105.0, 95.0, 105.0, 90.0]),
    )  # fmt: skip


def elastic_mount() -> Arm:
    """Return a mount of two axes that pans and tilts a camera of 12 kg: strain-wave gears."""
    joints = (
        Joint("pan", (0.0, 0.0, 0.15), "z", body(8.5, (0.01, 0.02, 0.14), 0.11, 0.09, 0.07),
              1.1e4, 7.0, 1 / 120, 4e-5, 1.1e-4),
        Joint("tilt", (0.0, 0.03, 0.28), "y",
              body(12.0, (0.13, -0.01, 0.06), 0.09, 0.26, 0.24, 0.01, -0.02, 0.005),
              9.0e3, 6.0, 1 / 100, 4e-5, 1e-4),
    )  # fmt: skip
    return Arm(
        "elastic camera mount", "jiminy", 1e-3, joints, "pi_velocity",
        kp=np.array([5.2e-3, 6.4e-3]), ki=np.array([5e-2, 6.2e-2]), kv=np.zeros(2),
        noise_std_rad=7e-5, pose_rad=np.array([0.2, 0.15]),
        top_speed_rad_s=np.array([100.0, 80.0]),
    )  # fmt: skip


def rigid_welder() -> Arm:
    """Return a rigid arm of five axes that weighs 60 kg and leads a welding torch."""
    joints = (
        Joint("base", (0.0, 0.0, 0.3), "z", body(20.0, (0.03, 0.01, 0.08), 0.25, 0.28, 0.2),
              ratio=1 / 110, motor_inertia=3.2e-4, viscous=9e-4),
        Joint("shoulder", (0.14, 0.0, 0.18), "y", body(17.0, (0.01, 0.05, 0.28), 0.75, 0.74, 0.1),
              ratio=1 / 130, motor_inertia=3.2e-4, viscous=1e-3),
        Joint("elbow", (0.0, 0.0, 0.6), "y", body(13.0, (0.08, -0.04, 0.1), 0.12, 0.2, 0.2),
              ratio=1 / 105, motor_inertia=2e-4, viscous=6e-4),
        Joint("roll", (0.22, 0.0, 0.12), "x", body(6.0, (0.2, 0.01, 0.015), 0.02, 0.12, 0.12),
              ratio=1 / 70, motor_inertia=6e-5, viscous=2e-4),
        Joint("bend", (0.48, 0.0, 0.0), "y",
              body(4.5, (0.1, 0.02, 0.05), 0.02, 0.03, 0.026, 0.001, -0.002, 0.001),
              ratio=1 / 65, motor_inertia=4e-5, viscous=1.2e-4),
    )  # fmt: skip
    return Arm(
        "rigid welding arm", "jiminy", 1e-3, joints, "pi_velocity",
        kp=np.array([0.1, 0.08, 0.04, 6e-3, 4.5e-3]),
        ki=np.array([0.8, 0.65, 0.32, 0.048, 0.036]), kv=np.zeros(5),
        noise_std_rad=5e-5, pose_rad=np.array([0.1, 0.2, 0.25, 0.4, 0.5]),
        top_speed_rad_s=np.array([95.0, 95.0, 95.0, 85.0, 85.0]),
    )  # fmt: skip


def rigid_assembler() -> Arm:
    """Return a rigid horizontal arm of four axes for assembly: a gripper of 1.6 kg tilts below its quill."""
    joints = (
        Joint("inner", (0.0, 0.0, 0.34), "z", body(11.0, (0.19, 0.02, 0.05), 0.05, 0.2, 0.22),
              ratio=1 / 50, motor_inertia=2.6e-4, viscous=8e-4),
        Joint("outer", (0.4, 0.0, 0.08), "z", body(8.0, (0.14, -0.015, 0.07), 0.04, 0.11, 0.12),
              ratio=1 / 50, motor_inertia=1.1e-4, viscous=4e-4),
        Joint("quill", (0.35, 0.0, 0.0), "z", body(2.2, (0.01, 0.0, -0.15), 0.02, 0.02, 0.004),
              ratio=1 / 25, motor_inertia=3e-5, viscous=8e-5),
        Joint("tilt", (0.03, 0.0, -0.28), "y",
              body(1.6, (0.07, 0.015, -0.05), 5e-3, 6e-3, 5e-3, 3e-4, 5e-4, 0.0),
              ratio=1 / 40, motor_inertia=1.2e-5, viscous=4e-5),
    )  # fmt: skip
    return Arm(
        "rigid assembly arm", "jiminy", 2e-3, joints, "cascade",
        kp=np.array([0.09, 0.022, 2.4e-3, 1e-3]), ki=np.array([0.7, 0.17, 0.019, 8e-3]),
        kv=np.array([7.0, 7.0, 8.0, 8.0]),
        noise_std_rad=7e-5, pose_rad=np.array([0.4, -0.7, 0.3, 0.2]),
        top_speed_rad_s=np.array([70.0, 75.0, 60.0, 70.0]),
    )  # fmt: skip

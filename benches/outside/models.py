"""The arms: own parameters of common shapes; elastic and rigid ones, each for one engine."""

from __future__ import annotations

import numpy as np

from .arms import Arm, Joint, body
from .models_jiminy import elastic_mount, elastic_palletizer, rigid_assembler, rigid_welder


def elastic_handler() -> Arm:
    """Return a handling arm of three axes: soft gears, an upper arm that twists."""
    joints = (
        Joint("column", (0.0, 0.0, 0.35), "z", body(95.0, (0.05, 0.0, 0.2), 4.0, 4.2, 3.0),
              2.6e5, 260.0, 1 / 140, 1.1e-3, 1.5e-3),
        Joint("shoulder", (0.18, 0.0, 0.4), "y", None, 3.1e5, 300.0, 1 / 150, 1.3e-3, 1.8e-3),
        Joint("upper_arm_twist", (0.0, 0.0, 0.0), "x",
              body(60.0, (0.02, 0.05, 0.38), 5.0, 5.2, 0.8), 5.5e5, 420.0),
        Joint("elbow", (0.0, 0.0, 0.78), "y",
              body(55.0, (0.45, -0.04, 0.08), 0.8, 4.5, 4.6, 0.05, -0.1, 0.02),
              1.4e5, 140.0, 1 / 120, 7e-4, 9e-4),
    )  # fmt: skip
    return Arm(
        "elastic handling arm", "exudyn", 1e-3, joints, "pi_velocity",
        kp=np.array([0.25, 0.3, 0.16]), ki=np.array([3.0, 3.6, 1.9]), kv=np.zeros(3),
        noise_std_rad=5e-5, pose_rad=np.array([0.0, 0.25, 0.1]),
        top_speed_rad_s=np.array([110.0, 90.0, 110.0]),
    )  # fmt: skip


def elastic_reacher() -> Arm:
    """Return a light arm of two axes in the vertical plane: strain-wave gears, a drive cascade."""
    joints = (
        Joint("lift", (0.0, 0.0, 0.2), "y", body(7.5, (0.0, 0.03, 0.21), 0.16, 0.17, 0.03),
              1.9e4, 11.0, 1 / 100, 9e-5, 2e-4),
        Joint("reach", (0.0, 0.0, 0.44), "y", body(5.2, (0.22, 0.0, 0.03), 0.02, 0.11, 0.11),
              7.5e3, 4.0, 1 / 80, 5e-5, 1.2e-4),
    )  # fmt: skip
    return Arm(
        "elastic reacher", "exudyn", 1e-3, joints, "cascade",
        kp=np.array([0.02, 0.0095]), ki=np.array([0.16, 0.075]), kv=np.array([11.0, 12.0]),
        noise_std_rad=6e-5, pose_rad=np.array([0.4, 0.5]),
        top_speed_rad_s=np.array([90.0, 90.0]),
    )  # fmt: skip


def rigid_six() -> Arm:
    """Return a rigid arm of six axes with a 4 kg tool."""
    joints = (
        Joint("base", (0.0, 0.0, 0.25), "z", body(14.0, (0.01, 0.0, 0.06), 0.12, 0.12, 0.08),
              ratio=1 / 101, motor_inertia=1.4e-4, viscous=4e-4),
        Joint("shoulder", (0.06, 0.0, 0.14), "y", body(16.0, (0.0, 0.04, 0.21), 0.42, 0.4, 0.09),
              ratio=1 / 121, motor_inertia=1.5e-4, viscous=5e-4),
        Joint("elbow", (0.0, 0.0, 0.46), "y", body(8.0, (0.1, -0.03, 0.04), 0.05, 0.12, 0.12),
              ratio=1 / 101, motor_inertia=8e-5, viscous=3e-4),
        Joint("forearm", (0.2, 0.0, 0.05), "x", body(4.5, (0.14, 0.0, 0.0), 0.012, 0.05, 0.05),
              ratio=1 / 80, motor_inertia=3e-5, viscous=1.2e-4),
        Joint("bend", (0.26, 0.0, 0.0), "y", body(2.2, (0.04, 0.0, 0.0), 0.005, 0.006, 0.006),
              ratio=1 / 80, motor_inertia=2.5e-5, viscous=1e-4),
        Joint("flange", (0.08, 0.0, 0.0), "x",
              body(4.0, (0.09, 0.02, 0.03), 0.015, 0.02, 0.018, -0.001, 0.001, 0.0),
              ratio=1 / 60, motor_inertia=2e-5, viscous=1e-4),
    )  # fmt: skip
    return Arm(
        "rigid six-axis arm", "drake", 2e-3, joints, "pi_velocity",
        kp=np.array([0.034, 0.032, 0.015, 0.0028, 0.0022, 0.0022]),
        ki=np.array([0.2, 0.19, 0.09, 0.016, 0.013, 0.013]), kv=np.zeros(6),
        noise_std_rad=8e-5, pose_rad=np.array([0.1, 0.3, 0.2, 0.0, 0.5, 0.3]),
        top_speed_rad_s=np.array([80.0, 80.0, 80.0, 80.0, 80.0, 80.0]),
    )  # fmt: skip


def rigid_stacker() -> Arm:
    """Return a rigid arm of four axes that stacks crates."""
    joints = (
        Joint("turn", (0.0, 0.0, 0.5), "z", body(110.0, (0.1, 0.0, 0.15), 5.0, 6.0, 6.0),
              ratio=1 / 160, motor_inertia=1.8e-3, viscous=2.5e-3),
        Joint("lift", (0.25, 0.0, 0.3), "y", body(75.0, (0.05, 0.0, 0.45), 9.0, 8.5, 1.2),
              ratio=1 / 190, motor_inertia=1.9e-3, viscous=2.5e-3),
        Joint("reach", (0.0, 0.0, 0.95), "y", body(58.0, (0.5, 0.05, 0.0), 1.0, 8.0, 8.2),
              ratio=1 / 150, motor_inertia=1.3e-3, viscous=2e-3),
        Joint("wrist", (1.05, 0.0, -0.15), "z", body(22.0, (0.06, 0.03, -0.12), 0.6, 0.55, 0.5),
              ratio=1 / 60, motor_inertia=3e-4, viscous=6e-4),
    )  # fmt: skip
    return Arm(
        "rigid stacking arm", "drake", 2e-3, joints, "pi_velocity",
        kp=np.array([0.35, 0.3, 0.22, 0.03]), ki=np.array([2.1, 1.8, 1.3, 0.18]), kv=np.zeros(4),
        noise_std_rad=8e-5, pose_rad=np.array([0.0, 0.2, 0.15, 0.4]),
        top_speed_rad_s=np.array([110.0, 110.0, 110.0, 70.0]),
    )  # fmt: skip


def elastic_scara() -> Arm:
    """Return a horizontal arm of three vertical axes: no axis carries weight, belts on the quill."""
    joints = (
        Joint("inner", (0.0, 0.0, 0.22), "z", body(6.2, (0.15, 0.01, 0.03), 0.02, 0.07, 0.08),
              6.5e3, 3.0, 1 / 80, 6e-5, 1.5e-4),
        Joint("outer", (0.325, 0.0, 0.03), "z", body(5.1, (0.14, -0.01, 0.06), 0.02, 0.05, 0.055),
              3.2e3, 1.6, 1 / 50, 4e-5, 1e-4),
        Joint("quill", (0.275, 0.0, 0.0), "z", body(2.4, (0.03, 0.015, -0.12), 0.012, 0.012, 0.006),
              6e2, 0.25, 1 / 30, 1.5e-5, 3e-5),
    )  # fmt: skip
    return Arm(
        "elastic horizontal arm", "dart", 1e-3, joints, "cascade",
        kp=np.array([0.017, 0.0078, 0.001]), ki=np.array([0.14, 0.062, 0.008]),
        kv=np.array([10.0, 10.0, 12.0]),
        noise_std_rad=6e-5, pose_rad=np.array([0.3, 0.6, -0.2]),
        top_speed_rad_s=np.array([100.0, 100.0, 90.0]),
    )  # fmt: skip


def elastic_loader() -> Arm:
    """Return a loader of three axes for 100 kg: soft gears, an upper arm that turns about itself."""
    joints = (
        Joint("turn", (0.0, 0.0, 0.45), "z", body(210.0, (0.12, 0.02, 0.25), 14.0, 16.0, 12.0),
              1.6e6, 700.0, 1 / 180, 3.2e-3, 4e-3),
        Joint("lift", (0.3, 0.0, 0.35), "y", body(130.0, (0.02, 0.06, 0.5), 11.0, 11.0, 1.5),
              2.0e6, 900.0, 1 / 200, 3.4e-3, 4e-3),
        Joint("neck", (0.0, 0.0, 1.05), "z", None, 2.0e6, 900.0),
        Joint("reach", (0.0, 0.0, 0.0), "y",
              body(140.0, (0.75, -0.05, 0.1), 3.0, 18.0, 18.0, 0.2, -0.4, 0.1),
              1.1e6, 500.0, 1 / 170, 2.6e-3, 3e-3),
    )  # fmt: skip
    return Arm(
        "elastic loader", "dart", 1e-3, joints, "pi_velocity",
        kp=np.array([0.4, 0.44, 0.24]), ki=np.array([4.0, 4.4, 2.4]), kv=np.zeros(3),
        noise_std_rad=5e-5, pose_rad=np.array([0.1, 0.2, 0.15]),
        top_speed_rad_s=np.array([110.0, 100.0, 110.0]),
    )  # fmt: skip


def rigid_desk() -> Arm:
    """Return a rigid desktop arm of five axes that weighs 3 kg."""
    joints = (
        Joint("pan", (0.0, 0.0, 0.06), "z", body(0.55, (0.0, 0.003, 0.03), 5e-4, 5e-4, 4e-4),
              ratio=1 / 50, motor_inertia=8e-6, viscous=3e-5),
        Joint("shoulder", (0.02, 0.0, 0.07), "y", body(0.9, (0.005, 0.01, 0.1), 4e-3, 4e-3, 5e-4),
              ratio=1 / 60, motor_inertia=8e-6, viscous=3e-5),
        Joint("elbow", (0.0, 0.0, 0.19), "y", body(0.75, (0.07, -0.008, 0.01), 4e-4, 2.5e-3, 2.5e-3),
              ratio=1 / 50, motor_inertia=6e-6, viscous=2e-5),
        Joint("pitch", (0.18, 0.0, 0.01), "y", body(0.4, (0.03, 0.0, 0.0), 1.5e-4, 2.5e-4, 2.5e-4),
              ratio=1 / 30, motor_inertia=3e-6, viscous=8e-6),
        Joint("roll", (0.07, 0.0, 0.0), "x", body(0.5, (0.05, 0.01, 0.012), 2.5e-4, 4e-4, 4e-4),
              ratio=1 / 20, motor_inertia=2e-6, viscous=2e-6),
    )  # fmt: skip
    return Arm(
        "rigid desktop arm", "dart", 2e-3, joints, "pi_velocity",
        kp=np.array([2.4e-3, 2.4e-3, 1.7e-3, 6e-4, 1.5e-4]),
        ki=np.array([1.4e-2, 1.4e-2, 1e-2, 3.6e-3, 9e-4]), kv=np.zeros(5),
        noise_std_rad=8e-5, pose_rad=np.array([0.2, 0.3, 0.2, 0.3, 0.4]),
        top_speed_rad_s=np.array([80.0, 80.0, 80.0, 70.0, 60.0]),
    )  # fmt: skip


def rigid_offset() -> Arm:
    """Return a rigid arm of six axes that weighs 90 kg; no two axes of its wrist meet in one point."""
    joints = (
        Joint("base", (0.0, 0.0, 0.2), "z", body(18.0, (0.0, -0.03, 0.02), 0.1, 0.09, 0.08),
              ratio=1 / 120, motor_inertia=4e-4, viscous=1.5e-3),
        Joint("shoulder", (0.0, 0.18, 0.0), "y", body(32.0, (0.0, -0.01, 0.33), 2.6, 2.5, 0.16),
              ratio=1 / 120, motor_inertia=4e-4, viscous=2e-3),
        Joint("elbow", (0.0, -0.13, 0.71), "y", body(17.0, (0.02, 0.02, 0.27), 0.7, 0.68, 0.06),
              ratio=1 / 100, motor_inertia=3e-4, viscous=8e-4),
        Joint("wrist_1", (0.0, 0.02, 0.58), "y", body(5.5, (0.0, 0.05, 0.01), 0.02, 0.015, 0.018),
              ratio=1 / 80, motor_inertia=6e-5, viscous=1.5e-4),
        Joint("wrist_2", (0.0, 0.13, 0.0), "z", body(5.0, (0.0, 0.01, 0.05), 0.018, 0.015, 0.012),
              ratio=1 / 80, motor_inertia=6e-5, viscous=1.2e-4),
        Joint("wrist_3", (0.0, 0.0, 0.12), "y",
              body(9.0, (0.03, 0.09, 0.06), 0.06, 0.05, 0.055, 0.003, -0.002, 0.004),
              ratio=1 / 70, motor_inertia=5e-5, viscous=1e-4),
    )  # fmt: skip
    return Arm(
        "rigid arm with an offset wrist", "dart", 2e-3, joints, "cascade",
        kp=np.array([0.125, 0.21, 0.06, 0.006, 0.0042, 0.0034]),
        ki=np.array([1.0, 1.7, 0.48, 0.048, 0.034, 0.027]),
        kv=np.array([8.0, 8.0, 8.0, 9.0, 9.0, 9.0]),
        noise_std_rad=8e-5, pose_rad=np.array([0.2, 0.5, 0.9, 0.3, 0.4, 0.2]),
        top_speed_rad_s=np.array([80.0, 80.0, 80.0, 80.0, 80.0, 70.0]),
    )  # fmt: skip


def elastic_rocker() -> Arm:
    """Return an arm of two crossed axes, both under weight: it rocks sideways and swings its arm."""
    joints = (
        Joint("rock", (0.0, 0.0, 0.6), "x", body(38.0, (0.12, 0.03, 0.15), 0.7, 0.9, 0.6),
              8.0e4, 80.0, 1 / 120, 4e-4, 8e-4),
        Joint("swing", (0.25, 0.0, 0.32), "y",
              body(24.0, (0.33, 0.02, 0.05), 0.15, 1.1, 1.1, 0.02, -0.03, 0.01),
              3.8e4, 38.0, 1 / 100, 2.5e-4, 5e-4),
    )  # fmt: skip
    return Arm(
        "elastic rocker", "bullet", 1e-3, joints, "pi_velocity",
        kp=np.array([0.055, 0.045]), ki=np.array([0.6, 0.5]), kv=np.zeros(2),
        noise_std_rad=6e-5, pose_rad=np.array([0.2, 0.3]),
        top_speed_rad_s=np.array([90.0, 90.0]),
    )  # fmt: skip


def elastic_crane() -> Arm:
    """Return an arm of three axes: soft gears, a drive cascade, a forearm that bends sideways."""
    joints = (
        Joint("column", (0.0, 0.0, 0.5), "z", body(150.0, (0.08, -0.02, 0.3), 8.0, 9.0, 6.0),
              7.0e5, 520.0, 1 / 160, 2e-3, 2.5e-3),
        Joint("lift", (0.22, 0.0, 0.45), "y", body(85.0, (0.03, 0.04, 0.42), 6.5, 6.4, 1.0),
              8.0e5, 600.0, 1 / 180, 2.2e-3, 2.8e-3),
        Joint("reach", (0.0, 0.0, 0.9), "y", None, 3.6e5, 270.0, 1 / 150, 1.5e-3, 1.8e-3),
        Joint("bend", (0.15, 0.0, 0.06), "z",
              body(70.0, (0.42, -0.03, 0.04), 0.9, 5.5, 5.6, 0.06, -0.12, 0.03), 6.0e5, 450.0),
    )  # fmt: skip
    return Arm(
        "elastic crane", "bullet", 1e-3, joints, "cascade",
        kp=np.array([0.3, 0.3, 0.19]), ki=np.array([2.4, 2.4, 1.5]),
        kv=np.array([10.0, 10.0, 10.0]),
        noise_std_rad=5e-5, pose_rad=np.array([0.15, 0.25, 0.1]),
        top_speed_rad_s=np.array([110.0, 95.0, 110.0]),
    )  # fmt: skip


def rigid_hanger() -> Arm:
    """Return a rigid arm of four axes that hangs from a ceiling and weighs 30 kg."""
    joints = (
        Joint("turn", (0.0, 0.0, -0.2), "z", body(9.0, (0.02, 0.01, -0.08), 0.06, 0.06, 0.04),
              ratio=1 / 90, motor_inertia=1.2e-4, viscous=3e-4),
        Joint("shoulder", (0.05, 0.0, -0.15), "y",
              body(11.0, (0.0, -0.02, -0.22), 0.25, 0.24, 0.04),
              ratio=1 / 110, motor_inertia=1.3e-4, viscous=4e-4),
        Joint("elbow", (0.0, 0.0, -0.42), "y", body(6.5, (0.03, 0.02, -0.18), 0.1, 0.1, 0.02),
              ratio=1 / 90, motor_inertia=7e-5, viscous=2e-4),
        Joint("wrist", (0.0, 0.0, -0.38), "z", body(3.5, (0.06, 0.03, -0.07), 0.014, 0.014, 0.01),
              ratio=1 / 50, motor_inertia=2e-5, viscous=5e-5),
    )  # fmt: skip
    return Arm(
        "rigid hanging arm", "bullet", 2e-3, joints, "pi_velocity",
        kp=np.array([0.011, 0.03, 0.014, 0.002]), ki=np.array([0.07, 0.19, 0.09, 0.013]),
        kv=np.zeros(4),
        noise_std_rad=8e-5, pose_rad=np.array([0.2, 0.5, -1.2, 0.3]),
        top_speed_rad_s=np.array([80.0, 80.0, 80.0, 70.0]),
    )  # fmt: skip


def rigid_forge() -> Arm:
    """Return a rigid arm of six axes that weighs 450 kg and holds 45 kg beside its last axis."""
    joints = (
        Joint("base", (0.0, 0.0, 0.6), "z", body(160.0, (0.1, 0.02, 0.1), 9.0, 9.0, 8.0),
              ratio=1 / 200, motor_inertia=4e-3, viscous=6e-3),
        Joint("shoulder", (0.35, 0.0, 0.25), "y", body(110.0, (0.04, -0.08, 0.5), 14.0, 13.0, 2.5),
              ratio=1 / 210, motor_inertia=4e-3, viscous=6e-3),
        Joint("elbow", (0.0, 0.0, 1.1), "y", body(75.0, (0.2, 0.06, 0.12), 2.0, 5.0, 5.0),
              ratio=1 / 190, motor_inertia=2.8e-3, viscous=4e-3),
        Joint("roll", (0.45, 0.0, 0.2), "x", body(40.0, (0.4, 0.01, 0.02), 0.5, 2.2, 2.2),
              ratio=1 / 140, motor_inertia=9e-4, viscous=1.5e-3),
        Joint("bend", (0.9, 0.0, 0.0), "y", body(18.0, (0.06, 0.0, 0.01), 0.2, 0.22, 0.22),
              ratio=1 / 120, motor_inertia=5e-4, viscous=9e-4),
        Joint("flange", (0.2, 0.0, 0.0), "x",
              body(45.0, (0.15, 0.06, 0.08), 0.9, 1.1, 1.0, -0.05, 0.04, 0.02),
              ratio=1 / 90, motor_inertia=4e-4, viscous=8e-4),
    )  # fmt: skip
    return Arm(
        "rigid forging arm", "bullet", 2e-3, joints, "cascade",
        kp=np.array([0.9, 0.9, 0.5, 0.07, 0.05, 0.04]),
        ki=np.array([6.0, 6.0, 3.4, 0.5, 0.35, 0.28]),
        kv=np.array([8.0, 8.0, 8.0, 9.0, 9.0, 9.0]),
        noise_std_rad=7e-5, pose_rad=np.array([0.1, 0.3, 0.2, 0.3, 0.6, 0.2]),
        top_speed_rad_s=np.array([100.0, 100.0, 100.0, 90.0, 90.0, 80.0]),
    )  # fmt: skip


ARMS = {
    "elastic_handler": elastic_handler,
    "elastic_reacher": elastic_reacher,
    "rigid_six": rigid_six,
    "rigid_stacker": rigid_stacker,
    "elastic_scara": elastic_scara,
    "elastic_loader": elastic_loader,
    "rigid_desk": rigid_desk,
    "rigid_offset": rigid_offset,
    "elastic_rocker": elastic_rocker,
    "elastic_crane": elastic_crane,
    "rigid_hanger": rigid_hanger,
    "rigid_forge": rigid_forge,
    "elastic_palletizer": elastic_palletizer,
    "elastic_mount": elastic_mount,
    "rigid_welder": rigid_welder,
    "rigid_assembler": rigid_assembler,
}


def arms_of(engines: list[str]) -> tuple[str, ...]:
    """Return the names of the arms of these engines, in order."""
    return tuple(name for name, build in ARMS.items() if build().engine in engines)

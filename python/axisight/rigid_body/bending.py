"""Bias of the inertias of a rigid-body fit from springs that it assumes rigid.

With held motors the arm swings at frequencies w_n. For a motor that moves it at w, the effective
inertia is J_a / (1 - (w / w_n)^2) instead of J_a, to first order J_a (1 + (w / w_n)^2). With several
springs of compliances c, the effective inertia at joint a is M_aa + w^2 sum_f c_f M_af^2, from the
expansion of the equations of motion about infinite stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.logs import Log
from axisight.rigid_body.findings import FindingKind, IdentificationFinding
from axisight.rigid_body.regressor import TorqueModel
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.robot import Robot

Array = NDArray[np.float64]

LEAST_BIAS = 0.01
"""Bias as a share of an arm inertia above which there is a warning."""
NOTED_BIAS = 0.001
"""Bias as a share of an arm inertia below which there is no finding."""
CLEARLY = 3.0
"""Bias in standard errors of the inertia above which there is a finding."""
POSES = 20
ABOVE_NOISE = 10.0
"""Least power of a line relative to the noise; noise exceeds it once in e^10 lines."""


def bending(
    estimate: RigidBodyEstimate, logs: Sequence[Log], q: Array, cutoff_hz: float
) -> list[IdentificationFinding]:
    """Return findings on inertias that bending makes too large, and on a cutoff above a resonance.

    ``q`` (n, n_joints) are joint angles of the logs. Springs are those of the robot file.
    """
    robot = estimate.model.robot
    springs, compliance = _springs(robot)
    if not len(springs):
        return []
    at = np.ascontiguousarray(q[:: max(1, len(q) // POSES)])
    mass = robot.inertia_matrix(at)
    root = np.sqrt(compliance)
    inside = mass[:, springs[:, None], springs] * root[:, None] * root
    lowest = 0.5 / np.pi / np.sqrt(np.linalg.eigvalsh(inside).max())
    out = []
    if cutoff_hz > lowest:
        text = (
            f"cutoff_hz: {cutoff_hz:g} Hz is above {lowest:.3g} Hz, where the arm swings with its "
            "motors held: what passes the filter there bends the arm and does not fit rigid bodies"
        )
        out.append(IdentificationFinding(FindingKind.BENDING, text, serious=False))
    joints = np.array(robot.axis_joints)
    arm = mass[:, joints, joints].mean(axis=0)
    felt = (mass[:, joints[:, None], springs] ** 2 * compliance).sum(axis=2).mean(axis=0)
    rms_hz = _motion_hz(estimate.model, logs, cutoff_hz)
    bias = (2 * np.pi * rms_hz) ** 2 * felt / arm
    share, error = _certainty(estimate, at)
    large = bias > LEAST_BIAS
    clear = (bias > NOTED_BIAS) & (bias * share > CLEARLY * error)
    chosen = np.flatnonzero(large | clear)
    if len(chosen):
        told = ", ".join(
            f"axis {i + 1} about {100 * bias[i]:.2g} % at {rms_hz[i]:.2g} Hz" for i in chosen
        )
        text = (
            f"the arm bends: with its motors held it swings at {lowest:.3g} Hz and above, and at the "
            "frequencies of the motion (rms of the acceleration) arm inertias come out too large: "
            f"{told}; move slower, or fit stiffness too"
        )
        names = tuple(robot.joint_names[joints[i]] for i in chosen)
        serious = bool(large.any())
        out.append(IdentificationFinding(FindingKind.BENDING, text, serious, names))
    return out


def _springs(robot: Robot) -> tuple[NDArray[np.intp], Array]:
    """Return the joints with elastic gears and the elastic joints, and their compliances [rad/Nm]."""
    stiffness = robot.parameters()
    rigid = dict(zip(robot.axis_joints, robot.axis_is_rigid, strict=True))
    joints = [
        joint
        for joint, name in enumerate(robot.joint_names)
        if not rigid.get(joint, False) and stiffness.get(f"{name}.stiffness", 0.0) > 0
    ]
    found = [1.0 / stiffness[f"{robot.joint_names[joint]}.stiffness"] for joint in joints]
    return np.array(joints, dtype=np.intp), np.array(found)


def _motion_hz(model: TorqueModel, logs: Sequence[Log], cutoff_hz: float) -> Array:
    """Return the rms frequency (n_axes,) of the joints' acceleration below the cutoff [Hz].

    It uses lines of the spectra of second differences that exceed the noise of the angles, estimated
    from the upper half of the spectra. It is zero if no line does.
    """
    power, moment = np.zeros(model.robot.n_axes), np.zeros(model.robot.n_axes)
    for log in logs:
        step = log.sample_time_s
        second = np.diff(model.coupling.joint_motion(log.position_rad), 2, axis=0) / step**2
        second = second * np.hanning(len(second) + 1)[:-1, None]
        density = np.abs(np.fft.rfft(second, axis=0)) ** 2
        f = np.fft.rfftfreq(len(second), step)
        gain = (2.0 / step * np.sin(np.pi * f * step)) ** 4
        above = f > max(cutoff_hz, 0.25 / step)
        floor = (density[above] / gain[above, None]).mean(axis=0) if above.any() else 0.0
        band = f <= cutoff_hz
        left = np.where(density[band] > ABOVE_NOISE * floor * gain[band, None], density[band], 0.0)
        # Energies give long logs more weight.
        scale = step / len(second) * step
        power += scale * left.sum(axis=0)
        moment += scale * (f[band, None] ** 2 * left).sum(axis=0)
    return np.sqrt(np.divide(moment, power, out=np.zeros_like(power), where=power > 0))


def _certainty(estimate: RigidBodyEstimate, q: Array) -> tuple[Array, Array]:
    """Return the share of the links in the inertia of each axis, and its relative standard error."""
    model, base = estimate.model, estimate.base
    zero = np.zeros_like(q)
    still = model.matrix(q, zero, zero)
    links = np.array([column.extra is None for column in model.columns])
    held = np.array([estimate.known.get(name, 0.0) for name in model.names])
    share, error = [], []
    for axis, joint in enumerate(model.robot.axis_joints):
        unit = zero.copy()
        unit[:, joint] = 1.0
        row = (model.matrix(q, zero, unit) - still)[:, axis].mean(axis=0)
        share.append((row * links) @ model.nominal / (row @ model.nominal))
        at = row[base.columns]
        spread = np.sqrt(at @ estimate.covariance @ at)
        error.append(spread / abs(at @ estimate.values + row @ held))
    # An infinite standard error keeps a bias without one from counting.
    return np.array(share), np.nan_to_num(np.array(error), nan=np.inf)

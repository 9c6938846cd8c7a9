"""MJCF through MuJoCo's own compiler: bodies, joints, armature, damping, dry friction."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from axisight.errors import MissingExtraError, RobotError
from axisight.robot_import.bodies import Body, Drive, Mass, Motion, Pose, Steps, Tree, still
from axisight.robot_import.outside import with_includes
from axisight.robot_import.xml_tree import Element

Array = NDArray[np.float64]


def read_mjcf(root: Element, path: Path) -> Tree:
    """Return the bodies of an MJCF file, whose root was read, as MuJoCo compiles it.

    Angles are MuJoCo's ``qpos``. What a serial chain cannot have is in the notes. Raises RobotError with file,
    line and element, also for files outside the folder of the model, and MissingExtraError without MuJoCo.
    """
    elements = with_includes(root, path)
    return _Compiled(_compiled(path), elements, path).tree()


def _compiled(path: Path) -> Any:
    try:
        return _mujoco().MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise RobotError(f"{path}: MuJoCo: {' '.join(str(error).split())}") from None


def _mujoco() -> Any:
    """Return MuJoCo: only those who have such a file load it."""
    try:
        return import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError(
            "MJCF is compiled by MuJoCo itself: pip install 'axisight[mujoco]'"
        ) from error


class _Compiled:
    """A compiled model and the lines of its file."""

    def __init__(self, model: Any, elements: Iterable[Element], path: Path) -> None:
        self.mujoco, self.model, self.path = _mujoco(), model, path
        self.lines = {
            (e.tag, e.attributes["name"]): e.where
            for root in elements
            for e in root.walk()
            if "name" in e.attributes
        }
        kinds = self.mujoco.mjtJoint
        self.motions: dict[int, Motion] = {
            int(kinds.mjJNT_HINGE): "revolute",
            int(kinds.mjJNT_SLIDE): "prismatic",
        }

    def tree(self) -> Tree:
        """Return its bodies, parents first, each joint one of its own."""
        model = self.model
        # The world is a body without a joint.
        bodies = {
            "world": Body("world", None, "", "fixed", still(), np.zeros(3), None, str(self.path))
        }
        names = [self._name("body", i) if i else "world" for i in range(model.nbody)]
        ratios, self.servos = self._ratios(), self._servos()
        for i in range(1, model.nbody):
            parent = names[model.body_parentid[i]]
            pose = Pose(_rotation(model.body_quat[i]), model.body_pos[i].copy())
            first, count = model.body_jntadr[i], model.body_jntnum[i]
            anchor = np.zeros(3)
            for j in range(first, first + count):
                last = j == first + count - 1
                one = self._joint(j, names[i], parent, pose, anchor, ratios, bare=not last)
                bodies[one.name] = one
                anchor = model.jnt_pos[j].copy()
                parent, pose = one.name, Pose(np.eye(3), np.zeros(3))
            pose = pose @ Pose(np.eye(3), -anchor)
            where = self._where("body", names[i])
            bodies[names[i]] = Body(
                names[i], parent, "", "fixed", pose, np.zeros(3), self._mass(i), where
            )
        tree = Tree(
            self._model_name(),
            bodies,
            str(self.path),
            np.array(model.opt.gravity),
            self._notes(ratios),
            self._steps(),
        )
        return tree

    def _steps(self) -> Steps | None:
        """Return the steps of the integrator; none of Runge-Kutta's, which are too exact to show."""
        kinds, option = self.mujoco.mjtIntegrator, self.model.opt
        if option.integrator == kinds.mjINT_RK4:
            return None
        if option.integrator != kinds.mjINT_EULER:
            return Steps(option.timestep, 1, 1)
        explicit = option.disableflags & self.mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        return Steps(option.timestep, -1, -1 if explicit else 1)

    def _model_name(self) -> str:
        """Return the name of the model, that of the file without one."""
        name = self.model.names.split(b"\0", 1)[0].decode()
        return name if name and name != "MuJoCo Model" else self.path.stem

    def _joint(
        self,
        j: int,
        body: str,
        parent: str,
        pose: Pose,
        anchor: Array,
        ratios: dict[int, float],
        *,
        bare: bool,
    ) -> Body:
        """Return the joint as a body without mass, at its anchor."""
        model = self.model
        name, axis = self._name("joint", j), model.jnt_axis[j].copy()
        where = self._where("joint", name)
        motion = self.motions.get(int(model.jnt_type[j]), "other")
        refused = (
            ""
            if motion != "other"
            else (
                "expected hinge and slide joints between base and tip, got a ball or free joint: choose "
                "them beyond it by --base and --tip"
            )
        )
        at = pose @ Pose(np.eye(3), model.jnt_pos[j] - anchor)
        if motion != "other":
            dof, zero = model.jnt_dofadr[j], float(model.qpos0[model.jnt_qposadr[j]])
            at = at @ _moved(motion, axis, -zero)
            drive = Drive(
                ratios.get(j, 1.0),
                float(model.dof_armature[dof]),
                float(model.dof_damping[dof]),
                float(model.dof_frictionloss[dof]),
                float(model.jnt_stiffness[j]),
                float(model.qpos_spring[model.jnt_qposadr[j]]),
                self.servos.get(j),
                *self._torque_path(j),
            )
        else:
            drive = Drive()
        limits = tuple(map(float, model.jnt_range[j])) if model.jnt_limited[j] else None
        # A second body of that name cannot be: MuJoCo's names have no such sign.
        return Body(
            f"{body}\N{RIGHTWARDS ARROW}{name}",
            parent,
            name,
            motion,
            at,
            axis,
            None,
            where,
            drive,
            limits,  # type: ignore[arg-type]
            refused,
            bare=bare,
            of=body,
        )

    def _mass(self, i: int) -> Mass | None:
        model = self.model
        if model.body_mass[i] == 0:
            return None
        rotation = _rotation(model.body_iquat[i])
        inertia = rotation @ np.diag(model.body_inertia[i]) @ rotation.T
        return Mass(float(model.body_mass[i]), model.body_ipos[i].copy(), inertia)

    def _ratios(self) -> dict[int, float]:
        """Return the gear ratio of joints that one motor drives: one over its gear."""
        found = self._of_one(self.model.actuator_gear[:, 0])
        return {j: 1.0 / g for j, g in found.items() if g != 0}

    def _torque_path(self, j: int) -> tuple[float, float, float, float]:
        """Return gain, limit [Nm], delay [s] and lag [s] of a joint that one motor drives; of a servo its delay."""
        model, plain = self.model, (1.0, math.inf, 0.0, 0.0)
        if j in self.servos:
            return (*plain[:2], self._of_one(_delays(model))[j], plain[3])
        every = (
            model.actuator_gainprm[:, 0],
            np.where(_is_limited(model), model.actuator_ctrlrange[:, 1], math.inf),
            _delays(model),
            _lags(model),
        )
        found = (
            self._of_one(values).get(j, usual) for values, usual in zip(every, plain, strict=True)
        )
        gain, limit, delay, lag = found
        return gain, limit, delay, lag

    def _of_one(self, values: Array) -> dict[int, float]:
        """Return values of actuators by joint, of joints that one motor or servo drives."""
        model, kinds = self.model, self.mujoco.mjtTrn
        found: dict[int, list[float]] = {}
        for i in range(model.nu):
            known = _is_motor(model, i) or _is_servo(model, i)
            if int(model.actuator_trntype[i]) == int(kinds.mjTRN_JOINT) and known:
                found.setdefault(int(model.actuator_trnid[i, 0]), []).append(float(values[i]))
        return {j: x[0] for j, x in found.items() if len(x) == 1}

    def _servos(self) -> dict[int, tuple[float, float]]:
        """Return the gains of position and speed of joints whose only actuator is told positions."""
        model, kinds = self.model, self.mujoco.mjtTrn
        on_joints = [
            i for i in range(model.nu) if int(model.actuator_trntype[i]) == int(kinds.mjTRN_JOINT)
        ]
        joints = [int(model.actuator_trnid[i, 0]) for i in on_joints]
        return {
            j: (float(model.actuator_gainprm[i, 0]), -float(model.actuator_biasprm[i, 2]))
            for i, j in zip(on_joints, joints, strict=True)
            if joints.count(j) == 1 and _is_servo(model, i)
        }

    def _notes(self, ratios: dict[int, float]) -> list[str]:
        """Return what of the file a serial chain with drives does not say."""
        model = self.model
        out = []
        for i in range(model.nu):
            is_servo = int(model.actuator_trnid[i, 0]) in self.servos and _is_servo(model, i)
            if not (_is_motor(model, i) or is_servo):
                out.append(
                    f"actuator {self._name('actuator', i)!r} is no plain motor: its gain and bias are the "
                    f"controller's, to be said in the drive data"
                )
            if model.actuator_ctrllimited[i] and (is_servo or not _is_limited(model)[i]):
                out.append(
                    f"actuator {self._name('actuator', i)!r}: limits of its command left out: expected those of a "
                    f"torque, the same both ways"
                )
            if model.actuator_forcelimited[i]:
                out.append(f"actuator {self._name('actuator', i)!r}: limits of its force left out")
        counts = {
            "equality constraints": model.neq,
            "tendons": model.ntendon,
            "mocap bodies": model.nmocap,
            "plugins": model.nplugin,
            "flexes": model.nflex,
        }
        out += [f"{count} {what} left out" for what, count in counts.items() if count]
        if model.opt.density > 0 or model.opt.viscosity > 0:
            out.append("drag of the medium left out")
        return out

    def _name(self, kind: str, i: int) -> str:
        """Return the name of an element, ``<kind> <number>`` without one."""
        known = {
            "body": self.mujoco.mjtObj.mjOBJ_BODY,
            "joint": self.mujoco.mjtObj.mjOBJ_JOINT,
            "actuator": self.mujoco.mjtObj.mjOBJ_ACTUATOR,
        }
        name = self.mujoco.mj_id2name(self.model, known[kind], i)
        return name or f"{kind} {i}"

    def _where(self, tag: str, name: str) -> str:
        return self.lines.get((tag, name), f"{self.path}, <{tag} {name!r}>")


# Torque per command of what may still be a motor: others have commands that are no torques.
_GAINS = (0.2, 3.0)


def is_gain(value: float) -> bool:
    """Whether a gain of an actuator may be that of a motor: torque per torque that is commanded."""
    return _GAINS[0] <= value <= _GAINS[1]


def _is_motor(model: Any, i: int) -> bool:
    """Whether an actuator is a source of torque: a gain about one, no bias, no state but that of a lag."""
    plain = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 0
    torque = is_gain(float(model.actuator_gainprm[i, 0]))
    return bool(plain and torque and model.actuator_dyntype[i] in (0, *_FILTERS))


# Kinds of dynamics of actuators that are lags of first order, by MuJoCo's numbers.
_FILTERS = (2, 3)


def _lags(model: Any) -> Array:
    """Return the lag of every actuator [s]."""
    filters = np.isin(model.actuator_dyntype, _FILTERS)
    return np.where(filters, model.actuator_dynprm[:, 0], 0.0)


def _delays(model: Any) -> Array:
    """Return the delay of every actuator [s]; MuJoCo knew none for long."""
    return np.asarray(getattr(model, "actuator_delay", np.zeros(model.nu)), dtype=np.float64)


def _is_limited(model: Any) -> NDArray[np.bool_]:
    """Return which commands are limited, as much one way as the other."""
    low, high = model.actuator_ctrlrange.T
    return np.asarray((model.actuator_ctrllimited == 1) & (high > 0) & (low == -high))


def _is_servo(model: Any, i: int) -> bool:
    """Whether an actuator is told positions: ``kp (target - length) - kd speed``, without a state of its own."""
    affine = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 1
    kp, bias = model.actuator_gainprm[i, 0], model.actuator_biasprm[i]
    law = bias[0] == 0 and bias[1] == -kp and bias[2] <= 0 and kp > 0
    return bool(affine and law and model.actuator_dyntype[i] == 0)


def _rotation(quaternion: Array) -> Array:
    """Return the rotation (3, 3) of a quaternion with the real part first."""
    return np.asarray(Rotation.from_quat(np.roll(quaternion, -1)).as_matrix())


def _moved(motion: Motion, axis: Array, by: float) -> Pose:
    """Return the pose after a joint has moved by an angle [rad] or way [m]."""
    if motion == "prismatic":
        return Pose(np.eye(3), by * axis)
    return Pose(Rotation.from_rotvec(by * axis).as_matrix(), np.zeros(3))

"""Read MJCF with MuJoCo's own compiler: bodies, joints, armature, damping and dry friction."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import MissingExtraError, RobotError
from axisight.robot import JointLimits
from axisight.robot_import.bodies import (
    Body,
    Drive,
    Mass,
    Motion,
    Pose,
    Steps,
    Tree,
    mimics,
    still,
)
from axisight.robot_import.mjcf.actuators import Actuators, numbers
from axisight.robot_import.mjcf.gravity import Compensation, compensation
from axisight.robot_import.mjcf.joint_limits import limits_of_joint
from axisight.robot_import.mjcf.loops import closes_a_loop, joints_in_loops
from axisight.robot_import.mjcf.notes import notes_of
from axisight.robot_import.mjcf.sensors import reading_delay_s
from axisight.robot_import.outside import with_includes
from axisight.robot_import.xml_tree import Element

Array = NDArray[np.float64]

# Smallest and largest impedance of a constraint; MuJoCo clips others to it.
_IMPEDANCES = (1e-4, 1.0 - 1e-4)


def read_mjcf(root: Element, path: Path) -> Tree:
    """Return the bodies of an MJCF file as MuJoCo compiles it; ``root`` is its root element.

    Joint angles are MuJoCo's ``qpos``. Notes list what a serial chain cannot have. Raises RobotError with
    file, line and element, also for files outside the folder of the model. Raises MissingExtraError if MuJoCo
    is not installed.
    """
    elements = with_includes(root, path)
    return _Compiled(_compiled(path), elements, path).tree()


def _compiled(path: Path) -> Any:
    try:
        return _mujoco().MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise RobotError(f"{path}: MuJoCo: {' '.join(str(error).split())}") from None


def _mujoco() -> Any:
    """Return the module MuJoCo, imported only for MJCF files."""
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
        parts = [e for root in elements for e in root.walk()]
        self.lines = {
            (e.tag, e.attributes["name"]): e.where for e in parts if "name" in e.attributes
        }
        worlds = [e.where for e in parts if e.tag == "worldbody"]
        self.world = worlds[0] if worlds else str(path)
        # A free joint may have no name, so it is looked up by the name of its body.
        self.free = {
            body.attributes.get("name", ""): joint.where
            for body in parts
            if body.tag == "body"
            for joint in body.all("freejoint")
        }
        kinds = self.mujoco.mjtJoint
        self.motions: dict[int, Motion] = {
            int(kinds.mjJNT_HINGE): "revolute",
            int(kinds.mjJNT_SLIDE): "prismatic",
        }

        # Joints that an equality constraint makes functions of other joints.
        coupled = model.eq_active0 & (model.eq_type == self.mujoco.mjtEq.mjEQ_JOINT)
        self.masters = {
            int(model.eq_obj1id[i]): int(model.eq_obj2id[i])
            for i in np.flatnonzero(coupled)
            if model.eq_obj2id[i] >= 0
        }

        self.loops = joints_in_loops(self.mujoco, model)

    def tree(self) -> Tree:
        """Return the bodies, parents first; every joint is a body of its own."""
        model = self.model
        # The world is a body without a joint.
        bodies = {"world": Body("world", None, "", "fixed", still(), np.zeros(3), None, self.world)}
        names = [self._name("body", i) if i else "world" for i in range(model.nbody)]
        actuators = Actuators(model)
        for i in range(1, model.nbody):
            parent = names[model.body_parentid[i]]
            pose = Pose(_rotation(model.body_quat[i]), model.body_pos[i].copy())
            first, count = model.body_jntadr[i], model.body_jntnum[i]
            anchor = np.zeros(3)
            for j in range(first, first + count):
                last = j == first + count - 1
                one = self._joint(j, names[i], parent, pose, anchor, actuators, bare=not last)
                bodies[one.name] = one
                anchor = model.jnt_pos[j].copy()
                parent, pose = one.name, Pose(np.eye(3), np.zeros(3))
            pose = pose @ Pose(np.eye(3), -anchor)
            where = self._where("body", names[i])
            bodies[names[i]] = Body(
                names[i], parent, "", "fixed", pose, np.zeros(3), self._mass(i), where
            )
        weight = compensation(model) or Compensation()
        return Tree(
            self._model_name(),
            bodies,
            str(self.path),
            np.array(model.opt.gravity),
            notes_of(model, self._name),
            self._steps(),
            weight.gravity_share,
            weight.by_actuators,
        )

    def _steps(self) -> Steps | None:
        """Return the time steps of the integrator; None for Runge-Kutta, whose step error is negligible."""
        kinds, option = self.mujoco.mjtIntegrator, self.model.opt
        if option.integrator == kinds.mjINT_RK4:
            return None
        if option.integrator != kinds.mjINT_EULER:
            return Steps(option.timestep, 1, 1)
        explicit = option.disableflags & self.mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        return Steps(option.timestep, -1, -1 if explicit else 1)

    def _model_name(self) -> str:
        """Return the name of the model, or of the file if the model has none."""
        name = self.model.names.split(b"\0", 1)[0].decode()
        return name if name and name != "MuJoCo Model" else self.path.stem

    def _joint(
        self,
        j: int,
        body: str,
        parent: str,
        pose: Pose,
        anchor: Array,
        actuators: Actuators,
        *,
        bare: bool,
    ) -> Body:
        """Return a joint as a massless body at its anchor."""
        model = self.model
        name, axis = self._name("joint", j), model.jnt_axis[j].copy()
        where = self._where("joint", name)
        if ("joint", name) not in self.lines:
            where = self.free.get(body, where)
        motion = self.motions.get(int(model.jnt_type[j]), "other")
        follows = self._name("joint", self.masters[j]) if j in self.masters else ""
        refused = mimics(follows) if follows else ""
        if j in self.loops:
            refused = closes_a_loop(self._name("equality", self.loops[j]))
        if motion == "other":
            refused = (
                "expected hinge and slide joints between base and tip, got a ball or free joint: choose "
                "them beyond it by --base and --tip"
            )
        at = pose @ Pose(np.eye(3), model.jnt_pos[j] - anchor)
        if motion != "other":
            dof, zero = model.jnt_dofadr[j], float(model.qpos0[model.jnt_qposadr[j]])
            at = at @ _moved(motion, axis, -zero)
            added = rotor, damper, drag = actuators.added(j)
            of_joint = _beyond(model, "dof_dampingpoly", dof)
            drive = Drive(
                actuators.ratios().get(j, 1.0),
                float(model.dof_armature[dof]) + rotor,
                float(model.dof_damping[dof]) + damper,
                float(model.dof_frictionloss[dof]),
                *self._friction_law(dof),
                float(model.jnt_stiffness[j]),
                float(model.qpos_spring[model.jnt_qposadr[j]]),
                actuators.servos().get(j),
                *actuators.torque_path(j),
                drag=of_joint[0] + drag,
                of_actuators=added,
                damping_beyond=of_joint,
                spring_beyond=_beyond(model, "jnt_stiffnesspoly", j),
                devices=actuators.devices(j),
                offset_nm=actuators.offset_nm(j),
                reading_delay_s=reading_delay_s(model, j),
                force_limits=actuators.force_limits(j),
                speed_gain=actuators.speed_gains().get(j),
                sums_up=actuators.has_sum(j),
            )
        else:
            drive = Drive()
        # The arrow makes the name unique, as names in MuJoCo cannot contain it.
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
            JointLimits() if motion == "other" else limits_of_joint(actuators, j),
            refused,
            bare=bare,
            of=body,
            follows=follows,
            is_free=int(model.jnt_type[j]) == int(self.mujoco.mjtJoint.mjJNT_FREE),
        )

    def _friction_law(self, dof: int) -> tuple[float, float]:
        """Return corner [rad/s] and lead [s] of MuJoCo's friction on a degree of freedom, joint-side.

        MuJoCo's friction f of at most F is a soft constraint. Below F it makes a + b v = -R f, with speed v and
        acceleration a. With the inverse inertia A and the acceleration a0 = a - A f without friction that is
        f = -clip((a0 + b v) / (A + R), -F, F). So it changes sign with v + a0 / b, over the corner F (A + R) / b.
        ``solref`` gives b. A is taken at the initial pose, as in R = A (1 - d) / d, with the impedance d at the
        beginning of ``solimp``. A constraint without damping stops nothing: then the usual corner, and no lead.
        """
        model = self.model
        least, most = np.clip(model.dof_solimp[dof][:2], *_IMPEDANCES)
        time, damping = model.dof_solref[dof]
        if time > 0:
            safe = not model.opt.disableflags & self.mujoco.mjtDisableBit.mjDSBL_REFSAFE
            damping = -2.0 / max(time, 2.0 * model.opt.timestep if safe else 0.0)
        if damping >= 0:
            return Drive.friction_corner_rad_s, Drive.friction_lead_s
        impedance = least if model.dof_solimp[dof][2] > 0 else 0.5 * (least + most)
        lead = most / -damping
        corner = model.dof_frictionloss[dof] * model.dof_invweight0[dof] / impedance * lead
        return float(corner), float(lead)

    def _mass(self, i: int) -> Mass | None:
        model = self.model
        if model.body_mass[i] == 0:
            return None
        rotation = _rotation(model.body_iquat[i])
        inertia = rotation @ np.diag(model.body_inertia[i]) @ rotation.T
        return Mass(float(model.body_mass[i]), model.body_ipos[i].copy(), inertia)

    def _name(self, kind: str, i: int) -> str:
        """Return the name of an element, or ``<kind> <number>`` if it has none."""
        known = getattr(self.mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        name = self.mujoco.mj_id2name(self.model, known, i)
        return name or f"{kind} {i}"

    def _where(self, tag: str, name: str) -> str:
        return self.lines.get((tag, name), f"{self.path}, <{tag} {name!r}>")


def _beyond(model: Any, name: str, i: int) -> tuple[float, float]:
    """Return the quadratic and cubic coefficient of a force of degree of freedom or joint ``i``."""
    first, second = numbers(model, name, np.zeros((i + 1, 2)))[i, :2].tolist()
    return first, second


def _rotation(quaternion: Array) -> Array:
    """Return the rotation (3, 3) of a quaternion (4,) with the real part first."""
    return np.asarray(
        scipy.spatial.transform.Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    )


def _moved(motion: Motion, axis: Array, by: float) -> Pose:
    """Return the pose after a joint has moved by an angle [rad] or a distance [m]."""
    if motion == "prismatic":
        return Pose(np.eye(3), by * axis)
    return Pose(scipy.spatial.transform.Rotation.from_rotvec(by * axis).as_matrix(), np.zeros(3))

"""How often does a diagnosis of a robot with branches name the right cause first? MuJoCo is the machine.

A two-arm robot, a quadruped whose trunk is fixed to a stand, and a hand follow references in MuJoCo under computed
torque. Each machine has one effect more than its model file. The logs of positions and torques and the model file are
diagnosed by inverse dynamics. Prints for each machine the verdict, and at the end the shares.

    python benches/branches.py FOLDER [--robots hand] [--effects ripple] [--json FILE]

FOLDER holds the URDF files of example-robot-data (github.com/Gepetto/example-robot-data). MuJoCo reads them by its
own reader, without meshes. The axis of each effect follows from the numbers of robot and effect; another mass or
centre goes to the next axis if it would change no torque by a tenth.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Log, Robot, diagnose
from axisight.robot_import import import_robot

Array = NDArray[np.float64]

# File, and the links at which the branches end; all branches if none are named.
ROBOTS = {
    "two arms": ("g1_29dof_rev_1_0.urdf", ["left_rubber_hand", "right_rubber_hand"]),
    "quadruped": ("a1.urdf", []),
    "hand": ("allegro_right_hand.urdf", []),
}
STEP_S, PER_SAMPLE = 0.001, 4
RUNS, DURATION_S = 3, 15.0
# Standard deviation of the noise of positions [rad], and of torques as a share of the rms torque of each axis.
NOISE_RAD, NOISE_SHARE = 2e-5, 3e-3
# Bandwidth of the controller [rad/s].
BANDWIDTH = 40.0
# Least share of the torque of an axis that another body must change.
SHOWN = 0.1


@dataclass(frozen=True)
class Along:
    """What a motor does along the references of the nominal model, rms: torque [Nm], speed and so on [rad, s]."""

    torque: float
    speed: float
    acceleration: float
    angle: float


# Changes the compiled model at a joint, and returns a torque [Nm] of angle and speed that the model cannot have.
Change = Callable[[mujoco.MjModel, int, Along], Callable[[float, float], float] | None]


def _field(name: str, size: Callable[[Along], float]) -> Change:
    def change(model: mujoco.MjModel, joint: int, along: Along) -> None:
        getattr(model, name)[model.jnt_dofadr[joint]] += size(along)

    return change


def _mass(model: mujoco.MjModel, joint: int, along: Along) -> None:
    del along
    model.body_mass[model.jnt_bodyid[joint]] *= 1.4


def _com(model: mujoco.MjModel, joint: int, along: Along) -> None:
    """Move the centre of mass across the axis, by a third of the radius of gyration."""
    del along
    body = model.jnt_bodyid[joint]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    across = np.cross(model.jnt_axis[joint], turn.reshape(3, 3)[:, 0])
    if np.linalg.norm(across) < 0.3:
        across = np.cross(model.jnt_axis[joint], turn.reshape(3, 3)[:, 1])
    gyration = np.sqrt(model.body_inertia[body].max() / model.body_mass[body])
    model.body_ipos[body] += gyration / 3 * across / np.linalg.norm(across)


def _gain(model: mujoco.MjModel, joint: int, along: Along) -> None:
    del along
    model.actuator(model.joint(joint).name).gear[0] *= 0.85


def _spring(model: mujoco.MjModel, joint: int, along: Along) -> None:
    model.jnt_stiffness[joint] = 0.3 * along.torque / along.angle


EFFECTS: dict[str, tuple[str, Change]] = {
    "dry friction": ("coulomb_friction", _field("dof_frictionloss", lambda a: 0.2 * a.torque)),
    "viscous": ("viscous_friction", _field("dof_damping", lambda a: 0.2 * a.torque / a.speed)),
    "link mass": ("link_mass", _mass),
    "centre of mass": ("link_com", _com),
    "rotor": ("rotor_inertia", _field("dof_armature", lambda a: 0.3 * a.torque / a.acceleration)),
    "torque constant": ("torque_constant", _gain),
    "offset": ("torque_offset", lambda _m, _j, a: lambda _q, _v: 0.2 * a.torque),
    "spring": ("cable_stiffness", _spring),
    "ripple": ("torque_ripple", lambda _m, _j, a: lambda q, _v: 0.15 * a.torque * np.sin(11 * q)),
    "drag": (
        "quadratic_drag",
        lambda _m, _j, a: lambda _q, v: -0.2 * a.torque * abs(v) * v / a.speed**2,
    ),
}


def bare(path: Path) -> str:
    """Return a URDF without shapes and friction, so that MuJoCo needs no mesh and each effect is the only one."""
    root = ElementTree.parse(path).getroot()
    for joint in root.iter("joint"):
        for stated in joint.findall("dynamics"):
            joint.remove(stated)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for other in [child for child in root if child.tag not in ("link", "joint")]:
        root.remove(other)
    for inertia in root.iter("inertia"):
        _balance(inertia)
    root.insert(
        0,
        ElementTree.fromstring('<mujoco><compiler fusestatic="true"/></mujoco>'),
    )
    return ElementTree.tostring(root, encoding="unicode")


def _balance(inertia: ElementTree.Element) -> None:
    """Make an inertia that no body can have, which MuJoCo refuses, that of a ball of the same trace."""
    moments = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    xx, xy, xz, yy, yz, zz = (float(inertia.get(key, 0.0)) for key in moments)
    least, middle, most = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if least > 0.0 and least + middle >= most:
        return
    ball = (xx + yy + zz) / 3
    for key in moments:
        inertia.set(key, repr(ball) if key[1] == key[2] else "0")


def machine_of(text: str, names: Sequence[str]) -> mujoco.MjModel:
    """Return MuJoCo's model of a URDF with a motor for each joint of ``names``; other joints are locked."""
    spec = mujoco.MjSpec.from_string(text)
    for equality in spec.equalities:
        spec.delete(equality)
    for joint in spec.joints:
        if joint.name not in names:
            spec.delete(joint)
            continue
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    for name in names:
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    spec.option.timestep, spec.option.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec.compile()


@dataclass(frozen=True)
class Body:
    """A robot as its model file says, in Axisight and in MuJoCo, and its references: middle and size [rad]."""

    path: Path
    tips: list[str]
    text: str
    names: tuple[str, ...]
    middle: Array
    size: Array

    @classmethod
    def of(cls, source: Path, tips: list[str], folder: Path) -> Body:
        """Read a URDF, of which ``folder`` gets a bare copy; all branches move, or those that end at ``tips``."""
        path = folder / source.name
        path.write_text(bare(source))
        robot = simulator(path, tips, STEP_S * PER_SAMPLE)
        names = tuple(robot.axis_names)
        text = path.read_text()
        spec = mujoco.MjSpec.from_string(text)
        ranges = np.array([next(j for j in spec.joints if j.name == name).range for name in names])
        ranges[ranges[:, 0] >= ranges[:, 1]] = -1.0, 1.0
        half = np.diff(ranges, axis=1)[:, 0] / 2
        middle = np.clip(0.0, ranges[:, 0] + 0.5 * half, ranges[:, 1] - 0.5 * half)
        return cls(path, tips, text, names, middle, np.minimum(0.4 * half, 0.45))

    def reference(self, run: int, t: float) -> tuple[Array, Array, Array]:
        """Return angle, speed and acceleration of the joints that a run asks for at a time [rad, s]."""
        axis = np.arange(len(self.names))
        ramp = min(t / 2.0, 1.0)
        grown = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
        out = np.zeros((3, len(axis)))
        for share, rate, phase in (
            (0.65, 1.3 + 0.2 * run, 0.3),
            (0.35, 3.1 + 0.3 * run, 1.0 + run),
        ):
            # Every axis has its own rates, so that no two move alike.
            w = rate * (1 + 0.037 * ((7 * axis + 3 * run) % 11))
            at = w * t + phase + 1.3 * axis
            out += share * self.size * np.array([np.sin(at), w * np.cos(at), -(w**2) * np.sin(at)])
        return self.middle + grown * out[0], grown * out[1], grown * out[2]

    def play(
        self, model: mujoco.MjModel, run: int, added: Callable[[Array, Array], Array]
    ) -> tuple[Array, Array]:
        """Return angles and motor torques (n, n_axes) [rad, Nm] of a machine under computed torque."""
        nominal = machine_of(self.text, self.names)
        plan, data = mujoco.MjData(nominal), mujoco.MjData(model)
        order = np.array([model.joint(name).dofadr[0] for name in self.names])
        data.qpos[order] = self.reference(run, 0.0)[0]
        angle, torque = [], []
        for k in range(round(DURATION_S / STEP_S)):
            mujoco.mj_step1(model, data)
            wanted, rate, acceleration = self.reference(run, k * STEP_S)
            q, v = data.qpos[order], data.qvel[order]
            plan.qpos[:], plan.qvel[:] = data.qpos, data.qvel
            plan.qacc[order] = (
                acceleration + BANDWIDTH**2 * (wanted - q) + 2 * BANDWIDTH * (rate - v)
            )
            mujoco.mj_inverse(nominal, plan)
            data.ctrl[:] = plan.qfrc_inverse[order]
            data.qfrc_applied[order] = added(q, v)
            if k % PER_SAMPLE == 0:
                angle.append(q)
                torque.append(data.ctrl.copy())
            mujoco.mj_step2(model, data)
        return np.array(angle), np.array(torque)

    @cached_property
    def nominal(self) -> tuple[Array, Array]:
        """Angles and torques (n, n_axes) [rad, Nm] of the nominal model in the second half of the first run."""
        angle, torque = self.play(
            machine_of(self.text, self.names), 0, lambda q, _v: np.zeros_like(q)
        )
        return angle[len(angle) // 2 :], torque[len(angle) // 2 :]

    def along(self, axis: int) -> Along:
        """Return what the motor of an axis does in `nominal`."""
        angle, torque = self.nominal
        q, at = angle[:, axis], STEP_S * PER_SAMPLE
        speed = np.gradient(q, at)
        parts = torque[:, axis], speed, np.gradient(speed, at), q - q.mean()
        return Along(*(float(np.sqrt(np.mean(part**2))) for part in parts))

    def shown(self, axis: int, change: Change) -> float:
        """Return the largest share by which a change of a body changes the torque of an axis, rms [1]."""
        models = [machine_of(self.text, self.names) for _ in range(2)]
        change(models[1], models[1].joint(self.names[axis]).id, Along(1.0, 1.0, 1.0, 1.0))
        times = np.arange(DURATION_S / 2, DURATION_S, 0.1)
        given, other = (np.array([self._torque(m, t) for t in times]) for m in models)
        size = np.sqrt(np.mean(given**2, axis=0))
        return float((np.sqrt(np.mean((other - given) ** 2, axis=0)) / size).max())

    def _torque(self, model: mujoco.MjModel, t: float) -> Array:
        data = mujoco.MjData(model)
        order = np.array([model.joint(name).dofadr[0] for name in self.names])
        data.qpos[order], data.qvel[order], data.qacc[order] = self.reference(0, t)
        mujoco.mj_inverse(model, data)
        return np.asarray(data.qfrc_inverse[order])

    def logs(self, axis: int, change: Change, seed: int) -> list[Log]:
        """Return the logs of a machine with one change at an axis."""
        model, along = machine_of(self.text, self.names), self.along(axis)
        own = change(model, model.joint(self.names[axis]).id, along)
        mujoco.mj_setConst(model, mujoco.MjData(model))

        def added(q: Array, v: Array) -> Array:
            out = np.zeros_like(q)
            if own is not None:
                out[axis] = own(q[axis], v[axis])
            return out

        return [self._log(run, *self.play(model, run, added), seed) for run in range(RUNS)]

    def _log(self, run: int, angle: Array, torque: Array, seed: int) -> Log:
        random = np.random.default_rng((seed, run))
        noise = NOISE_SHARE * np.sqrt(np.mean(torque**2, axis=0))
        return Log(
            name=f"run{run}",
            sample_time_s=STEP_S * PER_SAMPLE,
            time_s=STEP_S * PER_SAMPLE * np.arange(len(angle)),
            position_rad=angle + NOISE_RAD * random.normal(size=angle.shape),
            torque_nm=torque + noise * random.normal(size=angle.shape),
            source=Path(f"run{run}"),
        )


def simulator(path: Path, tips: list[str], sample_time_s: float) -> Robot:
    """Return the robot of a URDF as Axisight reads it."""
    which = {"tip": tips} if tips else {"whole_tree": True}
    return import_robot(path, sample_time_s=sample_time_s, **which)


def verdict_on(body: Body, logs: Sequence[Log]) -> Diagnosis:
    """Return the diagnosis of logs by the model file; the last log is held out."""
    robot = simulator(body.path, body.tips, logs[0].sample_time_s)
    return diagnose(robot=robot, estimation=list(logs[:-1]), validation=[logs[-1]])


def row(body: Body, number: int, effect: str, robot: int) -> dict[str, object]:
    """Return truth, verdict and time of one machine."""
    name, change = EFFECTS[effect]
    n = len(body.names)
    axis = (5 * number + 2 * robot) % n
    while change in (_mass, _com) and body.shown(axis, change) < SHOWN:
        axis = (axis + 1) % n
    logs = body.logs(axis, change, seed=100 * robot + number)
    started = time.process_time()
    found = verdict_on(body, logs)
    causes = [cause.label for cause in found.causes]
    truth = f"{name}@{axis + 1}"
    return {
        "truth": truth,
        "verdict": found.verdict,
        "causes": causes,
        "first": bool(causes) and causes[0] == truth,
        "wrong_and_sure": found.verdict == "explained" and causes != [truth],
        "gap": [found.gap.before, found.gap.after],
        "seconds": round(time.process_time() - started, 1),
    }


def rows_of(body: Body, name: str, number: int, effects: Sequence[str]) -> list[dict[str, object]]:
    """Return and print the rows of a robot, by name and number."""
    print(f"{name}: {len(body.names)} axes", flush=True)
    out = []
    for k, effect in enumerate(EFFECTS):
        if effect in effects:
            out.append({"robot": name, **row(body, k, effect, number)})
            print("  ", out[-1], flush=True)
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--effects", nargs="*", default=list(EFFECTS), choices=list(EFFECTS))
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for number, name in enumerate(ROBOTS):
            if name in given.robots:
                file, tips = ROBOTS[name]
                body = Body.of(next(given.folder.rglob(file)), tips, Path(folder))
                rows += rows_of(body, name, number, given.effects)
    hits, sure = sum(bool(r["first"]) for r in rows), sum(bool(r["wrong_and_sure"]) for r in rows)
    print(f"first cause right: {hits} of {len(rows)}; a wrong cause sure: {sure}")
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

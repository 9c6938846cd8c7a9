"""From recordings of ROS to a decided verdict: bags of a MuJoCo arm, a designed trajectory, and new bags.

    python benches/next_experiment_ros.py [NAME ...]

The arm of next_experiment_targets.py. A trajectory controller moves it at 1 kHz, and joint states are recorded at
100 Hz. What is withheld from the URDF acts in MuJoCo. Three recordings leave two causes open; the command designs a
trajectory within the limits of the URDF, which lacks an acceleration. The controller plays the ROS message that the
command wrote, from the pose in which the last motion ended. The new recordings are diagnosed beside the old ones. The
exit status is 1 unless all are decided rightly.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from next_experiment_targets import (
    BOTH_WAYS,
    HOME_RAD,
    NOISE_RAD,
    ONE_WAY,
    RATE_HZ,
    STEP_S,
    Array,
    Course,
    Machine,
    on,
    slow_sines,
    steady,
)
from scipy.interpolate import BPoly
from typer.testing import CliRunner

from axisight.cli import app

URDF = """<robot name="two_joints">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="8"/>
    <inertia ixx="0.12" iyy="0.12" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0 0.15"/><mass value="4"/>
    <inertia ixx="0.04" iyy="0.04" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-0.6" upper="1.4" velocity="2.5" effort="120"/>
    <dynamics damping="1.5" friction="1.0"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit lower="-0.4" upper="1.6" velocity="2.5" effort="45"/>
    <dynamics damping="0.6" friction="0.4"/></joint>
</robot>
"""
# Rotors, which a URDF cannot state.
DRIVES = "[joint.shoulder]\nmotor_inertia = 0.6\n[joint.elbow]\nmotor_inertia = 0.2\n"
# The limit that a URDF cannot state either.
ACCELERATION = ("--acceleration-limit", "15")
JOINTS = ("shoulder", "elbow")
STATE = "sensor_msgs/msg/JointState"


@dataclass(frozen=True)
class Row:
    """What the URDF lacks, and motions that hardly show it.

    The first recordings leave out ``cut_s`` at both ends; ``storage`` of the bags: mcap or sqlite3.
    """

    lacks: str
    machine: Machine
    course: Course
    cut_s: float = 0.7
    storage: str = "mcap"


ROWS = {
    "viscous, Coulomb friction": Row(
        "viscous_friction@1", Machine(lambda _q, v: -on(1, 5 * v[0])), steady(0.2, BOTH_WAYS)
    ),
    "spring of gravity, offset": Row(
        "gravity_compensation@2",
        Machine(lambda q, _v: on(2, 1.5 * np.sin(q[1]))),
        slow_sines(0.05),
        0.0,
        "sqlite3",
    ),
    "cable, spring of gravity": Row(
        "cable_stiffness@2",
        Machine(lambda q, _v: -on(2, 2 * (q[1] - HOME_RAD[1]))),
        steady(0.1, BOTH_WAYS),
    ),
    "drag, viscous friction": Row(
        "quadratic_drag@2",
        Machine(lambda _q, v: -on(2, 6 * v[1] * abs(v[1]))),
        steady(0.2, ONE_WAY),
    ),
    "cable, spring of gravity, axis 1": Row(
        "cable_stiffness@1", Machine(lambda q, _v: -on(1, 15 * (q[0] - 0.2))), slow_sines(0.1), 0.0
    ),
}


def controlled(message: dict[str, Any], pose_rad: Array) -> Array:
    """Return the targets (n, 2) of a trajectory controller at each step, from rest at ``pose_rad``.

    Quintic polynomials through position, velocity and acceleration of the points, as joint_trajectory_controller
    interpolates points that have all three.
    """
    order = [message["joint_names"].index(name) for name in JOINTS]
    still = np.zeros((1, 3, 2))
    still[0, 0] = pose_rad
    rows = [
        [np.array(point[key])[order] for key in ("positions", "velocities", "accelerations")]
        for point in message["points"]
    ]
    due = [point["time_from_start"] for point in message["points"]]
    time_s = np.array([0.0, *(d["sec"] + 1e-9 * d["nanosec"] for d in due)])
    course = BPoly.from_derivatives(time_s, np.concatenate([still, rows]))
    return np.asarray(course(np.arange(0.0, time_s[-1], STEP_S)))


def joint_states(machine: Machine, targets: Array, run: int) -> tuple[Array, Array, Array]:
    """Return position, velocity and effort (n, 2) of the joints at 100 Hz under targets (m, 2) at each step."""
    import mujoco  # noqa: PLC0415 - an extra

    model = mujoco.MjModel.from_xml_string(machine.mjcf())
    data = mujoco.MjData(model)
    data.qpos[:] = targets[0]
    every = round(1 / RATE_HZ / STEP_S)
    settled = [targets[0]] * round(2.0 / STEP_S)
    states = []
    for k, target in enumerate([*settled, *targets], start=-len(settled)):
        data.ctrl[:] = target
        if machine.extra is not None:
            data.qfrc_applied[:] = machine.extra(data.qpos, data.qvel)
        state = data.qpos.copy(), data.qvel.copy()
        mujoco.mj_step(model, data)
        # The force of this step acts where the step begins.
        if k >= 0 and k % every == 0:
            states.append((*state, data.qfrc_actuator.copy()))
    position, velocity, effort = (np.array(x) for x in zip(*states, strict=True))
    rng = np.random.default_rng([11, run])
    position += NOISE_RAD * rng.standard_normal(position.shape)
    effort += np.array(machine.noise_nm) * rng.standard_normal(effort.shape)
    return position, velocity, effort


def recorded(path: Path, storage: str, states: tuple[Array, Array, Array]) -> Path:
    """Write joint states as a rosbag2 recording of ROS 2 Jazzy, and return its folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: PLC0415 - an extra
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - an extra

    types = get_typestore(Stores.ROS2_JAZZY)
    known = types.types
    plugin = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}[storage]
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        topic = writer.add_connection("/joint_states", STATE, typestore=types)
        for k, (position, velocity, effort) in enumerate(zip(*states, strict=True)):
            at_ns = 1_700_000_000_000_000_000 + round(k * 1e9 / RATE_HZ)
            stamp = known["builtin_interfaces/msg/Time"](*divmod(at_ns, 1_000_000_000))
            header = known["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            # joint_state_broadcaster lists joints in an order of its own.
            fields = (x[::-1].copy() for x in (position, velocity, effort))
            message = known[STATE](header, list(JOINTS[::-1]), *fields)
            writer.write(topic, at_ns, types.serialize_cdr(message, STATE))
    return path


def diagnosed(folder: Path, bags: Sequence[Path], *more: str) -> dict[str, Any]:
    """Return the verdict of the command on bags, the third of which validates."""
    verdict = folder / "verdict.json"
    fit, check = [*bags[:2], *bags[3:]], bags[2]
    paths = [str(folder / "arm.urdf"), *map(str, fit), "--validation", str(check)]
    done = CliRunner().invoke(app, ["diagnose", *paths, "--json", str(verdict), *more])
    if done.exit_code:
        raise RuntimeError(done.output) from done.exception
    return dict(json.loads(verdict.read_text("utf-8")))


def says(found: dict[str, Any]) -> str:
    """Return a verdict as a cell of a table."""
    named = ", ".join(f"{c['effect']}@{c['axis']} {c['probability']:.2f}" for c in found["causes"])
    rivals = ", ".join(
        f"{a['effect']}@{a['axis']} {a['probability']:.2f}"
        for a in found["alternatives"]
        if a["probability"] > 0.05
    )
    return f"{found['verdict']}: {named or 'nothing'}" + (f" ({rivals})" if rivals else "")


def run(row: Row, folder: Path) -> tuple[list[str], bool]:
    """Return the cells of a row, and whether the right cause was decided that was open before."""
    (folder / "arm.urdf").write_text(URDF, "utf-8")
    (folder / "arm.drives.toml").write_text(DRIVES, "utf-8")
    bags = []
    for k in (1, 2, 3):
        course = row.course(k)
        at = np.arange(0, (len(course) - 1) / RATE_HZ, STEP_S)
        every = np.arange(len(course)) / RATE_HZ
        targets = np.stack([np.interp(at, every, x) for x in course.T], axis=1)
        states = joint_states(row.machine, targets, k)
        pose = states[0][-1]
        cut = round(row.cut_s * RATE_HZ)
        position, velocity, effort = (x[cut : len(x) - cut] for x in states)
        bags.append(recorded(folder / f"bag{k}", row.storage, (position, velocity, effort)))
    asked = ["--next-experiment", str(folder / "next"), *ACCELERATION]
    before = diagnosed(folder, bags, *asked)
    text = folder / "next" / "experiment.txt"
    if before["verdict"] != "undecidable" or not text.exists():
        return [says(before), "", ""], False
    plan = text.read_text("utf-8")
    often = re.search(r" s, (\d+) times", plan)
    message = yaml.safe_load((folder / "next" / "trajectory.yaml").read_text("utf-8"))
    for k in range(int(often.group(1)) if often else 1):
        states = joint_states(row.machine, controlled(message, pose), 9 + k)
        pose = states[0][-1]
        bags.append(recorded(folder / f"new{k}", row.storage, states))
    after = diagnosed(folder, bags)
    named = [f"{c['effect']}@{c['axis']}" for c in after["causes"]]
    right = after["verdict"] == "explained" and named == [row.lacks]
    return [says(before), plan.partition(":")[0], says(after)], right


def main() -> int:
    """Print the table and the count."""
    wanted = set(sys.argv[1:]) or set(ROWS)
    decided = []
    print("| withheld, rival | before | experiment | after |\n|---|---|---|---|")
    for name, row in ROWS.items():
        if name in wanted:
            with tempfile.TemporaryDirectory() as folder:
                cells, right = run(row, Path(folder))
            decided.append(right)
            print(f"| {name} | {' | '.join(cells)} |", flush=True)
    print(f"{sum(decided)} of {len(decided)} undecidable before and decided rightly after")
    return 0 if all(decided) else 1


if __name__ == "__main__":
    sys.exit(main())

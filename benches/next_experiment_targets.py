"""Pairs of causes that weak logs of a MuJoCo arm leave open, and what a designed trajectory makes of them.

    python benches/next_experiment_targets.py [NAME ...]

A vertical arm of two joints, whose position actuators follow joint targets in MuJoCo; what is withheld from the
simulator acts there. Three logs that hardly show it are diagnosed, with the experiment that tells the rivals apart.
Its trajectory is played on the same machine as often as it says, and all logs are diagnosed again. Logs hold positions
and torques (inverse dynamics), or positions and targets without torques. The exit status is 1 unless all are decided
rightly.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import Diagnosis, Log, Robot, diagnose, load_robot
from axisight.gap import ExperimentLimits
from axisight.gap.facts.experiment import Experiment
from axisight.logs.log import not_logged

Array = NDArray[np.float64]
Torque = Callable[[Array, Array], Array]
Course = Callable[[int], Array]

RATE_HZ = 100.0
SECONDS = 6.0
STEP_S = 1e-3
SETTLED_S = 2.0
# Noise of positions.
NOISE_RAD = 1e-5
HOME_RAD = np.array([0.4, 0.6])
# Speed over which dry friction turns its sign [rad/s].
CORNER_RAD_S = 0.005
# What the arm may do in an experiment.
FREE = ExperimentLimits(
    velocity_rad_s=2.5, acceleration_rad_s2=15.0, travel_rad=1.0, torque_nm=[120.0, 45.0]
)


@dataclass(frozen=True)
class Machine:
    """The arm in MuJoCo, SI units, joint side.

    ``extra``: torque on the joints from their angles and speeds, (2,) each; ``noise_nm`` of the reported torques.
    """

    extra: Torque | None = None
    noise_nm: tuple[float, float] = (0.3, 0.1)

    def mjcf(self) -> str:
        """Return the MuJoCo model (MJCF)."""
        return f"""<mujoco model="two joints">
  <option timestep="{STEP_S}" integrator="Euler"/>
  <worldbody>
    <body name="upper" pos="0 0 0.5">
      <joint name="shoulder" axis="0 1 0" damping="1.5" frictionloss="1.0" armature="0.6"/>
      <inertial pos="0 0 0.2" mass="8" diaginertia="0.12 0.12 0.02"/>
      <body name="fore" pos="0 0 0.4">
        <joint name="elbow" axis="0 1 0" damping="0.6" frictionloss="0.4" armature="0.2"/>
        <inertial pos="0 0 0.15" mass="4" diaginertia="0.04 0.04 0.008"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="4000" kv="200"/>
    <position joint="elbow" kp="1500" kv="70"/>
  </actuator>
</mujoco>
"""

    def played(self, targets: Array) -> tuple[Array, Array]:
        """Return positions [rad] (n + 1, 2) and reported torques [Nm] (n, 2) under targets (n, 2) from rest.

        Torques are means from one sample to the next.
        """
        import mujoco  # noqa: PLC0415 - an extra

        model = mujoco.MjModel.from_xml_string(self.mjcf())
        data = mujoco.MjData(model)
        data.qpos[:] = data.ctrl[:] = targets[0]
        self._step(mujoco, model, data, round(SETTLED_S / STEP_S))
        position, torque = np.empty_like(targets), np.empty_like(targets)
        for k, target in enumerate(targets):
            data.ctrl[:] = target
            position[k] = data.qpos
            torque[k] = self._step(mujoco, model, data, round(1 / RATE_HZ / STEP_S))
        return np.vstack([position, data.qpos]), torque

    def _step(self, mujoco: Any, model: Any, data: Any, steps: int) -> Array:
        """Take steps and return the mean torque of the actuators (2,) [Nm]."""
        sum_nm = np.zeros(2)
        for _ in range(steps):
            if self.extra is not None:
                data.qfrc_applied[:] = self.extra(data.qpos, data.qvel)
            mujoco.mj_step(model, data)
            sum_nm += data.qfrc_actuator
        return sum_nm / steps

    def log(self, targets: Array, run: int, *, with_targets: bool, cut_s: float = 0.0) -> Log:
        """Return the log of a run: positions and torques, or positions and targets, without ``cut_s`` at both ends."""
        ends, torque = self.played(targets)
        cut = round(cut_s * RATE_HZ)
        kept = slice(cut, len(targets) - cut)
        ends, torque, targets = ends[cut : len(ends) - cut], torque[kept], targets[kept]
        # The mean of a torque over a step belongs to its middle.
        position = ends[:-1] if with_targets else 0.5 * (ends[1:] + ends[:-1])
        rng = np.random.default_rng([7, run])
        noisy = position + NOISE_RAD * rng.standard_normal(position.shape)
        noise = np.array(self.noise_nm) * rng.standard_normal(torque.shape)
        return Log(
            name=f"run{run}",
            source=Path(f"run{run}.parquet"),
            sample_time_s=1 / RATE_HZ,
            time_s=np.arange(len(targets)) / RATE_HZ,
            position_rad=noisy,
            torque_nm=not_logged(position.shape) if with_targets else torque + noise,
            position_ref_rad=targets if with_targets else None,
        )


def on(joint: int, torque_nm: float) -> Array:
    """Return a torque on one joint (from 1)."""
    out = np.zeros(2)
    out[joint - 1] = torque_nm
    return out


def slow_sines(reach_rad: float) -> Course:
    """Return targets of three slow sines around home."""

    def course(seed: int) -> Array:
        time_s = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
        rng = np.random.default_rng(seed)
        phase = rng.uniform(0, 2 * np.pi, (3, 2))
        waves = [
            np.sin(2 * np.pi * f * time_s[:, None] + p)
            for f, p in zip((0.3, 0.5, 0.8), phase, strict=True)
        ]
        fade = np.clip(np.minimum(time_s, time_s[-1] - time_s) / 0.5, 0, 1)
        fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
        return np.asarray(HOME_RAD + reach_rad * np.sum(waves, axis=0) / 3 * fade[:, None])

    return course


def steady(speed_rad_s: float, ways: tuple[int, int, int]) -> Course:
    """Return targets at a constant speed; ``ways``: the direction of each run."""

    def course(seed: int) -> Array:
        time_s = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
        speed = speed_rad_s * (1 + 0.02 * np.sin(np.pi * time_s + seed))
        ramp = np.clip(np.minimum(time_s, time_s[-1] - time_s) / 0.5, 0, 1)
        way = np.cumsum(speed * ramp**2 * (3 - 2 * ramp)) / RATE_HZ
        return np.asarray(HOME_RAD + ways[seed - 1] * (way - way[-1] / 2)[:, None] * np.ones(2))

    return course


ONE_WAY, BOTH_WAYS = (1, 1, 1), (1, -1, 1)


@dataclass(frozen=True)
class Row:
    """A withheld effect and logs that hardly show it.

    ``lacks``: what the simulator lacks; ``cut_s`` of each end of the logs is left out; ``with_targets``: positions and
    targets are logged in place of torques.
    """

    lacks: str
    machine: Machine
    course: Course
    cut_s: float = 0.0
    with_targets: bool = False


ROWS = {
    "Coulomb friction, offset": Row(
        "coulomb_friction@1",
        Machine(lambda _q, v: -on(1, np.tanh(v[0] / CORNER_RAD_S))),
        steady(0.2, ONE_WAY),
        0.7,
    ),
    "viscous, Coulomb friction": Row(
        "viscous_friction@1", Machine(lambda _q, v: -on(1, 5 * v[0])), steady(0.2, BOTH_WAYS), 0.7
    ),
    "drag, viscous friction": Row(
        "quadratic_drag@2",
        Machine(lambda _q, v: -on(2, 6 * v[1] * abs(v[1]))),
        steady(0.2, ONE_WAY),
        0.7,
    ),
    "spring of gravity, offset": Row(
        "gravity_compensation@2", Machine(lambda q, _v: on(2, 1.5 * np.sin(q[1]))), slow_sines(0.05)
    ),
    "cable, spring of gravity": Row(
        "cable_stiffness@2",
        Machine(lambda q, _v: -on(2, 2 * (q[1] - HOME_RAD[1]))),
        steady(0.1, BOTH_WAYS),
        0.7,
    ),
    "cable, spring of gravity, axis 1": Row(
        "cable_stiffness@1", Machine(lambda q, _v: -on(1, 15 * (q[0] - 0.2))), slow_sines(0.1)
    ),
    "offset, drag": Row(
        "torque_offset@2", Machine(lambda _q, _v: on(2, 0.3)), steady(0.1, ONE_WAY), 0.7
    ),
    "offset, tilted base": Row(
        "torque_offset@1", Machine(lambda _q, _v: on(1, 1.5)), slow_sines(0.04)
    ),
    "offset, centre of mass": Row(
        "torque_offset@1", Machine(lambda _q, _v: on(1, 1.0)), steady(0.2, ONE_WAY), 0.7
    ),
    "cable, spring of gravity, targets, axis 1": Row(
        "cable_stiffness@1",
        Machine(lambda q, _v: -on(1, 30 * (q[0] - HOME_RAD[0]))),
        slow_sines(0.15),
        with_targets=True,
    ),
    "cable, spring of gravity, targets, axis 2": Row(
        "cable_stiffness@2",
        Machine(lambda q, _v: -on(2, 10 * (q[1] - HOME_RAD[1]))),
        slow_sines(0.06),
        with_targets=True,
    ),
}


def says(found: Diagnosis) -> str:
    """Return a verdict as a cell of a table."""
    named = ", ".join(f"{c.label} {c.probability:.2f}" for c in found.causes)
    rivals = ", ".join(
        f"{a.label} {a.probability:.2f}" for a in found.alternatives if a.probability > 0.05
    )
    return f"{found.verdict}: {named or 'nothing'}" + (f" ({rivals})" if rivals else "")


def played_targets(experiment: Experiment) -> Array:
    """Return the positions of a designed trajectory (n, 2) [rad] at the rate of the targets."""
    trajectory = experiment.plan.trajectory
    at = np.arange(0.0, trajectory.time_s[-1] + 1e-9, 1 / RATE_HZ)
    return np.stack([np.interp(at, trajectory.time_s, x) for x in trajectory.position.T], axis=1)


def run(row: Row, robot: Robot) -> tuple[list[str], bool]:
    """Return the cells of a row, and whether the right cause was decided that was open before."""
    logs = [
        row.machine.log(row.course(seed), seed, with_targets=row.with_targets, cut_s=row.cut_s)
        for seed in (1, 2, 3)
    ]
    first = time.process_time()
    alone = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    second = time.process_time()
    before = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], separate=True, within=FREE
    )
    design_s = time.process_time() - second - (second - first)
    cost = f"{second - first:.1f} + {design_s:.1f} s"
    made = before.experiment
    if alone.verdict != "undecidable" or made is None or not made.decides:
        return [says(before), before.next_experiment or "", "", cost], False
    targets = played_targets(made)
    new = [
        row.machine.log(targets, 9 + k, with_targets=row.with_targets) for k in range(made.repeats)
    ]
    after = diagnose(robot=robot, estimation=[*logs[:2], *new], validation=logs[2:])
    right = after.verdict == "explained" and [c.label for c in after.causes] == [row.lacks]
    return [says(before), str(made.plan), says(after), cost], right


def main() -> int:
    """Print the table and the count."""
    wanted = set(sys.argv[1:]) or set(ROWS)
    decided = []
    print("| withheld, rival | before | experiment | after | CPU time of diagnosis + design |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.xml"
        path.write_text(Machine().mjcf(), "utf-8")
        for name, row in ROWS.items():
            if name in wanted:
                robot = load_robot(path, sample_time_s=1 / RATE_HZ)
                cells, right = run(row, robot)
                decided.append(right)
                print(f"| {name} | {' | '.join(cells)} |", flush=True)
    print(f"{sum(decided)} of {len(decided)} undecidable before and decided rightly after")
    return 0 if all(decided) else 1


if __name__ == "__main__":
    sys.exit(main())

"""Does what a verdict promises hold in MuJoCo? Machines and models in MuJoCo, the diagnosis between them.

A machine, an MJCF with something that its nominal model lacks, follows references in MuJoCo under a controller.
Its logs and the nominal MJCF are diagnosed, the causes are written back, and MuJoCo's own inverse dynamics
(`mj_inverse`) of the nominal and of the new model, with `axisight.mujoco.apply` for what an MJCF has no place for,
are compared with the torque of the held-out log; so are both models run in MuJoCo along its references. Prints,
for ten machines, the gap that the verdict states before and after, and both as MuJoCo has them.

    python benches/write_back.py [CASE ...]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from printed import table

from axisight import Diagnosis, Effect, Log, diagnose, load_robot
from axisight.gap.signals.motion import Filtering
from axisight.logs import lowpass
from axisight.mujoco import apply
from axisight.write_back import Written, write_model

Array = NDArray[np.float64]

# A comment and single quotes, to see them kept.
NOMINAL = """<mujoco model="bench arm">
  <!-- as drawn -->
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="column" pos="0 0 0.4">
      <joint name="turn" axis="0 0 1" damping="4" armature="1.2"/>
      <inertial pos="0.05 0 0.1" mass="30" diaginertia="0.6 0.6 0.5"/>
      <body name="upper" pos="0.15 0 0.2" euler="0 0.2 0">
        <joint name="shoulder" axis='0 1 0' damping="5" armature="1.5"/>
        <inertial pos="0.02 0 0.25" mass="14" diaginertia="0.5 0.5 0.06"/>
        <body name="fore" pos="0 0 0.5" euler="0 -0.4 0">
          <joint name="elbow" axis="0 1 0" damping="1.5" armature="0.4"/>
          <inertial pos="0.15 0 0.02" mass="7" diaginertia="0.04 0.15 0.15"/>
          <body name="flange" pos="0.4 0 0">
            <inertial pos="0.03 0 0" mass="1.5" diaginertia="0.002 0.002 0.002"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="turn" gear="100"/>
    <motor name="m2" joint="shoulder" gear="120"/>
    <motor name="m3" joint="elbow" gear="80"/>
  </actuator>
</mujoco>
"""
GEAR = np.array([100.0, 120.0, 80.0])
STEP_S, PER_SAMPLE = 0.001, 4
KP, KD = np.array([9000.0, 12000.0, 3000.0]), np.array([600.0, 800.0, 200.0])
RUNS, DURATION_S = 3, 15.0
# Torque on motors (3,) [Nm] of their angles and speeds (3,) [rad, rad/s].
Added = Callable[[Array, Array], Array]


def nothing(_angle: Array, _speed: Array) -> Array:
    """Add no torque."""
    return np.zeros(3)


@dataclass(frozen=True)
class Machine:
    """What a machine has that the nominal model lacks.

    ``was``, ``has``: text of the model that is another one; ``added``: torques that an MJCF has no place for;
    ``effect``: the cause that is looked for.
    """

    effect: str
    was: str = ""
    has: str = ""
    added: Added = nothing

    @property
    def mjcf(self) -> str:
        """The machine as an MJCF."""
        assert not self.was or NOMINAL.count(self.was) == 1
        return NOMINAL.replace(self.was, self.has) if self.was else NOMINAL


def ripple(angle: Array, _speed: Array) -> Array:
    """Cogging of the first motor, once a turn."""
    return np.array([0.06 * np.cos(angle[0]) + 0.08 * np.sin(angle[0]), 0.0, 0.0])


def stribeck(_angle: Array, speed: Array) -> Array:
    """Friction of the third motor that falls from standstill."""
    level = 0.06 + 0.08 * np.exp(-((speed[2] / 6) ** 2))
    return np.array([0.0, 0.0, -level * np.tanh(speed[2] / 0.8)])


MACHINES = {
    "dry friction": Machine(
        "coulomb_friction@2", "axis='0 1 0' damping", "axis='0 1 0' frictionloss=\"25\" damping"
    ),
    "viscous friction": Machine("viscous_friction@1", 'damping="4"', 'damping="22"'),
    "rotor": Machine("motor_inertia@3", 'armature="0.4"', 'armature="1.6"'),
    "heavier link": Machine("link_mass@2", 'mass="14"', 'mass="22"'),
    "other centre": Machine("link_com@3", 'pos="0.15 0 0.02"', 'pos="0.2 0.02 0.05"'),
    "load": Machine(
        "payload",
        'diaginertia="0.002 0.002 0.002"/>',
        'diaginertia="0.002 0.002 0.002"/><body pos="0.05 0 0.08"><inertial pos="0 0 0" mass="4" '
        'diaginertia="1e-6 1e-6 1e-6"/></body>',
    ),
    "torque constant": Machine(
        "torque_constant@2",
        '<motor name="m2" joint="shoulder" gear="120"/>',
        '<general name="m2" joint="shoulder" gear="120" gainprm="0.8"/>',
    ),
    "spring": Machine("cable_stiffness@2", 'armature="1.5"', 'armature="1.5" stiffness="60"'),
    "ripple": Machine("torque_ripple@1", added=ripple),
    "Stribeck": Machine("stribeck_friction@3", added=stribeck),
}


def reference(run: int, t: float) -> tuple[Array, Array]:
    """Return angle and speed of the joints [rad, rad/s] that a run asks for at a time."""
    axis = np.arange(3)
    # From rest, without a jump of speed or acceleration.
    along = np.pi * min(t / 2, 1.0)
    start, rising = (along - np.sin(along) * np.cos(along)) / np.pi, np.sin(along) ** 2
    angle, speed = np.zeros(3), np.zeros(3)
    for size, rate, phase in ((0.5, 0.9 + 0.25 * run, 0.3), (0.25, 2.3 + 0.3 * run, 1.0 + run)):
        at = rate * t + phase + 1.3 * axis
        angle += size * start * np.sin(at)
        speed += size * (start * rate * np.cos(at) + rising * np.sin(at))
    return angle, speed


class Controller:
    """What every run has alike: feedback, and the weight of the nominal model."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(NOMINAL)
        self.data = mujoco.MjData(self.model)

    def command(self, run: int, t: float, angle: Array, speed: Array) -> Array:
        """Return the torque of the motors (3,) [Nm] at angles and speeds of the joints."""
        wanted, rate = reference(run, t)
        self.data.qpos[:], self.data.qvel[:] = angle, speed
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        feedback = KP * (wanted - angle) + KD * (rate - speed)
        return np.asarray((feedback + self.data.qfrc_bias) / GEAR)


def run_of(
    model: mujoco.MjModel, run: int, add: Callable[[mujoco.MjData], None], duration_s: float
) -> tuple[Array, Array]:
    """Return motor angles [rad] and commanded torques [Nm] (n, 3) of a model along the references of a run.

    ``add`` sets the forces that are not in the model.
    """
    data, controller = mujoco.MjData(model), Controller()
    data.qpos[:] = reference(run, 0.0)[0]
    angle, torque = [], []
    for k in range(round(duration_s / STEP_S)):
        mujoco.mj_step1(model, data)
        data.ctrl[:] = controller.command(run, k * STEP_S, data.qpos, data.qvel)
        add(data)
        if k % PER_SAMPLE == 0:
            angle.append(data.qpos * GEAR)
            torque.append(data.ctrl.copy())
        mujoco.mj_step2(model, data)
    return np.array(angle), np.array(torque)


def log_of(machine: Machine, run: int) -> Log:
    """Return what a machine logs along the references of a run, noise of sensors with it."""

    def add(data: mujoco.MjData) -> None:
        data.qfrc_applied[:] = machine.added(data.qpos * GEAR, data.qvel * GEAR) * GEAR

    model = mujoco.MjModel.from_xml_string(machine.mjcf)
    angle, torque = run_of(model, run, add, DURATION_S)
    random = np.random.default_rng(run)
    return Log(
        name=f"run{run}",
        sample_time_s=STEP_S * PER_SAMPLE,
        time_s=STEP_S * PER_SAMPLE * np.arange(len(angle)),
        position_rad=angle + 1e-4 * random.normal(size=angle.shape),
        torque_nm=torque + 2e-3 * random.normal(size=angle.shape),
        source=Path(f"run{run}"),
    )


def gap_of_run(
    path: Path, log: Log, cutoff_hz: float, effects: tuple[Effect, ...], duration_s: float
) -> float:
    """Return the relative torque error of a model that runs along the references of the held-out log [1].

    Torques are low-passed; of the log the first ``duration_s`` are simulated and compared.
    """
    model = mujoco.MjModel.from_xml_path(str(path))

    def add(data: mujoco.MjData) -> None:
        if effects:
            apply(model, data, effects, gear_ratio=1 / GEAR)

    _, torque = run_of(model, RUNS - 1, add, duration_s)
    measured = lowpass(log.torque_nm[: len(torque)], log.sample_time_s, cutoff_hz)
    off = lowpass(torque, log.sample_time_s, cutoff_hz) - measured
    return float(np.sqrt((off**2 / np.var(log.torque_nm, axis=0)).mean()))


def gap_in_mujoco(path: Path, log: Log, cutoff_hz: float, effects: tuple[Effect, ...]) -> float:
    """Return the relative torque error of a model on a log by MuJoCo's inverse dynamics [1].

    NaN of a model with a memory, whose torque the motion of a sample alone does not give. Motion and torque are
    low-passed as in the diagnosis; ``effects`` are added by `apply`.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    # What `apply` adds is taken at the speed of the log, not at one a step later.
    model.opt.timestep = 1e-9
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    if model.na:
        return float("nan")
    delivered = GEAR * model.actuator_gainprm[: len(GEAR), 0]
    filtering = Filtering(cutoff_hz)
    angle, speed, acceleration, torque = filtering(log)
    found = np.empty_like(torque)
    for k in range(len(torque)):
        data.qpos[:], data.qvel[:] = angle[k] / GEAR, speed[k] / GEAR
        data.qacc[:], data.ctrl[:] = acceleration[k] / GEAR, torque[k]
        mujoco.mj_inverse(model, data)
        # Without commands actuators have the torque of cogging and constant biases alone.
        data.ctrl[:] = 0.0
        mujoco.mj_fwdActuation(model, data)
        asked = data.qfrc_inverse - data.qfrc_actuator
        data.ctrl[:] = torque[k]
        if effects:
            asked -= apply(model, data, effects, gear_ratio=1 / GEAR)
        found[k] = asked / delivered
    off = filtering.compared(found - torque, log.sample_time_s)
    return float(np.sqrt((off**2 / np.var(log.torque_nm, axis=0)).mean()))


@dataclass(frozen=True)
class Outcome:
    """A verdict, the model that was written, and the gap in MuJoCo before and after [1].

    ``inverse``: by its inverse dynamics of the held-out log, NaN of models with a memory; ``run``: of simulations
    along its references.
    """

    found: Diagnosis
    made: Written
    inverse: tuple[float, float]
    run: tuple[float, float]


def outcome(
    machine: Machine, folder: Path, simulated_s: float = DURATION_S, *, inverse: bool = True
) -> Outcome:
    """Diagnose a machine by its nominal model, write the causes back, and measure in MuJoCo.

    ``simulated_s``: how much of the held-out run the models are simulated for. ``inverse``: also by inverse
    dynamics.
    """
    nominal = folder / "nominal.xml"
    nominal.write_text(NOMINAL)
    logs = [log_of(machine, run) for run in range(RUNS)]
    robot = load_robot(nominal, sample_time_s=logs[0].sample_time_s)
    found = diagnose(robot=robot, estimation=logs[:-1], validation=logs[-1:])
    made = write_model(nominal, robot, found.causes, folder / "new.xml")
    cutoff_hz = float(found.provenance["cutoff_hz"])
    models = ((nominal, ()), (made.path, made.remaining))
    gaps = [
        gap_in_mujoco(path, logs[-1], cutoff_hz, effects) if inverse else float("nan")
        for path, effects in models
    ]
    run = [gap_of_run(path, logs[-1], cutoff_hz, effects, simulated_s) for path, effects in models]
    return Outcome(found, made, (gaps[0], gaps[1]), (run[0], run[1]))


def row(name: str, folder: Path) -> tuple[list[str], str]:
    """Return the cells of a machine, and its headline."""
    out = outcome(MACHINES[name], folder)
    gap = out.found.gap
    gaps = [
        f"{100 * before:.1f} → " + ("–" if np.isnan(after) else f"{100 * after:.1f} %")
        for before, after in ((gap.before, gap.after), out.inverse, out.run)
    ]
    written = [", ".join(x) or "–" for x in (out.made.placed, out.made.left_out)]
    return [*written, *gaps], out.found.headline


def main(names: list[str]) -> None:
    """Print the table."""
    columns = ("machine", "causes written", "by `apply`", "verdict", "`mj_inverse`", "run")
    table(columns, names or MACHINES, row)


if __name__ == "__main__":
    main(sys.argv[1:])

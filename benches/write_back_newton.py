"""Does what a verdict promises hold in Newton? Machines in MuJoCo, their model a USD stage.

A machine, an MJCF with something that the nominal stage lacks, follows references in MuJoCo under a controller.
Its logs and the stage are diagnosed, the causes are written into a layer over the stage, and Newton's solver
MuJoCo runs the stage and the layer along the references of the held-out log. Prints, for ten machines, the gap
that the verdict states before and after, and both as Newton has them. For machines with dry friction it prints
what a joint does under half its friction: the machine, the new model, and a stage with the number alone.

    pip install 'newton[sim]'   # beside axisight[usd,mujoco]
    python benches/write_back_newton.py [CASE ...]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

import mujoco
import numpy as np
from numpy.typing import NDArray
from printed import table

from axisight import Diagnosis, Log, diagnose, load_robot
from axisight.logs import lowpass
from axisight.write_back import Written, write_model
from newton_arm import NewtonArm
from usd_data import MJCF, arm, saved
from write_back import reference

Array = NDArray[np.float64]

# Armature [kg m^2] and damping [Nm s/rad] of the joints.
DRIVES = {"turn": (1.25, 4.0), "shoulder": (1.5, 5.0), "elbow": (0.375, 1.5)}
TEXTS = {
    name: f"float newton:armature = {rotor}\n float newton:damping = {np.radians(damping)}"
    for name, (rotor, damping) in DRIVES.items()
}
# A machine holds at rest: almost no creep, and friction that follows the speed within 1 ms.
HOLDS = 'solreffriction="0.002 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
KP, KD = np.array([9000.0, 12000.0, 3000.0]), np.array([600.0, 800.0, 200.0])
STEP_S, PER_SAMPLE, RUNS, DURATION_S, SIMULATED_S = 0.001, 4, 3, 10.0, 2.5
_REST_S = 0.5
# Above this speed a machine does not hold at rest.
_MOVES_RAD_S = 1e-3


def _nominal() -> str:
    text = MJCF
    for name, (rotor, damping) in DRIVES.items():
        joint = f'name="{name}" axis'
        assert text.count(joint) == 1
        text = text.replace(joint, f'name="{name}" armature="{rotor}" damping="{damping}" axis')
    return text


NOMINAL = _nominal()


def _dry(joint: str, friction_nm: float) -> tuple[str, str]:
    return (
        f'name="{joint}" armature',
        f'name="{joint}" frictionloss="{friction_nm}" {HOLDS} armature',
    )


_LOAD = (
    'diaginertia="0.0625 0.125 0.125"/>',
    'diaginertia="0.0625 0.125 0.125"/><body pos="0.4 0 0.08"><inertial pos="0 0 0" mass="4" '
    'diaginertia="1e-6 1e-6 1e-6"/></body>',
)
MACHINES: dict[str, tuple[tuple[str, str], ...]] = {
    "dry friction": (_dry("shoulder", 25.0),),
    "dry friction, light": (_dry("elbow", 6.0),),
    "viscous friction": (('damping="4.0"', 'damping="22"'),),
    "rotor": (('armature="0.375"', 'armature="1.6"'),),
    "heavier link": (('mass="14"', 'mass="22"'),),
    "other centre": (('pos="0.125 0 0.03125"', 'pos="0.2 0.02 0.05"'),),
    "load": (_LOAD,),
    "spring": (('armature="1.5"', 'armature="1.5" stiffness="60"'),),
    "dry friction and load": (_dry("shoulder", 25.0), _LOAD),
    "dry and viscous friction": (_dry("turn", 20.0), ('damping="5.0"', 'damping="25"')),
}


def machine(name: str) -> str:
    """Return a machine as an MJCF."""
    text = NOMINAL
    for was, has in MACHINES[name]:
        assert text.count(was) == 1, was
        text = text.replace(was, has)
    return text


class Controller:
    """What every run has alike: feedback, and the weight of the nominal model."""

    def __init__(self, run: int) -> None:
        self.run, self.model = run, mujoco.MjModel.from_xml_string(NOMINAL)
        self.data = mujoco.MjData(self.model)

    def weight(self, angle: Array, speed: Array) -> Array:
        """Return gravity and Coriolis torques (3,) [Nm] of the nominal model."""
        self.data.qpos[:], self.data.qvel[:] = angle, speed
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        return self.data.qfrc_bias.copy()

    def __call__(self, t: float, angle: Array, speed: Array) -> Array:
        """Return the torques of the joints (3,) [Nm]."""
        wanted, rate = reference(self.run, t)
        return KP * (wanted - angle) + KD * (rate - speed) + self.weight(angle, speed)


def log_of(text: str, run: int) -> Log:
    """Return what a machine logs along the references of a run, noise of sensors with it."""
    model = mujoco.MjModel.from_xml_string(text)
    data, controller = mujoco.MjData(model), Controller(run)
    data.qpos[:] = reference(run, 0.0)[0]
    angle, torque = [], []
    for k in range(round(DURATION_S / STEP_S)):
        data.qfrc_applied[:] = controller(k * STEP_S, data.qpos, data.qvel)
        if k % PER_SAMPLE == 0:
            angle.append(data.qpos.copy())
            torque.append(data.qfrc_applied.copy())
        mujoco.mj_step(model, data)
    random, shape = np.random.default_rng(run), (len(angle), 3)
    return Log(
        name=f"run{run}",
        sample_time_s=STEP_S * PER_SAMPLE,
        time_s=STEP_S * PER_SAMPLE * np.arange(len(angle)),
        position_rad=np.array(angle) + 1e-6 * random.normal(size=shape),
        torque_nm=np.array(torque) + 0.2 * random.normal(size=shape),
        source=Path(f"run{run}"),
    )


def gap_in_newton(
    path: Path, log: Log, cutoff_hz: float, simulated_s: float = SIMULATED_S
) -> float:
    """Return the relative torque error of a stage that Newton runs along the references of the held-out log [1]."""
    controller, start = Controller(RUNS - 1), reference(RUNS - 1, 0.0)[0]
    torque = NewtonArm(path).run(controller, start, simulated_s, STEP_S)[2][::PER_SAMPLE]
    measured = lowpass(log.torque_nm[: len(torque)], log.sample_time_s, cutoff_hz)
    off = lowpass(np.ascontiguousarray(torque), log.sample_time_s, cutoff_hz) - measured
    return float(np.sqrt((off**2 / np.var(log.torque_nm, axis=0)).mean()))


def creep_in_newton(path: Path, axis: int, torque_nm: float) -> float:
    """Return the speed [rad/s] of a joint (from 0) of a stage after half a second under a torque beside its weight."""
    controller, push = Controller(0), torque_nm * np.eye(3)[axis]
    arm_ = NewtonArm(path)
    speeds = arm_.run(
        lambda _, q, v: controller.weight(q, 0 * v) + push, np.zeros(3), _REST_S, STEP_S
    )[1]
    return float(abs(speeds[-1, axis]))


def creep_of_machine(text: str, axis: int, torque_nm: float) -> float:
    """Return the same of a machine in MuJoCo."""
    model, controller = mujoco.MjModel.from_xml_string(text), Controller(0)
    data = mujoco.MjData(model)
    for _ in range(round(_REST_S / STEP_S)):
        data.qfrc_applied[:] = (
            controller.weight(data.qpos, np.zeros(3)) + torque_nm * np.eye(3)[axis]
        )
        mujoco.mj_step(model, data)
    return float(abs(data.qvel[axis]))


@dataclass(frozen=True)
class Outcome:
    """A verdict, the written layer, and the gap in Newton before and after [1].

    ``creep`` [rad/s]: of the machine, of the written model, and of a stage with the number of friction alone,
    under half the friction found; None without dry friction.
    """

    found: Diagnosis
    made: Written
    run: tuple[float, float]
    creep: tuple[float, float, float] | None


def outcome(name: str, folder: Path, simulated_s: float = SIMULATED_S) -> Outcome:
    """Diagnose a machine by its nominal stage, write the causes back, and measure in Newton."""
    nominal, text = saved(folder, arm(TEXTS), "nominal.usda"), machine(name)
    logs = [log_of(text, run) for run in range(RUNS)]
    robot = load_robot(nominal, sample_time_s=logs[0].sample_time_s)
    found = diagnose(robot=robot, estimation=logs[:-1], validation=logs[-1:])
    made = write_model(nominal, robot, found.causes, folder / "new.usda")
    cutoff_hz = float(found.provenance["cutoff_hz"])
    before, after = (
        gap_in_newton(path, logs[-1], cutoff_hz, simulated_s) for path in (nominal, made.path)
    )
    return Outcome(found, made, (before, after), _creep(found, made, text, folder))


def _creep(
    found: Diagnosis, made: Written, text: str, folder: Path
) -> tuple[float, float, float] | None:
    dry = [cause for cause in found.causes if "coulomb_nm" in cause.parameters]
    if not dry or dry[0].axis is None:
        return None
    axis, friction = dry[0].axis - 1, dry[0].parameters["coulomb_nm"].value
    name = list(DRIVES)[axis]
    copied = TEXTS | {name: f"{TEXTS[name]}\n float newton:friction = {friction}"}
    stage = saved(folder, arm(copied), "copied.usda")
    own = creep_of_machine(text, axis, friction / 2)
    if own > _MOVES_RAD_S:  # by a load beyond the weight that the controller knows
        return None
    return (
        own,
        creep_in_newton(made.path, axis, friction / 2),
        creep_in_newton(stage, axis, friction / 2),
    )


def row(name: str, folder: Path) -> tuple[list[str], str]:
    """Return the cells of a machine, and its headline."""
    out = outcome(name, folder)
    gap = out.found.gap
    gaps = [f"{100 * a:.1f} → {100 * b:.1f} %" for a, b in ((gap.before, gap.after), out.run)]
    creep = "–" if out.creep is None else " / ".join(f"{1e3 * x:.4f}" for x in out.creep)
    left = ", ".join(out.made.left_out) or "–"
    return [", ".join(out.made.placed) or "–", left, *gaps, creep], out.found.headline


def main(names: list[str]) -> None:
    """Print the table."""
    columns = ("machine", "causes written", "left out", "verdict", "Newton", "creep [mrad/s]")
    table(columns, names or MACHINES, row)


if __name__ == "__main__":
    main(sys.argv[1:])

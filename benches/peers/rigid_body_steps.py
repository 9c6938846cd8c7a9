"""Rigid-body steps side by side, in one process run: this package, Pinocchio, MuJoCo.

Run ``python benches/peers/rigid_body_steps.py`` from the root of the repository.

What is compared with what:

* inverse and forward dynamics of the 7-joint chain at the same random states. Pinocchio is
  called state by state from Python, its only interface there, so its call overhead counts;
  an upper estimate of that overhead (``integrate``, a vector sum through the same binding) is
  printed. The package is called once for all states.
* simulated time steps of the elastic plant, torque held. MuJoCo gets the same 7 hinges with
  springs and dampers and 3 motors as hinged rotors, coupled by tendons ``r phi - q``: the
  same 20 states and the same equations (checked here on accelerations near rest), stepped
  by ``mj_step`` with its ``nstep`` argument, so that the loop over steps is in C. MuJoCo
  keeps no log of the steps; ours keeps six arrays.
  The rotors' bodies stand on the base, so rotor gyroscopics are absent in both.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from axisight import _core
from axisight.simulation import Integrator

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))
import mujoco_model  # noqa: E402
import pinocchio_model  # noqa: E402


def best(action: Callable[[], object], repeats: int) -> float:
    """Shortest of several runs [s]; the least disturbed one."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def check_same_plant(robot: _core.Robot, text: str) -> float:
    """Largest relative difference of the accelerations at rest with 1 Nm extra."""
    model = mujoco.MjModel.from_xml_string(mujoco_model.build(text, "RK4", robot.sample_time_s))
    data = mujoco.MjData(model)
    rest = robot.equilibrium([])
    a, b, _ = robot.linearize([])
    n = a.shape[0] // 2
    data.qpos[:] = np.concatenate([rest["motor_angle"], rest["joint_angle"]])
    rng = np.random.default_rng(1)
    step = 1e-6 * rng.normal(size=2 * n)
    extra = 1e-3 * rng.normal(size=3)
    data.qpos[:] += step[:n]
    data.qvel[:] = step[n:]
    data.ctrl[:] = rest["motor_torque"] + extra
    mujoco.mj_forward(model, data)
    want = (a @ step + b @ extra)[n:]
    return float(np.abs(data.qacc - want).max() / np.abs(want).max())


def rows(repeats: int) -> list[tuple[str, float, float, str]]:
    """Label, our time and the peer's per unit [us], remark."""
    text = (ROOT / "python/axisight/robot/presets/irb6600_like.toml").read_text()
    robot = _core.Robot.from_toml(text)
    model = pinocchio_model.build(text)
    data = model.createData()
    rng = np.random.default_rng(0)
    count = 2000
    q, v, a = rng.uniform(-1, 1, (3, count, robot.n_joints))
    states = list(zip(q, v, a, strict=True))

    def each(call: Callable[..., object]) -> Callable[[], None]:
        def run() -> None:
            for state in states:
                call(model, data, *state)

        return run

    def mass_and_bias(model: pin.Model, data: pin.Data, *state: np.ndarray) -> None:
        pin.crba(model, data, state[0])
        pin.rnea(model, data, *state)

    out = []
    per_state = 1e6 / count
    overhead = best(lambda: [pin.integrate(model, x, y) for x, y, _ in states], repeats) * per_state
    ours = best(lambda: robot.inverse_dynamics(q, v, a), repeats) * per_state
    out.append(
        ("inverse dynamics", ours, best(each(pin.rnea), repeats) * per_state, "Pinocchio rnea")
    )
    out.append(
        (
            "  with inertia matrix",
            ours,
            best(each(mass_and_bias), repeats) * per_state,
            "Pinocchio crba + rnea (ours computes M on the way)",
        )
    )
    ours = best(lambda: robot.forward_dynamics(q, v, a), repeats) * per_state
    out.append(
        (
            "forward dynamics",
            ours,
            best(each(pin.aba), repeats) * per_state,
            f"Pinocchio aba; its integrate, call overhead mostly, takes {overhead:.2f} us",
        )
    )

    dt, steps = robot.sample_time_s, 4000
    torque = np.tile(robot.equilibrium([])["motor_torque"], (1, steps, 1))
    rk4 = Integrator("rk4")
    ours = (
        best(
            lambda: _core.simulate_batch(
                robot, [], torque, reference=False, integrator=rk4, threads=1
            ),
            repeats,
        )
        * 1e6
        / steps
    )
    difference = check_same_plant(robot, text)
    for name in ("RK4", "Euler", "implicitfast"):
        xml = mujoco.MjModel.from_xml_string(mujoco_model.build(text, name, dt))
        world = mujoco.MjData(xml)

        def roll(xml: mujoco.MjModel = xml, world: mujoco.MjData = world) -> None:
            mujoco.mj_resetData(xml, world)
            rest = robot.equilibrium([])
            world.qpos[:] = np.concatenate([rest["motor_angle"], rest["joint_angle"]])
            world.ctrl[:] = rest["motor_torque"]
            mujoco.mj_step(xml, world, steps)

        peer = best(roll, repeats) * 1e6 / steps
        rest = robot.equilibrium([])["joint_angle"]
        moved = np.abs(world.qpos[3:] - rest).max()
        remark = f"MuJoCo {name}, 0.5 ms; drift {moved:.0e} rad in {steps * dt:.0f} s"
        out.append(("step, ours RK4 with log", ours, peer, remark))
    out.append(("same plant, relative", difference, 0.0, "accelerations, ours against MuJoCo's"))
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    table = rows(parser.parse_args().repeats)
    print(f"Pinocchio {pin.__version__}, MuJoCo {mujoco.__version__}, best of repeats, one thread")
    print(f"{'':26}{'ours us':>9}{'peer us':>9}{'peer/ours':>11}  peer")
    for label, ours, peer, remark in table:
        if peer:
            print(f"{label:26}{ours:9.3f}{peer:9.3f}{peer / ours:11.2f}  {remark}")
        else:
            print(f"{label:26}{ours:9.1e}{'':20}  {remark}")


if __name__ == "__main__":
    main()

"""Steps of 0.5 ms of the 10-degree-of-freedom elastic arm: this package and MuJoCo.

Run ``python benches/peers/elastic_arm_steps.py`` from the root of the repository.

Both take steps of fourth order, one per sample, on one thread (classical Runge-Kutta, and
ours Nyström's too), with the motor torques held over each step: the static torques plus tones,
another value at every step. MuJoCo gets the equivalent MJCF (``tests/python/mujoco_model.py``) with everything
switched off that the arm does not need, and the faster of

* ``mj_step`` with its ``nstep`` argument: the loop in C, no log, torques constant;
* ``mujoco.rollout``: the loop in C++, torques and log at every step, as ours.

Accuracy is the relative RMS error of the positions in the run with varying torques,
against 32 Runge-Kutta sub-steps of the independent model. The order is what halving the step
does to the error of each side: 4 is a factor of 16.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from collections.abc import Callable

import mujoco
import numba
import numpy as np
from common import loops, numba_plant, robot_model, setting
from common.loops import relative_rms
from common.timing import cpu, timed
from mujoco import rollout

import axisight

sys.path.insert(0, str(setting.ROOT / "tests" / "python"))
import mujoco_model

Array = np.ndarray
OWN = ("rk4", "rkn4")
UNUSED = (
    "equality",
    "frictionloss",
    "limit",
    "clampctrl",
    "filterparent",
    "sensor",
    "midphase",
    "autoreset",
    "nativeccd",
    "eulerdamp",
    "island",
)


def mujoco_arm(text: str, timestep: float) -> mujoco.MjModel:
    """The arm with features off that it does not use."""
    model = mujoco.MjModel.from_xml_string(mujoco_model.build(text, "RK4", timestep))
    for name in UNUSED:
        flag = getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}", None)
        if flag is not None:
            model.opt.disableflags |= int(flag)
    return model


def torques(s: setting.Setting, count: int) -> Array:
    """Static torques plus tones of a few Nm, (count, n_axes)."""
    time = np.arange(count) * s.model.sample_time
    tones = s.tones.velocity(time)
    swing = s.tones.velocity(np.zeros(1))
    return s.feed_forward + 2.0 * (tones - swing) / np.abs(tones).max(axis=0)


def independent(s: setting.Setting, torque: Array) -> Callable[[int], Array]:
    """Positions of the independent model under held torques, by sub-steps per sample."""

    @numba.njit
    def command(k, w_ref, x, previous, phi_ref, u):
        for i in range(len(u)):
            u[i] = w_ref[k, i]

    task = loops.Task(**{**s.sampled.__dict__, "command": command, "reference": torque})
    loop = loops.rk4_loop(task)
    loop(task.start, torque[:2], 1)
    return lambda substeps: loop(task.start, torque, substeps)


def mujoco_run(model: mujoco.MjModel, start: Array, torque: Array) -> Array:
    """Positions before each step, (count, positions)."""
    data = mujoco.MjData(model)
    data.qpos[:] = start[: model.nq]
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    out, _ = rollout.rollout(model, data, state, torque)
    after = out[0, :, 1 : 1 + model.nq]
    return np.vstack([start[: model.nq], after[:-1]])


def held(torque: Array, times: int) -> Array:
    return np.repeat(torque, times, axis=0)


def own_run(s: setting.Setting, torque: Array, method: str, substeps: int) -> Array:
    out = axisight.simulate(s.robot, torque_nm=torque, method=method, substeps=substeps)
    return np.hstack([out["motor_position_rad"], out["joint_position_rad"]])


def accuracy(s: setting.Setting, torque: Array) -> list[tuple[str, float, float]]:
    """Error at 0.5 ms and the order, ours and MuJoCo's."""
    want = independent(s, torque)(32)
    period = s.model.sample_time
    runs = {}
    for method in OWN:
        errors = [relative_rms(own_run(s, torque, method, n), want) for n in (1, 2)]
        runs[f"axisight {method}"] = errors
    theirs = []
    for n in (1, 2):
        model = mujoco_arm(s.text, period / n)
        positions = mujoco_run(model, s.sampled.start, held(torque, n))[::n]
        theirs.append(relative_rms(positions, want))
    runs["MuJoCo RK4"] = theirs
    return [(label, e[0], float(np.log2(e[0] / e[1]))) for label, e in runs.items()]


def speeds(s: setting.Setting, torque: Array, repeats: int) -> list[tuple[str, float]]:
    """Microseconds a step: ours, the compiled independent model, MuJoCo two ways."""
    count = len(torque)
    start = s.sampled.start
    model = mujoco_arm(s.text, s.model.sample_time)
    data = mujoco.MjData(model)

    def step() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = start[: model.nq]
        data.ctrl[:] = s.feed_forward
        mujoco.mj_step(model, data, count)

    def own(method: str) -> Callable[[], object]:
        return lambda: axisight.simulate(s.robot, torque_nm=torque, method=method)

    rows = [(f"axisight {method}, with log", own(method)) for method in OWN]
    loop = independent(s, torque)
    rows.append(("numba RK4 loop, with log", lambda: loop(1)))
    rows.append(("MuJoCo RK4, mj_step(nstep)", step))
    rows.append(("MuJoCo RK4, rollout", lambda: mujoco_run(model, start, torque)))
    out = []
    for label, run in rows:
        run()
        out.append((label, 1e6 * timed(run, repeats)[0] / count))
    return out


def batch(s: setting.Setting, torque: Array, repeats: int, runs: int = 64) -> list:
    """Microseconds a step and run in a batch on one thread."""
    many = np.linspace(0.2, 1.0, runs)[:, None, None] * (torque - s.feed_forward)
    many = np.ascontiguousarray(many + s.feed_forward)
    model = mujoco_arm(s.text, s.model.sample_time)
    data = mujoco.MjData(model)
    data.qpos[:] = s.sampled.start[: model.nq]
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.tile(state, (runs, 1))
    per = 1e6 / (runs * len(torque))
    out = []
    for method in OWN:
        own = lambda m=method: axisight.simulate_batch(  # noqa: E731
            s.robot, torque_nm=many, method=m, substeps=1, threads=1
        )
        out.append((f"axisight {method}, batch of {runs}", timed(own, repeats)[0] * per))
    run = lambda: rollout.rollout(model, data, states, many)  # noqa: E731
    out.append((f"MuJoCo rollout, batch of {runs}", timed(run, repeats)[0] * per))
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=20000)
    parser.add_argument("--repeats", type=int, default=7)
    args = parser.parse_args()
    s = setting.make(args.steps * 5e-4, smooth=False)
    torque = torques(s, args.steps)
    inverse, linear = numba_plant.check(robot_model.read(s.text), s.robot.core)
    print(f"{cpu()}\nMuJoCo {mujoco.__version__}, one thread, {args.steps} steps of 0.5 ms")
    print(f"independent model against ours: inverse dynamics {inverse:.0e}, linear {linear:.0e}")
    print(f"\n{'':30}{'rel. RMS error':>15}{'order':>8}")
    for label, error, order in accuracy(s, torque):
        print(f"{label:30}{error:15.1e}{order:8.2f}")
    rows = speeds(s, torque, args.repeats) + batch(s, torque, args.repeats)
    ours = dict(rows)["axisight rkn4, with log"]
    print(f"\n{'':30}{'us/step':>10}{'steps/s':>12}{'peer/ours':>11}")
    for label, us in rows:
        print(f"{label:30}{us:10.3f}{1e6 / us:12.0f}{us / ours:11.2f}")


if __name__ == "__main__":
    main()

"""The independent robot model compiled by numba: right-hand sides for Python's ODE solvers.

The source is straight-line scalar code with the robot's numbers as constants: no loops, no
allocation, no branches. That is faster than the loops over small arrays one would write by
hand, so it is what the peers get.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np

from common import robot_model
from common.expressions import Scalar, lines, operations
from common.tones import Tones

Array = np.ndarray
# Contraction and reordering only: results stay finite, so nothing relies on NaN or infinity.
FASTMATH = {"contract", "reassoc", "nsz", "arcp"}


def compiled(signature: str, results: list[Scalar], out: str) -> Callable:
    """An njit function that fills ``out`` with the results; returns nothing."""
    assignments, texts = lines(results)
    body = [f"    {name} = {text}" for name, text in assignments]
    body += [f"    {out}[{i}] = {text}" for i, text in enumerate(texts)]
    source = f"def function({signature}):\n" + "\n".join(body) + "\n"
    scope = {"sin": math.sin, "cos": math.cos, "exp": math.exp, "tanh": math.tanh, "abs": abs}
    exec(compile(source, "<straight-line model>", "exec"), scope)
    return numba.njit(fastmath=FASTMATH, error_model="numpy")(scope["function"])


@dataclass
class Plant:
    """One robot with its extras; ``held(t, x, u, dx)`` fills dx under motor torques u."""

    n_states: int
    n_axes: int
    operations: int
    held: Callable


def held_torque(model: robot_model.Model, extras: robot_model.Extras | None = None) -> Plant:
    """The plant under torques given from outside."""
    tape, x, u = robot_model.fresh(model, extras)
    dx = robot_model.derivative(model, x, u, tape, extras)
    return Plant(len(x), model.n_axes, operations(dx), compiled("t, x, u, dx", dx, "dx"))


def smooth_loop(
    model: robot_model.Model,
    tones: Tones,
    start: Array,
    feed_forward: Array,
    extras: robot_model.Extras | None = None,
) -> Plant:
    """The plant in a continuous-time PI velocity loop on smooth references.

    ``u`` is unused; it keeps the two plants interchangeable.
    """
    tape, x, _ = robot_model.fresh(model, extras)
    u = smooth_torque(model, tones, start, feed_forward, x, tape)
    dx = robot_model.derivative(model, x, u, tape, extras)
    return Plant(len(x), model.n_axes, operations(dx), compiled("t, x, u, dx", dx, "dx"))


def smooth_torque(model, tones, start, feed_forward, x, tape) -> list[Scalar]:
    """``u_ff + kp (w_ref - w) + ki (phi_ref - phi)`` in continuous time."""
    w_ref, phi_ref = tones.traced(tape)
    kp, ki = model.controller["kp"], model.controller["ki"]
    rates = model.n_axes + model.n_joints
    return [
        float(feed_forward[i])
        + (w_ref[i] - x[rates + i]) * kp[i]
        + (phi_ref[i] + float(start[i]) - x[i]) * ki[i]
        for i in range(model.n_axes)
    ]


def jacobian_of(plant: Plant, size: Array) -> Callable:
    """``jacobian(t, x, u, out)`` by one-sided differences inside compiled code.

    ``size`` is the typical size of each state. Newton iterations need no more than this,
    and SciPy's own differences cost a Python call per column.
    """
    held, n = plant.held, plant.n_states
    step = 1.5e-8 * size

    @numba.njit
    def jacobian(t, x, u, out):
        base, moved, probe = np.empty(n), np.empty(n), x.copy()
        held(t, x, u, base)
        for j in range(n):
            h = max(step[j], 1.5e-8 * abs(x[j]))
            probe[j] = x[j] + h
            h = probe[j] - x[j]
            held(t, probe, u, moved)
            probe[j] = x[j]
            for i in range(n):
                out[i, j] = (moved[i] - base[i]) / h

    return jacobian


def check(model: robot_model.Model, robot: object, seed: int = 0) -> tuple[float, float]:
    """Largest relative errors against the package: inverse dynamics, and linearization.

    The chain's inertia matrix and bias are compared at random states, and the derivative near
    rest with ``A dx + B du``; the second leaves a term of the order of the step squared.
    """
    tape = robot_model.Tape()
    n, m = model.n_joints, model.n_axes
    q = [tape.leaf(f"x[{i}]") for i in range(n)]
    v = [tape.leaf(f"x[{n + i}]") for i in range(n)]
    a = [tape.leaf(f"x[{2 * n + i}]") for i in range(n)]
    matrix, bias = robot_model.rigid_body(model, q, v, tape)
    force = []
    for i in range(n):
        total = bias[i]
        for j in range(n):
            total = total + matrix[max(i, j)][min(i, j)] * a[j]
        force.append(total)
    function = compiled("x, out", force, "out")
    rng = np.random.default_rng(seed)
    states = rng.normal(size=(100, 3 * n))
    got = np.empty((100, n))
    for row, out in zip(states, got, strict=True):
        function(row, out)
    want = robot.inverse_dynamics(*np.ascontiguousarray(states.reshape(100, 3, n).swapaxes(0, 1)))
    inverse = np.abs(got - want).max() / np.abs(want).max()

    rest = robot.equilibrium([])
    slope, gain, _ = robot.linearize([])
    plant = held_torque(model)
    x0 = robot_model.equilibrium_state(rest)
    step, extra = 1e-3 * rng.normal(size=2 * (n + m)), rng.normal(size=m)
    ahead, back = np.empty(2 * (n + m)), np.empty(2 * (n + m))
    # Central differences of a step and its half, extrapolated: an error of the fifth order.
    central = []
    for h in (1e-2, 5e-3):
        plant.held(0.0, x0 + h * step, rest["motor_torque"] + h * extra, ahead)
        plant.held(0.0, x0 - h * step, rest["motor_torque"] - h * extra, back)
        central.append((ahead - back) / (2 * h))
    near = (4 * central[1] - central[0]) / 3
    linear = slope @ step + gain @ extra
    return float(inverse), float(np.abs(near - linear).max() / np.abs(linear).max())

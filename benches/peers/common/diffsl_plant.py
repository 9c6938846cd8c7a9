"""The independent robot model as DiffSL text, for pydiffsol.

DiffSL knows vectors and index notation but neither matrix factorization nor recursion over
links, so the model is written out as scalars, the LDL^T solve included. pydiffsol takes one
absolute tolerance for all states, so the states here are in units of their typical size.
"""

from __future__ import annotations

import re

import numpy as np

from common import robot_model
from common.expressions import Scalar, Tape, lines
from common.numba_plant import smooth_torque
from common.tones import Tones

Array = np.ndarray


def smooth_loop(
    model: robot_model.Model,
    tones: Tones,
    start: Array,
    feed_forward: Array,
    size: Array,
    extras: robot_model.Extras | None = None,
) -> str:
    """DiffSL source of the plant in a continuous-time PI loop, outputs the positions."""
    tape = Tape()
    scaled = [tape.leaf(state(i)) for i in range(len(start))]
    x = [s * float(a) for s, a in zip(scaled, size, strict=True)]
    u = smooth_torque(model, tones, start, feed_forward, x, tape)
    dx = robot_model.derivative(model, x, u, tape, extras)
    rates = [d * float(1.0 / a) for d, a in zip(dx, size, strict=True)]
    initial = [plain(repr(float(v))) for v in start / size]
    return source(rates, x[: model.n_axes + model.n_joints], initial)


def held_torque(
    model: robot_model.Model, size: Array, extras: robot_model.Extras | None = None
) -> str:
    """DiffSL source of the plant under held torques; outputs are the states.

    Inputs are the torques, then the initial states, so that one compiled model serves every
    sample.
    """
    tape = Tape()
    count = len(size)
    scaled = [tape.leaf(state(i)) for i in range(count)]
    x = [s * float(a) for s, a in zip(scaled, size, strict=True)]
    torque = [f"p{i}" for i in range(model.n_axes)]
    initial = [f"q{i}" for i in range(count)]
    u = [tape.leaf(name) for name in torque]
    dx = robot_model.derivative(model, x, u, tape, extras)
    rates = [d * float(1.0 / a) for d, a in zip(dx, size, strict=True)]
    inputs = "in_i { " + ", ".join(f"{name} = 0" for name in torque + initial) + " }\n"
    return inputs + source(rates, [], initial)


def state(i: int) -> str:
    """Name of a state; DiffSL keeps the underscore for indices."""
    return f"s{i}"


def source(rates: list[Scalar], outputs: list[Scalar], initial: list[str]) -> str:
    """DiffSL text: initial states, intermediate scalars, derivatives, outputs."""
    assignments, texts = lines([*rates, *outputs])
    n = len(rates)
    states = ", ".join(f"{state(i)} = {value}" for i, value in enumerate(initial))
    parts = [f"u_i {{ {states} }}"]
    parts += [f"{name} {{ {plain(text)} }}" for name, text in assignments]
    parts.append("F_i { " + ", ".join(plain(t) for t in texts[:n]) + " }")
    if outputs:
        parts.append("out_i { " + ", ".join(plain(t) for t in texts[n:]) + " }")
    return "\n".join(parts) + "\n"


def plain(text: str) -> str:
    """Python expression to DiffSL, which knows no plus sign in exponents."""
    return re.sub(r"(\d)e\+", r"\1e", text)

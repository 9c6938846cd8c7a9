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
    return source(rates, x[: model.n_axes + model.n_joints], start / size)


def state(i: int) -> str:
    """Name of a state; DiffSL keeps the underscore for indices."""
    return f"s{i}"


def source(rates: list[Scalar], outputs: list[Scalar], initial: Array) -> str:
    """DiffSL text: initial states, intermediate scalars, derivatives, outputs."""
    assignments, texts = lines([*rates, *outputs])
    n = len(rates)
    parts = [
        "u_i { " + ", ".join(f"{state(i)} = {number(v)}" for i, v in enumerate(initial)) + " }"
    ]
    parts += [f"{name} {{ {plain(text)} }}" for name, text in assignments]
    parts.append("F_i { " + ", ".join(plain(t) for t in texts[:n]) + " }")
    parts.append("out_i { " + ", ".join(plain(t) for t in texts[n:]) + " }")
    return "\n".join(parts) + "\n"


def number(value: float) -> str:
    """A number as DiffSL reads it: a sign stands apart from the digits."""
    return repr(float(value)).replace("e+", "e")


def plain(text: str) -> str:
    """Python expression to DiffSL."""
    return re.sub(r"(\d)e\+", r"\1e", text)

"""Draws of a benchmark: which machine, which effects, which motions; a function of (seed, number)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.blind.case_files import moves
from axisight.blind.engine import Machine
from axisight.blind.withheld import KINDS, Drawn
from axisight.robot import Robot

Array = NDArray[np.float64]

# Production scatter, relative, evenly within.
_SCATTER = {
    "mass": 0.02,
    "inertia_scale": 0.02,
    "stiffness": 0.02,
    "motor_inertia": 0.02,
    "viscous_friction": 0.03,
    "damping": 0.08,
}
# What a native change is a share of.
_CHANGES = (
    ("spring", "stiffness"),
    ("damper", "damping"),
    ("armature", "motor_inertia"),
    ("viscous", "viscous_friction"),
)
# Of so many cases one has nothing withheld, and one a pair.
_ONE_IN = {"nothing": 8, "pair": 6}
_SECONDS = 10.0


@dataclass(frozen=True)
class Draw:
    """One case as drawn: effects, a machine with and a ``bare`` one without, references by name and role."""

    number: int
    effects: tuple[Drawn, ...]
    machine: Machine
    bare: Machine
    references: dict[str, tuple[str, Array]]


def draw(seed: int, number: int, robot: Robot) -> Draw:
    """Return case ``number`` of a benchmark."""
    rng = np.random.default_rng([seed, number])
    effects = _effects(rng, number, robot)
    machine = _without_scatter_of(effects, scattered(rng, robot), robot)
    bare = machine_of(machine, ())
    return Draw(number, effects, machine_of(machine, effects), bare, references(rng, robot))


def _effects(rng: np.random.Generator, number: int, robot: Robot) -> tuple[Drawn, ...]:
    if number % _ONE_IN["nothing"] == 0:
        return ()
    names = list(KINDS)
    first = names[int(rng.integers(len(names)))]
    axes = rng.permutation(robot.n_axes) + 1
    out = [KINDS[first].draw(rng, robot, int(axes[0]))]
    if number % _ONE_IN["pair"] == 1 and KINDS[first].in_library and robot.n_axes > 1:
        others = [n for n, k in KINDS.items() if k.in_library and n != first]
        second = others[int(rng.integers(len(others)))]
        out.append(KINDS[second].draw(rng, robot, int(axes[1])))
    return tuple(out)


def scattered(rng: np.random.Generator, robot: Robot) -> Robot:
    """Return a machine of the robot's type, without effects: the same but for production scatter."""
    changed = {
        name: value * (1 + _SCATTER[quantity] * float(rng.uniform(-1, 1)))
        for name, value in robot.parameters().items()
        if (quantity := name.rsplit(".", 1)[1]) in _SCATTER
    }
    return robot.with_effects([]).with_parameters(changed)


def _without_scatter_of(effects: Sequence[Drawn], machine: Robot, robot: Robot) -> Robot:
    """Return the machine with what effects change as in the robot: they state the whole change."""
    stated: dict[str, float] = {}
    for effect in effects:
        if effect.axis is not None:
            native = asdict(effect.native)
            joint = robot.axis_names[effect.axis - 1]
            stated |= {
                f"{joint}.{q}": robot.parameters()[f"{joint}.{q}"] for n, q in _CHANGES if native[n]
            }
    return machine.with_parameters(stated)


def machine_of(robot: Robot, effects: Sequence[Drawn]) -> Machine:
    """Return a robot with effects."""
    out = Machine(robot)
    for effect in effects:
        if effect.axis is None:
            out = replace(out, ends=effect.ends)
            continue
        out = replace(out, robot=out.robot.with_parameters(effect.changed))
        axis = effect.axis - 1
        out = replace(
            out,
            native={**out.native, axis: effect.native},
            laws={**out.laws, axis: effect.laws},
        )
    return out


def references(rng: np.random.Generator, robot: Robot) -> dict[str, tuple[str, Array]]:
    """Return role and velocity reference (n, n_axes) [rad/s] of every log, by name."""
    n = round(_SECONDS / robot.sample_time_s)
    time: Array = np.arange(n, dtype=np.float64) * robot.sample_time_s
    axes = robot.n_axes
    sign = np.array([-1.0, 1.0])
    top: Array = rng.uniform(40.0, 55.0, axes) * rng.choice(sign, axes)
    fresh: Array = rng.uniform(30.0, 55.0, axes) * rng.choice(sign, axes)
    out: dict[str, tuple[str, Array]] = {}
    for axis in range(axes):
        loud: Array = 8.0 * np.eye(axes)[axis]
        out[f"multisine_axis{axis + 1}"] = ("estimation", _multisine(rng, time, loud))
    out["multisine_half"] = ("estimation", _multisine(rng, time, np.full(axes, 4.0), 0.5))
    out["triangle"] = ("estimation", _triangle(time, 0.55 * np.abs(top)))
    out["moves"] = ("estimation", moves(time, _SECONDS, top))
    out["multisine_fresh"] = ("validation", _multisine(rng, time, np.full(axes, 4.0), 0.7))
    out["moves_fresh"] = ("validation", moves(time, _SECONDS, fresh))
    return out


def _multisine(rng: np.random.Generator, time: Array, loud: Array, share: float = 1.0) -> Array:
    """Return random-phase multisines from 1 to 40 Hz on square waves that keep the motors turning."""
    lines = np.arange(1.0, 40.0, 1.0 / _SECONDS)
    out = np.empty((len(time), len(loud)))
    square = np.tanh(20 * np.sin(2 * np.pi * time / 5.0))
    for axis, size in enumerate(loud):
        phases = rng.uniform(0, 2 * np.pi, len(lines))
        wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
        out[:, axis] = share * 9.6 * square + size * wave / np.abs(wave).max()
    return np.asarray(out * np.minimum(time / 0.1, 1.0)[:, None])


def _triangle(time: Array, top: Array) -> Array:
    phase = (time / 5.0 + 0.25) % 1.0
    wave = 4 * np.abs(phase - 0.5) - 1
    return np.asarray(-wave[:, None] * top)

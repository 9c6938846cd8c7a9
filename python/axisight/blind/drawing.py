"""Random cases of a benchmark: engine, arm, motions and effects, as a function of (seed, number)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.blind.machine import Machine
from axisight.blind.motions import MOTIONS
from axisight.blind.scene import Drawn, Kind, Scene
from axisight.blind.withheld import BY_REFERENCES, KINDS, KINDS_ON_REQUEST
from axisight.blind.withheld_formulas import KINDS_BY_FORMULA, KINDS_BY_FORMULA_ON_REQUEST
from axisight.errors import InputError
from axisight.robot import Robot, load_robot

Array = NDArray[np.float64]

# Production scatter: half width of a uniform distribution, relative.
_SCATTER = {
    "mass": 0.02,
    "inertia_scale": 0.02,
    "stiffness": 0.02,
    "motor_inertia": 0.02,
    "viscous_friction": 0.03,
    "damping": 0.08,
}
# Native changes, and the quantity of which each is a share.
_CHANGES = (
    ("spring", "stiffness"),
    ("damper", "damping"),
    ("armature", "motor_inertia"),
    ("viscous", "viscous_friction"),
)
# One case of so many has no effect, one has two.
_ONE_IN = {"nothing": 8, "pair": 6}
ENGINES: Mapping[str, Mapping[str, Kind]] = {"mujoco": KINDS, "pinocchio": KINDS_BY_FORMULA}
"""Kinds of effects by engine, from which cases draw. Another name would change every draw of every seed."""
ON_REQUEST: Mapping[str, Mapping[str, Kind]] = {
    "mujoco": KINDS_ON_REQUEST,
    "pinocchio": KINDS_BY_FORMULA_ON_REQUEST,
}
"""Kinds of effects by engine that cases have only where a choice names them."""
# Share of the cases by engine, arm and motions.
_ENGINES = {"mujoco": 0.5, "pinocchio": 0.5}
_ARMS = {"irb6600_like": 0.6, "scara_like": 0.15, "lever_like": 0.15, "cobot_like": 0.1}
_MOTIONS = {"multisines": 0.6, "moves": 0.2, "slow_and_short": 0.2}
# One case of so many has first-order sensor noise with a corner between these frequencies.
_COLOURED_ONE_IN = 5
_CORNER_HZ = (300.0, 800.0)
# One case of so many has logs without references, unless only references show its effect or the logged torque
# contains it. One has quantized torques: 12 to 15 converter bits over twice the largest torque.
_UNREFERENCED_ONE_IN = 8
_STEPPED_ONE_IN = 8
_BITS = (12, 16)


@dataclass(frozen=True)
class Choice:
    """Fixed parts of a draw: engine, arm, motions and effect by name; None is drawn.

    ``effect``: withheld alone in every case. Raises InputError for unknown names.
    """

    engine: str | None = None
    arm: str | None = None
    motions: str | None = None
    effect: str | None = None

    def __post_init__(self) -> None:
        """Raise InputError for unknown names."""
        known: dict[str, Sequence[str]] = {
            "engine": list(_ENGINES),
            "arm": list(_ARMS),
            "motions": list(_MOTIONS),
            "effect": _effects_of(self.engine),
        }
        for name, names in known.items():
            value = getattr(self, name)
            if value is not None and value not in names:
                raise InputError(f"{name}: expected one of {', '.join(names)}, got {value!r}")


def _effects_of(engine: str | None) -> list[str]:
    """Return the names of the effects of an engine, or of those that all engines have."""
    kinds = [
        _all_kinds(e) for e in ([engine] if engine is not None and engine in ENGINES else ENGINES)
    ]
    return [name for name in kinds[0] if all(name in others for others in kinds)]


def _all_kinds(engine: str) -> dict[str, Kind]:
    return {**ENGINES[engine], **ON_REQUEST[engine]}


@dataclass(frozen=True)
class Draw:
    """One case as drawn: effects, the machine with them, a ``bare`` machine without them, references.

    - ``robot``: the simulator of the case.
    - ``references``: role and velocity reference (n, n_axes) [rad/s] by log name.
    - ``corner_hz``: corner of the sensor noise, None for white noise.
    - ``referenced``: whether the logs have references.
    - ``bits``: resolution of the logged torques, None for torques without steps.
    """

    number: int
    engine: str
    arm: str
    motions: str
    robot: Robot
    effects: tuple[Drawn, ...]
    machine: Machine
    bare: Machine
    references: dict[str, tuple[str, Array]]
    corner_hz: float | None = None
    referenced: bool = True
    bits: int | None = None


DRAWN = Choice()
"""Everything drawn."""


def draw(seed: int, number: int, choice: Choice = DRAWN, attempt: int = 0) -> Draw:
    """Return case ``number`` of a benchmark; every ``attempt`` draws another one.

    Raises InputError if the chosen effect shows on no axis of the arm.
    """
    rng = _chance(seed, number, attempt)
    engine, arm, motions = _circumstances(rng, choice)
    robot = load_robot(arm)
    references = MOTIONS[motions](rng, robot)
    scene = Scene(robot, [reference for _, reference in references.values()])
    if choice.effect is None:
        effects = _effects(rng, number, scene, ENGINES[engine])
    else:
        effects = _chosen(rng, scene, choice.effect, _all_kinds(engine))
    machine = _without_scatter_of(effects, scattered(rng, robot), robot)
    with_effects, bare = machine_of(machine, effects), machine_of(machine, ())
    corner_hz = float(rng.uniform(*_CORNER_HZ)) if rng.integers(_COLOURED_ONE_IN) == 0 else None
    referenced = bool(rng.integers(_UNREFERENCED_ONE_IN)) or any(
        e.effect in BY_REFERENCES for e in effects
    )
    bits = int(rng.integers(*_BITS)) if rng.integers(_STEPPED_ONE_IN) == 0 else None
    return Draw(
        number,
        engine,
        arm,
        motions,
        robot,
        effects,
        with_effects,
        bare,
        references,
        corner_hz,
        referenced,
        bits,
    )


def circumstances(seed: int, number: int, choice: Choice = DRAWN) -> tuple[str, str, str]:
    """Return engine, arm and motions of case ``number``, as drawn by its first attempt."""
    return _circumstances(_chance(seed, number, 0), choice)


def _chance(seed: int, number: int, attempt: int) -> np.random.Generator:
    return np.random.default_rng([seed, number, attempt] if attempt else [seed, number])


def _circumstances(rng: np.random.Generator, choice: Choice) -> tuple[str, str, str]:
    engine, arm, motions = (_one_of(rng, shares) for shares in (_ENGINES, _ARMS, _MOTIONS))
    return choice.engine or engine, choice.arm or arm, choice.motions or motions


def _one_of(rng: np.random.Generator, shares: Mapping[str, float]) -> str:
    return str(rng.choice(list(shares), p=list(shares.values())))


def _effects(
    rng: np.random.Generator, number: int, scene: Scene, kinds: Mapping[str, Kind]
) -> tuple[Drawn, ...]:
    if number % _ONE_IN["nothing"] == 0:
        return ()
    there = {name: kind for name, kind in kinds.items() if kind.axes(scene)}
    first = str(rng.choice(list(there)))
    out = [there[first].draw(rng, scene, int(rng.choice(there[first].axes(scene))))]
    if number % _ONE_IN["pair"] == 1 and there[first].in_library and not there[first].alone:
        out += _second(rng, scene, there, first, out[0])
    return tuple(out)


def _chosen(
    rng: np.random.Generator, scene: Scene, name: str, kinds: Mapping[str, Kind]
) -> tuple[Drawn, ...]:
    """Return one effect on an axis where it shows; raises InputError if there is none."""
    axes = kinds[name].axes(scene)
    if not axes:
        raise InputError(
            f"effect: expected one that shows on an axis of {scene.robot.name}, got {name!r}"
        )
    return (kinds[name].draw(rng, scene, int(rng.choice(axes))),)


def _second(
    rng: np.random.Generator, scene: Scene, kinds: Mapping[str, Kind], first: str, taken: Drawn
) -> list[Drawn]:
    """Return another effect of the library on another axis; none if no axis is free."""
    rooms = {
        name: [axis for axis in kind.axes(scene) if axis != taken.axis]
        for name, kind in kinds.items()
        if kind.in_library and not kind.alone and name != first
    }
    names = [name for name, axes in rooms.items() if axes]
    if not names or scene.robot.n_axes == 1:
        return []
    name = str(rng.choice(names))
    both = kinds[name].draw(rng, scene, int(rng.choice(rooms[name])))
    return [both] if both.axis != taken.axis else []


def scattered(rng: np.random.Generator, robot: Robot) -> Robot:
    """Return the robot with production scatter and without effects."""
    changed = {
        name: value * (1 + _SCATTER[quantity] * float(rng.uniform(-1, 1)))
        for name, value in robot.parameters().items()
        if (quantity := name.rsplit(".", 1)[1]) in _SCATTER
    }
    return robot.with_effects([]).with_parameters(changed)


def _without_scatter_of(effects: Sequence[Drawn], machine: Robot, robot: Robot) -> Robot:
    """Return the machine with nominal values of what the effects change, which state the whole change."""
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
    """Return the machine that has a robot's parameters and these effects."""
    out = Machine(robot)
    for effect in effects:
        if effect.axis is None:
            out = replace(out, ends=effect.ends, fast=effect.fast)
            continue
        out = replace(out, robot=out.robot.with_parameters(effect.changed))
        axis = effect.axis - 1
        out = replace(
            out,
            native={**out.native, axis: effect.native},
            laws={**out.laws, axis: effect.laws},
        )
    return out

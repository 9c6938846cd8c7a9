"""Which numbers of a model file a cause changes, and what it has no place for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from axisight.effects import Effect, effect_info
from axisight.effects.stated import DRY_FRICTION, ROTOR, VISCOUS_FRICTION
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot_file import Provenance, identified, write_identified
from axisight.robot_import.xml_tree import Element, parse_xml
from axisight.storage import write_whole
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.result import Cause

# What another model has a number for, by effect: of the joint.
_NUMBERS = {
    "robot": {DRY_FRICTION[0]: "friction", VISCOUS_FRICTION: "damping"},
    "mujoco": {DRY_FRICTION[0]: "frictionloss", VISCOUS_FRICTION: "damping", ROTOR: "armature"},
}

_KINDS = (".urdf", ".xml", ".mjcf")


@dataclass(frozen=True)
class Written:
    """A model that was written: labels of the causes in it, and of those that it has no place for."""

    path: Path
    placed: tuple[str, ...]
    left_out: tuple[str, ...]


def write_model(
    source: Path | str,
    robot: Robot,
    causes: Sequence[Cause],
    target: Path | str,
    *,
    overwrite: bool = False,
) -> Written:
    """Write the model of a diagnosis with its causes.

    source
        What ``robot`` was read from: a robot file or a preset, which is written as a robot file (``.toml``)
        with all causes as effects; a URDF or MJCF, which is written as its own kind, or as a robot file.
    target
        File to write. Of a URDF or MJCF all bytes stay but the numbers that change, each with a comment that says
        cause, value, interval and probability: dry and viscous friction of joints, of an MJCF rotors too
        (armature). What was re-fitted within its tolerance stays as it is.
    overwrite
        Replace a file that exists.

    Raises InputError as `check_target`.
    """
    check_target(source, target, overwrite=overwrite)
    path = Path(target)
    if path.suffix.lower() == ".toml":
        return _as_robot_file(robot, causes, path, overwrite=overwrite)
    return _as_model(Path(source), robot, causes, path)


def check_target(source: Path | str, target: Path | str, *, overwrite: bool = False) -> None:
    """Raise InputError for a ``target`` that a ``source`` cannot be written as, and for a file in the way.

    ``overwrite``: files that exist are no obstacle.
    """
    path, kind = Path(target), Path(target).suffix.lower()
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists: choose another name")
    if kind == ".toml":
        return
    if kind not in _KINDS or Path(source).suffix.lower() != kind:
        raise InputError(
            f"{path}: expected {Path(source).suffix or '.toml'} as the model that was diagnosed, or .toml, got "
            f"{kind!r}"
        )


def _as_robot_file(
    robot: Robot, causes: Sequence[Cause], path: Path, *, overwrite: bool
) -> Written:
    effects = [
        Effect(
            c.effect,
            None if c.axes else c.axis,
            {n: v.value for n, v in c.parameters.items()},
            c.axes,
        )
        for c in causes
    ]
    found = identified({}, Provenance("diagnosis of the sim-to-real gap"), effects=effects)
    write_identified(robot, path, found, overwrite=overwrite)
    return Written(path, tuple(c.label for c in causes), ())


def _as_model(source: Path, robot: Robot, causes: Sequence[Cause], path: Path) -> Written:
    text = source.read_bytes()
    root = parse_xml(text, str(source))
    if root.tag not in _NUMBERS:
        raise InputError(f"{source}: expected a URDF or MJCF to write back to, got <{root.tag}>")
    # Transmissions, actuators and constraints name joints by elements of the same name.
    holders = [root] if root.tag == "robot" else [e for e in root.walk() if e.tag == "body"]
    joints = {e.attributes.get("name"): e for holder in holders for e in holder.all("joint")}
    edits, placed, left_out = Edits(text, str(source)), [], []
    by_joint: dict[str, list[Cause]] = {}
    for cause in causes:
        name = robot.axis_names[cause.axis - 1] if cause.axis and not cause.axes else None
        if cause.effect in _NUMBERS[root.tag] and name in joints:
            by_joint.setdefault(str(name), []).append(cause)
            placed.append(cause.label)
        else:
            left_out.append(cause.label)
    for name, mine in by_joint.items():
        _edit(edits, root.tag, joints[name], _of_joint(robot, name, mine), _said(mine))
    try:
        write_whole(path, edits.result().decode("utf-8"))
    except UnicodeDecodeError:
        raise InputError(f"{source}: expected a text in UTF-8 to write back to") from None
    return Written(path, tuple(placed), tuple(left_out))


def _of_joint(robot: Robot, name: str, causes: Sequence[Cause]) -> dict[str, float]:
    """Return what causes on its axis make of a joint, by effect.

    Dry friction [Nm], viscous friction [Nm s/rad], inertia of the rotor [kg m^2].
    """
    axis = robot.axis_names.index(name)
    ratio = abs(float(robot.gear_ratio[axis]))
    out = {}
    for cause in causes:
        value = next(iter(cause.parameters.values())).value
        if cause.effect == DRY_FRICTION[0]:
            # It has taken the place of what the simulator had.
            out[cause.effect] = value / ratio
        else:
            quantity = (effect_info(cause.effect).stands_for or ("", ""))[0]
            own = robot.parameters().get(f"{name}.{quantity}", 0.0)
            out[cause.effect] = (own + value) / ratio**2
    return out


def _said(causes: Sequence[Cause]) -> str:
    """Return what a comment says of causes: motor side, as the diagnosis does."""
    parts = []
    for cause in causes:
        name, value = next(iter(cause.parameters.items()))
        unit = cause.units.get(name, "")
        parts.append(
            f"{cause.label}: {name} = {value.value:.4g} ({value.low:.4g} to {value.high:.4g}) {unit} on the "
            f"motor, probability {cause.probability:.2f}"
        )
    return "axisight: " + "; ".join(parts)


def _edit(edits: Edits, root: str, joint: Element, numbers: dict[str, float], comment: str) -> None:
    attributes = {_NUMBERS[root][key]: value for key, value in numbers.items()}
    if root == "mujoco":
        edits.set(joint, attributes, comment)
        return
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        edits.set(dynamics, attributes, comment)
    else:
        edits.add(joint, "dynamics", attributes, comment)

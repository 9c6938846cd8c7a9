"""Writing of a model file with its causes: which numbers change, and which causes it cannot express."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from axisight import storage
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.effects.stated import OTHER_GAINS
from axisight.errors import InputError
from axisight.mujoco.torques import acts_in_gear, is_torque
from axisight.robot import Robot
from axisight.robot.sources import USD_SUFFIXES
from axisight.robot_file import Provenance, identified, sidecar_path, write_identified
from axisight.robot_import.bodies import Drive
from axisight.robot_import.drives import DriveData
from axisight.robot_import.load import bodies_and_chain, drive_data
from axisight.robot_import.xml_tree import Element, parse_xml
from axisight.write_back.actuators import DRIVE_EFFECTS, write_drive
from axisight.write_back.frames import FRAME_EFFECTS, write_frames
from axisight.write_back.inertials import write_bodies
from axisight.write_back.joints import JOINT_NUMBERS, write_joint
from axisight.write_back.limits import limits_of
from axisight.write_back.links import LINK_EFFECTS, body_changes
from axisight.write_back.placed import Labelled, Placed, doubt
from axisight.write_back.refitted import Refitted, refitted_gains
from axisight.write_back.usd import check_usd_target, write_usd
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause, Interval

_KINDS = (".urdf", ".xml", ".mjcf")
# Reason why a joint's drive takes nothing, or no gains.
_NO_LAW = "the controller stands in the drive data, the file has no gains of it"
_NO_JOINT = "the file has no driven joint of this name"


# A model file and the drive data it was read with; None: the drive data beside the file.
_Source = tuple[Path, DriveData | None]


@summarized
@dataclass(frozen=True)
class Written:
    """A written model: labels of causes and re-fitted gains that it contains, and of those it cannot express.

    ``why``: reasons for the latter, by label. ``remaining``: causes among them as effects;
    `axisight.mujoco.apply` takes those that are torques or act inside gears.
    """

    path: Path
    placed: tuple[str, ...]
    left_out: tuple[str, ...]
    why: Mapping[str, str] = field(default_factory=dict)
    remaining: tuple[Effect, ...] = ()


def write_model(
    source: Path | str,
    robot: Robot,
    causes: Sequence[Cause],
    target: Path | str,
    *,
    refit: Mapping[str, Interval] = MappingProxyType({}),
    overwrite: bool = False,
    drives: DriveData | None = None,
) -> Written:
    """Write the model of a diagnosis with its causes, and return what it contains.

    source
        What ``robot`` was read from. A robot file or a preset is written as a robot file (``.toml``) with all
        causes as effects. A URDF, MJCF or USD is written in its own format, or as a robot file.
    target
        File to write. In a URDF or MJCF all other bytes stay. Each changed number has a comment with cause,
        value, interval, probability and what the data cannot tell from it. Both formats take dry and viscous
        friction of joints, masses, centres of mass and inertias of links, a load on the last link, positions
        of axes, zeros of joints and the tilt of the base. An MJCF also takes rotors (armature), springs of
        joints, and gains, limits, delays and lags of motors. For a USD the new file is a layer over the old
        one, which it needs beside it; it takes what a URDF takes, and also rotors, springs, gains and limits.
    refit
        `Diagnosis.refit`: relative changes [1] by name. Gains of a controller with position targets
        (``j1.kp``) go to the robot file, or to the actuators of an MJCF. All other re-fitted values stay
        unwritten.
    overwrite
        Replace an existing file.
    drives
        The drive data ``robot`` was read with; None: those beside the file.

    Raises InputError as `check_target` does, and for a ``source`` that is no USD, or URDF or MJCF in UTF-8.
    """
    check_target(source, target, overwrite=overwrite)
    path, gains = Path(target), refitted_gains(robot, refit)
    if path.suffix.lower() == ".toml":
        return _as_robot_file(robot, causes, gains, path, overwrite=overwrite)
    return _as_model((Path(source), drives), robot, (causes, gains), path)


def check_target(source: Path | str, target: Path | str, *, overwrite: bool = False) -> None:
    """Raise InputError if ``source`` cannot be written as ``target``, or if ``target`` exists.

    ``overwrite``: an existing file is no error.
    """
    path, kind = Path(target), Path(target).suffix.lower()
    storage.check_target(path, overwrite=overwrite)
    if kind == ".toml":
        storage.check_target(sidecar_path(path), overwrite=overwrite)
        return
    if Path(source).suffix.lower() in USD_SUFFIXES:
        check_usd_target(Path(source), path)
        return
    if kind not in _KINDS or Path(source).suffix.lower() != kind:
        raise InputError(
            f"{path}: expected {Path(source).suffix or '.toml'} as the model that was diagnosed, or .toml, got "
            f"{kind!r}"
        )


def _as_robot_file(
    robot: Robot,
    causes: Sequence[Cause],
    gains: Sequence[Refitted],
    path: Path,
    *,
    overwrite: bool,
) -> Written:
    doubts = [f"{cause.label}: {words}" for cause in causes for words in doubt(cause)]
    found = identified(
        {gain.label: gain.value for gain in gains},
        Provenance("; ".join(["diagnosis of the sim-to-real gap", *doubts])),
        standard_errors={gain.label: gain.standard_error for gain in gains},
        effects=[cause.as_effect() for cause in causes],
    )
    write_identified(robot, path, found, overwrite=overwrite)
    every: list[Labelled] = [*causes, *gains]
    return Written(path, tuple(x.label for x in every), ())


# Causes and re-fitted gains.
_Found = tuple[Sequence["Cause"], Sequence[Refitted]]


def _as_model(origin: _Source, robot: Robot, found: _Found, path: Path) -> Written:
    source, drives = origin
    if source.suffix.lower() in USD_SUFFIXES:
        done = write_usd(source, drives or drive_data(source), robot, found, path)
        return _written(path, done, found, lambda _: "USD has no number for it")
    text = source.read_bytes()
    root = parse_xml(text, str(source))
    if root.tag not in JOINT_NUMBERS:
        raise InputError(f"{source}: expected a URDF or MJCF to write back to, got <{root.tag}>")
    edits = Edits(text, str(source))
    done = [
        *_on_axes(edits, root, origin, robot, found),
        *_on_chain(edits, root, origin, robot, found[0]),
    ]
    try:
        storage.write_whole(path, edits.result().decode("utf-8"))
    except UnicodeDecodeError:
        raise InputError(f"{source}: expected a text in UTF-8 to write back to") from None
    return _written(path, done, found, lambda effect: _no_number(root, effect))


def _written(
    path: Path, done: Sequence[Placed], found: _Found, no_place: Callable[[Effect], str]
) -> Written:
    """Return the record of a written model; ``no_place`` says why its format cannot state an effect."""
    causes, gains = found
    why = {label: reason for placed in done for label, reason in placed.why_not.items()}
    there = {label for placed in done for label in placed.there} - set(why)
    out = [cause for cause in causes if cause.label not in there]
    reasons = {c.label: why.get(c.label) or no_place(c.as_effect()) for c in out}
    reasons |= {g.label: why.get(g.label, _NO_LAW) for g in gains if g.label not in there}
    every: list[Labelled] = [*causes, *gains]
    return Written(
        path,
        tuple(x.label for x in every if x.label in there),
        tuple(reasons),
        reasons,
        tuple(cause.as_effect() for cause in out),
    )


def _on_axes(
    edits: Edits, root: Element, source: _Source, robot: Robot, found: _Found
) -> list[Placed]:
    """Write the findings on joints and motors, axis by axis."""
    causes, gains = found
    # Only these elements hold joints: transmissions, actuators and constraints name joints by the same tag.
    holders = [root] if root.tag == "robot" else [e for e in root.walk() if e.tag == "body"]
    joints = {e.attributes.get("name"): e for holder in holders for e in holder.all("joint")}
    out = []
    is_mjcf = root.tag == "mujoco"
    known, own_law = _drives_of(source, found) if is_mjcf else ({}, False)
    for axis, name in enumerate(robot.axis_names):
        mine = [cause for cause in causes if not cause.axes and cause.axis == axis + 1]
        numbers = [cause for cause in mine if cause.effect in JOINT_NUMBERS[root.tag]]
        if numbers and name in joints:
            out.append(
                write_joint(
                    edits, root, joints[name], robot, axis, numbers, _of_actuators(known.get(name))
                )
            )
        drives = [cause for cause in mine if cause.effect in DRIVE_EFFECTS]
        refitted = [gain for gain in gains if gain.axis == axis + 1 and own_law]
        if (drives or refitted) and is_mjcf:
            placed, drive = Placed(), known.get(name)
            if not own_law:
                gained = [cause for cause in drives if cause.effect == OTHER_GAINS[0]]
                placed.refuse(gained, _NO_LAW)
                drives = [cause for cause in drives if cause not in gained]
            if drive is None:
                placed.refuse([*drives, *refitted], _NO_JOINT)
            else:
                limits, joint = limits_of(drive, robot, axis), (name, joints.get(name))
                made = write_drive(edits, root, joint, (drives, refitted), limits)
                placed = placed.joined(made)
            out.append(placed)
    return out


# Numbers that joints and actuators can both have.
_SHARED = ("armature", "damping")


def _drives_of(source: _Source, found: _Found) -> tuple[dict[str, Drive], bool]:
    """Return the drives of an MJCF by joint name, and whether the controller's law is in the drive data.

    Empty if the findings need no drive.
    """
    causes, gains = found
    shared = any(JOINT_NUMBERS["mujoco"].get(cause.effect) in _SHARED for cause in causes)
    if not shared and not gains and not any(cause.effect in DRIVE_EFFECTS for cause in causes):
        return {}, False
    file, given = source
    drives = given or drive_data(file)
    _, chain = bodies_and_chain(file, drives)
    return {joint.body.joint: joint.body.drive for joint in chain.joints}, drives.controller is None


def _of_actuators(drive: Drive | None) -> dict[str, float]:
    """Return the part of each joint number that the actuators state."""
    return {} if drive is None else dict(zip(_SHARED, drive.of_actuators, strict=True))


def _on_chain(
    edits: Edits,
    root: Element,
    source: _Source,
    robot: Robot,
    causes: Sequence[Cause],
) -> list[Placed]:
    """Write the findings on links and on positions of axes."""
    links = [cause for cause in causes if cause.effect in LINK_EFFECTS]
    frames = [cause for cause in causes if cause.effect in FRAME_EFFECTS]
    if not links and not frames:
        return []
    file, drives = source
    tree, chain = bodies_and_chain(file, drives or drive_data(file))
    if [joint.body.joint for joint in chain.joints] != robot.joint_names:
        placed = Placed()
        placed.refuse([*links, *frames], "the robot is not the chain that the file says")
        return [placed]
    changes, impossible = body_changes(tree, chain, robot, links)
    moved = write_frames(edits, root, (tree, chain), robot, frames)
    return [impossible, write_bodies(edits, root, changes), moved]


def _no_number(root: Element, effect: Effect) -> str:
    """Return why no number of a model can express an effect."""
    if root.tag == "mujoco" and is_torque(effect):
        return "MJCF has no number for it: axisight.mujoco.apply adds it at every step"
    if root.tag == "mujoco" and acts_in_gear(effect):
        return "MJCF has no number for it: axisight.mujoco.apply adds it to a joint that is the gear's spring"
    return f"{'MJCF' if root.tag == 'mujoco' else 'URDF'} has no number for it"

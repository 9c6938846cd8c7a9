"""Writing of a model file with its causes: which numbers change, and which causes it cannot express."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from axisight import storage
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.effects.dcmotor import DEVICE_EFFECTS
from axisight.effects.stated import OTHER_GAINS, PLAY
from axisight.errors import InputError
from axisight.mujoco.torques import acts_in_gear, is_torque
from axisight.remainder import ModelledRemainder
from axisight.robot import Robot
from axisight.robot.sources import USD_SUFFIXES
from axisight.robot_file import Provenance, identified, sidecar_path, write_identified
from axisight.robot_import.bodies import Drive
from axisight.robot_import.drives import DriveData
from axisight.robot_import.load import bodies_and_chain, drive_data
from axisight.robot_import.xml_tree import Element, parse_xml
from axisight.write_back.frames import FRAME_EFFECTS, write_frames
from axisight.write_back.inertials import write_bodies
from axisight.write_back.joints import JOINT_NUMBERS, write_joint
from axisight.write_back.links import LINK_EFFECTS, body_changes
from axisight.write_back.mjcf.actuators import DRIVE_EFFECTS, step_of, write_drive
from axisight.write_back.mjcf.limits import limits_of
from axisight.write_back.mjcf.passive import write_devices
from axisight.write_back.mjcf.play import is_play, write_play
from axisight.write_back.mjcf.readings import READING_EFFECTS, write_readings
from axisight.write_back.modelled import REMAINDER, TWICE, Own, why_not, with_modelled
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

    A modelled remainder has the label ``remainder``. ``why``: reasons for what is left out, by label.
    ``remaining``: causes among it as effects; `axisight.mujoco.apply` takes those that are torques or act inside
    gears. ``own``: re-fitted own parameters that were written with a remainder.
    """

    path: Path
    placed: tuple[str, ...]
    left_out: tuple[str, ...]
    why: Mapping[str, str] = field(default_factory=dict)
    remaining: tuple[Effect, ...] = ()
    own: tuple[str, ...] = ()


def write_model(
    source: Path | str,
    robot: Robot,
    causes: Sequence[Cause],
    target: Path | str,
    *,
    refit: Mapping[str, Interval] = MappingProxyType({}),
    overwrite: bool = False,
    drives: DriveData | None = None,
    play_joints: bool = False,
    remainder: ModelledRemainder | None = None,
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
    play_joints
        Write backlash into an MJCF as a joint of its own with a range, which adds a position to the model.
    remainder
        `Diagnosis.remainder.modelled`: it goes into the table ``[remainder]`` of a robot file, with the re-fitted
        own parameters if it belongs to them. URDF and MJCF have no place for it.

    Raises InputError as `check_target` does, and for a ``source`` that is no USD, or URDF or MJCF in UTF-8.
    """
    check_target(source, target, overwrite=overwrite)
    path, gains = Path(target), refitted_gains(robot, refit)
    if path.suffix.lower() == ".toml":
        return _as_robot_file(robot, (causes, gains), path, (remainder, refit), overwrite=overwrite)
    written = _as_model(
        (Path(source), drives), robot, (causes, gains), path, play_joints=play_joints
    )
    if remainder is None:
        return written
    kind = "robot" if path.suffix.lower() == ".urdf" else "mujoco"
    return _without_remainder(written, why_not(kind))


def _without_remainder(written: Written, why: str) -> Written:
    return replace(
        written,
        left_out=(*written.left_out, REMAINDER),
        why={**written.why, REMAINDER: why},
    )


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


# Causes and re-fitted gains.
_Found = tuple[Sequence["Cause"], Sequence[Refitted]]
# A remainder and all re-fitted parameters.
_Left = tuple[ModelledRemainder | None, "Mapping[str, Interval]"]


def _as_robot_file(
    robot: Robot, findings: _Found, path: Path, left: _Left, *, overwrite: bool
) -> Written:
    (causes, gains), (remainder, refit) = findings, left
    twice = remainder is not None and robot.remainder is not None
    own = Own()
    if remainder is not None and not twice:
        robot, own = with_modelled(robot, remainder, refit)
    doubts = [f"{cause.label}: {words}" for cause in causes for words in doubt(cause)]
    found = identified(
        {gain.label: gain.value for gain in gains} | own.values,
        Provenance("; ".join(["diagnosis of the sim-to-real gap", *doubts])),
        standard_errors={gain.label: gain.standard_error for gain in gains} | own.standard_errors,
        effects=[cause.as_effect() for cause in causes],
    )
    write_identified(robot, path, found, overwrite=overwrite)
    every: list[Labelled] = [*causes, *gains]
    placed = [x.label for x in every]
    if remainder is not None and not twice:
        placed.append(REMAINDER)
    written = Written(path, tuple(placed), (), own=tuple(own.values))
    return _without_remainder(written, TWICE) if twice else written


def _as_model(
    origin: _Source, robot: Robot, found: _Found, path: Path, *, play_joints: bool
) -> Written:
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
    if play_joints and root.tag == "mujoco":
        done += _plays(edits, root, origin, robot, found[0])
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
    joints = _joints(root)
    out = []
    is_mjcf = root.tag == "mujoco"
    known, own_law = _drives_of(source, found) if is_mjcf else ({}, False)
    for axis, name in enumerate(robot.axis_names):
        mine = [cause for cause in causes if not cause.axes and cause.axis == axis + 1]
        numbers = [cause for cause in mine if cause.effect in JOINT_NUMBERS[root.tag]]
        if numbers and name in joints:
            out.append(
                write_joint(edits, root, joints[name], robot, axis, numbers, known.get(name))
            )
        devices = [cause for cause in mine if cause.effect in DEVICE_EFFECTS and is_mjcf]
        if devices and name in known:
            drive, step_s = known[name], step_of(root)
            out.append(write_devices(edits, root, drive, robot, axis, devices, step_s))
        late = [cause for cause in mine if cause.effect in READING_EFFECTS and is_mjcf]
        if late and name in known:
            out.append(write_readings(edits, root, name, known[name], late, step_of(root)))
        drives = [cause for cause in mine if cause.effect in DRIVE_EFFECTS]
        refitted = [gain for gain in gains if gain.axis == axis + 1 and own_law]
        if (drives or refitted) and is_mjcf:
            placed = Placed()
            if not own_law:
                gained = [cause for cause in drives if cause.effect == OTHER_GAINS[0]]
                placed.refuse(gained, _NO_LAW)
                drives = [cause for cause in drives if cause not in gained]
            if name not in known:
                placed.refuse([*drives, *refitted], _NO_JOINT)
            else:
                limits, joint = limits_of(known[name], robot, axis), (name, joints.get(name))
                made = write_drive(edits, root, joint, (drives, refitted), limits)
                placed = placed.joined(made)
            out.append(placed)
    return out


def _plays(
    edits: Edits, root: Element, source: _Source, robot: Robot, causes: Sequence[Cause]
) -> list[Placed]:
    """Write backlash as joints of their own."""
    plays = [cause for cause in causes if is_play(cause)]
    if not plays:
        return []
    file, drives = source
    _, chain = bodies_and_chain(file, drives or drive_data(file))
    known = {joint.body.joint: joint.body.drive for joint in chain.joints}
    joints = _joints(root)
    out = []
    for cause in plays:
        assert cause.axis is not None  # backlash is of one axis
        name = robot.axis_names[cause.axis - 1]
        drive = known.get(name, Drive())
        step_s = step_of(root)
        out.append(write_play(edits, root, joints.get(name), drive, robot, cause, step_s))
    return out


def _joints(root: Element) -> dict[str | None, Element]:
    """Return the joints of a model by name."""
    # Only these elements hold joints: transmissions, actuators and constraints name joints by the same tag.
    holders = [root] if root.tag == "robot" else [e for e in root.walk() if e.tag == "body"]
    return {e.attributes.get("name"): e for holder in holders for e in holder.all("joint")}


def _drives_of(source: _Source, found: _Found) -> tuple[dict[str, Drive], bool]:
    """Return the drives of an MJCF by joint name, and whether the controller's law is in the drive data.

    Empty if the findings need no drive.
    """
    causes, gains = found
    on_joints = (*JOINT_NUMBERS["mujoco"], *DRIVE_EFFECTS, *DEVICE_EFFECTS, *READING_EFFECTS)
    if not gains and not any(cause.effect in on_joints for cause in causes):
        return {}, False
    file, given = source
    drives = given or drive_data(file)
    _, chain = bodies_and_chain(file, drives)
    return {joint.body.joint: joint.body.drive for joint in chain.joints}, drives.controller is None


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
    if root.tag == "mujoco" and effect.name == PLAY[0]:
        return (
            "MJCF has no number for it: --play-joints, or play_joints=True, writes a joint with a range, "
            "axisight.mujoco.apply adds it to a joint that is the gear's spring"
        )
    if root.tag == "mujoco" and acts_in_gear(effect):
        return "MJCF has no number for it: axisight.mujoco.apply adds it to a joint that is the gear's spring"
    return f"{'MJCF' if root.tag == 'mujoco' else 'URDF'} has no number for it"

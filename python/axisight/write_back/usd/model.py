"""Writing of a USD layer with the causes of a diagnosis over the diagnosed stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from axisight.effects.stated import OTHER_GAINS
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot.sources import USD_SUFFIXES
from axisight.robot_import.chain import Chain, chain_of
from axisight.robot_import.drives import DriveData
from axisight.robot_import.usd import UsdModel, usd_model
from axisight.write_back.frames import FRAME_EFFECTS
from axisight.write_back.links import LINK_EFFECTS, body_changes
from axisight.write_back.mjcf.limits import limits_of
from axisight.write_back.placed import Placed
from axisight.write_back.refitted import Refitted
from axisight.write_back.usd.bodies import write_bodies, write_frames
from axisight.write_back.usd.drives import DRIVE_EFFECTS, write_drive
from axisight.write_back.usd.joints import QUANTITY_OF, write_joint
from axisight.write_back.usd.layer import Overlay, cannot_change

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

_NO_LAW = "the controller stands in the drive data, the file has no gains of it"


def check_usd_target(source: Path, target: Path) -> None:
    """Raise InputError unless ``target`` can be a layer over the stage ``source``."""
    kinds = [kind for kind in USD_SUFFIXES if kind != ".usdz"]
    if target.suffix.lower() not in kinds:
        raise InputError(f"{target}: expected a layer ({', '.join(kinds)}) over {source.name}")
    if not source.resolve().is_relative_to(target.resolve().parent):
        raise InputError(
            f"{target}: expected a file in the folder of {source}, as the new file is a layer over it"
        )


def write_usd(
    source: Path,
    drives: DriveData,
    robot: Robot,
    found: tuple[Sequence[Cause], Sequence[Refitted]],
    target: Path,
) -> list[Placed]:
    """Write a layer with causes and re-fitted gains over a stage; return what it holds, and why not the rest."""
    causes, gains = found
    model = usd_model(source)
    chain = chain_of(model.tree, drives.base, drives.tip)
    overlay = Overlay(model.stage, source, target)
    done = [
        _on_axis(overlay, model, chain, robot, axis, (causes, gains), drives)
        for axis in range(len(robot.axis_names))
    ]
    done += _on_chain(overlay, model, chain, robot, causes)
    overlay.write()
    return done


def _on_axis(
    overlay: Overlay,
    model: UsdModel,
    chain: Chain,
    robot: Robot,
    axis: int,
    found: tuple[Sequence[Cause], Sequence[Refitted]],
    drives: DriveData,
) -> Placed:
    """Write the findings on the joint and the drive of one axis (from 0)."""
    mine = [cause for cause in found[0] if not cause.axes and cause.axis == axis + 1]
    numbers = [cause for cause in mine if cause.effect in QUANTITY_OF]
    driven = [cause for cause in mine if cause.effect in DRIVE_EFFECTS]
    gains = [gain for gain in found[1] if gain.axis == axis + 1]
    placed, known = Placed(), {joint.body.joint: joint.body.drive for joint in chain.joints}
    name = robot.axis_names[axis]
    if name not in known or (why := cannot_change(model.joints[name].prim)):
        placed.refuse(
            [*numbers, *driven, *gains],
            "the stage has no joint of this name" if name not in known else why,
        )
        return placed
    prim, turns = model.joints[name].prim, not robot.axis_is_prismatic[axis]
    placed = write_joint(overlay, prim, model.units, robot, axis, numbers)
    if drives.controller is not None:
        law = [cause for cause in driven if cause.effect == OTHER_GAINS[0]]
        placed.refuse([*law, *gains], _NO_LAW)
        driven, gains = [cause for cause in driven if cause not in law], []
    if driven or gains:
        limits = limits_of(known[name], robot, axis)
        placed = placed.joined(
            write_drive(overlay, prim, model.units, limits, driven, gains, turns=turns)
        )
    return placed


def _on_chain(
    overlay: Overlay, model: UsdModel, chain: Chain, robot: Robot, causes: Sequence[Cause]
) -> list[Placed]:
    """Write the findings on links and on positions of axes."""
    links = [cause for cause in causes if cause.effect in LINK_EFFECTS]
    frames = [cause for cause in causes if cause.effect in FRAME_EFFECTS]
    if [joint.body.joint for joint in chain.joints] != robot.joint_names:
        placed = Placed()
        placed.refuse([*links, *frames], "the robot is not the chain that the file says")
        return [placed]
    changes, impossible = body_changes(model.tree, chain, robot, links)
    written = write_bodies(overlay, model, changes)
    return [impossible, written, write_frames(overlay, model, chain, robot, frames)]

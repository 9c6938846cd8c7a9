"""Backlash as a joint of its own with a range, behind the joint of the motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from axisight.effects.stated import HALF_PLAY, PLAY
from axisight.robot import Robot
from axisight.robot_import.bodies import Drive
from axisight.robot_import.xml_tree import Element
from axisight.write_back.frames import angle_unit
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits, Numbers

if TYPE_CHECKING:
    from axisight.gap.facts.result import Cause

# What places a joint, and the class whose defaults may place it.
_PLACED = ("class", "type", "axis", "pos")
# MuJoCo's shortest time constant of a constraint, in time steps of the model.
_STIFFEST_STEPS = 2.0
# Of a joint without forces, against the defaults of a file.
_FREE = {
    "armature": "0",
    "damping": "0",
    "frictionloss": "0",
    "stiffness": "0",
    "ref": "0",
    "actuatorfrclimited": "false",
}


def is_play(cause: Cause) -> bool:
    """Return whether a cause is a gear without stiffness in its middle."""
    return cause.effect == PLAY[0]


def write_play(
    edits: Edits,
    root: Element,
    joint: Element | None,
    drive: Drive,
    robot: Robot,
    cause: Cause,
    step_s: float,
) -> Placed:
    """Write the backlash of an axis as a joint with a range, after the joint of the motor in the same body.

    The motor's joint keeps actuator, rotor and friction. The model has a further position and speed. MuJoCo's
    limits of joints are soft: they stand for the stiffness of the gear, and are as stiff as its time step
    ``step_s`` [s] allows.
    """
    placed = Placed()
    assert cause.axis is not None  # backlash is of one axis
    if joint is None:
        placed.refuse([cause], "the joint stands in another file")
    elif drive.rotor_inertia == 0:
        placed.refuse(
            [cause],
            "expected an armature of the joint, without one the motor has no inertia in the play",
        )
    else:
        slides = robot.axis_is_prismatic[cause.axis - 1]
        width = cause.parameters[HALF_PLAY].value * (1.0 if slides else angle_unit(root))
        where = {key: joint.attributes[key] for key in _PLACED if key in joint.attributes}
        made: dict[str, Numbers] = {
            "name": f"play of {joint.attributes['name']}",
            **where,
            "limited": "true",
            "range": (-width, width),
            "solreflimit": (_STIFFEST_STEPS * step_s, 1.0),
            **_FREE,
        }
        edits.add_after(joint, made, said([cause]))
        placed.take([cause])
    return placed

"""Positions whose names say which joint they are measured of, and nothing else."""

from __future__ import annotations

from dataclasses import replace

from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.families import Family, of_quantity
from axisight.logs.units import POSITION_UNITS


def name_by_joints(draft: Draft) -> None:
    """Take for positions what is called measured and after the joints of the robot, where no name says them.

    Only columns of all joints, of one kind, in no other unit than positions have: a choice stays open.
    """
    if draft.robot is None or of_quantity(draft.families, "position"):
        return
    joints = set(draft.robot.axis_names)
    found = [family for family in measured(draft.families) if joints <= set(family.signals)]
    if len(found) != 1:
        return
    family = found[0]
    named = Family(replace(family.meaning, quantity="position"), family.signals)
    draft.families = [named if one is family else one for one in draft.families]
    draft.doubts.append(
        f"position: {family.label}, for they are measured, of the joints, and no name says of what: "
        f"proposed, check"
    )


def measured(families: list[Family]) -> list[Family]:
    """Return the families whose names say that they are measured, and not what they are."""
    return [
        family
        for family in of_quantity(families, "")
        if family.meaning.wanted is False and family.meaning.unit in (None, *POSITION_UNITS)
    ]

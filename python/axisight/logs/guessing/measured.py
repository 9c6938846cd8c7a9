"""Find positions whose names say only that they are measured and at which joint."""

from __future__ import annotations

from dataclasses import replace

from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.families import Family, of_quantity
from axisight.logs.units import POSITION_UNITS


def name_by_joints(draft: Draft) -> None:
    """Mark as positions the columns named only as measured and by joint, if no name says position.

    This needs a robot and exactly one family that covers all its joints, without a unit or in a unit of
    positions. Otherwise nothing changes.
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
    """Return the families whose names say that they are measured but not which quantity."""
    return [
        family
        for family in of_quantity(families, "")
        if family.meaning.wanted is False and family.meaning.unit in (None, *POSITION_UNITS)
    ]

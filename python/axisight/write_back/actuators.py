"""Motors of an MJCF that give more or less torque than they are told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from axisight.effects.stated import TORQUE_CONSTANT
from axisight.robot_import.xml_tree import Element
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.result import Cause

GAIN_EFFECTS = (TORQUE_CONSTANT[0],)
# A source of torque whose gain is one or is said.
_PLAIN = ("motor", "general")


def write_gain(edits: Edits, root: Element, joint: str, causes: Sequence[Cause]) -> Placed:
    """Write what causes of one joint make of its actuator: its gain, as ``gear`` is the gear's.

    A <motor> has no gain: it becomes the <general> that it is short for.
    """
    placed = Placed()
    holders = [e for e in root.walk() if e.tag == "actuator"]
    mine = [e for h in holders for e in h.children if e.attributes.get("joint") == joint]
    if len(mine) != 1 or mine[0].tag not in _PLAIN or mine[0].children:
        got = "none" if not mine else ", ".join(f"<{e.tag}>" for e in mine)
        placed.refuse(causes, f"expected one motor of the joint that has a gain, got {got}")
        return placed
    gain = mine[0].attributes.get("gainprm", "1").split()
    # It has taken the place of what the simulator had.
    numbers = [1 + causes[-1].parameters[TORQUE_CONSTANT[1]].value, *map(float, gain[1:])]
    edits.set(mine[0], {"gainprm": numbers}, said(causes), tag="general")
    placed.take(causes)
    return placed

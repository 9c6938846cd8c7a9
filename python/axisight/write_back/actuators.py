"""Motors of an MJCF that give more or less torque than they are told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from axisight.effects.stated import TORQUE_CONSTANT
from axisight.robot_import.mjcf import is_gain
from axisight.robot_import.xml_tree import Element
from axisight.write_back.placed import Placed, said
from axisight.write_back.xml_edits import Edits

if TYPE_CHECKING:
    from axisight.gap.result import Cause

GAIN_EFFECTS = (TORQUE_CONSTANT[0],)
# What makes a <general> what a <motor> is, with a gain.
_MOTOR = {"gaintype": "fixed", "biastype": "none", "dyntype": "none"}


def write_gain(edits: Edits, root: Element, joint: str, causes: Sequence[Cause]) -> Placed:
    """Write what causes of one joint make of its actuator: its gain, as ``gear`` is the gear's.

    A <motor> has no gain: it becomes the <general> that it is short for, whatever defaults a file has for those.
    """
    placed = Placed()
    holders = [e for e in root.walk() if e.tag == "actuator"]
    mine = [e for h in holders for e in h.children if e.attributes.get("joint") == joint]
    defaults = any(e.tag in ("default", "include") for e in root.walk())
    if len(mine) != 1 or mine[0].children or not _is_motor(mine[0], defaults):
        got = "none" if not mine else ", ".join(f"<{e.tag}>" for e in mine)
        placed.refuse(causes, f"expected one motor of the joint that has a gain, got {got}")
        return placed
    # It has taken the place of what the simulator had.
    gain = 1 + causes[-1].parameters[TORQUE_CONSTANT[1]].value
    more = _MOTOR if defaults else {}
    edits.set(mine[0], {"gainprm": gain, **more}, said(causes), tag="general")
    placed.take(causes)
    return placed


def _is_motor(element: Element, defaults: bool) -> bool:
    """Whether an actuator is a source of torque, whose gain is one or said; ``defaults``: a file may have some."""
    if element.tag == "motor":
        return True
    said_so = {key: element.attributes.get(key) for key in _MOTOR}
    usual = all(said_so[key] in (None, value) for key, value in _MOTOR.items())
    sure = not defaults or said_so == _MOTOR
    gain = element.attributes.get("gainprm", "1").split()
    return (
        element.tag == "general" and usual and sure and len(gain) == 1 and is_gain(float(gain[0]))
    )

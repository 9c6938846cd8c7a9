"""Find the axis that a user names, by number from 1 or by the joint that it drives."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from axisight.arguments import did_you_mean, nearest, short, shown
from axisight.effects import Effect
from axisight.errors import InputError

# A message lists at most this many joints.
_MOST = 8


def axis_number(axis: object, joints: Sequence[str] | int, field: str = "axis") -> int:
    """Return the number of an axis, from 1.

    Parameters
    ----------
    axis : the number, or the name of the joint that the axis drives.
    joints : names of the joints that the axes drive, base to tip (`Robot.axis_names`), or the number of
        axes if the names are unknown.
    field : name of the argument in messages.

    Raises InputError, with the range, the joint names and the nearest one, for an axis that is not there.

    """
    names = [] if isinstance(joints, int) else list(joints)
    count = joints if isinstance(joints, int) else len(names)
    if isinstance(axis, str) and axis in names:
        return names.index(axis) + 1
    whole = isinstance(axis, int | np.integer) and not isinstance(axis, bool)
    if whole and 1 <= int(str(axis)) <= count:
        return int(str(axis))
    listed = ", ".join(map(short, names[:_MOST])) + (", ..." if len(names) > _MOST else "")
    known = f" or a joint name ({listed})" if names else ""
    raise InputError(
        f"{field}: expected {_range(count)}{known}, got {shown(axis)}{_meant(axis, names, count)}"
    )


def _range(count: int) -> str:
    return "1" if count == 1 else f"1 to {count}"


def _meant(axis: object, names: Sequence[str], count: int) -> str:
    """Return a question that proposes the nearest joint name or the number in a text; "" without one."""
    number = re.fullmatch(r"\D*?0*(\d{1,9})\D?", axis.strip()) if isinstance(axis, str) else None
    near = nearest(axis, names)
    if near is not None and re.sub(r"\D", "", near) == re.sub(r"\D", "", str(axis)):
        return f". Did you mean {near!r}?"
    if number:
        return f". Did you mean {int(number[1])}?" if 1 <= int(number[1]) <= count else ""
    return did_you_mean(axis, names)


def effect_on(effect: Effect, joints: Sequence[str]) -> Effect:
    """Return an effect with axis numbers in place of joint names; raise InputError as `axis_number`."""
    if not effect.joints:
        return effect
    field = f"effect {effect.name!r}: axis"
    found = tuple(axis_number(joint, joints, field) for joint in effect.joints)
    if len(found) == 1:
        return replace(effect, axis=found[0], joints=())
    return Effect(effect.name, None, effect.parameters, found)

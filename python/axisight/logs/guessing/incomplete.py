"""Say what the user must fill in before a guessed map can read a log."""

from __future__ import annotations

from axisight.logs.guessing.draft import Draft


def still_needed(draft: Draft) -> str | None:
    """Return what the user must add to the map; None if all axes have torques or position targets."""
    if "torque" in draft.fields or "position_ref" in draft.fields:
        return None
    ways = []
    if draft.torques:
        units = {unit for signals in draft.torques for _, unit in signals}
        way = "take the # off one torque of every axis"
        if draft.scaled or units & {"A", "V"}:
            per = "A" if "A" in units else "V" if "V" in units else "unit"
            way += f", with the Nm (or N) per {per} in place of the dots behind scale"
            way += ' ("unknown" where nobody knows it)' if "A" in units else ""
        ways.append(way)
    if draft.targets:
        ways.append("take the # off position_ref, if these are targets of the positions")
    return ", or ".join(ways) or "add a torque, or a position_ref, of every axis"

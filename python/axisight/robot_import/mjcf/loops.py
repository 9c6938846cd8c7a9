"""Which joints of an MJCF are part of a closed loop, as those of a delta robot."""

from __future__ import annotations

from typing import Any


def joints_in_loops(mujoco: Any, model: Any) -> dict[int, int]:
    """Return the joints that a constraint closes to a loop, and the constraint of each.

    Active `connect` and `weld` constraints close a loop of the joints between their two bodies or sites. Mocap
    bodies are no part of the robot, so a constraint to one closes nothing.
    """
    kinds, objects = mujoco.mjtEq, mujoco.mjtObj
    closing = {int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)}
    found: dict[int, int] = {}
    for i in range(model.neq):
        if not model.eq_active0[i] or int(model.eq_type[i]) not in closing:
            continue
        ends = [int(model.eq_obj1id[i]), int(model.eq_obj2id[i])]
        if int(model.eq_objtype[i]) == int(objects.mjOBJ_SITE):
            ends = [int(model.site_bodyid[site]) for site in ends]
        if any(body >= 0 and model.body_mocapid[body] >= 0 for body in ends):
            continue
        one, other = (_up(model, body) for body in ends)
        for body in one ^ other:
            first = int(model.body_jntadr[body])
            for j in range(first, first + int(model.body_jntnum[body])):
                found.setdefault(j, i)
    return found


def _up(model: Any, body: int) -> set[int]:
    """Return a body and all that carry it, the world left out; none for a body that the constraint leaves out."""
    out = set()
    while body > 0:
        out.add(body)
        body = int(model.body_parentid[body])
    return out


def closes_a_loop(constraint: str) -> str:
    """Return why a chain cannot have a joint of a closed loop."""
    return (
        f"expected a joint of an open chain, got one of a closed loop (equality {constraint!r}): robots with closed "
        "loops, such as deltas, cannot be modelled; choose a chain outside the loop by --base and --tip"
    )

"""A robot as HTML, for notebooks."""

from __future__ import annotations

from typing import Any

from axisight.display import html


def page_of(robot: Any) -> str:
    """Return the axes of a `Robot` with drives and operating point as HTML."""
    kinds = ["slides" if slides else "turns" for slides in robot.axis_is_prismatic]
    gears = ["rigid" if rigid else "elastic" for rigid in robot.axis_is_rigid]
    ratios, pose = (map(html.number, x) for x in (robot.gear_ratio, robot.operating_point))
    numbers = map(str, range(1, robot.n_axes + 1))
    rows = zip(numbers, robot.axis_names, kinds, gears, ratios, pose, strict=True)
    acting = [effect.label for effect in robot.effects if effect.acts]
    return html.page(
        f"{robot.name}: {robot.n_axes} axes, {robot.n_joints} joints, "
        f"sample time {robot.sample_time_s:g} s, controller {robot.controller_kind}",
        html.table(
            ("axis", "joint", "kind", "gear", "gear ratio", "operating point [rad or m]"),
            rows,
            "Axes",
        ),
        html.lines([f"with the effects {', '.join(acting)}"] if acting else []),
    )

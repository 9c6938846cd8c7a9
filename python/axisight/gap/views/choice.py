"""Chooses how simulator and logs are compared."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.facts.settings import Settings
from axisight.gap.prepare.position_targets import Commanded
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.gap.views.targets import TargetsView
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.robot import Robot


def view_of(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    settings: Settings,
    commanded: Commanded | None = None,
    silent: Sequence[int] = (),
) -> View:
    """Return the closed-loop view if the robot and all logs allow it, else inverse dynamics.

    ``silent``: axes (from 0) that are not judged by inverse dynamics. ``commanded``: given if no torque was
    logged; then positions are compared, and all logs belong to ``commanded``.
    """
    if commanded is not None:
        return TargetsView(commanded, list(estimation), settings)
    if is_closed_loop(robot, [*estimation, *validation]):
        return ClosedLoopView(robot, list(estimation), settings)
    return InverseView(robot, list(estimation), settings, validation, silent)

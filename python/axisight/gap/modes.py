"""The one place that decides how simulator and logs are compared."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.fitting.simulation_error import is_closed_loop
from axisight.gap.closed_loop import ClosedLoopView
from axisight.gap.inverse import InverseView
from axisight.gap.settings import Settings
from axisight.gap.view import View
from axisight.logs import Log
from axisight.robot import Robot


def view_of(
    robot: Robot, estimation: Sequence[Log], validation: Sequence[Log], settings: Settings
) -> View:
    """Return closed loop if robot and all logs have what it takes, else inverse dynamics."""
    if is_closed_loop(robot, [*estimation, *validation]):
        return ClosedLoopView(robot, list(estimation), settings)
    return InverseView(robot, list(estimation), settings, validation)

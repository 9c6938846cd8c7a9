"""The robot of section 8.3.2: the preset with weaker coupling of axis 1, and a slower controller.

Below 5 Hz the preset couples axis 1 with axes 2 and 3 more strongly than Tables 8.3 and 8.4 allow. If
axis 2 moves alone, its coupling torque on axis 1 has two parts that matter. The part at low frequency is
what the estimate measures. The part at 27 Hz meets ripple of order 18, which has this frequency at the
speed of the square wave, and becomes a disturbance at low frequency. By Table 8.3 the disturbance over
the low-frequency part is 6 to 11 times as large as on the preset.

Moving the centres of mass and the products of inertia of two links off the plane of the arm changes
only this ratio: the low-frequency coupling is a difference of two large parts. Six numbers and the speed
of the controller were fitted to Tables 8.2 to 8.4. They are no measurement of the robot.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace

import tomli_w

from axisight.robot import Robot
from axisight_thesis.context import Context

# Link of the joint: lateral centre of mass [m], products of inertia I_xy and I_yz [kg m^2].
_LINKS = {
    "axis2_yaw": (-0.8887, 5.182, 13.64),
    "axis3_yaw": (0.1759, 21.44, 21.11),
}
_XY, _YZ = 3, 5
# The thesis does not state its gains. Slower control lets the axes at rest move more.
CONTROLLER_SPEED = 0.7


def weakly_coupled(context: Context) -> Context:
    """Return the context of the robot of section 8.3.2, with the seed of ``context``."""

    def make() -> Context:
        return replace(context, robot=_changed(context.robot), _studies={})

    return context.shared("chapter8-weakly-coupled", make)


def _changed(robot: Robot) -> Robot:
    data = tomllib.loads(robot.toml)
    for joint in data["joint"]:
        if joint["name"] in _LINKS:
            lateral, xy, yz = _LINKS[joint["name"]]
            joint["link"]["com"][1] = lateral
            joint["link"]["inertia"][_XY] = xy
            joint["link"]["inertia"][_YZ] = yz
    return Robot.from_toml(tomli_w.dumps(data)).with_controller_speed(CONTROLLER_SPEED)

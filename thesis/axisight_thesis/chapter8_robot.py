"""The robot of section 8.3.2: the preset with weaker coupling of axis 1 at low frequency.

The preset couples axis 1 with axes 2 and 3 more strongly below 5 Hz than Tables 8.3 and 8.4 allow. If
axis 2 moves alone, its coupling torque U_12 turns ripple of axis 1 at 27 Hz (order 18 at the speed of
the square wave) into a disturbance at low frequency. Its size relative to U_12 there is that of U_12 at
27 Hz over that at low frequency, 6 to 11 times as large in Table 8.3 as on the preset. The relative
error of the multisine grows with it.

Moving the centres of mass and the products of inertia of two links off the plane of the arm changes
only this ratio: the low-frequency coupling is a difference of two large parts. The six numbers were
fitted to Tables 8.2 to 8.4. They are no measurement of the robot.
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
    return Robot.from_toml(tomli_w.dumps(data))

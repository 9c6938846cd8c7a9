"""USD stages for tests: one arm in USD and in MJCF, with numbers that single precision holds exactly."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

# Attributes of the joints of the arm, by joint.
JOINT_TEXT: Mapping[str, str] = {"turn": "", "shoulder": "", "elbow": ""}

_HEAD = """#usda 1.0
(
    defaultPrim = "arm"
    metersPerUnit = {metres}
    kilogramsPerUnit = {kilograms}
    upAxis = "Z"
)
# as drawn
"""
_BODY = """    def Xform "{name}" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
    )
    {{
        float physics:mass = {mass}
        point3f physics:centerOfMass = ({com})
        float3 physics:diagonalInertia = ({inertia})
        quatf physics:principalAxes = ({axes})
    }}
"""
_JOINT = """    def {kind} "{name}"{schemas}
    {{
        {bodies}
        point3f physics:localPos0 = ({pos0})
        quatf physics:localRot0 = ({rot0})
        point3f physics:localPos1 = ({pos1})
        quatf physics:localRot1 = ({rot1})
        {text}
    }}
"""


def body(name: str, mass: float, com: str, inertia: str, axes: str = "1, 0, 0, 0") -> str:
    """Return a rigid body."""
    return _BODY.format(name=name, mass=mass, com=com, inertia=inertia, axes=axes)


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "PhysicsRevoluteJoint",
    pos0: str = "0, 0, 0",
    rot0: str = "1, 0, 0, 0",
    pos1: str = "0, 0, 0",
    rot1: str = "1, 0, 0, 0",
    text: str = "",
    schemas: str = "",
) -> str:
    """Return a joint between two bodies; no parent is the world."""
    ends = [("0", parent), ("1", child)]
    bodies = "\n        ".join(f"rel physics:body{i} = </arm/{end}>" for i, end in ends if end)
    head = f" (\n        prepend apiSchemas = [{schemas}]\n    )" if schemas else ""
    return _JOINT.format(
        kind=kind,
        name=name,
        schemas=head,
        bodies=bodies,
        pos0=pos0,
        rot0=rot0,
        pos1=pos1,
        rot1=rot1,
        text=text,
    )


def arm(
    texts: Mapping[str, str] = JOINT_TEXT,
    *,
    schemas: str = "",
    metres: float = 1.0,
    kilograms: float = 1.0,
    more: str = "",
) -> str:
    """Return an arm of three axes on a fixed base, the elbow with its frames turned by 120 degrees.

    ``texts``: attributes of the joints. ``schemas``: of every joint. ``more``: further prims.
    """
    half = "0.5, 0.5, 0.5, 0.5"
    common = {"schemas": schemas}
    parts = [
        '    def PhysicsScene "scene"\n    {\n        vector3f physics:gravityDirection = (0, 0, -1)\n'
        f"        float physics:gravityMagnitude = {9.8125 / metres}\n    }}\n",
        body("base", 5, "0, 0, 0", "1, 1, 1"),
        joint("mount", "", "base", kind="PhysicsFixedJoint"),
        body("column", 30, "0.0625, 0, 0.125", "0.625, 0.625, 0.5"),
        joint(
            "turn",
            "base",
            "column",
            pos0="0, 0, 0.375",
            text='uniform token physics:axis = "Z"\n        ' + texts["turn"],
            **common,
        ),
        body("upper", 14, "0.03125, 0, 0.25", "0.5, 0.5, 0.0625", "0.5, 0.5, 0.5, 0.5"),
        joint(
            "shoulder",
            "column",
            "upper",
            pos0="0.125, 0, 0.25",
            pos1="0, 0, -0.0625",
            text='uniform token physics:axis = "Y"\n        ' + texts["shoulder"],
            **common,
        ),
        body("fore", 7, "0.125, 0, 0.03125", "0.0625, 0.125, 0.125"),
        # The axis of the joint is x of its frame, which is y of both bodies.
        joint(
            "elbow",
            "upper",
            "fore",
            pos0="0, 0, 0.5",
            rot0=half,
            rot1=half,
            text='uniform token physics:axis = "X"\n        float physics:lowerLimit = -90\n'
            "        float physics:upperLimit = 90\n        " + texts["elbow"],
            **common,
        ),
        more,
    ]
    head = _HEAD.format(metres=metres, kilograms=kilograms)
    root = 'def Xform "arm" (\n    prepend apiSchemas = ["PhysicsArticulationRootAPI"]\n)\n{\n'
    return head + root + "\n".join(parts) + "}\n"


MJCF = """<mujoco model="arm">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.8125" timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="column" pos="0 0 0.375">
      <joint name="turn" axis="0 0 1"/>
      <inertial pos="0.0625 0 0.125" mass="30" diaginertia="0.625 0.625 0.5"/>
      <body name="upper" pos="0.125 0 0.3125">
        <joint name="shoulder" axis="0 1 0" pos="0 0 -0.0625"/>
        <inertial pos="0.03125 0 0.25" mass="14" quat="0.5 0.5 0.5 0.5" diaginertia="0.5 0.5 0.0625"/>
        <body name="fore" pos="0 0 0.5">
          <joint name="elbow" axis="0 1 0"/>
          <inertial pos="0.125 0 0.03125" mass="7" diaginertia="0.0625 0.125 0.125"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def saved(folder: Path, text: str, name: str = "arm.usda") -> Path:
    """Write a stage and return its path."""
    path = folder / name
    path.write_text(text)
    return path

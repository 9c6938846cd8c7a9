"""Model files for tests: a small URDF and MJCF, and broken variants of them."""

from __future__ import annotations

from pathlib import Path

URDF = """<?xml version="1.0"?>
<robot name="two">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.1 0 0.2" rpy="0.1 -0.2 0.3"/>
      <mass value="4"/>
      <inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="-0.02" izz="0.25"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.025"/>
    </inertial>
  </link>
  <link name="flange">
    <inertial>
      <origin xyz="0 0 0.05"/>
      <mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="upper"/>
    <origin xyz="0 0 0.4" rpy="0.3 0.1 -0.2"/>
    <axis xyz="0 1 1"/>
    <limit lower="-2" upper="2" effort="80" velocity="3"/>
    <dynamics damping="0.7" friction="1.5"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/>
    <child link="lower"/>
    <origin xyz="0.5 0 0" rpy="0 1.2 0"/>
    <axis xyz="0 0 -1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="lower"/>
    <child link="flange"/>
    <origin xyz="0.3 0.1 0" rpy="0 0 1"/>
  </joint>
  <transmission name="t">
    <joint name="shoulder"/>
    <actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator>
  </transmission>
</robot>
"""

MJCF = """<mujoco model="two">
  <compiler angle="radian"/>
  <worldbody>
    <body name="upper" pos="0 0 0.4" euler="0.3 0.1 -0.2">
      <joint name="shoulder" axis="0 1 1" pos="0.02 0 0.01" ref="0.3" damping="0.7"
             frictionloss="1.5" armature="0.2" stiffness="3"/>
      <inertial pos="0.1 0 0.2" mass="4" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"/>
      <body name="lower" pos="0.5 0 0" euler="0 1.2 0">
        <joint name="elbow" axis="0 0 -1"/>
        <joint name="slide" type="slide" axis="1 0 0" pos="0 0.1 0"/>
        <inertial pos="0 0 0" mass="2" diaginertia="0.02 0.03 0.025"/>
        <body name="flange" pos="0.3 0.1 0" euler="0 0 1">
          <inertial pos="0 0 0.05" mass="0.5" diaginertia="0.001 0.001 0.001"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder" gear="50"/></actuator>
</mujoco>
"""

DH = """joint,convention,theta_rad,d_m,a_m,alpha_rad,mass_kg,com_x_m,com_y_m,com_z_m,ixx,iyy,izz,ixy
one,standard,0.1,0.4,0.2,1.5707963267948966,4,0.1,0,0.02,0.2,0.3,0.25,0.01
two,standard,-0.2,0.05,0.5,0.3,2,-0.2,0.01,0,0.02,0.03,0.025,0
three,standard,0.4,0.1,0,-1.2,1,0,0.02,0.1,0.01,0.01,0.004,0
"""


def dh_toml(table: str = DH) -> str:
    """Return the TOML that equals a CSV of one DH convention, with the same numbers."""
    head, *rows = [line.split(",") for line in table.splitlines()]
    tables = [dict(zip(head, row, strict=True)) for row in rows]
    (convention,) = {row.pop("convention") for row in tables}
    words = ("joint", "motion")
    joints = [
        "[[joint]]\n"
        + "".join(f'{k} = "{v}"\n' if k in words else f"{k} = {v}\n" for k, v in row.items())
        for row in tables
    ]
    return f'convention = "{convention}"\n' + "".join(joints)


def written(folder: Path, text: str | bytes, name: str = "arm.urdf") -> Path:
    """Write a model file and return its path."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def changed(text: str, old: str, new: str) -> str:
    """Return a text with its only ``old`` replaced."""
    assert text.count(old) == 1, (old, text.count(old))
    return text.replace(old, new)

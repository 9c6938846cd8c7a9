"""Closed loops of an MJCF: refused where the chain is part of one."""

from __future__ import annotations

from pathlib import Path

import pytest

from axisight.errors import RobotError
from axisight.robot_import import import_robot

pytest.importorskip("mujoco")

BODY = '<inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
TWO_LEGS = f"""<mujoco><worldbody>
<body name="base" pos="0 0 1"><joint name="turn" axis="0 0 1"/>{BODY}
  <body name="left"><joint name="left" axis="0 1 0"/>{BODY}
    <body name="left tip" pos="0.2 0 0"><joint name="left knee" axis="0 1 0"/>{BODY}
      <site name="left end"/></body></body>
  <body name="right" pos="0.4 0 0"><joint name="right" axis="0 1 0"/>{BODY}<site name="right end"/></body>
</body>
<body name="hand" mocap="true"/>
</worldbody><equality>{{}}</equality></mujoco>"""
CONNECT = '<connect name="platform" body1="left tip" body2="right" anchor="0.2 0 0"/>'
BY_SITES = '<connect name="platform" site1="left end" site2="right end"/>'
WELD = '<weld name="platform" body1="left tip" body2="right"/>'


def written(folder: Path, equality: str) -> Path:
    path = folder / "legs.xml"
    path.write_text(TWO_LEGS.format(equality))
    return path


@pytest.mark.parametrize("equality", [CONNECT, BY_SITES, WELD])
def test_a_chain_in_a_closed_loop_is_refused_by_the_name_of_the_constraint(
    tmp_path: Path, equality: str
) -> None:
    with pytest.raises(RobotError, match=r"joint 'left'.*closed loop \(equality 'platform'\)"):
        import_robot(written(tmp_path, equality), tip="left tip")


def test_a_chain_before_the_loop_is_taken(tmp_path: Path) -> None:
    taken = import_robot(written(tmp_path, CONNECT), tip="base")
    assert 'name = "turn"' in taken.toml
    assert 'name = "left"' not in taken.toml


@pytest.mark.parametrize(
    "equality",
    [CONNECT.replace("<connect", '<connect active="false"'), WELD.replace("right", "hand")],
)
def test_a_constraint_that_closes_nothing_refuses_nothing(tmp_path: Path, equality: str) -> None:
    taken = import_robot(written(tmp_path, equality), tip="left tip")
    assert 'name = "left knee"' in taken.toml

"""Logs beyond the range of a joint that a model file states are flagged, and nothing else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight import Log, Robot, load_robot
from axisight.gap.gate.joint_ranges import check_ranges
from axisight.gap.gate.machine import check_machine

URDF = """
<robot name="lever">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0 0 -0.2"/><mass value="1.0"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lever" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-1.0" upper="0.5" effort="10" velocity="3"/></joint>
</robot>
"""


@pytest.fixture(scope="module")
def lever(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("lever") / "lever.urdf"
    path.write_text(URDF, "utf-8")
    return load_robot(path)


def log_of(low: float, high: float, target: float | None = None) -> Log:
    time = 0.001 * np.arange(1000)
    position = np.linspace(low, high, 1000)[:, None]
    return Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=0.001,
        time_s=time,
        torque_nm=np.ones((1000, 1)),
        position_rad=position,
        position_ref_rad=None if target is None else np.full((1000, 1), target),
    )


def test_an_import_keeps_the_ranges_of_its_joints(lever: Robot) -> None:
    assert lever.joint_ranges == ((-1.0, 0.5),)
    assert lever.with_operating_point([0.1]).joint_ranges == ((-1.0, 0.5),)
    assert load_robot("irb6600_like").joint_ranges == (None, None, None)


@pytest.mark.parametrize(
    ("low", "high", "target", "fields"),
    [
        (-0.9, 0.4, None, []),
        (-1.0, 0.51, None, []),
        (-0.9, 0.6, None, ["position_1"]),
        (-1.2, 0.4, None, ["position_1"]),
        (-0.9, 0.5, 0.8, ["position_ref_1"]),
    ],
)
def test_what_passes_the_range_is_flagged(
    lever: Robot, low: float, high: float, target: float | None, fields: list[str]
) -> None:
    """By more than 0.02 rad: a hard stop gives way by less."""
    found = check_ranges(lever, [log_of(low, high, target)])
    assert [f.field for f in found] == fields
    assert {f.name for f in found} <= {"range_passed"}
    assert {f.severity for f in found} <= {"flag"}
    assert [
        f for f in check_machine(lever, [log_of(low, high, target)]) if f.field in fields
    ] == found


def test_an_axis_has_one_flag_with_the_extremes_of_all_logs(lever: Robot) -> None:
    """In the unit of the axis, at the log and column that go furthest."""
    logs = [replace(log_of(*at), name=name) for name, at in RUNS.items()]
    (found,) = check_ranges(lever, logs)
    assert (found.log, found.axis, found.field) == ("third", 1, "position_ref_1")
    assert "-1 to 0.5 rad, got -1.2 to 0.8 rad over all logs" in found.message


RUNS = {"first": (-1.2, 0.4, None), "second": (-0.9, 0.6, 0.1), "third": (-0.9, 0.5, 0.8)}
SLIDE = URDF.replace("revolute", "prismatic")


@pytest.mark.parametrize(("high", "passes"), [(0.52, False), (0.54, True)])
def test_an_axis_that_slides_passes_its_range_by_metres(
    tmp_path: Path, high: float, passes: bool
) -> None:
    """By more than 2 % of its travel of 1.5 m, as an angle does by more than 2 % of a radian."""
    path = tmp_path / "slide.urdf"
    path.write_text(SLIDE, "utf-8")
    found = check_ranges(load_robot(path), [log_of(-0.9, high)])
    assert len(found) == passes
    assert all(f"got -0.9 to {high} m over all logs" in f.message for f in found)

"""A real arm as URDF and MCAP on the command line: the verdict of the same logs in Parquet."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

from axisight import Robot, load_robot
from axisight.cli import app
from bag_data import written_states

# Of 250 Hz: every other is enough for friction, and quick.
STEP = 2
SECONDS = {"A": (0.0, 20.0), "B": (0.0, 20.0), "C": (0.0, 12.0)}


def urdf_of(robot: Robot) -> str:
    """Return a URDF of a rigid robot whose frames are parallel at zero, gears in <transmission>."""
    parts = ['<robot name="arm"><link name="base"/>']
    parent = "base"
    for joint, ratio in zip(robot.joints, robot.gear_ratio.tolist(), strict=True):
        link = joint.link
        assert link is not None
        x, y, z = link.com_m.tolist()
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        inertia = " ".join(
            f'{k}="{v!r}"' for k, v in zip(keys, link.inertia_kg_m2.tolist(), strict=True)
        )
        parts.append(
            f'<link name="{joint.name}_link"><inertial><origin xyz="{x!r} {y!r} {z!r}"/>'
            f'<mass value="{link.mass_kg!r}"/><inertia {inertia}/></inertial></link>'
            f'<joint name="{joint.name}" type="continuous"><parent link="{parent}"/>'
            f'<child link="{joint.name}_link"/><origin xyz="{" ".join(map(str, joint.origin_m))}"/>'
            f'<axis xyz="{" ".join(map(str, joint.axis))}"/></joint>'
            f'<transmission name="t_{joint.name}"><joint name="{joint.name}"/><actuator name="m">'
            f"<mechanicalReduction>{1 / ratio!r}</mechanicalReduction></actuator></transmission>"
        )
        parent = f"{joint.name}_link"
    return "\n".join([*parts, "</robot>"])


@pytest.fixture(scope="module")
def runs(shared_data: Path) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Angle [rad] and speed of the joints of the KR300, and torque of its motors [Nm], by run."""
    out = {}
    for name, (start, stop) in SECONDS.items():
        record = loadmat(
            shared_data / "kuka_kr300" / name / "data.mat", struct_as_record=False, squeeze_me=True
        )["rec"]
        rows = slice(int(start * 250), int(stop * 250), STEP)
        fields = (record.act_pos_mot_deg, record.act_vel_mot_deg_per_s, record.act_torque_abs_nm)
        angle, speed, torque = (np.asarray(f.T[rows], dtype=np.float64) for f in fields)
        out[name] = (np.deg2rad(angle), np.deg2rad(speed), torque)
    return out


def diagnosed(folder: Path, *arguments: str) -> dict:
    result = CliRunner().invoke(
        app, ["diagnose", *arguments, "--json", str(folder / "verdict.json"), "--max-causes", "4"]
    )
    assert result.exit_code == 0, result.output
    return json.loads((folder / "verdict.json").read_text())


def test_bags_beside_a_urdf_say_what_parquet_does(tmp_path: Path, runs, example_robot):
    """Joints by name, on their own side in the recording, on the motors' in the table."""
    arm = tmp_path / "arm.urdf"
    arm.write_text(urdf_of(example_robot))
    robot = load_robot(arm)
    np.testing.assert_allclose(robot.gear_ratio, example_robot.gear_ratio, rtol=1e-12)
    ratio = robot.gear_ratio
    bags, tables = [], []
    for name, (angle, speed, torque) in runs.items():
        time = np.arange(len(angle)) * STEP / 250.0
        shuffled = [3, 0, 5, 1, 4, 2]
        states = [np.ascontiguousarray(x[:, shuffled]) for x in (angle, speed, torque / ratio)]
        joints = [robot.axis_names[i] for i in shuffled]
        bags.append(str(written_states(tmp_path / f"run{name}", "mcap file", time, joints, states)))
        columns = {"time_s": time}
        for i in range(6):
            columns |= {
                f"position_{i + 1}": angle[:, i] / ratio[i],
                f"velocity_{i + 1}": speed[:, i] / ratio[i],
                f"torque_cmd_{i + 1}": torque[:, i],
            }
        table = tmp_path / f"run{name}.parquet"
        pd.DataFrame(columns).to_parquet(table)
        tables.append(str(table))
    by_bags = diagnosed(tmp_path, str(arm), *bags[:2], "--validation", bags[2])
    by_tables = diagnosed(tmp_path, "--model", str(arm), *tables[:2], "--validation", tables[2])
    assert by_bags["verdict"] == by_tables["verdict"]
    assert [c["effect"] for c in by_bags["causes"]] == [c["effect"] for c in by_tables["causes"]]
    assert by_bags["causes"]
    for one, other in zip(by_bags["causes"], by_tables["causes"], strict=True):
        assert one["axis"] == other["axis"]
        for name, value in one["parameters"].items():
            # Rounding of times and gears only.
            wanted = other["parameters"][name]["value"]
            assert value["value"] == pytest.approx(wanted, rel=1e-6)


@pytest.fixture(scope="module")
def example_robot() -> Robot:
    """The arm with round figures for its bodies."""
    return load_robot(Path(__file__).parents[3] / "examples" / "rigid_body" / "kuka_kr300.toml")

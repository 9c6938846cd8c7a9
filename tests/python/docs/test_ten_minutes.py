"""The page "your robot in ten minutes": its commands run as they stand, on files as it asks for."""

from __future__ import annotations

import importlib
import re
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from axisight import load_robot
from axisight.cli import app
from servo_arm import MACHINES, NOMINAL

Array = NDArray[np.float64]
LINK = """  <link name="{name}"><inertial><origin xyz="{com} 0 0"/><mass value="{mass}"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{name}"/>
    <origin xyz="{at}"/><axis xyz="{axis}"/><limit lower="-2" upper="2" effort="80" velocity="3"/>
    <dynamics damping="0.5"/></joint>
"""
JOINTS = {
    "pan": ("0 0 1", "0 0 0.3"),
    "shoulder": ("0 1 0", "0 0 0.1"),
    "elbow": ("0 1 0", "0.4 0 0"),
}


@pytest.fixture(scope="module")
def commands(repository: Path) -> dict[str, list[str]]:
    """The commands of each section."""
    page = (repository / "docs" / "ten_minutes.md").read_text(encoding="utf-8")
    found = {}
    for section in page.split("\n## ")[1:]:
        blocks = re.findall(r"```sh\n(.*?)```", section, re.DOTALL)
        lines = "".join(blocks).replace("\\\n", " ").splitlines()
        found[section.splitlines()[0]] = [line for line in lines if line.strip()]
    return found


def said(line: str) -> str:
    program, *arguments = shlex.split(line)
    assert program == "axisight"
    out = CliRunner().invoke(app, arguments)
    assert out.exit_code == 0, out.output
    return " ".join(out.output.split())


def arm_urdf() -> None:
    """Write arm.urdf: three links, viscous friction."""
    parents = ["base", "l1", "l2"]
    links = [
        LINK.format(name=f"l{i + 1}", joint=joint, parent=parents[i], axis=axis, at=at,
                    com=0.2, mass=(6, 5, 3)[i])
        for i, (joint, (axis, at)) in enumerate(JOINTS.items())
    ]  # fmt: skip
    Path("arm.urdf").write_text(
        '<robot name="arm">\n  <link name="base"/>\n' + "".join(links) + "</robot>\n"
    )


def measured(run: int) -> tuple[Array, tuple[Array, Array, Array]]:
    """Time [s], position, velocity and torque (n, 3) of the arm, which has dry friction on axis 2 as well."""
    robot, time = load_robot("arm.urdf"), np.arange(2000) / 100
    rng = np.random.default_rng(run)
    q, v, a = np.zeros((3, len(time), 3))
    for axis in range(3):
        for f in rng.uniform(0.1, 0.8, 4):
            w, phase = 2 * np.pi * f, rng.uniform(0, 2 * np.pi)
            q[:, axis] += 0.2 * np.sin(w * time + phase)
            v[:, axis] += 0.2 * w * np.cos(w * time + phase)
            a[:, axis] -= 0.2 * w**2 * np.sin(w * time + phase)
    torque = robot.inverse_dynamics(q, v, a) + 0.5 * v
    torque[:, 1] += 2.0 * np.tanh(v[:, 1] / 0.01)
    return time, (
        q + 1e-5 * rng.normal(size=q.shape),
        v + 1e-3 * rng.normal(size=q.shape),
        torque + 0.1 * rng.normal(size=q.shape),
    )


def shape(text: str) -> str:
    """Return a screen without its figures and columns."""
    return re.sub(r"\d[\d.]*", "#", " ".join(text.split()))


def test_a_urdf_and_csv(
    commands: dict[str, list[str]],
    repository: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    arm_urdf()
    for run in (1, 2, 3):
        time, noisy = measured(run)
        table = {"time": time}
        for name, values in zip(("position", "velocity", "torque"), noisy, strict=True):
            table |= {f"{name}_{joint}": values[:, i] for i, joint in enumerate(JOINTS)}
        pd.DataFrame(table).to_csv(f"run{run}.csv", index=False)
    guess, check, diagnose = commands["URDF and CSV"]
    said(guess)
    said(check)
    answer = said(diagnose)
    assert "explained: The simulator lacks Coulomb friction on axis 2" in answer
    assert "compared by inverse dynamics, below" in answer
    page = (repository / "docs" / "ten_minutes.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    assert all(shape(part) in shape(answer) for part in shown.split("\n...\n"))
    assert re.search(r'<dynamics damping="0.5" friction="[12]\.', Path("new.urdf").read_text())
    assert Path("verdict.json").exists()
    assert Path("report.html").exists()


def test_recordings_of_ros(
    commands: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joints in another order than the model's."""
    pytest.importorskip("rosbags", reason="bags are read with the extra `ros`")
    written_states = importlib.import_module("bag_data").written_states
    monkeypatch.chdir(tmp_path)
    arm_urdf()
    for run in (1, 2, 3):
        time, fields = measured(run)
        back = [np.ascontiguousarray(x[:, ::-1]) for x in fields]
        written_states(Path(f"bag{run}"), "rosbag2", time, list(JOINTS)[::-1], back)
    (diagnose,) = commands["Recordings of ROS"]
    assert "explained: The simulator lacks Coulomb friction on axis 2" in said(diagnose)


def test_an_mjcf_with_targets(
    commands: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    monkeypatch.chdir(tmp_path)
    Path("arm.xml").write_text(NOMINAL.mjcf())
    for run in (1, 2, 3):
        for name, machine in (("run", MACHINES["coulomb_friction@2"]), ("sim", NOMINAL)):
            log = machine.log(run, noise_rad=2e-4 if name == "run" else 0.0)
            assert log.position_ref_rad is not None
            table = {"time_s": log.time_s}
            for i in range(3):
                table[f"position_ref_{i + 1}"] = log.position_ref_rad[:, i]
                table[f"position_{i + 1}"] = log.position_rad[:, i]
            pd.DataFrame(table).to_parquet(f"{name}{run}.parquet")
    (diagnose,) = commands["MJCF, targets and positions"]
    assert "explained: The simulator lacks Coulomb friction on axis 2" in said(diagnose)
    assert 'frictionloss="2.' in Path("new.xml").read_text()
    own = "".join(f" --simulated sim{run}.parquet" for run in (1, 2, 3))
    answer = said(diagnose.partition(" --write-model")[0] + own)
    assert "The model differs from your simulator by axis 1: 0." in answer
    assert "explained: The simulator lacks Coulomb friction on axis 2" in answer

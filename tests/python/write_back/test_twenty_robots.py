"""The parts of benches/twenty_robots.py, on two small models."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("mujoco")

LINK = """<link name="{0}"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial>
<visual><geometry><mesh filename="package://nowhere/{0}.stl"/></geometry></visual></link>
"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0.4 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="50" velocity="3"/><dynamics damping="0.5"/></joint>
"""
URDF = (
    '<robot name="arm"><link name="base"/>'
    + "".join(LINK.format(name) for name in ("upper", "fore", "side"))
    + JOINT.format("shoulder", "base", "upper")
    + JOINT.format("elbow", "upper", "fore")
    + JOINT.format("spare", "upper", "side")
    + "</robot>"
)
MJCF = """<mujoco><asset><mesh name="far" file="nowhere.stl"/></asset><worldbody>
<body name="trunk"><freejoint/><inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>
  <geom type="mesh" mesh="far"/>
  <body name="leg"><joint name="hip" axis="0 1 0" damping="0.4"/>
    <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body></body>
</worldbody><actuator><motor joint="hip"/></actuator>
<keyframe><key qpos="0 0 0 1 0 0 0 0"/></keyframe></mujoco>"""
JOINTS = {"urdf": ["shoulder", "elbow"], "xml": ["hip"]}


@pytest.fixture
def machines(repository: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(repository / "benches"))
    return importlib.import_module("twenty_machines")


@pytest.fixture
def bench(machines: ModuleType) -> ModuleType:
    return importlib.import_module("twenty_robots")


def arm_of(machines: ModuleType, folder: Path, kind: str) -> object:
    source, path = folder / f"source.{kind}", folder / f"model.{kind}"
    source.write_text({"urdf": URDF, "xml": MJCF}[kind])
    machines.without_shapes(source, path)
    return machines.Arm(path, JOINTS[kind])


@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_a_nominal_arm_follows_its_reference(
    machines: ModuleType, tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machines, "DURATION_S", 2.0)
    arm = arm_of(machines, tmp_path, kind)
    position, _ = machines.run(arm, arm, 1)
    reference = machines.Reference(*arm.middle_and_reach(), 1)
    times = machines.STEP_S * machines.PER_SAMPLE * np.arange(len(position))
    wanted = np.array([reference(t)[0] for t in times])
    # The loop is exact but for the order one of the integrator: a step of 0.5 ms at 5 rad/s^2 and poles at 20 rad/s.
    assert np.abs(position - wanted).max() < 5e-3


def test_the_derivatives_of_a_reference_are_its_own(machines: ModuleType) -> None:
    reference = machines.Reference(np.zeros(2), np.full(2, 0.5), 2)
    for t in (0.3, 1.2, 1.9, 4.0):
        h = 1e-5
        (q0, v0, _), (_, v, a), (q1, v1, _) = (reference(t + k * h) for k in (-1, 0, 1))
        np.testing.assert_allclose((q1 - q0) / (2 * h), v, atol=1e-7)
        np.testing.assert_allclose((v1 - v0) / (2 * h), a, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "effect"), [("urdf", "viscous_friction"), ("xml", "rotor_inertia")]
)
def test_an_effect_has_its_share_of_the_torque(
    machines: ModuleType, tmp_path: Path, kind: str, effect: str
) -> None:
    nominal = arm_of(machines, tmp_path, kind)
    motion = machines.run(nominal, nominal, 2)
    machine = machines.sized(effect, 0, nominal, motion)
    arm = machines.Arm(nominal.path, nominal.joints)
    machine.change(arm)
    torque = machines.run(arm, nominal, 2, machine)[1]
    added = (torque - motion[1])[:, 0].std() / motion[1][:, 0].std()
    # Feedback alone pushes against the effect, so the motion changes a little.
    assert added == pytest.approx(machines.SHARE, rel=0.2)


def test_a_load_counts_as_a_heavier_last_link_and_nothing_else_does(
    bench: ModuleType, machines: ModuleType
) -> None:
    load = machines.Machine("payload", 0, 1.0)
    assert bench.right(load, ["payload"], 6)
    assert bench.right(load, ["link_mass@6", "payload"], 6)
    assert not bench.right(load, ["link_mass@5"], 6)
    assert not bench.right(load, [], 6)
    dry = machines.Machine("coulomb_friction", 1, 1.0)
    assert bench.right(dry, ["coulomb_friction@2"], 6)
    assert not bench.right(dry, ["stribeck_friction@2", "coulomb_friction@2"], 6)


def test_every_row_of_the_table_is_an_entry_with_a_name_of_its_own(bench: ModuleType) -> None:
    _, table = bench.entries()
    assert len({entry.name for entry in table}) == len(table)
    assert sum(not entry.refused for entry in table) == 20
    assert {entry.format for entry in table} == set(bench.HELD)
    hand = next(entry for entry in table if entry.kind == "hand")
    assert hand.ends() == ["--tip", hand.tip]
    assert hand.ends(whole_tree=True) == ["--whole-tree"]


def test_the_page_is_made_from_the_stored_results(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(repository / "docs")
    page = (repository / "docs" / "twenty_robots.md").read_text(encoding="utf-8")
    assert page == importlib.import_module("make_twenty_robots").render(), "run `make docs`"

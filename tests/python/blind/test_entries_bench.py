"""benches/diagnosis_entries.py: the baselines of the public test find what their idea can find, and runs go on."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from axisight import load_robot
from axisight.blind.entries import as_verdict, entries_in
from axisight.blind.sealed import SEAL
from axisight.cli.demo import write_demo_case
from axisight.effects import Effect
from axisight.logs import Log, read_case


@pytest.fixture
def bench(repository: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(repository / "benches"))
    return import_module


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = write_demo_case(tmp_path_factory.mktemp("public") / "case_a")
    (made / SEAL).write_text("sealed")
    return made


def test_the_single_best_effect_is_friction_where_friction_is_withheld(
    bench: Any, case: Path
) -> None:
    said = bench("entries_by_aic").entry(read_case(case))
    first = said["causes"][0]
    # AIC may prefer a law with more parameters, of which Coulomb friction is a special case.
    assert said["verdict"] != "none" and first["axis"] == 2 and "friction" in first["effect"]
    assert first["parameters"]["coulomb_nm"]["value"] == pytest.approx(0.6, abs=0.06)
    checked = as_verdict({"schema": "axisight.entry/1", **said}, "case_a.json")
    assert checked["verdict"] == said["verdict"]


def test_everything_at_once_moves_friction_where_friction_is_withheld(
    bench: Any, case: Path
) -> None:
    pytest.importorskip("absl", reason="mujoco[sysid]")
    pytest.importorskip("tabulate", reason="mujoco[sysid]")
    said = bench("entries_by_sysid").entry(read_case(case))
    assert said == {
        "verdict": "explained",
        "causes": [{"effect": "coulomb_friction", "axis": 2}],
    }


def test_the_model_for_mujoco_has_the_torque_of_the_lever(bench: Any) -> None:
    pytest.importorskip("absl", reason="mujoco[sysid]")
    pytest.importorskip("tabulate", reason="mujoco[sysid]")
    sysid = bench("entries_by_sysid")
    robot = load_robot("lever_like")
    (joint,) = robot.joints
    assert joint.link is not None and joint.drive is not None
    time = np.arange(20_000) * robot.sample_time_s
    angle = 0.4 * np.sin(2 * np.pi * 0.5 * time)
    speed = 0.4 * np.pi * np.cos(2 * np.pi * 0.5 * time)
    # Axis y, mass on x: gravity turns it by m g l cos(q), inertia as seen from the joint, motor behind the gear.
    mass, reach, turn = joint.link.mass_kg, joint.link.com_m[0], joint.drive.gear_ratio
    inertia = joint.link.inertia_kg_m2[1] + mass * reach**2 + joint.drive.motor_inertia / turn**2
    damping = joint.drive.viscous_friction / turn**2
    torque = inertia * -(np.pi**2) * angle + damping * speed - mass * 9.81 * reach * np.cos(angle)
    log = Log(
        name="swing",
        source=Path("swing"),
        time_s=time,
        sample_time_s=robot.sample_time_s,
        torque_nm=torque[:, None] * turn,
        position_rad=angle[:, None] / turn,
        velocity_ref_rad_s=None,
    )
    motion = sysid._Motion.of(log, robot)
    free = list(sysid._free(robot))
    (off,) = motion.residual(sysid.spec_of(robot), free, [f.nominal for f in free])
    # Away from the ends, where the filters begin, differences over 0.5 ms leave (pi * 0.0005)^2 / 6 = 4e-7 of an
    # acceleration, and the low-pass takes (0.5 / 4)^8 = 6e-8 of a sine of 0.5 Hz.
    assert np.abs(off[20:-20]).max() < 3e-6


def test_a_stopped_run_goes_on_and_a_failure_stops_nothing(
    bench: Any, case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("case_b", "case_c"):
        (case.parent / name).mkdir(exist_ok=True)
        (case.parent / name / SEAL).write_text("sealed")
    driver = bench("diagnosis_entries")
    seen: list[str] = []

    def read(folder: Path, **_: Any) -> str:
        seen.append(folder.name)
        if folder.name == "case_b":
            raise OSError("no disk")
        return folder.name

    monkeypatch.setattr(driver, "read_case", read)
    monkeypatch.setattr(driver, "method", lambda _: lambda _case: {"verdict": "none"})
    assert driver.written("aic", case.parent, tmp_path, 1) == 1
    assert driver.written("aic", case.parent, tmp_path, None) == 1
    assert seen == ["case_a", "case_b", "case_c"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["case_a.json", "case_c.json"]
    said = json.loads((tmp_path / "case_c.json").read_text())
    assert as_verdict(said, "case_c.json")["verdict"] == "none" and said["seconds"] >= 0
    # One file of lines goes on in the same way.
    lines = tmp_path / "aic.jsonl"
    assert driver.written("aic", case.parent, lines, 1) == 1
    assert driver.written("aic", case.parent, lines, None) == 1
    assert list(entries_in(lines)) == ["case_a", "case_c"]


def test_effects_of_the_baselines_are_of_the_library(bench: Any) -> None:
    pytest.importorskip("absl", reason="mujoco[sysid]")
    free = list(bench("entries_by_sysid")._free(load_robot("cobot_like")))
    assert len(free) == 6 * 8 + 6 * 5 + 2
    for one in free:
        Effect(one.effect, one.axis)

"""The table of homes in an MJCF against what is written, and against the installed MuJoCo."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

from axisight import load_robot
from axisight.effects import effect_info, effect_table
from axisight.write_back import Home, mujoco_homes, write_model
from axisight.write_back.mjcf import versions
from found_causes import several
from import_data import written
from servo_arm import NOMINAL

mujoco = pytest.importorskip("mujoco")

SENSORS = '<sensor><jointpos joint="j1"/><jointvel joint="j1"/></sensor></mujoco>'
# Sizes that bodies and gears of the arm allow, where the typical one is that of a larger robot.
SMALL = {"sine_nm": 3.0, "cosine_nm": 1.0, "relative_change": 0.05, "x_m": 0.005, "mass_kg": 0.3}


def arm(folder: Path, name: str) -> Path:
    """Return the file of an arm with motors, or with servos for effects of their controllers."""
    text = NOMINAL.mjcf().replace("</mujoco>", SENSORS)
    if effect_info(name).acts != "controller":
        for i in (1, 2, 3):
            own = f'<position joint="j{i}" kp="{NOMINAL.kp[i - 1]}" kv="{NOMINAL.kd[i - 1]}"/>'
            text = text.replace(own, f'<motor joint="j{i}" gear="2"/>')
    return written(folder, text, "arm.xml")


def values(name: str) -> dict[str, float]:
    """Return parameters of an effect with every amplitude at a small typical size."""
    info = effect_info(name)
    shape = {p.name: p.neutral for p in info.parameters if p.role == "shape"}
    sizes = [p for p in info.parameters if p.role == "amplitude"]
    if name == "torque_ripple":
        return {"order_1": 6.0, "cosine_1_nm": 0.1, "sine_1_nm": 0.2}
    if name == "controller_gain":
        return {"relative_proportional": 0.1, "relative_integral": -0.1}
    return shape | {p.name: SMALL.get(p.name, p.typical) for p in sizes}


@pytest.mark.parametrize("name", mujoco_homes())
def test_every_home_is_written_and_compiled(tmp_path: Path, name: str):
    """The installed MuJoCo reads each home since its version; below, the cause is refused with the reason."""
    source, home = arm(tmp_path, name), mujoco_homes()[name]
    scope = effect_info(name).scope
    cause = several(name, 1 if scope == "axis" else None, **values(name))
    made = write_model(source, load_robot(source), [cause], tmp_path / "new.xml")
    if versions.installed() < home.since:
        assert f"since {home.since[0]}.{home.since[1]}" in made.why[cause.label]
        return
    assert made.placed == (cause.label,), made.why
    mujoco.MjModel.from_xml_path(str(made.path))


def test_effects_without_a_home_are_not_written(tmp_path: Path):
    for name, info in effect_table().items():
        if name in mujoco_homes() or info.scope == "axes":
            continue
        source = arm(tmp_path, name)
        cause = several(name, 1 if info.scope == "axis" else None, **values(name))
        made = write_model(source, load_robot(source), [cause], tmp_path / f"{name}.xml")
        assert made.placed == (), name


def test_an_older_mujoco_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """With 3.2 none of the newer homes is written, and each reason names the version."""
    monkeypatch.setattr("axisight.write_back.mjcf.versions.installed", lambda: (3, 2))
    newer = {name: home for name, home in mujoco_homes().items() if home.since > (3, 2)}
    assert len(newer) > 5
    for name, home in newer.items():
        source = arm(tmp_path, name)
        cause = several(name, 1, **values(name))
        made = write_model(source, load_robot(source), [cause], tmp_path / f"{name}.xml")
        assert f"since {home.since[0]}.{home.since[1]}, installed is 3.2" in made.why[cause.label]


def test_the_installed_mujoco_reads_what_its_version_has(
    repository: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.syspath_prepend(repository / "docs")
    script = import_module("make_mujoco_homes")
    found = {name: script.reads(name) for name in script.PROBES}
    assert found == {k: versions.installed() >= since for k, (since, *_) in script.PROBES.items()}
    # Every home that is newer than the oldest version stands in a probe of its version.
    assert {h.since for h in mujoco_homes().values()} == {
        since for since, *_ in script.PROBES.values()
    }


def test_the_page_is_up_to_date(repository: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(repository / "docs")
    script = import_module("make_mujoco_homes")
    page = (repository / "docs" / "mujoco_homes.md").read_text("utf-8")
    assert page == script.render(), "run `make docs`"
    # A reason is given for effects without a home only; of gears, only backlash has one of its own.
    without = {n: i for n, i in effect_table().items() if n not in mujoco_homes()}
    assert script.WHY.keys() == {
        n for n, i in without.items() if i.acts != "transmission" or n == "backlash"
    }


def test_a_home_has_words():
    assert all(isinstance(home, Home) and home.where for home in mujoco_homes().values())
    assert set(mujoco_homes()) <= set(effect_table())

"""Documents, models, designs and results damaged in any way, seeded: read, or refused by the package."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from axisight.excitation import multisine, references, write_references
from axisight.logs import named_map_text
from axisight.montecarlo.design import digest, freeze
from axisight.montecarlo.store import FORMAT, Store
from axisight.robot import load_robot
from axisight.robot_file.sidecar import Sidecar
from columns_data import robot_toml
from damage import TIMES, batch, mutated, sound
from import_data import DH, MJCF, URDF, dh_toml
from montecarlo_data import small_study
from reading_children import read_in_child

DRIVES = """class = "cobot"
base = "base"
sample_time = 0.004
operating_point = [0.1, -0.2]
[tolerances]
mass = 0.1
[joint.shoulder]
gear_ratio = 0.02
motor_inertia = 1e-4
stiffness = 2e4
damping = 3.0
[payload]
mass = 2.0
com = [0.0, 0.01, 0.1]
"""
DESIGN = """robot = "irb6600_like"
[signal]
kind = "multisine"
period_s = 0.5
band_hz = [2.0, 40.0]
peak_rad_s = 8.0
"""
CASE = """schema = "axisight.case/1"
name = "c"
robot = "robot.toml"
[[log]]
file = "a.csv"
role = "estimation"
period_s = 1.0
"""


def sidecar() -> str:
    source = {
        "method": "m", "data": {"log": "a.csv"}, "settings": {"seed": 1, "axes": [1, 2]},
        "created": "2026-01-01T00:00:00", "axisight_version": "0.1.0", "notes": "",
    }  # fmt: skip
    values = [{"name": "axis1.mass", "value": 2.0, "standard_error": 0.1}]
    text = json.dumps(
        {
            "schema": "axisight.identified/2", "robot": "r.toml", "robot_sha256": "0" * 64,
            "source_sha256": "1" * 64, "parameters": values, "covariance": [[0.01]],
            "provenance": source,
        }
    )  # fmt: skip
    Sidecar.model_validate_json(text)
    return text


# Reader, and a good file of it by name.
TEXTS = {
    "urdf": ("models", "arm.urdf", URDF),
    "mjcf": ("models", "arm.xml", MJCF),
    "dh": ("models", "arm.csv", DH),
    "dh toml": ("robot", "arm.toml", dh_toml()),
    "robot": ("robot", "robot.toml", robot_toml(2)),
    "preset": ("robot", "robot.toml", load_robot("irb6600_like").toml),
    "drives": ("drives", "drives.toml", DRIVES),
    "columns": ("columns", "columns.toml", named_map_text("ur-rtde")),
    "study": ("study", "study.toml", small_study().to_toml()),
    "design": ("design", "design.toml", DESIGN),
    "verdict": ("verdict", "one.json", json.dumps({"verdict": "none", "causes": [], "gap": 0.5})),
    "sidecar": ("sidecar", "r.identified.json", sidecar()),
}


@pytest.mark.parametrize("name", TEXTS)
def test_damaged_texts(tmp_path, name):
    reader, file, text = TEXTS[name]
    if name == "mjcf":
        pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    good = tmp_path / file
    good.write_text(text)
    rng = np.random.default_rng([21, list(TEXTS).index(name)])
    paths = [good, *batch(tmp_path, good, rng)]
    outcomes = read_in_child(paths, reader=reader, seconds=10, limit=3 * 10**9)
    assert outcomes[0][0] == "read" or name == "design", outcomes[0]
    sound(outcomes)


@pytest.mark.parametrize("kind", ["csv", "mat", "parquet"])
def test_damaged_references(tmp_path, kind):
    good = tmp_path / f"good.{kind}"
    files = write_references(references(multisine(0.1, 0.002, band_hz=(20.0, 60.0)), 1), good)
    rng = np.random.default_rng([22, len(kind)])
    paths = [good]
    for number in range(TIMES):
        for file in files:
            data = file.read_bytes()
            damaged = mutated(data, rng) if file is files[number % len(files)] else data
            (tmp_path / file.name.replace("good", str(number))).write_bytes(damaged)
        paths.append(tmp_path / f"{number}.{kind}")
    outcomes = read_in_child(paths, reader="references", seconds=10, limit=3 * 10**9)
    assert outcomes[0][0] == "read", outcomes[0]
    sound(outcomes)


def test_damaged_descriptions_of_stores(tmp_path):
    design = freeze(small_study())
    good = Store(tmp_path / "good")
    good.folder.mkdir()
    begun = {"format": FORMAT, "design": design, "design_sha256": digest(design), "seed": 1}
    good.create("", begun)
    rng = np.random.default_rng(23)
    data, paths = (good.root / "zarr.json").read_bytes(), [good.folder]
    for number in range(TIMES):
        folder = Path(shutil.copytree(good.folder, tmp_path / f"{number}"))
        (folder / "study.zarr" / "zarr.json").write_bytes(mutated(data, rng))
        paths.append(folder)
    outcomes = read_in_child(paths, reader="store", seconds=10, limit=3 * 10**9)
    assert outcomes[0][0] == "read", outcomes[0]
    sound(outcomes)

"""Two real robots: what the example finds on motions that took no part in the fit."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "rigid_body" / "run.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("rigid_body_run", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclass looks its module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def tx40(shared_data, example):
    return example.analyse_tx40(shared_data)


@pytest.fixture(scope="module")
def kr300(shared_data, example):
    return example.analyse_kr300(shared_data)


def error(found, label, part=0):
    return found.errors[label, found.held_out[part].name]


def test_tx40_is_predicted_on_what_was_held_out(tx40):
    # Per cent of the torque: large axes below ten, the small wrist axes below a quarter.
    assert np.all(error(tx40, "bodies that can exist")[:2] < 0.1)
    assert np.all(error(tx40, "bodies that can exist") < 0.25)
    assert np.all(error(tx40, "without friction") > 0.6)


def test_tx40_parameters_make_sense(tx40):
    values = dict(zip(tx40.estimate.names, tx40.estimate.values, strict=True))
    spread = dict(zip(tx40.estimate.names, tx40.estimate.standard_error, strict=True))
    # All of the arm about axis 1 and friction of axes 1 and 2: positive, a few per cent.
    for name in ("axis1.inertia_zz", "axis1.viscous_friction", "axis2.viscous_friction"):
        assert values[name] > 10 * spread[name], name
    for name, value in values.items():
        if name.endswith(("viscous_friction", "coulomb_friction", "motor_inertia")):
            assert value > 0, name
    # The whole arm weighs on axis 2: the first moment of 27 kg at less than a third of 0.45 m.
    assert 1.0 < values["axis2.mass_x"] < 4.0


def test_kr300_trained_on_one_run_predicts_the_others(kr300):
    for part in range(2):
        ours = error(kr300, "bodies that can exist", part)
        assert np.all(ours < 0.45) and ours[[0, 2, 4]].max() < 0.2
        # Ten seconds of one run leave unconstrained least squares free to go astray.
        free = error(kr300, "least squares", part)
        assert np.sqrt(np.mean(ours**2)) < 0.75 * np.sqrt(np.mean(free**2))
        assert np.all(error(kr300, "without friction", part)[:4] > 1.0)
        # The controller's own model, with its best constant: worse but for axis 2.
        controller = error(kr300, "controller's model", part)
        assert np.all(ours[[0, 2, 3, 4, 5]] < controller[[0, 2, 3, 4, 5]])


def test_kr300_bodies_exist(kr300):
    assert kr300.consistent.status == "solved"
    assert np.all(kr300.consistent.least_eigenvalue > 0)
    # The price in the fit is small: what was given up was not known.
    assert kr300.consistent.loss < 1.1 * kr300.consistent.loss_unconstrained


def test_example_writes_figures_and_tables(shared_data, tmp_path):
    done = run("--data", str(shared_data), "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        f"{robot}{end}"
        for robot in ("tx40", "kr300")
        for end in (".png", "_base.csv", "_errors.csv")
    }
    table = (tmp_path / "out" / "tx40_base.csv").read_text().splitlines()
    assert len(table) == 1 + 58
    assert not any(bad in line for line in table for bad in ("nan", "inf,"))


def test_example_without_data_says_so_and_writes_nothing(tmp_path):
    copy = shutil.copytree(EXAMPLE.parent, tmp_path / "a" / "b" / "c")
    done = run("--data", str(tmp_path / "absent"), cwd=copy)
    assert done.returncode == 0
    assert done.stdout.count("not run: no ") == 2
    assert not (copy / "rigid_body").exists()


def run(*arguments, cwd=None):
    script = EXAMPLE if cwd is None else cwd / EXAMPLE.name
    return subprocess.run(
        [sys.executable, str(script), *arguments],
        capture_output=True,
        text=True,
        timeout=200,
        cwd=cwd,
        check=False,
    )

"""A real two-mass bench: what its two multisine runs say."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "fditools" / "run.py"


def load():
    spec = importlib.util.spec_from_file_location("fditools_run", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclass looks its module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def example():
    return load()


@pytest.fixture(scope="module")
def found(shared_data, example):
    return example.analyse(shared_data / "fditools_multisine")


@pytest.fixture(scope="module")
def rows(found, example):
    return {(row["output"], row["low_hz"]): row for row in example.summary(found)}


def test_only_the_transient_and_the_last_period_are_dropped(found):
    for run, dropped, lines in (("A", 2, 240), ("B", 1, 60)):
        prepared = found.prepared[run]
        assert prepared.dropped_periods == dropped
        assert prepared.records.n_periods == 19 - dropped
        assert len(prepared.records.lines) == lines
        assert not prepared.serious


def test_anti_resonance_and_resonance(found):
    # Known to be near 53 and 77 Hz, to the line; a line is 1 Hz in run A.
    for run in "AB":
        assert found.modes[run, "anti-resonance"][0] == pytest.approx(53.5, abs=1.0)
        assert found.modes[run, "resonance"][0] == pytest.approx(76.5, abs=1.0)
        assert 0.01 < found.modes[run, "resonance"][2] < 0.025
    (a, error_a, _), (b, error_b, _) = (found.modes[run, "resonance"] for run in "AB")
    assert abs(a - b) < 1.96 * np.hypot(error_a, error_b)


def test_low_frequency_is_that_of_two_masses(found, example):
    # Also the sign of the load angle: a coupling does not turn it round.
    assert example.two_mass_error(found) < 0.015
    low = found.full["response"].sel(frequency_hz=slice(0, 30), input=1)
    turn = np.angle((low.sel(output=2) / low.sel(output=1)).values, deg=True)
    assert np.abs(turn).max() < 5


@pytest.mark.parametrize("pole", [False, True])
def test_mode_of_a_known_oscillator_is_found(example, pole):
    # Two masses, f_a 53.4 Hz, f_r 76.3 Hz, damping ratios 1.5 % and 2 %, on the grid of run A.
    f = np.arange(11.0, 251.0)
    anti = 53.4**2 - f**2 + 2j * 0.015 * 53.4 * f
    at = 76.3**2 - f**2 + 2j * 0.02 * 76.3 * f
    g = (-anti / (f**2 * at))[:, None, None]
    response = example.frf.frequency_response(f, g, estimator="exact", variance=np.zeros(g.shape))
    f0, error, damping = example.mode(response, 76.0 if pole else 53.0, pole=pole)
    assert error == 0
    true, damped, other = (76.3, 0.02, 0.015 * 53.4) if pole else (53.4, 0.015, 0.02 * 76.3)
    # The other pair turns the phase by its imaginary over its real part; f0 moves by the half
    # bandwidth damped * true times that, up to curvature.
    turn = 2 * other * true / (76.3**2 - 53.4**2)
    assert abs(f0 - true) == pytest.approx(damped * true * turn, rel=0.1)
    assert damping == pytest.approx(damped, rel=0.05)


def test_distortion_rises_above_the_noise(rows):
    for (output, low), row in rows.items():
        assert row["odd_db"] > row["noise_db"] + 3, (output, low)
        if (output, low) != ("load angle", 120):
            assert row["even_db"] > row["noise_db"] + 3, (output, low)
            assert -60 < row["even_db"] < -30
    # The load hardly moves above its resonance, and what it does is odd.
    assert rows["load angle", 120]["odd_db"] > -25
    # Correction for the distorted current is more than cosmetic.
    motor = rows["motor angle", 120]
    assert motor["even_db"] - motor["even_uncorrected_db"] > 5


def test_runs_agree_inside_the_bands_where_linear(rows):
    for output, least in (("motor angle", 50), ("load angle", 10)):
        chosen = [r for (o, low), r in rows.items() if o == output and r["linear"] and low != 70]
        lines = sum(r["lines"] for r in chosen)
        # Of lines that agree 95 % are inside: fewer than 88 % of 53 has a probability of 2 %.
        assert lines >= least
        assert sum(r["inside_95"] for r in chosen) >= 0.88 * lines


def test_runs_differ_at_the_resonance(rows):
    for output in ("motor angle", "load angle"):
        assert rows[output, 70]["median_difference_percent"] > 10
        assert rows[output, 70]["inside_95"] < rows[output, 70]["lines"]


def test_bands_are_not_so_wide_that_agreement_means_nothing(found):
    f = found.full["frequency_hz"].values
    g = found.full.sel(output=1, input=1)
    relative = np.sqrt(g["variance"].values) / np.abs(g["response"].values)
    assert np.median(relative[(f > 85) & (f < 250)]) < 0.06
    assert np.median(relative[f < 45]) < 0.06


def run(*arguments: str, **options) -> subprocess.CompletedProcess:
    command = [sys.executable, "-W", "error", str(EXAMPLE), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


def test_example_writes_figure_and_tables(shared_data, tmp_path):
    done = run("--data", str(shared_data / "fditools_multisine"), "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert "resonance: A 76" in done.stdout
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "fditools.png",
        "responses.csv",
        "bands.csv",
    }
    table = (tmp_path / "out" / "responses.csv").read_text().splitlines()
    assert len(table) == 1 + 2 * (240 + 60)
    assert not any(bad in line for line in table for bad in ("nan", "inf"))


def test_example_without_data_says_so_and_writes_nothing(tmp_path):
    copy = shutil.copytree(EXAMPLE.parent, tmp_path / "a" / "b" / "c")
    done = run("--data", str(tmp_path / "absent"), cwd=copy)
    assert done.returncode == 0
    assert done.stdout.startswith("not run: no multisine data in")
    assert not (copy / "fditools").exists()

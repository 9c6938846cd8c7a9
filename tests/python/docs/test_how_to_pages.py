"""Pages that say how to simulate, average and estimate: their snippets run as they stand."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

import axisight
from axisight.cli import app
from montecarlo_data import small_study

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SAMPLE_TIME_S = 1e-3


@pytest.fixture
def snippets(repository, tmp_path, monkeypatch):
    """The snippets of a page, in order, of one language; what they write goes into a folder of its own."""
    monkeypatch.chdir(tmp_path)

    def of(page, language):
        text = (repository / "docs" / f"{page}.md").read_text(encoding="utf-8")
        found = [code for kind, code in BLOCK.findall(text) if kind == language]
        assert found
        return found

    return of


def gain(input_):
    """Positions of a plant that is a gain by channel: what is estimated is known."""
    return input_ * np.array([2.0, -0.5])


def test_simulation(snippets):
    names = {}
    for code in snippets("simulation", "python"):
        exec(code, names)
    assert names["run"].attrs["status"] == "completed"
    # One run of a batch is the run of its number: halved at first, whole in the end.
    runs = names["runs"]
    assert runs.sizes["run"] == 16
    alone = axisight.simulate(names["robot"], names["references"][3], noise_seed=0, run=103)
    same = runs.isel(run=3)["torque_cmd_nm"].values
    # Runs of a batch share their steps: equal to the integrator's tolerance, with the same noise.
    np.testing.assert_allclose(same, alone["torque_cmd_nm"].values, atol=1e-6)


def test_frequency_responses(snippets, capsys):
    rng = np.random.default_rng(1)
    lines = np.arange(2, 40)
    n = 256
    time = np.arange(n) / n
    phases = rng.uniform(0, 2 * np.pi, (2, len(lines), 1))
    x = np.cos(2 * np.pi * lines[:, None] * time + phases).sum(axis=1)
    # Experiments in a row: orthogonal, two inputs in two experiments; six periods with a little noise.
    mixed = np.einsum("ei,it->eti", [[1, 1], [1, -1]], x)
    torque = np.repeat(mixed[:, None], 6, axis=1)
    angle = gain(torque) + 1e-6 * rng.standard_normal(torque.shape)
    names = {
        "sample_time_s": SAMPLE_TIME_S,
        "torque": torque,
        "motor_angle": angle,
        "lines": lines,
        "reference": torque,
    }
    (code,) = snippets("frequency_responses", "python")
    exec(code, names)
    omega = 2 * np.pi * lines / (n * SAMPLE_TIME_S)
    found = names["g"].response.values / -(omega**2)[:, None, None]
    np.testing.assert_allclose(found, np.broadcast_to(np.diag([2.0, -0.5]), found.shape), atol=1e-5)
    assert names["radius"].shape == found.shape
    assert capsys.readouterr().out


def test_local_models(snippets):
    torque = np.random.default_rng(2).standard_normal((2, 1000, 2))
    names = {"sample_time_s": SAMPLE_TIME_S, "torque": torque, "position": gain(torque)}
    (code,) = snippets("local_models", "python")
    exec(code, names)
    found = names["estimate"].response.values
    assert len(found) == 391
    np.testing.assert_allclose(found, np.broadcast_to(np.diag([2.0, -0.5]), found.shape), atol=1e-9)


def test_monte_carlo(snippets, tmp_path):
    """With a study of milliseconds: 250 runs by command, 750 more, and 250 from Python."""
    (tmp_path / "study.toml").write_text(small_study(runs=10).to_toml())
    first = snippets("monte_carlo", "sh")[0].splitlines()
    for line in first:
        words = line.partition("#")[0].split()
        out = CliRunner().invoke(app, [*words[1:], "--quiet"])
        assert out.exit_code == 0, out.output
    code = snippets("monte_carlo", "python")[0]  # the others: test_montecarlo_docs.py
    names = {}
    exec(code.replace('out="results"', 'out="again"'), names)
    assert int(names["result"].attrs["runs"]) == 250
    assert names["result"].arithmetic_mean.dims == ("frequency_hz", "output", "input")


@pytest.mark.parametrize("page", ["conventions", "effects", "plots"])
def test_short_examples(page, snippets):
    names = {}
    for code in snippets(page, "python"):
        exec(code, names)
    assert names["robot"].n_axes == 3
    if "run" in names:
        assert names["run"].attrs["status"] == "completed"


@pytest.mark.parametrize("page", ["branches", "floating_base"])
def test_printed_numbers(page, snippets, capsys):
    (code,) = snippets(page, "python")
    exec(code, {})
    told = [line.split("# ")[1] for line in code.splitlines() if line.startswith("print(")]
    assert capsys.readouterr().out.splitlines() == told

"""What a verdict promises holds in MuJoCo: machines and figures of benches/write_back*.py."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest


@pytest.mark.parametrize("name", ["dry friction", "load", "torque constant", "Stribeck"])
def test_the_gap_in_mujoco_is_the_promised_one(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    """Within a point by inverse dynamics, or below: MuJoCo's dry friction has no corner, the one that is fitted has."""
    monkeypatch.syspath_prepend(repository / "benches")
    bench = import_module("write_back")
    machine = bench.MACHINES[name]
    out = bench.outcome(machine, tmp_path, simulated_s=5.0)
    assert [cause.label for cause in out.found.causes] == [machine.effect]
    promised = out.found.gap
    assert promised.after < 0.2 * promised.before
    assert out.inverse[0] == pytest.approx(promised.before, abs=0.001)
    # By inverse dynamics of single samples a model with bristles has no torque.
    bristles = name == "Stribeck"
    assert np.isnan(out.inverse[1]) == bristles
    assert bristles or promised.after - 0.02 < out.inverse[1] < promised.after + 0.01
    assert out.run[0] == pytest.approx(promised.before, abs=0.05)
    # Bristles hold where the machine's Stribeck friction creeps.
    assert promised.after - 0.05 < out.run[1] < promised.after + (0.03 if bristles else 0.01)
    assert out.made.remaining == ()
    # Quotes, comments and all that is no number of the cause.
    text = out.made.path.read_text()
    assert "<!-- as drawn -->" in text
    assert "axis='0 1 0'" in text


@pytest.mark.parametrize("name", ["balance spring", "weak motor of dcmotor"])
def test_motors_of_mujoco_close_the_gap_as_promised(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    """Within 5 points of the promised gap, by a passive motor and by a controller of its own."""
    monkeypatch.syspath_prepend(repository / "benches")
    out = import_module("write_back_dcmotor").outcome(name, tmp_path)
    assert out.holds
    assert out.promised[1] < 0.1 * out.promised[0]
    assert out.run[0] == pytest.approx(out.promised[0], abs=0.05)
    assert "dcmotor" in out.made.path.read_text()


def test_gains_that_were_fitted_are_the_machines_in_mujoco(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Off by up to a factor of two, dry friction beside: MuJoCo runs the written model under held-out targets."""
    monkeypatch.syspath_prepend(repository / "benches")
    bench = import_module("write_back_targets")
    out = bench.outcome("gains and friction", tmp_path)
    assert out.made.left_out == ()
    assert set(out.made.placed) == {
        "coulomb_friction@2",
        *(f"j{i}.{gain}" for i in (1, 2, 3) for gain in ("kp", "kd")),
    }
    # The law is the same and its steps are in the model: what is left is noise, and corners of friction.
    np.testing.assert_allclose(out.run[0], out.promised[0], rtol=0.02)
    assert np.all(out.run[1] < 1.25 * out.promised[1])
    assert np.all(out.promised[1] < 0.02 * out.promised[0])

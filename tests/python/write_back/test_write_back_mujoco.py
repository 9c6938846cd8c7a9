"""What a verdict promises holds in MuJoCo: machines and figures of benches/write_back.py and write_back_targets.py."""

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
    assert promised.after - 0.02 < out.inverse[1] < promised.after + 0.01
    assert out.run[0] == pytest.approx(promised.before, abs=0.05)
    assert promised.after - 0.05 < out.run[1] < promised.after + 0.01
    assert (out.made.remaining == ()) == (name != "Stribeck")
    # Quotes, comments and all that is no number of the cause.
    text = out.made.path.read_text()
    assert "<!-- as drawn -->" in text
    assert "axis='0 1 0'" in text


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

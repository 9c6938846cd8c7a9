"""A real machine: the EMPS benchmark, its simulator a bare mass."""

import importlib
import sys
from pathlib import Path

import pytest

import axisight

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "emps"


@pytest.fixture(scope="module")
def example():
    sys.path.insert(0, str(EXAMPLE))
    try:
        return importlib.import_module("run")
    finally:
        sys.path.remove(str(EXAMPLE))


def test_the_missing_friction_terms_are_named_and_sized(shared_data, example):
    columns = EXAMPLE / "columns.toml"
    robot = axisight.load_robot(EXAMPLE / "robot.toml")
    first = axisight.read_log(shared_data / "emps" / "DATA_EMPS.mat", columns)
    second = axisight.read_log(shared_data / "emps" / "DATA_EMPS_PULSES.mat", columns)
    found = axisight.diagnose(robot=robot, estimation=[first], validation=[second])
    assert found.mode == "inverse_dynamics"
    assert found.verdict == "explained_in_part"
    assert {c.effect for c in found.causes} == {
        "coulomb_friction",
        "viscous_friction",
        "viscous_asymmetry",
    }
    assert found.gap.after < 0.15 * found.gap.before
    ours = example.found_parameters(robot, found)
    # The published fit counts samples at standstill in full, the diagnosis hardly.
    for name in ("mass", "viscous", "coulomb"):
        assert ours[name] == pytest.approx(example.PUBLISHED[name], rel=0.03), name
    assert "offset" not in ours
    # Least squares of the mean forces at 16 constant speeds: -38.3 +- 0.7 N s/m without an offset, which has
    # other samples than the diagnosis; three standard errors.
    assert ours["asymmetry"] == pytest.approx(-38.3, abs=2.1)

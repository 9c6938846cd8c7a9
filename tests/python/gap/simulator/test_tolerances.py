"""Tolerances of the simulator's own parameters: by quantity, by name, from an identification."""

import json
from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose, load_robot
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.simulator.tolerances import identified_tolerances, tolerance_of, with_tolerances
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.robot_file import Provenance, identified, write_identified
from gap_data import HELD, PLAN, bare_axis, logs_of

INERTIA = "axis1.motor_inertia"


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """The two-mass axis, its motor inertia said to be known to 6 %."""
    robot = bare_axis()
    value = robot.parameters()[INERTIA]
    found = identified(
        {INERTIA: value}, Provenance("by hand"), standard_errors={INERTIA: 0.06 * value}
    )
    path = tmp_path / "axis.toml"
    write_identified(robot, path, found)
    return path


def test_a_name_comes_before_its_quantity():
    tolerances = {"mass": 0.01, "axis2.mass": 0.2}
    assert tolerance_of(tolerances, "axis1.mass") == 0.01
    assert tolerance_of(tolerances, "axis2.mass") == 0.2
    assert tolerance_of(tolerances, "axis1.stiffness") is None


def test_standard_errors_and_errors_of_formulas_add_in_squares(written: Path):
    assert identified_tolerances(written, 0.01) == pytest.approx({INERTIA: np.hypot(0.06, 0.01)})
    assert identified_tolerances("two_mass_axis", 0.01) == {}


def test_what_is_given_comes_first(written: Path):
    robot = load_robot(written)
    found = with_tolerances(Settings(), robot, written).tolerances or {}
    assert found[INERTIA] == pytest.approx(np.hypot(0.06, 0.01))
    assert found["motor_inertia"] == DEFAULT_TOLERANCES["motor_inertia"]
    found = with_tolerances(Settings(), robot, written, {"motor_inertia": 0.002}).tolerances or {}
    assert tolerance_of(found, INERTIA) == 0.002


def test_standard_errors_belong_to_the_values_that_were_identified(written: Path):
    # Something else was changed in the file: what was identified still stands there.
    text = written.read_text("utf-8")
    written.write_text(text + "[tolerances]\nstiffness = 0.2\n", "utf-8")
    assert INERTIA in identified_tolerances(written, 0.01)
    (line,) = (x for x in text.splitlines() if x.startswith("motor_inertia"))
    written.write_text(text.replace(line, "motor_inertia = 0.02"), "utf-8")
    assert identified_tolerances(written, 0.01) == {}


def test_an_inertia_known_badly_is_no_effect(written: Path):
    off = bare_axis()
    machine = off.with_parameters({INERTIA: 1.08 * off.parameters()[INERTIA]})
    logs = logs_of(machine, [], PLAN), logs_of(machine, [], HELD)
    settings = Settings(bootstrap=100)
    found = diagnose(robot=written, estimation=logs[0], validation=logs[1], settings=settings)
    assert found.verdict == "none"
    assert found.refit[INERTIA].value == pytest.approx(0.08, abs=0.005)
    # With the usual tolerance of 1.5 % it is one.
    sidecar = written.with_name("axis.identified.json")
    assert json.loads(sidecar.read_text("utf-8"))["parameters"][0]["name"] == INERTIA
    sidecar.unlink()
    found = diagnose(robot=written, estimation=logs[0], validation=logs[1], settings=settings)
    # Of one axis without weight a torque constant would do as well, with all else four tolerances off.
    (cause,) = found.causes
    assert cause.effect == "motor_inertia"
    rivals = {one.effect: one.probability for one in found.ranking}
    assert 0 < rivals["torque_constant"] < 0.01
    own = [x for x in found.trace.comparisons[0].ledger if x.rule == "own_parameters"]
    assert {x.hypothesis: x.nats for x in own}["torque_constant@1"] < -0.5 * 4**2


@pytest.mark.parametrize(
    ("name", "values", "scatter"),
    [
        ("piecewise_stiffness", {"step": 0.003, "within": 0.003, "knee_rad": 3e-6}, True),
        # Softer at first and stiffer beyond: either alone is more than scatter.
        ("piecewise_stiffness", {"step": 0.1, "within": -0.09, "knee_rad": 3e-4}, False),
        ("piecewise_stiffness", {"step": 0.1, "within": 0.0, "knee_rad": 3e-4}, False),
        ("lost_motion", {"softness": 0.02, "half_width_rad": 1e-4}, True),
        ("gear_hysteresis", {"share": 0.2, "deflection_rad": 1e-4}, False),
    ],
)
def test_a_law_that_changes_a_spring_by_its_tolerance_is_scatter(name, values, scatter):
    robot = bare_axis()
    fitter = ClosedLoopView(robot, logs_of(robot, [], PLAN, 1.0), Settings()).fitter
    effect = Effect(name, 1, values)
    assert fitter.within_tolerance(effect) == scatter
    # Three deviations of one and a half per cent.
    assert fitter.tolerated(effect) == pytest.approx(0.045)

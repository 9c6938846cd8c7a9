"""Ranges for training: sides of the gear, what is drawn together, what has no home."""

import ast
from dataclasses import replace

import numpy as np
import pytest

from axisight.errors import InputError
from axisight.posterior import PROJECTS, PosteriorHypothesis, PosteriorParameter, randomization
from axisight.posterior.parameter import Prior
from posterior_data import (
    COULOMB,
    INERTIA,
    MASS,
    OFFSET,
    RATIO,
    STIFFNESS,
    VISCOUS,
    one_hypothesis,
    two_hypotheses,
)


def fields(made):
    return {(f.kind, f.joint): f for f in made.fields}


def constants(text: str) -> dict:
    """Return the literals at the top of the code."""
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            try:
                found[node.targets[0].id] = ast.literal_eval(node.value)
            except ValueError:
                continue
    return found


@pytest.mark.parametrize("project", PROJECTS)
def test_motor_side_values_pass_the_gear(project):
    found = fields(randomization(one_hypothesis(), project))
    damping, friction = found["damping", "axis1"], found["frictionloss", "axis1"]
    # r is the joint angle over the motor angle: r^2 for inertia and viscous friction, r for dry friction.
    assert damping.mean == pytest.approx(0.013 / RATIO**2)
    assert damping.std == pytest.approx(3e-4 / RATIO**2)
    assert found["armature", "axis1"].mean == pytest.approx(0.0121 / RATIO**2)
    assert friction.mean == pytest.approx(0.5 / RATIO)
    # Fit, formula and variation between runs.
    assert friction.std == pytest.approx(np.sqrt(0.02**2 + 0.005**2 + 0.03**2) / RATIO)
    assert found["mass", "axis1"].mean == pytest.approx(1.0)
    assert found["mass", "axis1"].std == pytest.approx(2.0 / 500.0)
    assert (damping.unit, friction.unit, found["mass", "axis1"].unit) == ("Nm s/rad", "Nm", "1")
    reach = 1.96 * damping.std
    assert (damping.low, damping.high) == (
        pytest.approx(damping.mean - reach),
        pytest.approx(damping.mean + reach),
    )


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("project", PROJECTS)
@pytest.mark.parametrize("made", [one_hypothesis, two_hypotheses])
def test_every_parameter_has_a_home_or_a_reason(project, made, elastic):
    found = made()
    out = randomization(found, project, elastic_gears=elastic)
    placed = {name for f in out.fields for name in f.parameters}
    assert placed | out.without_home.keys() == set(found.names)
    assert not placed & out.without_home.keys()
    compile(out.text, "code", "exec")
    # Neither stays unsaid.
    for name in (*placed, *out.without_home):
        assert name in out.text
    assert (STIFFNESS in placed) == (elastic and project != "isaaclab")


def test_correlated_numbers_are_drawn_together():
    # Without variation between runs the correlation of -0.8 stays; with it, friction has its own scatter.
    still = replace(one_hypothesis(), between_runs=())
    out = randomization(still, "mjlab")
    found = fields(out)
    together = {key for key, f in found.items() if f.together}
    assert together == {("damping", "axis1"), ("frictionloss", "axis1")}
    assert found["damping", "axis1"].with_others == (
        ("frictionloss of axis1", pytest.approx(-0.7761, abs=1e-4)),
    )
    told = constants(out.text)
    assert told["TOGETHER"] == [("damping", "axis1"), ("frictionloss", "axis1")]
    root = np.array(told["ROOTS"][0])
    scale = np.array([RATIO**-2, RATIO**-1])
    wanted = still.gaussian().sel(parameter=[VISCOUS, COULOMB], other=[VISCOUS, COULOMB])
    # Six digits of every number.
    assert root @ root.T == pytest.approx(
        wanted.covariance.values * np.outer(scale, scale), rel=1e-4
    )
    varying = fields(randomization(one_hypothesis(), "mjlab"))
    assert not any(f.together for f in varying.values())


def test_open_rivals_are_drawn_one_at_a_time():
    out = randomization(two_hypotheses(), "playground")
    told = constants(out.text)
    assert told["ALONE"] == {}
    assert told["WEIGHTS"] == [0.75, 0.25]
    place = told["TOGETHER"].index(("frictionloss", "axis1"))
    assert [row[place] for row in told["MEANS"]] == [50.0, 0.0]
    f = fields(out)["frictionloss", "axis1"]
    # Mean and variance of a mixture.
    own = (0.02**2 + 0.005**2 + 0.03**2) / RATIO**2
    assert f.mean == pytest.approx(0.75 * 50)
    assert f.std == pytest.approx(np.sqrt(0.75 * own + 0.75 * 0.25 * 50**2))
    assert f.low == 0.0, "no friction below zero"
    assert "coulomb_friction@1 (0.75); torque_offset@1 (0.25)" in out.text


def test_what_varies_between_runs_is_drawn_at_every_reset():
    text = randomization(one_hypothesis(), "mjlab").text
    assert '"axisight_frictionloss_reset"' in text and '"axisight_damping_startup"' in text
    assert "frictionloss of axis1: 42.87 to 57.13 Nm; varies: yes" in text


def relative(name: str, changes: tuple[str, str]) -> PosteriorParameter:
    effect, quantity = name.split(".")
    return PosteriorParameter(
        name, "1", "cause", 1, effect.split("@")[0], quantity, 0.0, -0.9, 10.0,
        Prior("half_normal", 0.0, 0.1), changes=changes,
    )  # fmt: skip


def test_causes_that_change_a_parameter_of_the_robot():
    name = "motor_inertia@1.relative_change"
    base = one_hypothesis()
    rotor = relative(name, (INERTIA, "relative"))
    found = replace(
        base,
        parameters=(rotor,),
        hypotheses=(
            PosteriorHypothesis(
                (), 1.0, (name,), np.array([0.2]), np.array([[0.01**2]]), np.zeros(1)
            ),
        ),
        between_runs=(),
    )
    f = fields(randomization(found, "playground"))["armature", "axis1"]
    # The cause stands in place of the own parameter: nominal times 1.2.
    assert f.mean == pytest.approx(1.2 * 0.0121 / RATIO**2)
    assert f.std == pytest.approx(0.01 * 0.0121 / RATIO**2)


def test_gains_have_a_home_in_servos_only():
    gain = PosteriorParameter(
        "axis1.kp", "1", "own", 1, "controller_gain", "relative_proportional", 0.0, -0.5, 0.5,
        Prior("normal", 0.0, 0.1),
    )  # fmt: skip
    one = PosteriorHypothesis(
        (), 1.0, ("axis1.kp",), np.array([0.1]), np.eye(1) * 1e-4, np.zeros(1)
    )
    base = replace(one_hypothesis(), parameters=(gain,), hypotheses=(one,), between_runs=())
    servo = replace(base, simulated=replace(base.simulated, controller="pd_position"))
    assert fields(randomization(servo, "isaaclab"))["kp", "axis1"].mean == pytest.approx(1.1)
    assert "no gains of a servo" in randomization(base, "isaaclab").without_home["axis1.kp"]


def test_unknown_projects_are_refused_and_files_are_written(tmp_path):
    with pytest.raises(InputError, match="project: expected one of mjlab, playground, isaaclab"):
        randomization(one_hypothesis(), "gazebo")
    out = randomization(one_hypothesis(), "mjlab")
    assert out.save(tmp_path / "dr.py").read_text("utf-8") == out.text
    assert "no home" in repr(out) and MASS not in out.without_home
    assert OFFSET in randomization(two_hypotheses(), "mjlab").without_home

"""The document for any simulator: numbers by hand, YAML and JSON by other parsers, draws."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from axisight.errors import InputError
from axisight.posterior import (
    PROJECTS,
    load_randomization,
    randomization,
    randomization_document,
    save_randomization,
)
from axisight.posterior.randomization.document_files import to_yaml
from axisight.posterior.randomization.engines import ENGINES
from axisight.posterior.randomization.homes import UNITS
from posterior_data import COULOMB, OFFSET, RATIO, STIFFNESS, one_hypothesis, two_hypotheses

FRICTION = "frictionloss of axis1"


def test_numbers_by_hand():
    found = randomization_document(one_hypothesis())
    friction = found.number(FRICTION)
    # Dry friction passes a gear with r; fit, formula, and variation between runs add in squares.
    assert friction.mean == pytest.approx(0.5 / RATIO)
    assert friction.std == pytest.approx(np.sqrt(0.02**2 + 0.005**2 + 0.03**2) / RATIO)
    assert friction.between_runs_std == pytest.approx(0.03 / RATIO)
    assert (friction.varies_between_runs, friction.draw) == ("yes", "episode")
    assert friction.simulators["mujoco"] == "dof_frictionloss"
    assert (friction.lower, friction.upper) == (0.0, pytest.approx(10.0 / RATIO))
    assert friction.parameters == [COULOMB]
    still = found.number("armature of axis1")
    assert (still.varies_between_runs, still.draw, still.between_runs_std) == (
        "not known",
        "once",
        0,
    )


def test_no_parameter_is_left_out():
    for elastic in (False, True):
        known = two_hypotheses()
        found = randomization_document(known, elastic_gears=elastic)
        assert {p for n in found.numbers for p in n.parameters} == set(known.names)
    # A parameter that may be negative keeps its sign, side and unit.
    offset = found.number(OFFSET)
    assert offset.kind == "own" and offset.unit == "Nm" and offset.low < 0 and offset.note
    rigid = randomization_document(known).number(STIFFNESS)
    assert rigid.kind == "own" and rigid.unit == "Nm/rad" and "elastic_gears" in rigid.note


@pytest.mark.parametrize("project", PROJECTS)
def test_ranges_are_those_of_the_code(project):
    known = replace(one_hypothesis(), between_runs=())
    document = randomization_document(known)
    for f in randomization(known, project).fields:
        one = document.number(f.label)
        assert (one.low, one.high, one.unit) == (f.low, f.high, f.unit)


@pytest.mark.parametrize("ending", ["yaml", "yml", "json"])
def test_files_hold_everything(tmp_path, ending):
    found = randomization_document(two_hypotheses(), elastic_gears=True)
    path = save_randomization(found, tmp_path / f"ranges.{ending}")
    assert load_randomization(path) == found
    # Other parsers see the same values: no number is text, no word a truth value.
    text = path.read_text("utf-8")
    content = json.loads(text) if ending == "json" else yaml.safe_load(text)
    assert content == found.model_dump(by_alias=True)
    assert content["schema"] == "axisight.randomization/1"


def test_yaml_keeps_types():
    values = {
        "a": 1e-8,
        "b": 1e300,
        "c": "yes",
        "d": None,
        "e": -0.5,
        "f": "a: #b",
        "g e": [1.5, 2.0],
    }
    nested = {**values, "rows": [[1e-9, 2.0], [3.0, 4.0]], "empty": [], "none": {}, "in": [values]}
    again = yaml.safe_load(to_yaml(nested))
    assert again == nested and isinstance(again["a"], float)


def test_draws_have_the_moments_of_the_document():
    known = replace(one_hypothesis(), between_runs=())
    found = randomization_document(known)
    number = 4000
    drawn = found.samples(number, seed=2)
    pair = np.stack([drawn["damping of axis1"], drawn[FRICTION]])
    # Four standard errors of a mean, of a variance and of a correlation from so many draws.
    joint = found.joint_draw.hypotheses[0]
    std = np.sqrt(np.diag(joint.covariance))
    assert (pair.mean(axis=1) - joint.mean) / std == pytest.approx([0, 0], abs=4 / number**0.5)
    assert pair.var(axis=1) / std**2 == pytest.approx([1, 1], abs=4 * (2 / number) ** 0.5)
    assert np.corrcoef(pair)[0, 1] == pytest.approx(-0.7761, abs=4 / number**0.5)
    armature = found.number("armature of axis1")
    alone = drawn["armature of axis1"].values
    assert armature.low <= alone.min() and alone.max() <= armature.high
    # The variance of a uniform distribution.
    assert alone.std() == pytest.approx((armature.high - armature.low) / 12**0.5, rel=0.03)
    # A function of seed and run.
    late = found.samples(3, seed=2, first_run=7)
    assert late.equals(drawn.isel(draw=slice(7, 10)))


def test_open_rivals_are_drawn_one_at_a_time():
    found = randomization_document(two_hypotheses())
    assert [h.causes for h in found.joint_draw.hypotheses] == [
        ["coulomb_friction@1"], ["torque_offset@1"],
    ]  # fmt: skip
    drawn = found.samples(400, seed=0)
    has = drawn[FRICTION].values > 0
    assert has.mean() == pytest.approx(0.75, abs=4 * (0.1875 / 400) ** 0.5)
    assert np.all((drawn[OFFSET].values == 0) == has)


def test_every_kind_has_a_parameter_in_some_simulator():
    kinds = set(UNITS) - {"own"}
    assert set(ENGINES["mujoco"]) == kinds
    assert all(set(one) <= kinds for one in ENGINES.values())


def test_misuse(tmp_path):
    found = randomization_document(one_hypothesis())
    with pytest.raises(InputError, match=r"expected a name ending in \.yaml, \.yml, \.json"):
        save_randomization(found, tmp_path / "ranges.toml")
    path = save_randomization(found, tmp_path / "ranges.yaml")
    for before, after, message in (
        ("axisight.randomization/1", "axisight.randomization/9", "schema"),
        ('distribution: "uniform"', 'distribution: "normal"', r"numbers\.\d+\.distribution"),
        ("std: ", "sdt: ", r"numbers\.0\.std"),
        ('name: "by hand"', "name: [", "expected YAML"),
    ):
        other = tmp_path / "other.yaml"
        other.write_text(path.read_text("utf-8").replace(before, after), "utf-8")
        with pytest.raises(InputError, match=message):
            load_randomization(other)
    with pytest.raises(InputError, match="expected a randomization document"):
        load_randomization(tmp_path / "missing.json")

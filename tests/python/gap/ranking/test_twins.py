"""Effects that no log tells apart: the same logs, one probability, both said."""

import numpy as np
import pytest

from axisight import Effect, simulate
from axisight.blind.score import _judged
from axisight.effects import effect_table
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Candidate
from axisight.gap.ranking.twins import (
    about_twins,
    less_their_twins,
    open_twins,
    twins_of,
    with_twins,
)
from gap_data import bare_axis, reference

PAIRS = sorted({tuple(sorted((i.name, t))) for i in effect_table().values() for t in i.twins})


def cause(effect: str, axis: int = 2, probability: float = 0.9) -> NamedCause:
    return NamedCause(effect, axis, probability, {}, {}, "timing", probability)


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_twins_have_the_same_parameters_and_logs(one: str, other: str):
    robot, table = bare_axis(), effect_table()
    assert table[one].twins == (other,) and table[other].twins == (one,)
    assert table[one].family == table[other].family
    assert table[one].parameters == table[other].parameters
    values = {p.name: p.typical for p in table[one].parameters}
    ref = reference("multisine", 1, 400, robot.sample_time_s)
    runs = [simulate(robot, ref, effects=[Effect(n, 1, values)]) for n in (one, other)]
    for name in ("torque_cmd_nm", "position_rad"):
        a, b = runs[0][name].values, runs[1][name].values
        # What is read between samples is off by a 384th of fourth differences.
        assert np.abs(a - b).max() <= 1e-5 * np.abs(a).max()


def test_what_is_late_is_a_twin_of_an_axis_alone():
    assert twins_of("sensor_delay", 1) == ("input_delay",)
    assert twins_of("sensor_delay", 3) == twins_of("input_delay", 2) == ()
    assert twins_of("torque_offset", 3) == ("torque_sensor_offset",)


def test_they_share_one_probability():
    ranking = (
        Candidate("torque_offset", 2, 0.9, 0.95, 9.0, "loss_converged"),
        Candidate("backlash", 2, 0.1, 0.5, 4.0, "loss_converged"),
    )
    found = with_twins(ranking, 3)
    assert [c.label for c in found] == ["torque_offset@2", "torque_sensor_offset@2", "backlash@2"]
    assert sum(c.probability for c in found) == pytest.approx(1.0)
    assert found[1].probability == pytest.approx(0.18)
    (less,) = less_their_twins([cause("torque_offset")], 3)
    assert less.probability == pytest.approx(found[0].probability)
    assert less.family_probability == 0.9


def test_they_are_said_and_others_are_not():
    causes = [cause("torque_offset", 3), cause("backlash", 1)]
    assert open_twins(causes, 3) == (("torque_offset@3", "torque_sensor_offset@3"),)
    (says,) = about_twins(causes, 3)
    assert "A torque offset on axis 3" in says and "a torque sensor offset" in says
    assert less_their_twins(causes, 3)[1] is not None
    assert less_their_twins(causes, 3)[1].probability == 0.9


def test_a_score_takes_one_for_the_other_and_nothing_else():
    def judged(withheld: str, named: str):
        effect = {"effect": withheld, "axis": 1, "parameters": {}}
        found = {
            "effect": named,
            "axis": 1,
            "parameters": {},
            "probability": 0.8,
            "gap_reduction": {"value": 1.0},
        }
        verdict = {
            "verdict": "explained",
            "causes": [found],
            "alternatives": [],
            "equivalent": [],
            "where": [],
            "detection_limits": [],
        }
        setting = {
            "engine": "mujoco",
            "arm": "lever_like",
            "motions": "moves",
            "references": "logged",
        }
        return _judged("case", {"effects": [effect], "severity": [9.0], **setting}, verdict)

    assert judged("torque_sensor_offset", "torque_offset").truth == ("torque_offset@1",)
    # What is said of one counts for both: four fifths are all of it.
    twin = judged("torque_sensor_offset", "torque_offset")
    assert twin.probabilities == pytest.approx((1.0,))
    assert judged("torque_sensor_offset", "backlash").truth == ("torque_sensor_offset@1",)
    assert judged("backlash", "torque_offset").truth == ("backlash@1",)

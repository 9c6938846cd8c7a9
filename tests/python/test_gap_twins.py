"""Effects that no log tells apart: the same logs, one probability, both said."""

import numpy as np
import pytest

from axisight import Effect, simulate
from axisight.blind.score import _judged
from axisight.effects import effect_table
from axisight.gap.named import NamedCause
from axisight.gap.result import Candidate
from axisight.gap.twins import about_twins, less_their_twins, open_twins, with_twins
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
        np.testing.assert_array_equal(runs[0][name].values, runs[1][name].values)


def test_a_position_read_late_is_a_torque_applied_late():
    """By another way than the library's: the plain loop, written out, reads its own past."""
    rng = np.random.default_rng(3)
    wanted = rng.standard_normal(300)

    def loop(read_late: int, act_late: int) -> tuple[np.ndarray, np.ndarray]:
        # An integrator, with some friction that is not linear; at rest before.
        speed, was, asked, seen = 0.0, [0.0] * 9, [0.0] * 9, []
        for r in wanted:
            was.append(speed)
            seen.append(was[-1 - read_late])
            asked.append(0.3 * (r - seen[-1]))
            speed += asked[-1 - act_late] - 0.05 * np.tanh(speed)
        return np.array(asked), np.array(seen)

    for a, b in zip(loop(3, 0), loop(0, 3), strict=True):
        np.testing.assert_array_equal(a, b)


def test_they_share_one_probability():
    ranking = (
        Candidate("input_delay", 2, 0.9, 0.95, 9.0, "loss_converged"),
        Candidate("backlash", 2, 0.1, 0.5, 4.0, "loss_converged"),
    )
    found = with_twins(ranking)
    assert [c.label for c in found] == ["input_delay@2", "sensor_delay@2", "backlash@2"]
    assert sum(c.probability for c in found) == pytest.approx(1.0)
    assert found[1].probability == pytest.approx(0.18)
    (less,) = less_their_twins([cause("input_delay")])
    assert less.probability == pytest.approx(found[0].probability)
    assert less.family_probability == 0.9


def test_they_are_said_and_others_are_not():
    causes = [cause("torque_offset", 3), cause("backlash", 1)]
    assert open_twins(causes) == (("torque_offset@3", "torque_sensor_offset@3"),)
    (says,) = about_twins(causes)
    assert "a torque offset on axis 3" in says and "a torque sensor offset" in says
    assert less_their_twins(causes)[1] is not None
    assert less_their_twins(causes)[1].probability == 0.9


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
        setting = {"engine": "mujoco", "arm": "lever_like", "motions": "moves"}
        return _judged("case", {"effects": [effect], "severity": [9.0], **setting}, verdict)

    assert judged("sensor_delay", "input_delay").truth == ("input_delay@1",)
    # What is said of one counts for both: four fifths are all of it.
    assert judged("sensor_delay", "input_delay").probabilities == pytest.approx((1.0,))
    assert judged("sensor_delay", "backlash").truth == ("sensor_delay@1",)
    assert judged("backlash", "input_delay").truth == ("backlash@1",)

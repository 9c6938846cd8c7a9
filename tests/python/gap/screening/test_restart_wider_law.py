"""A law of friction begins where a plainer law that it contains ended."""

from types import SimpleNamespace

import pytest

from axisight import Effect
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.screening.restart_wider_law import begun_wider

EVEN = Effect("coulomb_friction", 2, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.3, "arm_share": 0.9})
UNEVEN = Hypothesis(
    Effect("position_dependent_friction", 2, {"order": 0.07, "cosine_nm": 0.2, "sine_nm": 0.1}),
    ("cosine_nm", "sine_nm", "order", "mean_nm"),
)


def trial(effect: Effect, total: float):
    fitted = SimpleNamespace(effects=(effect,), total=total)
    return SimpleNamespace(label=effect.label, fitted=fitted)


def begun(even, *others, score: float = 0.9, axis: int = 1, offered=(UNEVEN,)):
    standing = SimpleNamespace(axis=axis, best=SimpleNamespace(trial=even, score=score))
    return begun_wider([standing], [even, *others], lambda fitted: list(offered))


@pytest.mark.parametrize(
    "tried",
    [(), (trial(UNEVEN.effect, 200.0),), (trial(UNEVEN.effect, 99.5),)],
    ids=["not", "worse", "no better"],
)
def test_uneven_friction_takes_over_size_corner_and_side(tried):
    even = trial(EVEN, 100.0)
    ((model, option),) = begun(even, *tried)
    assert model is even.fitted
    wanted = {"mean_nm": 0.5, "smoothing_rad_s": 0.3, "arm_share": 0.9}
    # Its wave is that of what even friction leaves.
    assert option.effect.parameters == {**UNEVEN.effect.parameters, **wanted}
    assert option.free == UNEVEN.free


def test_friction_of_the_motor_takes_over_no_side():
    of_motor = Effect("coulomb_friction", 2, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.3})
    ((_, option),) = begun(trial(of_motor, 100.0))
    assert "arm_share" not in option.effect.parameters


@pytest.mark.parametrize(
    "nothing",
    [
        lambda: begun(trial(EVEN, 100.0), trial(UNEVEN.effect, 50.0)),
        lambda: begun(trial(EVEN, 100.0), score=0.995),
        lambda: begun(trial(EVEN, 100.0), axis=0),
        lambda: begun(trial(Effect("torque_offset", 2, {"offset_nm": 1.0}), 100.0)),
        lambda: begun(trial(EVEN, 100.0), offered=()),
    ],
    ids=["it fits better", "little is left", "elsewhere", "another leads", "no wave"],
)
def test_it_is_left_alone_where_there_is_no_need(nothing):
    assert nothing() == []


def test_stribeck_friction_worse_than_the_coulomb_friction_in_it_begins_there_at_each_start():
    rises = Effect("stribeck_friction", 2, {"excess_nm": 0.1, "stribeck_speed_rad_s": 2.0})
    falling = Hypothesis(
        rises,
        ("coulomb_nm", "excess_nm", "stribeck_speed_rad_s", "smoothing_rad_s"),
        starts=({"excess_nm": 0.2, "stribeck_speed_rad_s": 20.0},),
    )
    found = begun(trial(EVEN, 100.0), trial(rises, 130.0), offered=(falling,))
    taken = {"coulomb_nm": 0.5, "smoothing_rad_s": 0.3, "arm_share": 0.9}
    assert [option.effect.parameters for _, option in found] == [
        {"excess_nm": 0.1, "stribeck_speed_rad_s": 2.0, **taken},
        {"excess_nm": 0.2, "stribeck_speed_rad_s": 20.0, **taken},
    ]
    assert begun(trial(EVEN, 100.0), trial(rises, 90.0), offered=(falling,)) == []

"""Bristles that stick begin where those that do not ended, over each speed that Stribeck friction is looked for."""

from types import SimpleNamespace

import pytest

from axisight import Effect
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.screening.restart_stiction import begun_sticking

SPEED = "stribeck_speed_rad_s"
ENDED = Effect("presliding_friction", 2, {"coulomb_nm": 0.5, "presliding_rad": 2e-3})
YIELDING = Hypothesis(
    ENDED, ("coulomb_nm", "presliding_rad"), bounds={"presliding_rad": (0.0, 1.0)}
)
FALLING = Hypothesis(
    Effect("stribeck_friction", 2, {SPEED: 3.0}),
    ("coulomb_nm", SPEED),
    bounds={SPEED: (0.1, 30.0)},
    starts=({SPEED: 9.0}, {"arm_share": 1.0}),
)
OTHER = Hypothesis(Effect("backlash", 2), ("half_width_rad",))


def ranked(option: Hypothesis, score: float):
    fitted = SimpleNamespace(effects=(option.effect,))
    trial = SimpleNamespace(label=option.effect.label, hypothesis=option, fitted=fitted)
    return SimpleNamespace(trial=trial, score=score)


def begun(*tried, axis: int = 1, options=(FALLING,)):
    standing = SimpleNamespace(axis=axis, best=tried[0], ranked=tried)
    return begun_sticking([standing], options)


def test_they_hold_more_over_each_speed():
    law = ranked(YIELDING, 0.9)
    found = begun(ranked(FALLING, 0.95), law)
    assert [model for model, _ in found] == [law.trial.fitted] * 2
    for (_, option), speed in zip(found, (3.0, 9.0), strict=True):
        assert option.effect.parameters == {**ENDED.parameters, "static_ratio": 1.3, SPEED: speed}
        assert option.free == (*YIELDING.free, "static_ratio", SPEED)
        wanted = {"presliding_rad": (0.0, 1.0), "static_ratio": (1.0, 5.0), SPEED: (0.1, 30.0)}
        assert option.bounds == wanted


@pytest.mark.parametrize(
    "nothing",
    [
        lambda: begun(ranked(OTHER, 0.95), ranked(YIELDING, 0.9)),
        lambda: begun(ranked(YIELDING, 0.9), axis=0),
        lambda: begun(ranked(YIELDING, 0.999)),
        lambda: begun(ranked(YIELDING, 0.9), options=()),
        lambda: begun(ranked(Hypothesis(ENDED, (*YIELDING.free, "static_ratio"), bounds={}), 0.9)),
    ],
    ids=["another leads", "elsewhere", "little is left", "no speed", "they stick already"],
)
def test_they_are_left_alone_where_there_is_no_need(nothing):
    assert nothing() == []

"""More usual effects begun where a less usual one led, and axes that judge their own effects."""

from types import SimpleNamespace

import pytest

from axisight import Effect
from axisight.gap.evidence import FreeEffect
from axisight.gap.search import _beaten_at_home
from axisight.gap.usual import begun_where_it_ended

WIDTH = 2.1e-4
PLAY = FreeEffect(Effect("backlash", 1, {"half_width_rad": 0.0}), ("half_width_rad",))
CUBE = FreeEffect(Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 0.0}), ("cubic_nm_rad3",))
ELSEWHERE = FreeEffect(Effect("backlash", 2, {"half_width_rad": 0.0}), ("half_width_rad",))
SOFT = Effect("lost_motion", 1, {"softness": 0.98, "half_width_rad": WIDTH, "rounding": 0.02})
KNEE = Effect("piecewise_stiffness", 1, {"step": 1.0, "within": -0.95, "knee_rad": WIDTH})


def led_by(effect: Effect):
    values = {"axis1.stiffness": 1.7e6}
    return SimpleNamespace(evidence=SimpleNamespace(effects=(effect,), robot_values=values))


@pytest.mark.parametrize("leader", [SOFT, KNEE], ids=lambda e: e.name)
def test_play_begins_with_the_width_of_a_soft_middle(leader: Effect):
    """Of the same name or the only one of its unit; a cube has no width, axis 2 another gear."""
    (start,) = begun_where_it_ended(led_by(leader), [CUBE, PLAY, ELSEWHERE], set())
    assert start.option.effect.label == "backlash@1"
    assert start.option.effect.parameters["half_width_rad"] == WIDTH
    assert start.robot_values == {"axis1.stiffness": 1.7e6}


def test_what_was_tried_is_not_tried_again():
    assert not begun_where_it_ended(led_by(SOFT), [CUBE, PLAY], {"backlash@1"})


def test_nothing_is_more_usual_than_play():
    play = Effect("backlash", 1, {"half_width_rad": WIDTH})
    assert not begun_where_it_ended(led_by(play), [CUBE, PLAY], set())


def standing(axis: int, effect: Effect):
    trial = SimpleNamespace(candidate=SimpleNamespace(effect=effect))
    return SimpleNamespace(axis=axis - 1, best=SimpleNamespace(trial=trial))


def test_an_axis_judges_its_own_effects():
    """The soft middle of axis 1 leads on axis 3, where it is felt; on axis 1 it is play that leads."""
    felt, home = standing(3, SOFT), standing(1, Effect("backlash", 1))
    assert _beaten_at_home(felt, {0: home, 2: felt})
    assert not _beaten_at_home(home, {0: home, 2: felt})


@pytest.mark.parametrize(
    "home",
    [
        None,
        standing(1, SOFT),
        standing(1, Effect("payload", None)),
        standing(1, Effect("backlash", 2)),
    ],
    ids=["no cause", "the same", "of the arm", "of another axis"],
)
def test_it_stands_where_its_own_axis_has_no_other(home):
    felt = standing(3, SOFT)
    assert not _beaten_at_home(felt, {0: home, 2: felt})
    assert not _beaten_at_home(felt, {2: felt})
    whole = standing(3, Effect("payload", None))
    assert not _beaten_at_home(whole, {0: home, 2: whole})

"""More usual effects begun where a less usual one led, and axes that judge their own effects."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening import search_round
from axisight.gap.screening.restart_look_alike import begun_where_it_ended
from axisight.gap.screening.search_round import SearchRound
from axisight.gap.search.search import _beaten_at_home, _rival_leads
from gap_data import PLAN, bare_axis, logs_of, scattered

WIDTH = 2.1e-4
PLAY = Hypothesis(Effect("backlash", 1, {"half_width_rad": 0.0}), ("half_width_rad",))
CUBE = Hypothesis(Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 0.0}), ("cubic_nm_rad3",))
ELSEWHERE = Hypothesis(Effect("backlash", 2, {"half_width_rad": 0.0}), ("half_width_rad",))
SOFT = Effect("lost_motion", 1, {"softness": 0.98, "half_width_rad": WIDTH, "rounding": 0.02})
KNEE = Effect("piecewise_stiffness", 1, {"step": 1.0, "within": -0.95, "knee_rad": WIDTH})


def led_by(effect: Effect):
    values = {"axis1.stiffness": 1.7e6}
    return SimpleNamespace(fitted=SimpleNamespace(effects=(effect,), robot_values=values))


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


def stood(effect: Effect, score: float, probability: float) -> RankedHypothesis:
    fitted = SimpleNamespace(effects=(effect,))
    trial = SimpleNamespace(label=effect.label, fitted=fitted)
    return RankedHypothesis(trial, score, 1.0, 9.0, probability)


FOUND = Effect("backlash", 1, {"half_width_rad": WIDTH})


@pytest.mark.parametrize("leader", [SOFT, KNEE], ids=lambda e: e.name)
def test_a_gear_whose_middle_has_lost_its_stiffness_has_play(leader: Effect):
    """Whatever formula does better; with the probability of the two exchanged."""
    led = AxisPosterior(0, (stood(leader, 0.99, 0.9), stood(FOUND, 0.85, 0.02)), 0.05, 0.03)
    found = led.play_first()
    assert [(r.trial.label, r.probability) for r in found.ranked] == [
        ("backlash@1", 0.9),
        (leader.label, 0.02),
    ]
    assert (found.p_none, found.p_unknown) == (0.05, 0.03)


def test_it_has_none_where_play_does_not_explain_it_or_the_middle_carries():
    far = AxisPosterior(0, (stood(SOFT, 0.99, 0.9), stood(FOUND, 0.75, 0.02)), 0.05, 0.03)
    assert far.play_first() is far
    carries = SOFT.with_values({"softness": 0.9})
    soft = AxisPosterior(0, (stood(carries, 0.99, 0.9), stood(FOUND, 0.98, 0.02)), 0.05, 0.03)
    assert soft.play_first() is soft
    friction = Effect("coulomb_friction", 1)
    other = AxisPosterior(0, (stood(friction, 0.99, 0.9), stood(FOUND, 0.98, 0.02)), 0.05, 0.03)
    assert other.play_first() is other


def standing(axis: int, effect: Effect):
    trial = SimpleNamespace(hypothesis=SimpleNamespace(effect=effect))
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


def none_usual(axis: int):
    return SimpleNamespace(effect=Effect("viscous_friction", axis))


WITHIN = SimpleNamespace(effects=(none_usual(1).effect,), ended_at_bound=())
# A cube of axis 3, a play of axis 1 that feels it, and friction of axis 2 that does not.
TRIED = [
    SimpleNamespace(label=label, hypothesis=none_usual(int(label[-1])), cost=2.0, fitted=WITHIN)
    for label in ("cube@3", "play@1", "friction@2")
]
FALLS = np.array([[30.0, 1.0, 90.0], [60.0, 1.0, 5.0], [0.1, 9.0, 0.1]])
LED = {0: "play@1", 1: "friction@2", 2: "cube@3"}


def led(axis: int, score: float = 0.99, rivals: tuple = ()):
    trial = next(t for t in TRIED if t.label == LED[axis])
    best = SimpleNamespace(trial=trial, gain=1.0, score=score)
    return SimpleNamespace(axis=axis, best=best, ranked=(best, *rivals))


def test_what_feels_the_first_waits_for_the_next_round(monkeypatch):
    monkeypatch.setattr(search_round, "falls", lambda *_: FALLS)
    field = SimpleNamespace(current=None, layout=None)
    field.first = partial(SearchRound.first, field)
    assert field.first([], TRIED) == ""
    assert field.first([led(0), led(1), led(2)], TRIED) == "cube@3"
    kept = SearchRound._not_coupled(field, [led(0), led(1), led(2)], TRIED)
    assert [s.axis for s in kept] == [1, 2]
    # One of axis 1 that gains most, on axis 3: its rival at home is judged now.
    monkeypatch.setitem(vars(TRIED[0].hypothesis), "effect", Effect("viscous_friction", 1))
    kept = SearchRound._not_coupled(field, [led(0), led(1), led(2)], TRIED)
    assert [s.axis for s in kept] == [0, 1, 2]


def test_a_round_without_candidates_refines_nothing():
    """Logs of one speed may leave no effect to try; a diagnosis of such logs must not break off."""
    assert SearchRound._not_coupled(SimpleNamespace(current=None, layout=None), [], []) == []


def test_a_clear_leader_is_refined_where_one_of_its_axis_leads_elsewhere(monkeypatch):
    elsewhere = led(2)
    monkeypatch.setitem(vars(TRIED[0].hypothesis), "effect", Effect("viscous_friction", 1))
    assert refined_next(monkeypatch, rival_of(0.5, 2.0)) == []
    assert "play@1" in refined_next(monkeypatch, rival_of(0.5, 2.0), others=(elsewhere,))


def rival_of(score: float, cost: float):
    effect = Effect("backlash", 1)
    candidate = SimpleNamespace(effect=effect)
    trial = SimpleNamespace(label=effect.label, hypothesis=candidate, cost=cost)
    return SimpleNamespace(score=score, trial=trial)


def refined_next(
    monkeypatch, rival, begun: set | None = None, *, mends: bool = False, others: tuple = ()
) -> list[str]:
    standing = led(0, rivals=(rival,))
    monkeypatch.setattr(search_round, "clear", lambda _: True)
    field = SimpleNamespace(
        standings=lambda _: [standing, *others],
        layout=SimpleNamespace(samples=lambda: np.ones(3)),
        least=np.zeros(3),
        mends=lambda _: mends,
        settings=Settings(),
        usual=begun or set(),
        done=set(),
        waiting=[],
    )
    todo = SearchRound._worth_refining(field, TRIED, set(), even_felt=True)
    return [t.label for t in todo]


@pytest.mark.parametrize("begun", [set(), {"backlash@1"}])
def test_what_began_where_a_clear_leader_ended_is_refined(monkeypatch, begun: set):
    """A leader that is clear needs no better fit itself, but not while it may be another at its limits."""
    assert refined_next(monkeypatch, rival_of(0.89, cost=2.0), begun) == sorted(begun)


def test_what_does_as_well_with_less_is_refined(monkeypatch):
    """Two per cent are the error of sensitivities that are not its own, or of a formula."""
    assert refined_next(monkeypatch, rival_of(0.98, cost=1.0)) == ["backlash@1"]
    assert refined_next(monkeypatch, rival_of(0.98, cost=2.0)) == []
    assert refined_next(monkeypatch, rival_of(0.96, cost=1.0)) == []


def test_what_mends_a_formula_is_not_refined(monkeypatch):
    assert refined_next(monkeypatch, rival_of(0.98, cost=1.0), mends=True) == []


def test_a_heavier_link_is_not_an_eccentric_encoder():
    """Over a short way the encoder's wave is a slope, and does as well with one number more."""
    robot = bare_axis()
    machine = scattered(robot, 4)
    load = Effect("payload", None, {"mass_kg": 200.0, "x_m": 1.0})
    wanted = robot.parameters()["axis1.inertia_scale"]
    logs = logs_of(machine, [load], PLAN, seconds=4.0)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    (cause,) = found.causes
    assert cause.label == "link_inertia@1"
    # The link turns about the axis of the joint: 1130 kg m^2, and 200 kg at one metre more.
    heavier = 200.0 / (1130.0 * wanted)
    assert cause.parameters["relative_change"].value == pytest.approx(heavier, rel=0.05)


@pytest.mark.parametrize("damped", [0.0, 1.0])
def test_play_is_found_whatever_damps_in_its_gap(damped: float):
    """Engines damp the whole way or in contact only; a soft middle imitates the one or the other."""
    robot = bare_axis()
    play = Effect("backlash", 1, {"half_width_rad": 4e-4, "damped": damped})
    logs = logs_of(scattered(robot, 6), [play], PLAN, seconds=4.0)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    (cause,) = found.causes
    assert (found.verdict, cause.label) == ("explained", "backlash@1")
    assert cause.parameters["half_width_rad"].value == pytest.approx(4e-4, rel=0.03)


@pytest.mark.parametrize(
    ("unknown", "removed", "leads"),
    [(0.01, 0.0, True), (0.9, 0.0, False), (0.01, 1e4, True), (0.01, 3e4, False)],
)
def test_a_rival_leads_no_axis_for_next_to_nothing(unknown: float, removed: float, leads: bool):
    """What takes next to nothing away of another axis says nothing of the cause: less than something unknown does,
    or than the formula of a cause of that axis may leave, a fiftieth of what it ``removed``: 600 against 470.
    """
    viscous, sag = Effect("viscous_friction", 2), Effect("power_supply_sag", 2)

    def ranked(effect: Effect, p: float):
        held_out = np.zeros(2)
        trial = SimpleNamespace(
            hypothesis=Hypothesis(effect, ()), label=effect.label, held_out=held_out
        )
        return SimpleNamespace(trial=trial, probability=p)

    def standing(axis: int, entries, p_unknown: float):
        return SimpleNamespace(
            axis=axis, ranked=tuple(entries), best=entries[0], p_none=0.0, p_unknown=p_unknown
        )

    one, other = ranked(viscous, 0.97), ranked(sag, 0.02)
    led = standing(1, [one, other], 0.0)
    there = standing(0, [SimpleNamespace(trial=other.trial, probability=0.1)], unknown)
    fall = np.array([[-400.0, 8e5], [70.0, 3e5]])
    place = {viscous.label: 0, sag.label: 1}
    state = SimpleNamespace(
        layout=SimpleNamespace(significance=lambda *_: 9.0),
        removed=lambda: np.array([removed, 0.0]),
    )
    assert _rival_leads(led, there, fall, place, state, Settings()) == leads

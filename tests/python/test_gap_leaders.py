"""Which leaders of a round are fitted again before one of them is believed."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.effects import effect_info
from axisight.gap import trials
from axisight.gap.trials import Trials

LOAD, MASS = Effect("payload", None), Effect("link_mass", 3)


def ranked(effect: Effect, score: float, cost: float = 1.0, promise: float = 0.0):
    """A candidate as it stands; ``promise``: share of its loss that a step would still gain."""
    trial = SimpleNamespace(
        label=effect.label,
        candidate=SimpleNamespace(effect=effect),
        cost=cost,
        evidence=SimpleNamespace(total=100.0, promise=100.0 * promise),
    )
    family = effect_info(effect.name).family
    return SimpleNamespace(trial=trial, score=score, gain=1.0, probability=0.98, family=family)


def standing(axis: int, *rivals):
    return SimpleNamespace(
        axis=axis,
        best=rivals[0],
        ranked=rivals,
        p_unknown=0.0,
        inseparable=lambda: rivals[:1],
    )


@pytest.fixture(autouse=True)
def promised(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(trials, "linear_gain", lambda evidence: evidence.promise)


@pytest.mark.parametrize(
    ("rival", "clear"),
    [
        (ranked(MASS, 0.93, cost=1, promise=0.15), False),
        (ranked(MASS, 0.93, cost=1, promise=1e-4), True),
        (ranked(MASS, 0.93, cost=5, promise=0.15), True),
        (ranked(MASS, 0.5, cost=1, promise=0.15), True),
    ],
    ids=["may catch up", "has settled", "needs more numbers", "is far behind"],
)
def test_a_leader_is_clear_of_what_cannot_catch_up(rival, clear: bool):
    assert trials._clear(standing(0, ranked(LOAD, 1.0, cost=4), rival)) == clear


@pytest.mark.parametrize(("promise", "clear"), [(0.15, False), (1e-4, True)])
def test_a_lag_is_clear_of_no_other_that_has_not_settled(promise: float, clear: bool):
    """They are held against one another by little."""
    delay = ranked(Effect("input_delay", 1), 0.999)
    loop = ranked(Effect("current_loop", 1), 0.998, cost=2, promise=promise)
    assert trials._clear(standing(0, delay, loop)) == clear


def test_what_is_more_usual_than_a_clear_leader_is_refined():
    """An inertia with sensitivities of another simulator left half; a mode beyond the band led."""
    mode, inertia = Effect("extra_mode", 1), Effect("link_inertia", 1)
    field = SimpleNamespace(
        layout=SimpleNamespace(samples=lambda: np.ones(3)),
        least=np.zeros(3),
        mends=lambda _: False,
        settings=Settings(),
        usual=set(),
        done=set(),
    )
    for score, refined in ((0.5, ["link_inertia@1"]), (0.2, [])):
        led = standing(0, ranked(mode, 0.995, cost=3), ranked(inertia, score))
        field.standings = lambda _, led=led: [led]
        todo = Trials._worth_refining(field, [], set(), even_felt=True)
        assert [t.label for t in todo] == refined


def test_what_leads_on_its_own_axis_is_refined_beside_its_rivals_elsewhere():
    """A load was refined on the first axis, the heavier link that it imitates on no axis: the load won."""
    mass, load = ranked(MASS, 0.92, promise=0.15), ranked(LOAD, 0.91, cost=4)
    first, third = standing(0, mass, load), standing(2, mass)
    field = SimpleNamespace(
        standings=lambda _: [first, third],
        layout=SimpleNamespace(samples=lambda: np.ones(3)),
        least=np.zeros(3),
        mends=lambda _: False,
        settings=Settings(),
        usual=set(),
        done=set(),
    )
    todo = Trials._worth_refining(field, [], set(), even_felt=True)
    assert [t.label for t in todo] == ["link_mass@3", "payload"]
    # One that leads nowhere on its own axis says little on another.
    field.standings = lambda _: [first]
    first.best, first.ranked = load, (load, mass)
    assert [t.label for t in Trials._worth_refining(field, [], set(), even_felt=True)] == [
        "payload"
    ]

"""Which leaders of a round are fitted again before one of them is believed."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking import clear_lead
from axisight.gap.screening import search_round
from axisight.gap.screening.search_round import SearchRound

LOAD, MASS = Effect("payload", None), Effect("link_mass", 3)


def ranked(effect: Effect, score: float, cost: float = 1.0, promise: float = 0.0, ended=()):
    """A candidate as it stands; ``promise``: share of its loss that a step would still gain."""
    trial = SimpleNamespace(
        label=effect.label,
        hypothesis=SimpleNamespace(effect=effect),
        cost=cost,
        fitted=SimpleNamespace(
            total=100.0, promise=100.0 * promise, effects=(effect,), ended_at_bound=ended
        ),
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


def field_of(*standings, waiting=()):
    """A round in which candidates stand so, nothing is refined yet, and some wait."""
    return SimpleNamespace(
        standings=lambda _: list(standings),
        layout=SimpleNamespace(samples=lambda: np.ones(3)),
        least=np.zeros(3),
        mends=lambda _: False,
        settings=Settings(),
        usual=set(),
        done=set(),
        waiting=list(waiting),
    )


@pytest.fixture(autouse=True)
def promised(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(clear_lead, "linear_gain", lambda fitted: fitted.promise)


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
    assert clear_lead.clear(standing(0, ranked(LOAD, 1.0, cost=4), rival)) == clear


@pytest.mark.parametrize(("promise", "clear"), [(0.15, False), (1e-4, True)])
def test_a_lag_is_clear_of_no_other_that_has_not_settled(promise: float, clear: bool):
    """They are held against one another by little."""
    delay = ranked(Effect("input_delay", 1), 0.999)
    loop = ranked(Effect("current_loop", 1), 0.998, cost=2, promise=promise)
    assert clear_lead.clear(standing(0, delay, loop)) == clear


def test_what_is_more_usual_than_a_clear_leader_is_refined():
    """An inertia with sensitivities of another simulator left half; a mode beyond the band led."""
    mode, inertia = Effect("extra_mode", 1), Effect("link_inertia", 1)
    field = field_of()
    for score, refined in ((0.5, ["link_inertia@1"]), (0.2, [])):
        led = standing(0, ranked(mode, 0.995, cost=3), ranked(inertia, score))
        field.standings = lambda _, led=led: [led]
        todo = SearchRound._worth_refining(field, [], set(), even_felt=True)
        assert [t.label for t in todo] == refined
    # At its limits the mode is an inertia, whose own fit may have begun far off.
    at_its_limit = ranked(mode, 0.995, cost=3, ended=((0, "frequency_hz"),))
    field.standings = lambda _: [standing(0, at_its_limit, ranked(inertia, 0.02))]
    todo = SearchRound._worth_refining(field, [], set(), even_felt=True)
    assert [t.label for t in todo] == ["link_inertia@1"]


def test_what_leads_on_its_own_axis_is_refined_beside_its_rivals_elsewhere():
    """A load was refined on the first axis, the heavier link that it imitates on no axis: the load won."""
    mass, load = ranked(MASS, 0.92, promise=0.15), ranked(LOAD, 0.91, cost=4)
    first, third = standing(0, mass, load), standing(2, mass)
    field = field_of(first, third)
    todo = SearchRound._worth_refining(field, [], set(), even_felt=True)
    assert [t.label for t in todo] == ["link_mass@3", "payload"]
    # One that leads nowhere on its own axis says little on another.
    field.standings = lambda _: [first]
    first.best, first.ranked = load, (load, mass)
    assert [t.label for t in SearchRound._worth_refining(field, [], set(), even_felt=True)] == [
        "payload"
    ]


def test_what_leads_where_candidates_wait_is_not_refined():
    """It has had no rivals there: a soft base was refined on axes where a spring of axis 3 was felt."""
    base = ranked(Effect("base_compliance", None), 0.9, cost=3)
    field = field_of(
        standing(0, base),
        waiting=[SimpleNamespace(option=SimpleNamespace(effect=Effect("backlash", 1)))],
    )
    assert SearchRound._worth_refining(field, [], {0}, even_felt=True) == []
    field.waiting = []
    assert SearchRound._worth_refining(field, [], {0}, even_felt=True) == [base.trial]


@pytest.mark.parametrize(
    ("effect", "promise", "waits"),
    [(LOAD, 80.0, False), (LOAD, 40.0, True), (MASS, 80.0, True), (MASS, 95.0, False)],
)
def test_what_a_cause_elsewhere_explains_waits_unless_it_promises_as_much(
    monkeypatch: pytest.MonkeyPatch, effect: Effect, promise: float, waits: bool
):
    """Of a load one step knows the mass alone: it is tried where it promises half as much as a link."""

    def start(effect: Effect, gain: float):
        return SimpleNamespace(option=SimpleNamespace(effect=effect), gain=gain)

    link = start(Effect("link_com", 6), 100.0)
    one = start(effect, promise)
    fitted: list[SimpleNamespace] = []

    def fit(_pool, starts):
        fitted.extend(starts)
        return [SimpleNamespace(hypothesis=SimpleNamespace(effect=x.option.effect)) for x in starts]

    # The link explains all of what is left on the axis where the other one is tried.
    monkeypatch.setattr(search_round, "falls", lambda *_: np.full((1, 6), 10.0))
    field = SimpleNamespace(
        layout=SimpleNamespace(by_axis=lambda x: x, n_axes=6),
        current=np.full(6, 10.0),
        floor=np.zeros(6),
        waiting=[],
        progress=lambda *_: None,
        _turns=lambda _: [(6, [link]), (3, [one])],
        _fitted=fit,
    )
    SearchRound._fitted_by_place(field, None, [link, one], "")
    assert fitted == ([link] if waits else [link, one])
    assert field.waiting == ([one] if waits else [])


LEFT = {"none": [40.0, 60.0], "leader": [10.0, 2.0], "behind": [30.0, 40.0], "near": [30.0, 20.0]}


@pytest.mark.parametrize(("rival", "looked_at"), [("behind", False), ("near", True)])
def test_a_rival_left_far_behind_on_part_of_the_data_is_not_looked_at_on_all(
    monkeypatch: pytest.MonkeyPatch, rival: str, looked_at: bool
):
    """On its own axis, which is what they are held against one another by."""

    def fit_of(name: str):
        return SimpleNamespace(
            loss=np.array(LEFT[name]),
            axis=np.array([0, 1]),
            renewed=False,
            free=[Hypothesis(Effect("joint_damping", 2), ())],
        )

    looked: list[str] = []
    monkeypatch.setattr(search_round, "settled", lambda *_: fit_of(rival))
    monkeypatch.setattr(search_round, "has_settled", lambda _: True)
    monkeypatch.setattr(search_round, "replace", lambda found, renewed: found)
    whole = SimpleNamespace(fit=lambda *_, **__: looked.append(rival) or fit_of(rival))
    field = SimpleNamespace(
        rough=object(),
        model=fit_of("none"),
        screen=SimpleNamespace(model=fit_of("none")),
        fitter=whole,
    )
    field.looked_at = partial(SearchRound.looked_at, field)
    found = SearchRound._comparable(field, fit_of("none"), fit_of("leader"))
    assert (found is not None) == looked_at == bool(looked)
    # A leader is looked at, however little it takes away.
    assert SearchRound._comparable(field, fit_of("none"), None) is not None

"""The search: what waits for the next round, what a cause has to earn, the last fit."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from axisight import Effect, Settings
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.screening import search_round
from axisight.gap.screening.screening import Start
from axisight.gap.screening.search_round import SearchRound
from axisight.gap.search import moves, search
from axisight.gap.search import state as states
from axisight.gap.search.pairs import Pair
from gap_data import linear_evidence


def free(label: str) -> Hypothesis:
    name, _, axis = label.partition("@")
    return Hypothesis(Effect(name, int(axis) if axis else None), ())


class Round(SearchRound):
    """A round on axes with one block each, whose fits have known losses by label."""

    def __init__(self, losses: dict[str, tuple[float, ...]]) -> None:
        n = len(next(iter(losses.values()), (0.0, 0.0)))
        one = np.ones(n, dtype=np.int64)
        self.layout = Layout(np.arange(n), one, one, one)
        self.current, self.floor = np.array([10.0, *[2.0] * (n - 1)]), np.ones(n)
        self.least, self.settings = np.zeros(n), Settings()
        self.losses, self.waiting, self.asked = losses, [], []
        self.progress = lambda *_: None

    def _fitted(self, pool, starts):
        labels = [start.option.effect.label for start in starts]
        self.asked += labels
        return [
            SimpleNamespace(
                label=label, hypothesis=start.option, held_out=np.array(self.losses[label])
            )
            for label, start in zip(labels, starts, strict=True)
        ]

    def fit(self, promises: dict[str, float], falls: tuple[float, float] = (0.5, 0.5)) -> list[str]:
        """Fit candidates with these promises, one of the arm by axis; return the labels of those fitted."""
        starts = [
            Start(free(label), {}, gain, None if "@" in label else np.array(falls))
            for label, gain in promises.items()
        ]
        with ThreadPoolExecutor(1) as pool:
            return [t.label for t in self._fitted_by_place(pool, starts, "fitting")]


PROMISES = {"torque_offset@2": 0.8, "backlash@1": 8.0, "payload": 1.0}


def test_what_one_elsewhere_explains_waits():
    # Play on axis 1 takes three tenths of what is left on axis 2: more than a fifth of any gain there.
    losses = {"backlash@1": (2.0, 1.7), "payload": (10.0, 2.0), "torque_offset@2": (10, 1)}
    round_ = Round(losses)
    # The load comes near the offset, and nowhere near the play: it is no rival of the play's.
    assert round_.fit(PROMISES) == ["backlash@1"]
    assert [s.option.effect.label for s in round_.waiting] == ["torque_offset@2", "payload"]
    # One that does is tried beside it.
    assert Round(losses).fit(PROMISES, (3.0, 0.1)) == ["backlash@1", "payload"]


def test_what_promises_as_much_as_any_does_not_wait():
    # An offset on axis 3 hangs on axis 2 as well: either may be the other's shadow.
    round_ = Round({"torque_offset@1": (1.0, 1.4), "torque_offset@2": (1.0, 1.0)})
    promises = {"torque_offset@1": 8.0, "torque_offset@2": 7.9, "backlash@2": 5.0}
    assert round_.fit(promises) == ["torque_offset@1", "torque_offset@2"]
    assert [s.option.effect.label for s in round_.waiting] == ["backlash@2"]


def test_what_promises_as_much_as_what_explains_it_does_not_wait():
    # A constant on axis 3 hangs on axis 2, too; that play promises far more on axis 1 is nothing to it.
    losses = {
        "backlash@1": (2.0, 2.0, 2.0),
        "torque_offset@2": (10.0, 1.1, 1.1),
        "torque_offset@3": (10.0, 1.0, 1.0),
    }
    promises = {"backlash@1": 8.0, "torque_offset@2": 0.81, "torque_offset@3": 0.8}
    assert set(Round(losses).fit(promises)) == set(losses)
    # What promises less waits.
    round_ = Round(losses)
    round_.fit({**promises, "torque_offset@3": 0.5})
    assert [s.option.effect.label for s in round_.waiting] == ["torque_offset@3"]


def test_what_nothing_elsewhere_explains_is_fitted():
    round_ = Round({"backlash@1": (2.0, 1.9), "payload": (10.0, 2.0), "torque_offset@2": (10, 1)})
    assert set(round_.fit(PROMISES)) == set(PROMISES)
    assert round_.waiting == []
    # The most promising axis comes first.
    assert round_.asked[0] == "backlash@1"


def test_effects_of_the_arm_alone_are_tried():
    round_ = Round({"payload": (10.0, 2.0)})
    assert round_.fit({"payload": 1.0}) == ["payload"]


def test_a_leader_that_cannot_be_simulated_anew_leaves_the_field_to_others(monkeypatch):
    """A stiff law may be fitted along a run of another model and break down by itself."""
    whole = SimpleNamespace(hypothesis=free("gear_hysteresis@1"), label="gear_hysteresis@1")
    whole.fitted = SimpleNamespace(free=())
    other = SimpleNamespace(hypothesis=free("backlash@1"), label="backlash@1")
    other.fitted = SimpleNamespace(free=(1,))

    class Field(Round):
        def _bent_axes(self, trials):
            return set()

        def _leader_before(self, one, trials):
            return None

        def _worth_refining(self, trials, crooked, *, even_felt):
            return [t for t in trials if t.label not in self.done]

        def _with_restarts(self, pool, trials, options):
            return trials

    def settled(fitter, free_, start):
        if start is whole.fitted:
            return Diverged("diverged at sample 5", logs=[0], sample=5)
        return start

    field = Field({})
    field.settings = Settings()
    field.bench = SimpleNamespace(skipped={})
    field.screen = SimpleNamespace(bench=field.bench)
    field.fitter, field.model = SimpleNamespace(work=SimpleNamespace()), None
    field.done = set()
    monkeypatch.setattr(search_round, "settled", settled)
    monkeypatch.setattr(search_round, "trial", lambda candidate, fitted, model: other)
    assert SearchRound.refined(field, [whole, other], [], 1) == [other]
    assert field.bench.skipped == {
        "gear_hysteresis@1": "the simulation failed: diverged at sample 5"
    }


def finished(pull: float) -> list[dict[str, object]]:
    """What a search asks a fitter for at its end, where the slope of its model is ``pull``."""
    asked: list[dict[str, object]] = []

    class Fitter:
        def fit(self, free, start, **options):
            asked.append(options)
            return replace(start, gradient=0 * start.gradient)

    x = np.ones((40, 1))
    model = linear_evidence(x, x[:, 0], np.repeat([0, 1], 20))
    effect = Hypothesis(Effect("payload", None), ("mass_kg",))
    model = replace(model, free=(effect,), effects=(effect.effect,), gradient=model.gradient + pull)
    state = states.SearchState(
        model, model, np.zeros(2), Layout(*[np.zeros(2, int)] * 3, np.ones(2))
    )
    moves.finish(Fitter(), state)
    assert (state.model is model) == (not asked)
    return asked


def test_a_model_short_of_its_best_is_fitted_on():
    # Two blocks of twenty samples and a unit column: a slope s promises (2 s)^2 / 40.
    assert finished(3.0) == []
    (options,) = finished(3.3)
    assert options["worth"] == 1.0


def earns(without, within: bool = False, least: float = 1.0) -> bool:
    """Whether a fit that takes 6 of 10 away earns that; ``without`` is what is left without its effect."""

    def evaluate(free, model, *, robot_values):
        if without is None:
            return Diverged("diverged at sample 5")
        return SimpleNamespace(total=without)

    fitter = SimpleNamespace(evaluate=evaluate, within_tolerance=lambda effect: within)
    one = free("torque_offset@1")
    fitted = SimpleNamespace(free=(one,), effects=(one.effect,), robot_values={}, total=4.0)
    winner = SimpleNamespace(trial=SimpleNamespace(fitted=fitted))
    return search._earns_its_gain(fitter, winner, SimpleNamespace(total=10.0), least)


def test_a_gain_that_stays_without_its_cause_is_not_earned():
    assert earns(without=8.0)
    assert not earns(without=6.0)
    assert not earns(without=8.0, within=True)


def test_what_predicts_better_and_fits_no_better_is_no_cause():
    """Parameters within their tolerances do as much on all logs together; a linear step may be a third of a gain."""
    assert earns(without=8.0, least=19.0)
    assert not earns(without=8.0, least=21.0)


def test_the_floor_falls_only_where_a_judged_axis_has_a_finite_loss(monkeypatch):
    """The second axis is not judged; on the third, the model has no prediction."""
    none = np.zeros(3, int)
    layout = Layout(np.arange(3), none, none, np.ones(3), silent=(1,))
    monkeypatch.setattr(states, "held_out_loss", lambda model: np.array([1.0, 1.0, np.nan]))
    state = states.SearchState(None, None, np.full(3, 4.0), layout, noise=np.ones(3))
    state.refute_floor()
    np.testing.assert_array_equal(state.floor, [1.0, 4.0, 4.0])
    np.testing.assert_array_equal(state.noise, [0.5, 1.0, 1.0])


def test_a_simulation_that_diverges_without_a_cause_needs_it():
    assert earns(without=None)
    assert not earns(without=None, within=True)


def test_each_of_a_pair_is_judged_beside_its_partner():
    """Also where the partner is a part of a composite, which no round has tried by itself."""
    asked = []

    class Bodies:
        def allow(self, one, model):
            asked.append((one, model))
            return True

    members = tuple((SimpleNamespace(trial=name), None) for name in ("friction", "offset"))
    pair = Pair(0, None, 1.0, members, ("with offset", "with friction"))
    assert search._each_allowed(pair, SimpleNamespace(bodies=Bodies(), model="neither"))
    assert asked == [("friction", "with offset"), ("offset", "with friction")]


def test_what_diverges_together_is_told_and_not_tried_again(monkeypatch):
    """Two rounds: the second begins after a cause that the first found by itself."""
    ordinary, cause = (
        (SimpleNamespace(trial=SimpleNamespace(label=label)), SimpleNamespace(axis=0))
        for label in ("coulomb_friction@1", "backlash@1")
    )
    judged = iter([(cause,), ()])
    tried = []

    class Together:
        def __init__(self, *_):
            pass

        def found(self, options):
            tried.append(options)
            return [ordinary]

    class Trials:
        skipped, sensitivities = {}, {}

        def __init__(self, *_):
            pass

        def run(self, *_):
            return []

        def run_waiting(self, *_):
            return []

        def refined(self, *_, **__):
            return []

        def first(self, *_):
            return "backlash@1"

    def take_in(round_, state, taken, progress):
        return Diverged("diverged at sample 5") if ordinary in taken else None

    monkeypatch.setattr(search, "OrdinaryTogether", Together)
    monkeypatch.setattr(search, "SearchRound", Trials)
    monkeypatch.setattr(search, "_judged", lambda *_: ((), next(judged)))
    monkeypatch.setattr(search, "_take_in", take_in)
    monkeypatch.setattr(search, "make", lambda *_: set())
    monkeypatch.setattr(search, "_settled", lambda *_: False)
    x = np.ones((40, 1))
    model = linear_evidence(x, x[:, 0], np.repeat([0, 1], 20))
    layout = Layout(*[np.zeros(2, int)] * 3, np.ones(2))
    state = states.SearchState(model, model, np.zeros(2), layout)
    fitter = SimpleNamespace(work=SimpleNamespace())
    search._add_causes(fitter, lambda _: [], state, Settings(), lambda *_: None)
    assert len(state.rounds) == 2
    assert len(tried) == 1
    assert state.skipped == {"coulomb_friction@1": "the simulation failed: diverged at sample 5"}


def led_by(axis: int, label: str, total: float) -> SimpleNamespace:
    trial = SimpleNamespace(label=label, fitted=SimpleNamespace(total=total))
    return SimpleNamespace(axis=axis, best=SimpleNamespace(trial=trial))


def test_the_leader_that_fits_best_comes_first_whatever_is_left_out():
    # The load predicts axis 2 better without a log; the centre of mass of axis 1 does not act there, and fits better.
    load, link = led_by(1, "payload", 1133.0), led_by(0, "link_com@1", 1121.0)
    fall = np.array([[9000.0, 4000.0], [9010.0, 3500.0]])
    place = {"payload": 0, "link_com@1": 1}
    assert search.best_fit_first([load, link], fall, place) == [link, load]


def test_a_leader_of_two_axes_comes_with_the_axis_where_its_loss_falls_most():
    here, there = led_by(0, "payload", 50.0), led_by(1, "payload", 50.0)
    assert search.best_fit_first([here, there], np.array([[1.0, 8.0]]), {"payload": 0}) == [
        there,
        here,
    ]

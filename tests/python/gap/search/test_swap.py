"""Causes that hold only with a bent simulator, and their rivals."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, load_robot
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.fit.tolerance_edges import BENT, bent
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.revision import weigh_again
from axisight.gap.search.swap import (
    mending,
    nearly_as_good,
    open_rivals,
    straightened,
    weighed_again,
)
from gap_data import StateStub, linear_evidence

ROBOT = load_robot("irb6600_like").with_effects([])
TOLERANCE = {"mass": 0.015, "stiffness": 0.015, "motor_inertia": 0.015}


@dataclass
class Model:
    """As much of a fitted model as swaps look at."""

    free: list
    total: float
    off: float
    """Relative change of the first parameters of the simulator."""
    first: int | None = None
    """So many of them; all by default."""
    renewed: bool = True
    converged: bool = True
    fresh: bool = False
    status: str = "loss_converged"
    ended_at_bound: tuple = ()
    robot_values: dict = field(init=False)

    def __post_init__(self):
        known = ROBOT.parameters()
        names = [n for n in known if n.rsplit(".", 1)[1] in TOLERANCE]
        self.robot_values = {n: known[n] for n in names}
        self.robot_values |= {n: (1 + self.off) * known[n] for n in names[: self.first]}


@dataclass
class Free:
    """A free effect."""

    effect: Effect


@dataclass
class Fitter:
    """Fits by table: labels of the effects to what the model is then."""

    known: dict
    robot = ROBOT
    tolerances = TOLERANCE
    adds_up: bool = False

    def fit(self, free, _start, **_options):
        total, off = self.known[tuple(sorted(f.effect.label for f in free))]
        return Model(list(free), total, off)


MASS = Free(Effect("link_mass", 3, {"relative_change": 0.2}))
LOAD = Free(Effect("payload", None, {"mass_kg": 100.0}))
OFFSET = Free(Effect("torque_offset", 3, {"offset_nm": 3.0}))


def ranked(free, score, probability):
    trial = FittedHypothesis(free, Model([free], 1e5, 0.0), np.zeros(1))
    return RankedHypothesis(trial, score, 1.0, 10.0, probability)


def standing(offset_score=0.999):
    first, second = ranked(MASS, 0.999, 0.9), ranked(LOAD, 0.998, 0.05)
    third = ranked(OFFSET, offset_score, 0.04)
    return AxisPosterior(2, (first, second, third), 0.0, 0.01)


def swap(known, offset_score=0.999):
    at = standing(offset_score)
    return straightened(Fitter(known), Model([MASS], 300.0, 0.1), [(at.ranked[0], (at,))])


def test_the_rival_that_leaves_less_with_a_straight_simulator_takes_the_place():
    model, gone, (rival, at) = swap(
        {("payload",): (30.0, 0.001), ("torque_offset@3",): (40.0, 0.0)}
    )
    assert gone.trial.label == "link_mass@3"
    assert rival.trial.label == "payload" == at.best.trial.label
    assert model.total == 30.0
    # What the cause had is shared by the others: 0.05 of 0.1.
    assert rival.probability == pytest.approx(0.5)


def test_a_rival_that_bends_the_simulator_too_does_not():
    assert swap({("payload",): (30.0, 0.1), ("torque_offset@3",): (310.0, 0.0)}) is None


def test_one_that_explains_less_is_no_rival():
    known = {("payload",): (310.0, 0.0)}
    # The offset is not fitted at all: the table does not have it.
    assert swap(known, offset_score=0.9) is None


@pytest.mark.parametrize(
    ("total", "off", "probability", "swapped"),
    [
        (290.0, 0.0, 0.3, True),
        (297.0, 0.0, 0.3, False),
        (290.0, 0.1, 0.3, False),
        (290.0, 0.0, 0.03, False),
    ],
)
def test_one_parameter_at_the_edge_decides_between_what_could_not_be_told_apart(
    total: float, off: float, probability: float, swapped: bool
):
    """A rival takes the place that leaves clearly less, with none there, and was open as the cause came in."""
    first, second = ranked(MASS, 0.999, 0.7), ranked(LOAD, 0.998, probability)
    entered = AxisPosterior(2, (first, second), 0.0, 0.01)
    model = Model([MASS], 300.0, 0.1, first=1)
    found = straightened(Fitter({("payload",): (total, off)}), model, [(first, (entered,))])
    assert (found is not None) is swapped
    if found is not None:
        # What it takes the place of is its rival still: neither was clear.
        odds = [(r.trial.label, r.probability) for r in found[2][1].ranked]
        assert odds == [("payload", 0.7), ("link_mass@3", probability)]
        assert found[2][0] is found[2][1].best


def test_bent_is_a_share_of_parameters_three_tolerances_off():
    fitter = Fitter({})
    straight, crooked = Model([], 1.0, 2.9 * 0.015), Model([], 1.0, 3.1 * 0.015)
    assert bent(fitter, straight) == 0.0
    assert bent(fitter, crooked) == 1.0 > BENT
    # Where errors add up it says nothing.
    assert bent(Fitter({}, adds_up=True), crooked) == 0.0


# Rivals weighed again.


class Weighed:
    """Fits whose held-out losses are known by the labels of their effects."""

    adds_up = False

    def __init__(self, losses):
        self.losses, self.asked = losses, []

    def fit(self, free, start, **_options):
        labels = tuple(sorted(f.effect.label for f in free))
        self.asked.append(labels)
        if self.losses[labels] is None:
            return Diverged("it cannot be simulated")
        return self.of(free)

    def of(self, free):
        labels = tuple(sorted(f.effect.label for f in free))
        loss = np.full(8, (self.losses[labels] or 0.0) / 8)
        found = replace(
            linear_evidence(np.ones((8, 1)), np.zeros(8), np.repeat([0, 1], 4), block=1),
            loss=loss,
            gradient=np.zeros((8, 1)),
            effects=tuple(f.effect for f in free),
            free=tuple(free),
        )
        return found


SOFT = Hypothesis(
    Effect("piecewise_stiffness", 1, {"knee_rad": 1e-4}), ("step", "within", "knee_rad")
)
PLAY = Hypothesis(Effect("backlash", 1, {"half_width_rad": 1e-4}), ("half_width_rad",))
CUBIC = Hypothesis(Effect("nonlinear_stiffness", 3, {"cubic_nm_rad3": 1e11}), ("cubic_nm_rad3",))
LAYOUT = Layout(np.zeros(8, int), np.arange(8), np.repeat([0, 1], 4), np.full(8, 100))


def again(losses, rival_score=0.93):
    fitter = Weighed({("nonlinear_stiffness@3",): 8000.0, **losses})
    model = fitter.of([SOFT, CUBIC])
    trials = [FittedHypothesis(f, fitter.of([CUBIC, f]), np.zeros(8)) for f in (SOFT, PLAY)]
    entered = AxisPosterior(
        0,
        (
            RankedHypothesis(trials[0], 0.95, 1.0, 9.0, 0.86),
            RankedHypothesis(trials[1], rival_score, 1.0, 9.0, 0.14),
        ),
        0.0,
        0.0,
    )
    rivals = nearly_as_good(model, entered.best, entered)
    found = weighed_again(
        fitter, model, entered.best, entered, np.full(8, 100.0), LAYOUT, 0.6, rivals
    )
    return found, fitter.asked


BOTH = ("nonlinear_stiffness@3", "piecewise_stiffness@1")
WITH_PLAY = ("backlash@1", "nonlinear_stiffness@3")


def test_a_rival_that_is_likelier_beside_the_true_cause_takes_its_place():
    found, _ = again({BOTH: 900.0, WITH_PLAY: 820.0})
    assert found is not None
    model, (ranked_, standing_) = found
    assert {f.effect.label for f in model.free} == set(WITH_PLAY)
    assert ranked_.trial.label == "backlash@1"
    assert ranked_ is standing_.best


def test_a_cause_stays_where_its_rivals_are_no_likelier():
    # Less by what formulas differ by, with fewer numbers: that would do; much more does not.
    assert again({BOTH: 820.0, WITH_PLAY: 1500.0})[0] is None
    # One that explained little is not tried, one that cannot be simulated is none.
    found, asked = again({BOTH: 900.0, WITH_PLAY: 820.0}, rival_score=0.5)
    assert found is None and asked == []
    assert again({BOTH: 900.0, WITH_PLAY: None}, 0.93)[0] is None


def standing_of(effect: Effect, axis: int = 0) -> AxisPosterior:
    one = FittedHypothesis(Hypothesis(effect, ()), Weighed({(): 800.0}).of([]), np.zeros(8))
    return AxisPosterior(axis, (RankedHypothesis(one, 0.9, 1.0, 9.0, 1.0),), 0.0, 0.0)


def test_another_law_of_the_same_dry_friction_or_gear_mends_a_cause():
    """The first law may have come in by a better fit: what mends it is judged in its place."""
    dry = standing_of(Effect("coulomb_friction", 1, {"coulomb_nm": 0.5})).best
    waves = Effect("position_dependent_friction", 1, {"cosine_nm": 0.3})
    assert [r.trial.label for r in mending(dry, [standing_of(waves)])] == [waves.label]
    # Elsewhere, of another axis, of something else, and the same again: no.
    others = [
        standing_of(waves, 1),
        standing_of(Effect("position_dependent_friction", 2, {"cosine_nm": 0.3})),
        standing_of(Effect("viscous_friction", 1, {"viscous_nm_s_rad": 0.2})),
        standing_of(Effect("coulomb_friction", 1, {"coulomb_nm": 0.2})),
    ]
    assert mending(dry, others) == []


def test_rivals_that_stood_beside_a_cause_are_judged_again_once_others_are_in():
    """The likeliest on any axis that it led; not those that are in themselves, nor where another one led."""

    def at(axis: int, *shares: tuple[Hypothesis, float]) -> AxisPosterior:
        return AxisPosterior(axis, tuple(ranked(f, 0.9, p) for f, p in shares), 0.0, 0.0)

    first = at(0, (SOFT, 0.5), (CUBIC, 0.3), (PLAY, 0.2))
    second = at(1, (SOFT, 0.5), (PLAY, 0.4), (CUBIC, 0.1))
    elsewhere = at(2, (OFFSET, 0.6), (MASS, 0.4))
    entered = (first, second, elsewhere)

    def labels(final: set[str]) -> list[str]:
        return [r.trial.label for r in open_rivals(first.best, entered, final)]

    assert labels({"piecewise_stiffness@1", "torque_offset@3"}) == [
        "backlash@1",
        "nonlinear_stiffness@3",
    ]
    assert labels({"piecewise_stiffness@1", "backlash@1"}) == ["nonlinear_stiffness@3"]


@pytest.mark.parametrize(
    ("beside_none", "mends", "after", "swapped"),
    [
        (True, False, -2.0, True),
        (True, False, 30.0, True),
        (False, True, 9.0, False),
        (False, True, 4.0, True),
        (False, False, 9.0, True),
        (False, False, 11.0, False),
    ],
)
def test_only_a_law_that_mends_has_to_halve_what_is_left(
    beside_none: bool, mends: bool, after: float, swapped: bool, monkeypatch: pytest.MonkeyPatch
):
    """What came in beside a cause that was none is judged by likelihood alone, at the floor or below it too.

    What was a rival before others came in has to leave less.
    """
    before = -1.0 if beside_none else 10.0
    sides = [SOFT, CUBIC] if beside_none else [SOFT]
    cause = SimpleNamespace(trial=SimpleNamespace(fitted=SimpleNamespace(free=sides)))
    standing = SimpleNamespace(axis=0)
    new = SimpleNamespace(name="new")
    state = StateStub(
        model=SimpleNamespace(free=[SOFT, PLAY]),
        standings_of=lambda _cause: (),
        rounds=[SimpleNamespace(standings=())],
        accepted=[(cause, standing)],
        floor=np.zeros(1),
        layout=None,
        left=lambda: np.array([before]),
        left_by=lambda _model: np.array([after]),
    )
    monkeypatch.setattr("axisight.gap.search.revision.mending", lambda *_: [cause] if mends else [])
    for name in ("open_rivals", "nearly_as_good"):
        monkeypatch.setattr(f"axisight.gap.search.revision.{name}", lambda *_: [])
    monkeypatch.setattr("axisight.gap.search.revision.drop_idle", lambda *_: set())
    monkeypatch.setattr(
        "axisight.gap.search.revision.weighed_again", lambda *_: (new, (cause, standing))
    )
    weigh_again(None, state, SimpleNamespace(explained_share=0.6))
    assert (state.model is new) is swapped

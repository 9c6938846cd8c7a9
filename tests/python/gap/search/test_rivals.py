"""Which rivals are tried in the place of a cause: those that what came in since may have hidden."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search import rivals
from axisight.gap.search.rivals import exchanged, mending, open_rivals


def of(name: str, axis: int | None, **values: float) -> Hypothesis:
    return Hypothesis(Effect(name, axis, values), tuple(values))


SOFT = of("piecewise_stiffness", 1, knee_rad=1e-4)
PLAY = of("backlash", 1, half_width_rad=1e-4)
CUBIC = of("nonlinear_stiffness", 3, cubic_nm_rad3=1e11)
OFFSET = of("torque_offset", 3, offset_nm=3.0)
MASS = of("link_mass", 3, relative_change=0.2)


def ranked(
    one: Hypothesis, probability: float, beside: tuple[Hypothesis, ...] = (), score: float = 0.9
) -> RankedHypothesis:
    fitted = SimpleNamespace(free=(*beside, one))
    return RankedHypothesis(
        FittedHypothesis(one, fitted, np.zeros(1)), score, 1.0, 9.0, probability
    )


def standing_of(effect: Effect, axis: int = 0) -> AxisPosterior:
    return AxisPosterior(axis, (ranked(Hypothesis(effect, ()), 1.0),), 0.0, 0.0)


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


def test_rivals_that_stood_beside_a_cause_are_the_likeliest_on_any_axis_that_it_led():
    def at(axis: int, *shares: tuple[Hypothesis, float]) -> AxisPosterior:
        return AxisPosterior(axis, tuple(ranked(f, p) for f, p in shares), 0.0, 0.0)

    first = at(0, (SOFT, 0.5), (CUBIC, 0.3), (PLAY, 0.2))
    second = at(1, (SOFT, 0.5), (PLAY, 0.4), (CUBIC, 0.1))
    elsewhere = at(2, (OFFSET, 0.6), (MASS, 0.4))
    found = open_rivals(first.best, (first, second, elsewhere))
    assert [r.trial.label for r in found] == ["backlash@1", "nonlinear_stiffness@3"]


def leaving(above: float) -> dict[str, object]:
    """Parts of a state whose model leaves so much above noise of one on its only axis."""
    layout = SimpleNamespace(by_axis=np.asarray)
    return {"left": lambda: np.array([above]), "floor": np.array([1.0]), "layout": layout}


@pytest.mark.parametrize(
    ("beside", "final", "crooked", "left", "tried"),
    [
        # Judged beside what is in the model still, and nothing else came in.
        ((), (SOFT,), False, 0.9, []),
        # The simulator is bent now.
        ((), (SOFT,), True, 0.9, ["backlash@1"]),
        # It leaves as much again as noise does: those that explained nearly as much, likely or not.
        ((), (SOFT,), False, 1.1, ["backlash@1", "torque_offset@1"]),
        # Another cause came in since.
        ((), (SOFT, CUBIC), False, 0.9, ["backlash@1"]),
        # What it was judged beside went out: again those that explained nearly as much.
        ((CUBIC,), (SOFT,), False, 0.9, ["backlash@1", "torque_offset@1"]),
        # A rival that is in the model itself is none.
        ((), (SOFT, PLAY), False, 0.9, []),
    ],
)
def test_a_cause_is_judged_anew_where_it_stands_otherwise_now(
    beside: tuple[Hypothesis, ...],
    final: tuple[Hypothesis, ...],
    crooked: bool,
    left: float,
    tried: list[str],
    monkeypatch: pytest.MonkeyPatch,
):
    little, none = (
        of("torque_offset", 1, offset_nm=1.0),
        of("torque_constant", 1, relative_error=0.1),
    )
    standing = AxisPosterior(
        0,
        (
            ranked(SOFT, 0.7, beside),
            ranked(PLAY, 0.25),
            ranked(little, 0.04, score=0.8),
            ranked(none, 0.01, score=0.5),
        ),
        0.0,
        0.0,
    )
    state = SimpleNamespace(
        model=SimpleNamespace(free=final),
        accepted=[(standing.best, standing)],
        standings_of=lambda _: (standing,),
        **leaving(left),
    )
    monkeypatch.setattr(rivals, "bent", lambda *_: float(crooked))
    proposals = list(exchanged(SimpleNamespace(fitter=None, state=state, last=())))
    assert [a.hypothesis.effect.label for p in proposals for a in p.instead] == tried
    assert all(p.gone == (SOFT,) and p.axis == 0 for p in proposals)


def test_a_law_that_mends_is_proposed_whatever_rounds_moves_have_added(
    monkeypatch: pytest.MonkeyPatch,
):
    """How the last round of the search stood counts, for every axis."""
    dry = of("coulomb_friction", 1, coulomb_nm=0.5)
    waves = standing_of(Effect("position_dependent_friction", 1, {"cosine_nm": 0.3}))
    standing = AxisPosterior(0, (ranked(dry, 1.0),), 0.0, 0.0)
    state = SimpleNamespace(
        model=SimpleNamespace(free=(dry,)),
        accepted=[(standing.best, standing)],
        rounds=[SimpleNamespace(standings=(standing,))],
        standings_of=lambda _: (standing,),
        **leaving(0.5),
    )
    monkeypatch.setattr(rivals, "bent", lambda *_: 0.0)
    (found,) = exchanged(SimpleNamespace(fitter=None, state=state, last=(waves,)))
    assert [a.hypothesis.effect.name for a in found.instead] == ["position_dependent_friction"]
    # Alone it is fitted on from where its trial ended.
    assert found.instead[0].start is waves.best.trial.fitted

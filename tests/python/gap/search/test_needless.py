"""Which causes are put in question: those that the others make needless, and those that came in as doubtful."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.fitting.divergence import Diverged
from axisight.gap.facts.trace import Step
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.search import needless as module
from axisight.gap.search.contest import Context
from axisight.gap.search.needless import doubtful, needless
from gap_data import linear_evidence

COLUMNS = {"viscous_friction": 0, "torque_offset": 1, "quadratic_drag": 2}


class Fits:
    """Least squares of y on the columns of effects; without ``needed`` no simulation ends."""

    def __init__(self, needed: str | None) -> None:
        rng = np.random.default_rng(1)
        self.x, self.needed = rng.standard_normal((400, 3)), needed
        # The last one explains nothing.
        self.y = self.x @ [3.0, 2.0, 0.0] + rng.standard_normal(400)

    def evaluate(self, free, start, *, robot_values):
        del start, robot_values
        names = [f.effect.name for f in free]
        if self.needed is not None and self.needed not in names:
            return Diverged("diverged at sample 7")
        columns = self.x[:, [COLUMNS[name] for name in names]]
        found = linear_evidence(columns, self.y, np.zeros(400, int))
        return SimpleNamespace(**vars(found) | {"free": free, "total": float(found.loss.sum())})


def in_question(fitter: object, model: object, samples: Sequence[float]) -> list[str]:
    counted = np.array(samples)
    state = SimpleNamespace(
        model=model, counted=lambda axis: counted.min() if axis is None else counted[axis]
    )
    here = Context(fitter, state, Settings(smallest_gain=0.01))  # type: ignore[arg-type]
    proposals = list(needless(here))
    assert all(p.or_none == "needless" and p.instead == () for p in proposals)
    return [f.effect.label for p in proposals for f in p.gone]


@pytest.mark.parametrize(
    ("needed", "asked"), [(None, ["quadratic_drag@1"]), ("quadratic_drag", [])]
)
def test_a_cause_that_takes_away_too_little_is_in_question_unless_a_loop_swings_without_it(
    needed, asked, monkeypatch
):
    fits = Fits(needed)
    free = [Hypothesis(Effect(name, 1), ("size",)) for name in COLUMNS]
    model = fits.evaluate(free, None, robot_values={})
    monkeypatch.setattr(module, "linear_gain", lambda _: 0.0)
    # Of noise of one a per cent is worth a cause: one by chance takes a four-hundredth.
    assert in_question(fits, model, [400.0]) == asked


def test_what_may_stand_in_for_a_load_is_in_question_however_far_a_step_goes(monkeypatch):
    free = [
        Hypothesis(Effect("link_com", 2), ("x_m",)),
        Hypothesis(Effect("payload", None), ("mass_kg",)),
        Hypothesis(Effect("viscous_friction", 1), ("viscous_nm_s_rad",)),
    ]
    model = SimpleNamespace(free=free, total=100.0, robot_values={})
    fitter = SimpleNamespace(evaluate=lambda *_, **__: SimpleNamespace(total=1000.0))
    monkeypatch.setattr(module, "linear_gain", lambda _: 0.0)
    # Friction stands in for no load.
    assert in_question(fitter, model, [400.0, 400.0]) == ["link_com@2"]


def test_a_single_cause_is_not_needless():
    only = SimpleNamespace(free=[Hypothesis(Effect("link_com", 2), ("x_m",))])
    assert in_question(None, only, [400.0, 400.0]) == []


def entered(label: str, axis: int, p: float, unknown: float, beside: Sequence[str] = ()):
    fitted = SimpleNamespace(free=[named(x) for x in (*beside, label)])
    ranked = SimpleNamespace(trial=SimpleNamespace(label=label, fitted=fitted), probability=p)
    return ranked, SimpleNamespace(axis=axis, p_unknown=unknown)


def named(label: str) -> Hypothesis:
    name, _, axis = label.partition("@")
    return Hypothesis(Effect(name, int(axis)), ())


@pytest.mark.parametrize(
    ("p", "unknown", "beside", "move", "asked"),
    [
        (0.95, 0.02, (), "withdraw", []),
        # Something unknown was likelier.
        (0.04, 0.9, (), "withdraw", ["torque_constant@1"]),
        # It came in beside a cause that was withdrawn, or that another one took the place of.
        (0.95, 0.02, ("link_com@1",), "withdraw", ["torque_constant@1"]),
        (0.95, 0.02, ("link_com@1",), "exchange", []),
        (0.95, 0.02, ("backlash@2",), "withdraw", []),
    ],
)
def test_causes_are_doubtful_as_they_came_in(
    p: float, unknown: float, beside: tuple[str, ...], move: str, asked: list[str]
):
    accepted = [
        entered("torque_constant@1", 0, p, unknown, beside),
        entered("backlash@2", 1, 0.99, 0.0),
    ]
    model = SimpleNamespace(free=[named("torque_constant@1"), named("backlash@2")])
    final = ("torque_constant@1", "backlash@2")
    steps = [Step(move, (*final, "link_com@1"), final, 1.0, 1.0)]
    state = SimpleNamespace(model=model, accepted=accepted, steps=steps)
    proposals = list(doubtful(Context(None, state, Settings())))  # type: ignore[arg-type]
    assert [f.effect.label for x in proposals for f in x.gone] == asked
    assert all((x.or_none, x.axis) == ("doubtful", 0) for x in proposals)

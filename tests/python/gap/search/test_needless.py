"""Causes that others have made needless are dropped, and none that a simulation cannot do without."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.search import revision
from gap_data import StateStub, linear_evidence

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


@pytest.mark.parametrize(
    ("needed", "dropped"), [(None, {"quadratic_drag@1"}), ("quadratic_drag", set())]
)
def test_a_cause_is_dropped_unless_a_loop_swings_without_it(needed, dropped, monkeypatch):
    fits = Fits(needed)
    free = [Hypothesis(Effect(name, 1), ("size",)) for name in COLUMNS]
    model = fits.evaluate(free, None, robot_values={})
    state = StateStub(model=model, layout=SimpleNamespace(samples=lambda: np.array([400.0])))
    monkeypatch.setattr(revision, "linear_gain", lambda _: 0.0)
    monkeypatch.setattr(
        revision, "settled", lambda fitter, rest, _: fitter.evaluate(rest, None, robot_values={})
    )
    # Of noise of one a per cent is worth a cause: one by chance takes a four-hundredth.
    assert revision.drop_idle(fits, state, Settings(smallest_gain=0.01)) == dropped


@pytest.mark.parametrize(("left", "dropped"), [(100.5, {"link_com@2"}), (200.0, set())])
def test_what_stood_in_for_a_load_is_fitted_away_however_far_a_step_goes(
    left: float, dropped: set[str], monkeypatch
):
    """One step from a load that lies elsewhere promises nothing; a fit may leave no more than both did."""
    free = [
        Hypothesis(Effect("link_com", 2), ("x_m",)),
        Hypothesis(Effect("payload", None), ("mass_kg",)),
        Hypothesis(Effect("viscous_friction", 1), ("viscous_nm_s_rad",)),
    ]
    state = StateStub(
        model=SimpleNamespace(free=free, total=100.0, robot_values={}),
        layout=SimpleNamespace(samples=lambda: np.array([400.0, 400.0])),
    )

    class Steps:
        def evaluate(self, free, start, *, robot_values):
            del free, start, robot_values
            return SimpleNamespace(total=1000.0)

    tried = []

    def fitted(_, rest, start):
        del start
        tried.append([f.effect.label for f in rest])
        return SimpleNamespace(free=rest, total=left, robot_values={})

    monkeypatch.setattr(revision, "linear_gain", lambda _: 0.0)
    monkeypatch.setattr(revision, "settled", fitted)
    assert revision.drop_idle(Steps(), state, Settings(smallest_gain=0.01)) == dropped
    # Friction stands in for no load.
    assert tried == [["payload", "viscous_friction@1"]]

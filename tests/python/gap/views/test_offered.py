"""Where effects are candidates: on axes that leave something, fitted or predicted."""

import numpy as np
import pytest

from axisight.gap import Settings
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.views import view
from axisight.gap.views.choice import view_of
from gap_data import PLAN, bare_axis, logs_of


@pytest.fixture(scope="module")
def offered():
    """Return what is offered for a simulator that is right, by how well it predicts each log."""
    robot = bare_axis()
    compared = view_of(robot, logs_of(robot, [], PLAN, seconds=3.0), [], Settings(threads=1))
    model = compared.fitter.fit([], refreshes=1)

    def labels(times: float, monkeypatch: pytest.MonkeyPatch, axes=None) -> set[str]:
        monkeypatch.setattr(view, "held_out_loss", lambda model: times * held_out_loss(model))
        return {c.effect.label for c in compared.candidates(model, axes=axes)}

    return labels


def test_an_axis_without_a_gap_is_offered_nothing(offered, monkeypatch):
    assert not any(label.endswith("@1") for label in offered(1.0, monkeypatch))


def test_what_is_predicted_badly_is_offered_effects_though_it_is_fitted_well(offered, monkeypatch):
    """Parameters of a simulator that make up for a cause in one log do not in another."""
    labels = offered(1e3, monkeypatch)
    assert {"coulomb_friction@1", "backlash@1"} <= labels
    assert labels == offered(1.0, monkeypatch, axes=[1])
    assert offered(np.inf, monkeypatch, axes=[]) == offered(1.0, monkeypatch)

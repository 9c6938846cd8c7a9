"""From what a search found to a verdict."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.held_out import held_out_loss
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.search.state import Round, SearchState
from axisight.gap.verdict.conclusion import _strongest, conclude
from gap_data import linear_evidence

NOISE = 0.3


@pytest.mark.parametrize(("missing", "verdict"), [(0.0, "none"), (1.0, "unknown")])
def test_what_one_log_alone_tells_of_a_parameter_lacks_nothing(missing: float, verdict: str):
    """Left out, that log is predicted as badly as if an effect lacked; the fit to all leaves noise alone."""
    rng = np.random.default_rng(0)
    log = np.repeat(np.arange(3), 200)
    x = rng.normal(size=(600, 2))
    x[log != 1, 1] *= 1e-3
    y = x @ np.array([1.0, 3.0]) + NOISE * rng.normal(size=600)
    y += 3 * missing * np.sin(np.arange(600.0))
    fitted = linear_evidence(x, y, log)
    layout = layout_of(fitted)
    # In units of a sample's noise, as residuals are weighted.
    floor = NOISE**2 * fitted.samples
    assert (held_out_loss(fitted) - floor).sum() > 2.0 * fitted.samples.sum()
    found = SearchState(fitted, fitted, floor, layout, rounds=[Round((), (), np.zeros(1))])
    assert conclude(found, Settings(), stands_out=False).verdict == verdict


def ranked(label: str, probability: float, *beside: str) -> RankedHypothesis:
    """A candidate with what its model has beside it."""
    one, *others = (Effect(x[:-2], int(x[-1])) for x in (label, *beside))
    free = [SimpleNamespace(effect=e) for e in (*others, one)]
    trial = SimpleNamespace(label=label, hypothesis=free[-1], fitted=SimpleNamespace(free=free))
    return RankedHypothesis(trial, 1.0, 1.0, 9.0, probability)


@pytest.mark.parametrize(("beside", "open_still"), [((), True), (("torque_offset@1",), False)])
def test_what_gave_way_stays_an_alternative_of_what_took_its_place(
    beside: tuple[str, ...], open_still: bool
):
    """And of nothing else: what came in beside it and made it needless has no rival in it."""
    offset, friction = ranked("torque_offset@1", 0.5), ranked("coulomb_friction@1", 0.4)
    first = AxisPosterior(0, (offset, friction), 0.0, 0.1)
    winner, loser = (
        ranked("coulomb_friction@1", 0.5, *beside),
        ranked("torque_offset@1", 0.4),
    )
    later = AxisPosterior(0, (winner, loser), 0.0, 0.1)
    rounds = [
        Round((first,), ((offset, first),), np.zeros(1)),
        Round((later,), ((winner, later),), np.zeros(1)),
    ]
    found = SimpleNamespace(rounds=rounds, accepted=[(winner, later)])
    standing = _strongest(found)
    assert standing is not None
    labels = [r.trial.label for r in standing.ranked]
    assert ("torque_offset@1" in labels) is open_still
    assert labels[0] == "coulomb_friction@1"

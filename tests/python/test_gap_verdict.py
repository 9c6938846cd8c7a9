"""From what a search found to a verdict."""

import numpy as np
import pytest

from axisight import Settings
from axisight.gap.layout import layout_of
from axisight.gap.score import held_out_loss
from axisight.gap.state import Round, Search
from axisight.gap.verdict import conclude
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
    evidence = linear_evidence(x, y, log)
    layout = layout_of(evidence)
    # In units of a sample's noise, as residuals are weighted.
    floor = NOISE**2 * evidence.samples
    assert (held_out_loss(evidence) - floor).sum() > 2.0 * evidence.samples.sum()
    found = Search(evidence, evidence, floor, layout, rounds=[Round((), (), np.zeros(1))])
    assert conclude(found, Settings(), stands_out=False).verdict == verdict

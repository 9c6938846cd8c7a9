"""Derivatives of predicted torques: small motors weigh a residual so much that a step is huge."""

import numpy as np

from axisight import Effect
from axisight.fitting import Weighting
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.signals.motion import motion
from axisight.gap.views.inverse_dynamics import InverseDynamicsFitter, block_s
from rigid_arm import arm, log_of

ROBOT = arm()


def test_every_block_has_a_derivative_however_small_the_motor():
    weighting = Weighting(np.zeros(1), np.full((6, 1), 1e6))
    at = motion(log_of(ROBOT, 0, seconds=10.0), 10.0)
    fitter = InverseDynamicsFitter(ROBOT, [at], [np.ones_like(at[3])], weighting, {}, 1.0)
    option = Hypothesis(
        Effect("viscous_friction", 2, {"viscous_nm_s_rad": 0.0}), ("viscous_nm_s_rad",)
    )
    found = fitter.fit([option], max_iterations=0)
    blocks = found.axis == 1
    squares = np.array(
        [
            (at[1][start : start + size, 1] ** 2).sum()
            for start, size in zip(
                found.start[blocks] - found.start[blocks].min(), found.size[blocks], strict=True
            )
        ]
    )
    np.testing.assert_allclose(found.matrix[blocks, 0, 0], 1e12 * squares, rtol=1e-6)


def test_short_logs_have_short_blocks():
    settings = Settings()
    long = [log_of(ROBOT, k, seconds=40.0) for k in range(2)]
    short = [log.part(0.0, 3.0) for log in long]
    assert block_s(long, 20.0, settings) == settings.block_s
    assert 10 / 20.0 <= block_s(short, 20.0, settings) < settings.block_s

"""A linear regression from normal equations: weights by axis, bounds, and the scatter between stretches of time."""

from __future__ import annotations

import numpy as np
import pytest

from axisight.gap.fit.data_blocks import Layout
from axisight.gap.fit.fitted_model import NormalEquations
from axisight.gap.fit.joint_regression import JointRegression

STRETCHES, ROWS, AXES = 12, 50, 2
TRUE = np.array([2.0, -1.0])
NOISE = np.array([0.1, 5.0])


def regression(
    bounds=(-np.inf, np.inf), loose=(False, False), noise=NOISE, silent=()
) -> JointRegression:
    """Of two parameters on two axes, the second of which is fifty times as noisy."""
    rng = np.random.default_rng(0)
    matrix, gradient, loss, axes, stretches = [], [], [], [], []
    for stretch in range(STRETCHES):
        for axis in range(AXES):
            columns = rng.normal(size=(ROWS, 2))
            residual = noise[axis] * rng.normal(size=ROWS) - columns @ TRUE
            matrix.append(columns.T @ columns)
            gradient.append(columns.T @ residual)
            loss.append(residual @ residual)
            axes.append(axis)
            stretches.append(stretch)
    names = ((0, "a"), (1, "b"))
    at = NormalEquations(
        names,
        (),
        np.array(matrix),
        np.array(gradient),
        np.array(loss),
        np.zeros((2, 2)),
        np.zeros(2),
        room={names[0]: (-np.inf, np.inf), names[1]: bounds},
    )
    blocks = len(axes)
    layout = Layout(
        np.array(axes),
        np.array(stretches),
        np.zeros(blocks, dtype=int),
        np.full(blocks, ROWS),
        silent,
    )
    return JointRegression(at, layout, np.array(loose))


def test_a_noisy_axis_does_not_hide_the_others():
    found = regression()
    # Standard deviation by the quiet axis alone, with unit columns.
    alone = NOISE[0] / np.sqrt(STRETCHES * ROWS)
    np.testing.assert_allclose(found.step, TRUE, atol=4 * alone)
    # Twelve stretches tell a standard deviation to a fifth; twice that is allowed.
    np.testing.assert_allclose(found.deviation, alone, rtol=0.4)


def test_an_axis_that_is_not_judged_has_no_weight():
    found, other = (regression(noise=np.array([NOISE[0], x]), silent=(1,)) for x in NOISE)
    np.testing.assert_array_equal(found.step, other.step)
    loss = found.held_out()
    assert found.weighed(loss, None) == found.weighed(loss, 0) == other.weighed(loss, None)


def test_a_value_is_sure_where_the_stretches_agree():
    found = regression()
    assert found.is_sure(0, 1e-6)
    low, high = found.interval(0, 0.95)
    assert low < TRUE[0] < high
    assert high - low == pytest.approx(4.4 * found.deviation[0], rel=0.01)


@pytest.mark.parametrize("bound", [0.0, -0.5])
def test_a_value_at_its_bound_scatters_as_one_without_bounds(bound: float):
    """It is not known to the last digit. The misfit that the bound leaves weighs the axes otherwise, not better."""
    found = regression(bounds=(bound, np.inf))
    assert found.step[1] == bound
    assert found.deviation[1] > 0.5 * regression().deviation[1]
    assert found.is_sure(1, 1e-6) == (bound < 0.0)
    low, high = found.interval(1, 0.95)
    assert low < bound < high


def test_a_loose_value_is_held_by_its_bounds_only():
    narrow = regression(bounds=(-1e-4, 1e-4), loose=(False, True))
    wide = regression(bounds=(-100.0, 100.0), loose=(False, True))
    assert abs(narrow.step[1]) <= 1e-4
    assert wide.step[1] == pytest.approx(TRUE[1], abs=0.05)


def test_what_a_parameter_explains_is_told_on_its_axis():
    found = regression()
    # The squares of the torque over those of the noise, without and with the parameter.
    assert found.rise(0, 0) == pytest.approx((TRUE[0] / NOISE[0]) ** 2, rel=0.2)
    assert found.rise(0, 1) == pytest.approx((TRUE[0] / NOISE[1]) ** 2, abs=0.1)


def test_the_held_out_loss_is_that_of_the_noise():
    found = regression()
    with_it = found.held_out()
    without = found.held_out(np.array([True, False]))
    assert found.weighed(with_it, 0) == pytest.approx(STRETCHES * ROWS, rel=0.05)
    assert found.weighed(without, 0) > 100 * found.weighed(with_it, 0)

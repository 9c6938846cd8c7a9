"""Parameters that the data do not show leave those that they do show their intervals."""

import numpy as np
import pytest

from axisight import Effect
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval
from axisight.gap.fit.rank_deficiency import deviations_seen, pseudo_inverse
from axisight.gap.ranking.intervals import intervals, with_own_scatter


def problem(seed: int, unseen: bool) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations and scatter of a regression, in units far apart; the last column may be zero."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(200, 4)) * [1e6, 1.0, 1e-5, 0.0 if unseen else 30.0]
    error = rng.normal(size=200)
    g = x * error[:, None]
    return x.T @ x, g.T @ g


def test_where_all_is_seen_it_is_the_sandwich():
    matrix, scatter = problem(1, unseen=False)
    inverse = np.linalg.inv(matrix)
    np.testing.assert_allclose(pseudo_inverse(matrix), inverse, rtol=1e-8)
    expected = np.sqrt(np.diag(inverse @ scatter @ inverse))
    np.testing.assert_allclose(deviations_seen(matrix, scatter), expected, rtol=1e-8)


def test_what_is_not_seen_is_infinitely_unsure_and_the_rest_as_without_it():
    matrix, scatter = problem(2, unseen=True)
    found = deviations_seen(matrix, scatter)
    seen = deviations_seen(matrix[:3, :3], scatter[:3, :3])
    assert np.isinf(found[3])
    np.testing.assert_allclose(found[:3], seen, rtol=1e-9)
    # Two that show only in a sum are both unseen.
    both = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    assert np.isinf(deviations_seen(both, both)).tolist() == [True, True, False]


def test_an_unseen_parameter_has_all_it_may_have():
    effect = Effect("link_com", 1, {"x_m": 0.02, "y_m": 0.0, "z_m": 0.0})
    found = intervals(effect, ("x_m", "z_m"), {"x_m": 0.001, "z_m": np.inf})
    assert found["x_m"].high - found["x_m"].low < 0.005
    assert found["z_m"].low < -0.1 and found["z_m"].high > 0.1
    assert np.isfinite([found["z_m"].low, found["z_m"].high]).all()


def cause(effect: str, name: str, value: float, reach: float) -> NamedCause:
    told = {name: Interval(value, value - reach, value + reach)}
    return NamedCause(effect, 3, 0.9, told, {name: "1"}, "load", 0.9)


def test_a_change_of_a_parameter_has_the_scatter_of_that():
    """Inertia of 2 %: of a link that is 30 % heavier, 1.96 x 0.02 x 1.3 beside what the fit leaves open."""
    link = cause("link_inertia", "relative_change", 0.3, 0.01)
    (wider,) = with_own_scatter([link], lambda _: 3 * 0.02)
    told = wider.parameters["relative_change"]
    reach = np.hypot(0.01, 1.96 * 0.02 * 1.3)
    assert (told.low, told.high) == pytest.approx((0.3 - reach, 0.3 + reach), rel=1e-12)
    # What stands for no parameter of the simulator has none.
    offset = cause("torque_offset", "offset_nm", 0.3, 0.01)
    assert with_own_scatter([offset], lambda _: 1.0) == (offset,)


def test_lags_are_as_unsure_as_laws():
    """By 1 % of each number that is fitted; what a linear model holds by 0.4 %."""
    loop = Effect("current_loop", 1, {"time_constant_s": 1e-3, "damping": 0.5})
    found = intervals(loop, ("time_constant_s", "damping"), {})["time_constant_s"]
    assert found.high - found.value == pytest.approx(1.96 * 0.02 * 1e-3)
    offset = intervals(Effect("torque_offset", 1, {"offset_nm": 2.0}), ("offset_nm",), {})
    assert offset["offset_nm"].high - 2.0 == pytest.approx(1.96 * 0.004 * 2.0)

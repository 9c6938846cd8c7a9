"""Priors of parameters: densities within their bounds, which improbable values cost much."""

import math

import pytest
from scipy.integrate import quad
from scipy.stats import lognorm, norm

from axisight.effects import EffectParameter, effect_info, effect_table

PARAMETERS = {f"{e.name}.{p.name}": p for e in effect_table().values() for p in e.parameters}


def parameter(effect: str, name: str) -> EffectParameter:
    return PARAMETERS[f"{effect}.{name}"]


@pytest.mark.parametrize("p", PARAMETERS.values(), ids=PARAMETERS)
def test_a_prior_is_a_density_within_the_bounds(p: EffectParameter) -> None:
    """Identity: it integrates to one, over the logarithm where it is one of that."""
    assert p.log_prior(p.upper + abs(p.upper)) == p.log_prior(p.lower - 1.0) == -math.inf
    if p.prior == "log_normal":
        # Ten deviations either way.
        reach = math.exp(10 * p.spread)
        low, high = max(p.lower, p.typical / reach), min(p.upper, p.typical * reach)
        ends = math.log(low), math.log(high)
        whole = quad(lambda x: math.exp(p.log_prior(math.exp(x)) + x), *ends, limit=200)[0]
    else:
        low = max(p.lower, p.neutral - 10 * p.typical)
        high = min(p.upper, p.neutral + 10 * p.typical)
        if p.prior == "uniform":
            low, high = p.lower, p.upper
        whole = quad(lambda x: math.exp(p.log_prior(x)), low, high, limit=200)[0]
    assert whole == pytest.approx(1.0, abs=1e-6)


def test_priors_are_those_of_the_books() -> None:
    """Oracle: scipy's densities, of bounds that hardly cut them; the half of a normal one has twice its density."""
    corner = parameter("coulomb_friction", "smoothing_rad_s")
    assert corner.prior == "log_normal"
    whole = lognorm(corner.spread, scale=corner.typical)
    inside = whole.cdf(corner.upper) - whole.cdf(corner.lower)
    assert corner.log_prior(0.3) == pytest.approx(whole.logpdf(0.3) - math.log(inside))
    size = parameter("coulomb_friction", "coulomb_nm")
    assert size.log_prior(0.8) == pytest.approx(norm(scale=0.5).logpdf(0.8) + math.log(2))
    offset = parameter("torque_offset", "offset_nm")
    assert offset.log_prior(-0.8) == pytest.approx(norm(scale=0.5).logpdf(0.8))
    assert parameter("backlash", "damped").log_prior(0.3) == 0.0


def test_improbable_values_cost_many_nats() -> None:
    corner = parameter("stribeck_friction", "smoothing_rad_s")
    # A corner as wide as all speeds of a robot is no sign; beyond its bound there is no such law.
    assert corner.log_prior(corner.typical) - corner.log_prior(40.0) > 10
    assert corner.log_prior(1e4) == -math.inf
    way = parameter("presliding_friction", "presliding_rad")
    # Of a value itself: bristles without a length, as of its logarithm too.
    assert (
        way.log_prior(way.typical) + math.log(way.typical) - (way.log_prior(1e-9) + math.log(1e-9))
        > 40
    )
    assert parameter("presliding_friction", "bristle_time_s").log_prior(0.0) == -math.inf
    width = parameter("backlash", "half_width_rad")
    assert width.log_prior(0.0) - width.log_prior(10 * width.typical) == pytest.approx(50.0)


@pytest.mark.parametrize("effect", effect_table())
def test_what_a_prior_rests_on_is_said(effect: str) -> None:
    for p in effect_info(effect).parameters:
        assert len(p.sizes) > 20
        assert p.typical > 0 and (p.spread > 0) == (p.prior == "log_normal")
        # What is there for sure has a size that it may have.
        assert p.prior != "log_normal" or p.lower <= p.typical <= p.upper
        # A deviation of nothing is an effect that is not there.
        assert p.prior != "half_normal" or math.isfinite(p.log_prior(p.neutral))

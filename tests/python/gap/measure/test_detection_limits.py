"""Detection limits: what logs would have shown, against machines that have it."""

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.effects import effect_info
from axisight.gap.fit.fitted_model import Hypothesis, NormalEquations
from axisight.gap.fit.sensitivity import Sensitivity
from axisight.gap.measure.detection_limits import _limit, _of_a_stiffer_gear
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

LOOKED_AT = (
    "coulomb_friction",
    "torque_offset",
    "quadratic_drag",
    "input_delay",
    "transmission_error",
    "torque_deadband",
)


def run(effects):
    machine = scattered(bare_axis(), 4)
    return diagnose(
        robot=bare_axis(),
        estimation=logs_of(machine, effects, PLAN),
        validation=logs_of(machine, effects, HELD),
        settings=Settings(bootstrap=50),
    )


@pytest.fixture(scope="module")
def nothing():
    return run([])


@pytest.fixture(scope="module")
def limits(nothing):
    return {(limit.effect, limit.axis): limit for limit in nothing.detection_limits}


def test_every_effect_that_may_be_nothing_has_a_limit_at_every_place(nothing, limits):
    assert nothing.verdict == "none"
    assert set(LOOKED_AT) <= {name for name, _ in limits}
    assert len(limits) == len(nothing.detection_limits)
    for limit in limits.values():
        info = {p.name: p for p in effect_info(limit.effect).parameters}
        assert {limit.parameter, *limit.others} == set(info)
        assert info[limit.parameter].role == "amplitude"
        assert limit.unit == info[limit.parameter].unit
        assert limit.value is None or limit.value > 0
        assert (limit.hidden is None) == (limit.value is not None)


def test_what_is_scatter_of_a_parameter_is_below_the_limit(limits):
    # Three deviations of 1.5 %, by which motors of one type differ.
    assert limits["motor_inertia", 1].value >= 0.045


@pytest.mark.parametrize("name", LOOKED_AT)
def test_twice_the_limit_is_found_and_a_third_is_not(name, limits):
    """Nineteen in twenty at the limit; at twice it, four times the loss, all but always."""
    limit = limits[name, 1]
    found = run([Effect(name, 1, {limit.parameter: 2.0 * limit.value})])
    assert name in {c.effect for c in found.ranking[:4]}
    assert found.causes, found.headline
    assert run([Effect(name, 1, {limit.parameter: limit.value / 3.0})]).causes == ()


def test_the_limit_of_a_richer_law_is_of_what_a_plainer_one_lacks(limits):
    """Beside dry friction, which alone shows earlier; an excess of a twentieth of it is its corner."""
    excess = limits["stribeck_friction", 1]
    assert excess.parameter == "excess_nm"
    assert excess.value > 2.0 * limits["coulomb_friction", 1].value
    dry = {"coulomb_nm": 0.3, "stribeck_speed_rad_s": 2.0}
    found = run([Effect("stribeck_friction", 1, {**dry, "excess_nm": 2.0 * excess.value})])
    assert [c.effect for c in found.causes] == ["stribeck_friction"], found.headline


@pytest.mark.parametrize(
    ("column", "tolerance", "hidden"),
    [
        # Along the column of a parameter of the simulator, which may change by as much.
        ([1.0, 1.0, 1.0, 1.0], 1e6, "tolerances"),
        # The same where that is known: the effect shows.
        ([1.0, 1.0, 1.0, 1.0], 1e-6, None),
        # Next to nothing, whatever is known.
        ([1e-9, 0.0, 0.0, 0.0], 1e6, "motion"),
    ],
)
def test_why_no_size_shows_is_what_hides_it(column, tolerance, hidden):
    own, effect = np.ones(4), np.array(column)
    one = Effect("torque_offset", 1)
    rest = NormalEquations(
        parameters=((None, "axis1.mass"),),
        at_bound=(),
        matrix=np.array([[[own @ own]]]),
        gradient=np.array([[own @ effect]]),
        loss=np.array([effect @ effect]),
        prior_matrix=np.array([[tolerance**-2]]),
        prior_gradient=np.zeros(1),
    )
    option = Hypothesis(one, ("offset_nm",))
    limit = _limit(Sensitivity(option, "offset_nm", rest), np.ones(1), 0.0)
    assert (limit.hidden, limit.value is None) == (hidden, hidden is not None)


@pytest.mark.parametrize(("softer", "stiffer"), [(0.2, 0.25), (0.45, 9 / 11), (0.6, None)])
def test_a_stiffer_gear_shows_by_what_it_gives_less(softer, stiffer):
    # 1 / (1 + x) = 1 - c; at twice the limit a gear gives less still.
    assert _of_a_stiffer_gear(softer) == (stiffer and pytest.approx(stiffer))


def test_limits_fall_with_more_data(limits):
    machine = scattered(bare_axis(), 4)
    twice = PLAN | {"third": ("multisine", 5), "fourth": ("multisine", 6), "fifth": ("moves", 1)}
    longer = diagnose(
        robot=bare_axis(),
        estimation=logs_of(machine, [], twice, seconds=9.0),
        validation=logs_of(machine, [], HELD),
        settings=Settings(bootstrap=50),
    )
    more = {(limit.effect, limit.axis): limit.value for limit in longer.detection_limits}
    ratio = [more[k] / x.value for k, x in limits.items() if x.value and more.get(k)]
    # What a cause has to be worth grows with the data as what it shows does: limits stay.
    assert 0.5 < np.median(ratio) < 1.1

"""What varies between runs and days, from repeats: variances by hand, recovery, ranges, misuse."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from axisight.errors import InputError
from axisight.posterior import randomization_document, with_repeats
from axisight.repeats import compare_days
from posterior_data import COULOMB, INERTIA, MASS, RATIO, VISCOUS, one_hypothesis
from repeat_data import COULOMB as COULOMB_NM
from repeat_data import VISCOUS as VISCOUS_NM_S_RAD
from repeat_data import runs


def compared(days, per_day, **options):
    return compare_days(*runs(days, per_day, **options), torque_held=False)


def test_scatter_of_repeats_is_recovered():
    """Friction of 20 runs of each of two days scatters by 5 %: 39 degrees of freedom give 12 %, times 3."""
    found = with_repeats(one_hypothesis(), compared(2, 20, scatter=0.05))
    for name, value in ((COULOMB, COULOMB_NM), (VISCOUS, VISCOUS_NM_S_RAD)):
        one = found.variation(name)
        assert one.says == "yes" and one.std == pytest.approx(0.05 * value, rel=0.36)
        assert np.std(one.by_log, ddof=1) == pytest.approx(one.std, rel=0.1)
    # What the repeats do not show stays as the logs say.
    assert found.variation(MASS) == one_hypothesis().variation(MASS)
    assert found.variation(INERTIA) is None
    assert len(found.between_runs) == 3


def test_the_variance_is_that_of_runs_and_days():
    comparison = compared(3, 3, scatter=0.02, change=0.3)
    table = comparison.parameters.sel(parameter="axis2.viscous_friction")
    base = one_hypothesis()
    moved = [replace(p, axis=2, name="axis2.viscous_friction") for p in base.parameters[:1]]
    found = with_repeats(replace(base, parameters=tuple(moved)), comparison)
    one = found.variation("axis2.viscous_friction")
    std = np.hypot(float(table.std_between_runs), float(table.std_between_days))
    assert one.varies and one.std == pytest.approx(std, rel=1e-12)
    # Two tests: of the days, and of the scatter of runs with 9 - 3 degrees of freedom.
    ratio = 6 * float(table.std_of_run / table.std_within_run) ** 2
    oracle = 2 * min(float(table.p_value), scipy.stats.chi2.sf(ratio, 6))
    assert one.p_value == pytest.approx(oracle, rel=1e-9)


def test_constant_machines_vary_nowhere():
    """All tests of a comparison have 5 % false alarms: three or more in 12 have a chance of 2 %."""
    alarms = 0
    for seed in range(12):
        found = with_repeats(one_hypothesis(), compared(2, 4, scatter=0.0, seed=seed))
        alarms += any(found.variation(name).varies for name in (COULOMB, VISCOUS))
    assert alarms < 3


def test_ranges_include_what_varies():
    base = one_hypothesis()
    found = with_repeats(base, compared(2, 20, scatter=0.05))
    number = randomization_document(found).number("frictionloss of axis1")
    std = found.variation(COULOMB).std
    assert number.between_runs_std == pytest.approx(std / RATIO)
    # Fit and formula as before, in squares.
    assert number.std == pytest.approx(np.sqrt(0.02**2 + 0.005**2 + std**2) / RATIO)
    assert number.draw == "episode"


def test_the_document_of_the_command_says_the_same():
    comparison = compared(2, 4)
    document = json.loads(json.dumps(comparison.to_dict()))
    one, other = (with_repeats(one_hypothesis(), x) for x in (comparison, document))
    assert one.between_runs[:2] == other.between_runs[:2]


def test_runs_without_repeats_say_not_known():
    document = compared(2, 2).to_dict()
    for one in document["parameters"]:
        one |= {"p_value": None, "std_within_run": None}
    assert with_repeats(one_hypothesis(), document).variation(COULOMB).says == "not known"


def test_misuse():
    document = compared(2, 2).to_dict()
    with pytest.raises(InputError, match=r"expected axisight\.repeat/1, got 'axisight\.verdict/2'"):
        with_repeats(one_hypothesis(), {**document, "schema": "axisight.verdict/2"})
    with pytest.raises(InputError, match="expected a document of"):
        with_repeats(one_hypothesis(), {})
    base = one_hypothesis()
    alone = replace(base, parameters=base.parameters[3:4])
    with pytest.raises(InputError, match=r"got none in common; the posterior has axis1\.mass"):
        with_repeats(alone, document)
    single = replace(base.simulated, axes=base.simulated.axes[:1])
    with pytest.raises(InputError, match="expected axes from 1 to 1"):
        with_repeats(replace(base, simulated=single), document)

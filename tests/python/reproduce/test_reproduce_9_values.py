"""Claims on the values of Tables 9.1 to 9.3: the thesis's own table holds, a changed one does not."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from axisight_thesis.chapter9_tables import TABLE_9_1, TABLE_9_2, TABLE_9_3
from axisight_thesis.chapter9_values import change_claims, fit_claims, parameter_claims
from axisight_thesis.item import Claim


def fits(values: np.ndarray) -> xr.DataArray:
    coords = {"data_set": ["1", "2", "3"], "estimated_on": ["m0", "m1", "m2", "m3"]}
    return xr.DataArray(values, coords=coords, dims=("data_set", "estimated_on"))


def changes(values: np.ndarray) -> xr.DataArray:
    coords = {"parameter": list(TABLE_9_3), "data_set": ["1", "2", "3"], "change": [1.2, 0.8]}
    return xr.DataArray(values, coords=coords, dims=("parameter", "data_set", "change"))


def verdicts(claims: tuple[Claim, ...]) -> dict[str, bool | None]:
    return {claim.id.split("-", 2)[2]: claim.holds for claim in claims}


ONE_ARM = {name: values[3] for name, values in TABLE_9_1.items()}
THESIS_9_2 = np.array(list(TABLE_9_2.values()))
THESIS_9_3 = np.array([TABLE_9_3[name] for name in TABLE_9_3])


def test_the_tables_of_the_thesis_hold() -> None:
    assert verdicts(parameter_claims(TABLE_9_1, TABLE_9_1, ONE_ARM)) == {
        "rigid": True,
        "flexible": True,
    }
    claims = fit_claims(fits(THESIS_9_2), TABLE_9_2, THESIS_9_2[:, 3].tolist())
    assert verdicts(claims) == {"set-1": True, "models": True, "residual": True}
    claims = change_claims(changes(THESIS_9_3), TABLE_9_3)
    assert verdicts(claims) == {"order": True, "signs": True, "largest": True}


@pytest.mark.parametrize(("name", "group"), [("J_m", "rigid"), ("k1", "flexible")])
def test_parameters_may_differ_by_the_range_of_the_models(name: str, group: str) -> None:
    """J_m of m1 to m3 has a range of 4 %, k1 of 3 %: 2 % more is inside, 5 % more is not."""
    for factor, holds in ((1.02, True), (1.05, False)):
        moved = {**TABLE_9_1, name: tuple(factor * v for v in TABLE_9_1[name])}
        assert verdicts(parameter_claims(moved, TABLE_9_1, ONE_ARM))[group] is holds


def test_fits_that_differ_do_not_hold() -> None:
    three = THESIS_9_2[:, 3].tolist()
    swapped = verdicts(fit_claims(fits(THESIS_9_2[[1, 0, 2]]), TABLE_9_2, three))
    assert not swapped["set-1"] and not swapped["residual"]
    spread = THESIS_9_2.copy()
    spread[1, 1] -= 3
    assert not verdicts(fit_claims(fits(spread), TABLE_9_2, three))["models"]
    # Half the residual on every set is the limit of the factor.
    for share, holds in ((0.51, True), (0.49, False)):
        better = 100 - share * (100 - THESIS_9_2)
        assert verdicts(fit_claims(fits(better), TABLE_9_2, three))["residual"] is holds


def test_changes_that_differ_do_not_hold() -> None:
    rng = np.random.default_rng(0)
    other = rng.permutation(THESIS_9_3.ravel()).reshape(THESIS_9_3.shape)
    assert not verdicts(change_claims(changes(other), TABLE_9_3))["order"]
    turned = THESIS_9_3.copy()
    turned[1, 1, 0] *= -1  # J_a +20 % on set 2, 5.03 points
    (claim,) = (c for c in change_claims(changes(turned), TABLE_9_3) if c.id.endswith("signs"))
    assert claim.holds is False
    assert "J_a on set 2 +5.03 (here -5.03)" in claim.evidence
    small = THESIS_9_3.copy()
    small[3] *= -1  # k3, at most 0.11 points
    assert verdicts(change_claims(changes(small), TABLE_9_3))["signs"]
    weak = THESIS_9_3.copy()
    weak[6] /= 100  # F_c
    assert not verdicts(change_claims(changes(weak), TABLE_9_3))["largest"]

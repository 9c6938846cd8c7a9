"""Fits of simulations to logs from where nothing can be simulated, and from what is misused."""

import pytest

from axisight import Effect, InputError, Log
from axisight.fitting import effect_parameter, fit
from gap_data import bare_axis, logs_of


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    return logs_of(bare_axis(), [], {"moves": ("moves", 0)}, seconds=1.0)


def fitted(logs: list[Log], effect: Effect) -> None:
    fit(bare_axis(), logs, [effect_parameter([effect], 0, "viscous_nm_s_rad")], effects=[effect])


def test_a_start_that_diverges_says_what_to_do(logs: list[Log]):
    stiff = Effect("viscous_friction", 1, {"viscous_nm_s_rad": 1e4})
    with pytest.raises(InputError, match=r"can be simulated, got .* diverged at sample \d+; start"):
        fitted(logs, stiff)


def test_misuse_is_told_as_that(logs: list[Log]):
    misplaced = Effect("viscous_friction", 2, {"viscous_nm_s_rad": 1.0})
    with pytest.raises(
        InputError, match=r"^effect `viscous_friction`: expected an axis from 1 to 1"
    ):
        fitted(logs, misplaced)

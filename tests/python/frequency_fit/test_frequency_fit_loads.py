"""Responses with different loads, fitted by one model."""

import numpy as np
import pytest

from axisight import Effect, InputError
from axisight.frequency_fit import (
    FrequencyFitOptions,
    MeasuredResponse,
    fit_responses,
    model_response,
)
from axisight.logs import Load
from multiaxis_data import ROBOT, TRUTH

LINES_HZ = np.arange(1.0, 40.5, 0.5)
LOADS = (None, Load(80.0, (0.9, 0.1, 0.2), 0.02), Load(150.0, (0.6, 0.3, 0.3)))
NAMES = ("axis1.stiffness", "axis2.stiffness", "axis3.stiffness", "axis3.damping")


@pytest.fixture(scope="module")
def responses() -> list[MeasuredResponse]:
    pose = (0.0, 0.3, -0.4)
    out = []
    for load in LOADS:
        effects = [] if load is None else [Effect("payload", None, load.parameters)]
        g = model_response(ROBOT, LINES_HZ, pose, quantity="acceleration", effects=effects).values
        out.append(MeasuredResponse(pose, LINES_HZ, g, "acceleration", load=load))
    return out


def test_one_model_over_loads(responses: list[MeasuredResponse]) -> None:
    """Without noise the truth is found to the tolerance of the search."""
    start = {name: 1.4 * TRUTH[name] for name in NAMES}
    options = FrequencyFitOptions(criterion="log_least_squares")
    found = fit_responses(ROBOT, responses, start, options=options)
    np.testing.assert_allclose(found.values, [TRUTH[n] for n in found.names], rtol=1e-6)
    unaware = [one.with_load(None) for one in responses]
    blind = fit_responses(ROBOT, unaware, start, options=options)
    assert blind.loss > 1e3 * max(found.loss, 1e-12)


def test_loads_and_a_payload_exclude_each_other(responses: list[MeasuredResponse]) -> None:
    with pytest.raises(InputError, match="effects: expected no payload beside logs that state"):
        fit_responses(
            ROBOT,
            responses,
            NAMES,
            effects=[Effect("payload", None, {"mass_kg": 1.0})],
            options=FrequencyFitOptions(criterion="log_least_squares"),
        )


@pytest.mark.parametrize(
    ("mass", "centre", "text"),
    [
        (-1.0, (0.0, 0.0, 0.0), "mass_kg"),
        (1.0, (0.0, 0.0), "centre_m: expected three numbers, got 2"),
        (1.0, (0.0, np.nan, 0.0), "centre_m"),
    ],
)
def test_a_load_that_cannot_be(mass: float, centre: tuple, text: str) -> None:
    with pytest.raises(InputError, match=text):
        Load(mass, centre)

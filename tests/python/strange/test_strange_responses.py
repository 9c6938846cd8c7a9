"""Every argument of the responses package, fed with what it was not made for."""

import numpy as np
import pytest

import axisight
from axisight import excitation, responses
from response_logs import periodic_logs
from strange_values import feed

LOGS = periodic_logs(n=64, lines=np.arange(2, 12), periods=4, noise=1e-3)
DESIGN = excitation.references(excitation.multisine(0.064, 1e-3, lines=range(2, 12)), 2)
CASES = {
    "response_of_logs": (
        responses.response_of_logs,
        {
            "logs": LOGS,
            "robot": None,
            "design": DESIGN,
            "estimator": "auto",
            "average": None,
            "quantity": "acceleration",
            "axes": [1, 2],
            "operating_point_rad": [0.0, 0.1],
            "period_s": None,
            "band_hz": (20.0, 200.0),
            "bandwidth_hz": None,
            "drop_periods": 1,
        },
    ),
    "joint_angles": (
        responses.joint_angles,
        {
            "robot": axisight.load_robot("irb6600_like"),
            "gear_angle_rad": [0.0, 0.1, 0.2],
            "gear_torque_nm": [0.0, 10.0, 20.0],
        },
    ),
    "plot_levels": (
        responses.plot_levels,
        {"response": responses.response_of_logs(LOGS).response, "width_in": 7.0},
    ),
}
NAMES = {"ESTIMATORS", "MEANS", "GEAR_ANGLE", "GEAR_TORQUE", "OPERATING_POINT", "Estimator", "Mean"}
RESULTS = {"Account", "LogResponse"}


@pytest.mark.parametrize("name", CASES)
def test_only_errors_of_ours_come_out(name: str) -> None:
    function, good = CASES[name]
    assert not (wrong := feed(function, good)), "\n".join(wrong)


def test_every_public_name_is_fed() -> None:
    assert set(responses.__all__) == set(CASES) | NAMES | RESULTS

"""Fits of an axis against the robot file they are meant for."""

from dataclasses import replace

import numpy as np
import pytest

from axis_data import RATIO, SAMPLE_S, torque
from axisight import InputError, load_robot, simulate
from axisight.graybox import AxisData, AxisModel, compare_with_robot, fit_axis

ROBOT = load_robot("two_mass_axis")
START = {"J_m": 0.012, "J_a": 1100.0, "k1": 1.4e6, "k3": 3.7e10, "d": 2600.0, "F_v": 0.013}


def fitted(motion: float = 1.0, torques: float = 1.0, ratio: float = RATIO):
    """The preset's axis as a fit sees it when motion and torque are off by factors."""
    u = torque(4000, 1)
    run = simulate(ROBOT, torque_nm=u[:, None], tolerance=1e-8)
    data = AxisData(
        torques * u,
        position_rad=motion * run.motor_position_rad.values[:, 0],
        sample_time_s=SAMPLE_S,
    )
    model = AxisModel(gear_ratio=ratio, output="position", friction_smoothing_rad_s=0.01 * motion)
    side = torques / motion
    start = {name: value * side for name, value in {**START, "F_c": 0.644 * motion}.items()}
    # What belongs to the joint's side at another ratio.
    for name, power in {"J_a": 2, "k1": 2, "d": 2, "k3": 4}.items():
        start[name] *= (RATIO / ratio) ** power
    start["k3"] /= motion**2
    return fit_axis(model, data, start)


def test_a_right_fit_is_like_the_robot() -> None:
    """The preset is the truth; the other smoothing of friction costs a per mille."""
    found = compare_with_robot(fitted(), ROBOT)
    assert not found.one_factor and not found.findings
    np.testing.assert_allclose(list(found.ratios.values()), 1.0, rtol=2e-3)


@pytest.mark.parametrize(
    ("motion", "torques", "words"),
    [
        (180 / np.pi, 1.0, "degrees instead of radians"),
        (1.0, 1000.0, "units and the side of the gear of motion and torque"),
        (RATIO, 1.0, "joint's side of the gear"),
    ],
)
def test_wrong_units_are_one_factor(motion: float, torques: float, words: str) -> None:
    """The fit itself is perfect and says nothing, for the start was wrong with the data."""
    fit = fitted(motion, torques)
    assert fit.fit_percent[0] > 99
    found = compare_with_robot(fit, ROBOT)
    assert found.one_factor
    np.testing.assert_allclose(list(found.ratios.values()), torques / motion, rtol=5e-3)
    assert words in found.findings[0]


def test_single_values_far_off_are_named() -> None:
    fit = fitted()
    far = replace(fit, parameters={**fit.parameters, "k1": 10 * fit.parameters["k1"]})
    found = compare_with_robot(far, ROBOT)
    assert not found.one_factor
    (text,) = found.findings
    assert text.startswith("the gear stiffness is 10 times that of the robot file")
    with pytest.raises(InputError, match="axis: expected 1"):
        compare_with_robot(fit, ROBOT, axis=2)
    with pytest.raises(InputError, match="expected an AxisFit"):
        compare_with_robot({}, ROBOT)  # type: ignore[arg-type]

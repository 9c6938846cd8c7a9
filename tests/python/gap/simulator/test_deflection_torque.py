"""What gears that give way add to the torque of rigid ones."""

import numpy as np
import pytest

from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.simulator.deflection_torque import deflection_torque
from axisight.gap.simulator.rigid_torque import predicted_torque
from gap_data import bare_axis

STEP = 5e-4


def sine(share: float):
    """A motion of the motor at a share of the mode that the arm has with its motor held."""
    values = bare_axis().parameters()
    mode = np.sqrt(values["axis1.stiffness"] / 1130.0)
    rate, time = share * mode, np.arange(8000) * STEP
    position = 2.0 * np.sin(rate * time)[:, None]
    velocity = 2.0 * rate * np.cos(rate * time)[:, None]
    return position, velocity, -(rate**2) * position, np.zeros_like(position)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2, 1 / 3])
def test_a_mass_behind_a_spring_weighs_more_by_the_square_of_the_frequency(share: float):
    """Closed form without damping: ``x^2 / (1 - x^2)`` of the torque of the arm more; two terms of its series.

    Differences of second order on 8000 samples of half a millisecond are good to 1e-4 of that.
    """
    robot, at = bare_axis(), sine(share)
    ratio = robot.gear_ratio[0]
    arm = ratio**2 * 1130.0 * at[2]
    found = deflection_torque(robot, at, STEP)
    inner = slice(10, -10)
    exact = share**2 / (1 - share**2) * arm
    size = np.abs(exact).max()
    # What two steps leave: order six of the arm's torque.
    assert np.abs(found - exact)[inner].max() < (share**4 + 1e-3) * size
    np.testing.assert_allclose(found[inner], (share**2 + share**4) * arm[inner], atol=1e-3 * size)


def test_friction_and_the_rotor_turn_with_the_motor():
    """Ten times of either change nothing: what is behind the gear alone gives way."""
    robot, at = bare_axis(), sine(0.2)
    values = robot.parameters()
    names = ("axis1.motor_inertia", "axis1.viscous_friction")
    other = robot.with_parameters(values | {name: 10 * values[name] for name in names})
    first, second = (deflection_torque(r, at, STEP) for r in (robot, other))
    # Second differences of second differences: rounding of 1e-16 is 1e-7 of the torque.
    np.testing.assert_allclose(first, second, atol=1e-6 * np.abs(first).max())


def test_stiff_gears_give_way_by_nothing():
    robot = bare_axis()
    robot = robot.with_parameters(robot.parameters() | {"axis1.stiffness": 1e12})
    at = sine(0.2)
    rigid = predicted_torque(robot, AS_GIVEN, at)
    assert np.abs(deflection_torque(robot, at, STEP)).max() < 1e-5 * np.abs(rigid).max()

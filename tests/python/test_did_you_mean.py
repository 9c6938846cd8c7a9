"""A name that is nearly one that is there is answered with that one."""

import numpy as np
import pytest

import axisight
from axisight import Effect, excitation, load_robot, robot_parameter, simulate
from axisight.arguments import did_you_mean, nearest
from axisight.errors import AxisightError
from axisight.logs import load_column_map

ROBOT = load_robot("two_mass_axis")
WRONG = {
    "effect": (
        lambda: Effect("columb_friction", 1),
        r"^unknown effect 'columb_friction'\. Did you mean 'coulomb_friction'\? "
        r"axisight\.effect_table\(\) lists all \d+ effects$",
    ),
    "effect without a near one": (
        lambda: Effect("wobble", 1),
        r"^unknown effect 'wobble'\. axisight\.effect_table\(\) lists",
    ),
    "effect of another type": (lambda: Effect(3, 1), "^unknown effect 3"),
    "parameter of an effect": (
        lambda: Effect("coulomb_friction", 1, {"coulom_nm": 1.0}),
        r"parameter 'coulom_nm': expected coulomb_nm, .*Did you mean 'coulomb_nm'\?$",
    ),
    "parameters by place": (
        lambda: Effect("coulomb_friction", 1, 0.4),
        r"parameters: expected \{'coulomb_nm': \.\.\.\}, got 0\.4",
    ),
    "preset": (lambda: load_robot("irb6600_lik"), r"Did you mean 'irb6600_like'\?$"),
    "column map": (lambda: load_column_map("ur_rtd"), r"Did you mean 'ur-rtde'\?$"),
    "robot parameter": (
        lambda: robot_parameter(ROBOT, "axis1.stifness"),
        r"Did you mean 'axis1\.stiffness'\?$",
    ),
    "robot values": (
        lambda: ROBOT.with_parameters({"axis1.stifness": 1.0}),
        r"Did you mean 'axis1\.stiffness'\?$",
    ),
    "method": (
        lambda: simulate(ROBOT, np.ones((5, 1)), method="dopri"),
        r"^method: expected one of .*Did you mean 'dopri5'\?$",
    ),
    "model": (
        lambda: simulate(ROBOT, np.ones((5, 1)), model="non-linear"),
        r"^model: .*Did you mean 'nonlinear'\?$",
    ),
    "grid": (
        lambda: excitation.multisine(1.0, 1e-3, band_hz=(1, 9), grid="odd random"),
        r"^grid: .*Did you mean 'odd_random'\?$",
    ),
    "directions": (
        lambda: excitation.direction_matrix("hadamrd", 2),
        r"^directions: .*Did you mean 'hadamard'\?$",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_was_meant_is_said(case):
    call, message = WRONG[case]
    with pytest.raises(AxisightError, match=message):
        call()


@pytest.mark.parametrize(
    ("given", "near"),
    [
        ("Backlash ", "backlash"),
        ("coulomb friction", "coulomb_friction"),
        ("coulomb", "coulomb_friction"),
        ("torque", None),  # the start of several
        ("zzz", None),
        ("x" * 1000, None),
        ("", None),
        (3, None),
    ],
)
def test_the_nearest_effect(given, near):
    assert nearest(given, axisight.effect_table()) == near


def test_nothing_is_said_where_nothing_is_near():
    assert did_you_mean("zzz", ["abc"]) == ""
    assert did_you_mean("abd", ["abc"]) == ""  # too short to tell
    assert did_you_mean("abcd", ["abcde"]) == ". Did you mean 'abcde'?"

"""What hangs on joints and how bases stand, in every engine: where there is one formula only, ours."""

from functools import cache

import numpy as np
import pytest

from axisight import Effect, Robot, load_robot, simulate
from axisight.blind import (
    formulas,
    joint_formulas,
    joint_laws,
    laws,
    mujoco_engine,
    pinocchio_engine,
)
from axisight.blind.machine import Ends, Machine
from axisight.blind.motions import multisines

RUN = {"mujoco": mujoco_engine.run, "pinocchio": pinocchio_engine.run}
MODE = {"inertia_kg_m2": 60.0, "frequency_hz": 14.0, "damping": 0.04}
IRB = "irb6600_like"
UPRIGHT = {"sine_nm": 900.0, "cosine_nm": -300.0}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(IRB)


@cache
def excitation() -> np.ndarray:
    _, reference = multisines(np.random.default_rng(3), load_robot(IRB))["multisine_fresh"]
    return reference[:1000]


def off(engine: str, machine: Machine, ours: list[Effect], reference: np.ndarray) -> float:
    """By how much an engine's torques are not ours, in what the effects change of them."""
    ((torque, _),) = RUN[engine](machine, [reference], [np.zeros_like(reference)])
    robot = machine.robot
    with_it = simulate(robot, reference, effects=ours)["torque_cmd_nm"].values
    without = simulate(robot, reference)["torque_cmd_nm"].values
    return float(np.sqrt(np.mean((torque - with_it) ** 2) / np.mean((with_it - without) ** 2)))


@pytest.mark.parametrize(
    ("engine", "law", "ours"),
    [
        ("mujoco", joint_laws.Balancer(900.0, -300.0), Effect("gravity_compensation", 2, UPRIGHT)),
        (
            "mujoco",
            joint_laws.Cable(900.0, 0.2),
            Effect("cable_stiffness", 2, {"stiffness_nm_rad": 900.0, "at_zero_nm": 180.0}),
        ),
        (
            "pinocchio",
            # Of a hose that is hardly wound.
            joint_formulas.WoundHose(900.0, 100.0),
            Effect("cable_stiffness", 2, {"stiffness_nm_rad": 900.0}),
        ),
        (
            "pinocchio",
            # A spring of no free length is a sine.
            joint_formulas.SpringBalancer(900.0, 0.2, 0.0, 0.3),
            Effect(
                "gravity_compensation",
                2,
                {"sine_nm": 900.0 * np.cos(0.3), "cosine_nm": 900.0 * np.sin(0.3)},
            ),
        ),
        ("mujoco", joint_laws.Swing(*MODE.values()), Effect("extra_mode", 2, MODE)),
        ("pinocchio", joint_formulas.HungMass(*MODE.values()), Effect("extra_mode", 2, MODE)),
        ("mujoco", laws.Drag(0.01), Effect("quadratic_drag", 2, {"drag_nm_s2_rad2": 0.01})),
    ],
)
def test_what_has_one_formula_only_is_what_ours_is(
    engine: str, law: object, ours: Effect, robot: Robot
):
    """Engines settle for a second under the controller before they begin, of a constant torque some hundredths
    are still to come; and MuJoCo holds torques of laws over half a sample."""
    machine = Machine(robot, laws={1: [law]})
    assert off(engine, machine, [ours], excitation()) < 0.05


@pytest.mark.parametrize("engine", sorted(RUN))
def test_a_base_that_stands_tilted_is_ours(engine: str, robot: Robot):
    tilted = Effect("base_tilt", None, {"about_x_rad": 0.03, "about_y_rad": -0.05})
    machine = Machine(robot, ends=Ends(tilted_rad=(0.03, -0.05)))
    assert off(engine, machine, [tilted], excitation()) < 0.02


def place(speed: float) -> formulas.Place:
    one = np.ones(1)
    return formulas.Place(0.0, one, speed * one, one, 0 * one, 0.01, 1e5, 50.0)


def test_friction_against_both_ways_is_what_it_says_far_from_standstill():
    """Arc tangents are within 2 / pi over the speed in corners of their end, quotients within one over it."""
    law = formulas.OneSidedFriction(0.6, 0.2, 0.1)
    for speed, size in ((300.0, 0.6), (-300.0, 0.2)):
        torque = np.asarray(law.torque(place(speed))[0])
        assert torque == pytest.approx(-np.sign(speed) * size, rel=1e-3)
    native = laws.OneSidedFriction(0.6, 0.2, 0.1)
    for speed, size in ((300.0, 0.6), (-300.0, 0.2)):
        at = laws.Axis(0.0, 0.0, speed, 0.0, 0.0, 0.01, 0.0)
        assert native.torque(at) == (pytest.approx(-np.sign(speed) * size, rel=1e-3), 0.0)


def test_oil_is_churned_the_more_the_faster():
    law = formulas.Churning(0.5, 100.0)
    torque = [float(np.asarray(law.torque(place(v))[0])[0]) for v in (100.0, -100.0, 200.0)]
    assert torque == pytest.approx([-0.5, 0.5, -0.5 * 2**1.75])

"""When the simulator's own parameters are at the edge of their tolerances."""

from types import SimpleNamespace

import pytest

from axisight import Effect, load_robot
from axisight.gap.fit.tolerance_edges import BENT, bent, parameters_at_edge
from axisight.gap.simulator.brought_inertia import brought_inertias
from rigid_arm import arm

ROBOT = load_robot("irb6600_like").with_effects([])
TOLERANCE = {"mass": 0.015, "stiffness": 0.015, "motor_inertia": 0.015}


KNOWN = [n for n in ROBOT.parameters() if n.rsplit(".", 1)[1] in TOLERANCE]


@pytest.mark.parametrize(
    ("off", "count", "bends"),
    [
        (2.9, len(KNOWN), False),
        (3.1, len(KNOWN), True),
        (3.1, len(KNOWN) // 4 - 1, False),
        (3.1, -(-len(KNOWN) // 4), True),
    ],
)
def test_bent_is_a_share_of_parameters_three_tolerances_off(off: float, count: int, bends: bool):
    known = ROBOT.parameters()
    values = {n: known[n] for n in KNOWN} | {n: (1 + off * 0.015) * known[n] for n in KNOWN[:count]}
    model = SimpleNamespace(robot_values=values, ended_at_bound=())
    fitter = SimpleNamespace(robot=ROBOT, tolerances=TOLERANCE, adds_up=False)
    share = count / len(KNOWN) if off > 3 else 0.0
    assert bent(fitter, model) == pytest.approx(share)
    assert (bent(fitter, model) >= BENT) is bends
    # Where errors add up it says nothing.
    fitter.adds_up = True
    assert bent(fitter, model) == 0.0


ARM = arm()
# Inertia about the last axis per unit of its parameters [kg m^2]: gears of ratio one, a link of 0.02 kg m^2.
LAST = {"j6.motor_inertia": 1.0, "j6.inertia_scale": 0.02}


def load(mass_kg: float, gyration_m2: float = 0.0) -> Effect:
    return Effect("payload", None, {"mass_kg": mass_kg, "x_m": 0.1, "gyration_m2": gyration_m2})


def said(name: str, change: float, *causes: Effect) -> str:
    """Return what is said of one parameter that a re-fit moved by so much."""
    nominal = ARM.parameters()
    model = SimpleNamespace(robot_values={name: nominal[name] + change}, ended_at_bound=())
    tolerances = {"motor_inertia": 1e-6, "inertia_scale": 1e-6}
    (found,) = parameters_at_edge(model, nominal, tolerances, brought_inertias(ARM, causes))
    return found.message


@pytest.mark.parametrize("name", LAST)
def test_the_inertia_of_a_load_is_no_error_of_the_rotor_that_turns_it(name: str):
    text = said(name, 0.004 / LAST[name], load(2.0))
    assert "an inertia of 0.004 kg m^2 about axis 6" in text and "payload" in text
    assert "tolerance in the robot file" not in text
    # A load that is missing takes its inertia away.
    assert "payload" in said(name, -0.004 / LAST[name], load(-2.0))


@pytest.mark.parametrize(
    ("change", "causes"),
    [
        (0.004, ()),
        (0.004, (Effect("coulomb_friction", 6, {"coulomb_nm": 1.0}),)),
        # The load was fitted with its inertia.
        (0.004, (load(2.0, 0.01),)),
        # No load takes inertia away.
        (-0.004, (load(2.0),)),
        # A body of 2 kg that spreads over 0.3 m is no tool.
        (0.2, (load(2.0),)),
    ],
)
def test_other_parameters_at_their_edge_stay_doubtful(change: float, causes: tuple[Effect, ...]):
    assert "tolerance in the robot file" in said("j6.motor_inertia", change, *causes)

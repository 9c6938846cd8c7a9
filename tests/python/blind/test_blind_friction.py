"""Friction that remembers or is uneven, in both engines of the benchmark: closed forms."""

import numpy as np
import pytest

from axisight.blind import formulas, friction_formulas, friction_laws, laws
from axisight.blind.drawing import ENGINES
from axisight.blind.formulas import Place
from axisight.blind.friction_formulas import SlidingElements, UnevenArctan
from axisight.blind.friction_laws import ElastoPlastic, UnevenFriction
from axisight.blind.laws import Axis
from axisight.blind.scene import Scene
from axisight.blind.withheld import yielding
from axisight.blind.withheld_formulas import DRY_STRAIN_RAD
from axisight.robot import load_robot

DRY, WAY = 0.7, 0.05


def along(motor: np.ndarray, engine: str) -> np.ndarray:
    """Friction on a motor that follows these angles."""
    if engine == "mujoco":
        law = ElastoPlastic(DRY, WAY)
        law.begin(1e-3)
        return np.array([law.torque(Axis(0.0, m, 0.0, 0.0, 0.0, 0.01, 0.0))[0] for m in motor])
    formula, out = SlidingElements(DRY, WAY), []
    places = [Place(0.0, np.array([m]), *[np.zeros(1)] * 3, 0.01, 1.0, 0.0) for m in motor]
    formula.begin(places[0], 1e-3)
    for place in places:
        out.append(float(np.asarray(formula.torque(place)[0])[0]))
        formula.moved(place)
    return np.array(out)


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio"])
def test_it_yields_before_it_slips_and_remembers(engine: str):
    """A spring for small moves, dry friction after long ones, a loop that a reversal of twice the way closes."""
    small = np.linspace(0.0, 0.1 * WAY, 20)
    torque = along(small, engine)
    assert np.diff(torque) == pytest.approx(np.diff(torque)[0], rel=1e-9)
    there = np.linspace(0.0, 4 * WAY, 2000)
    path = np.concatenate([there, there[::-1], there])
    torque = along(path, engine)
    assert torque[1999] == pytest.approx(-DRY, rel=1e-3)
    assert torque[3999] == pytest.approx(DRY, rel=1e-3)
    assert torque[-1] == pytest.approx(-DRY, rel=1e-3)
    # Elements that slip one by one give back what bends both ways: of every leg twice the way is lost.
    work = -np.sum(torque[2000:] * np.gradient(path)[2000:])
    # Bristles that slip before the end lose less.
    near = 0.01 if engine == "pinocchio" else 0.3
    assert 4 * WAY - 0.5 * work / DRY == pytest.approx(2 * WAY, rel=near)


def test_friction_is_uneven_over_the_joint():
    """Dry friction far above its corner, of the size of the place and against the speed."""
    angle, share, waves, phase = 0.3, 0.8, 5.0, 0.4
    size = DRY * (1 + share * np.sin(waves * angle + phase))
    law = UnevenFriction(DRY, share, waves, phase, 1e-6)
    formula = UnevenArctan(DRY, share, waves, phase, 1e-6)
    for speed in (-2.0, 2.0):
        place = Place(
            0.0, np.array([30.0]), np.array([100.0 * speed]), *[np.zeros(1)] * 2, 0.01, 1.0, 0.0
        )
        found = [
            law.torque(Axis(0.0, 30.0, 100 * speed, angle, speed, 0.01, 0.0)),
            [float(np.asarray(x).squeeze()) for x in formula.torque(place)],
        ]
        for motor, joint in found:
            assert (motor, joint) == (0.0, pytest.approx(-np.sign(speed) * size, rel=1e-5))


@pytest.mark.parametrize("speed", [-40.0, -0.02, 0.0, 0.3, 25.0])
def test_viscous_friction_by_direction_is_that_of_the_table_beyond_its_corner(speed: float):
    """Corners of 0.05 rad/s: both laws leave out at most 0.05 D of the torque D |w|, the table less."""
    half = -0.004
    law = friction_laws.ViscousByDirection(half, -half)
    formula = friction_formulas.RoundedViscousByDirection(half, 0.05)
    one = np.ones(1)
    place = Place(0.0, 3.0 * one, speed * one, *[np.zeros(1)] * 2, 0.01, 1.0, 0.0)
    motor = law.torque(Axis(0.0, 3.0, speed, 0.03, 0.01 * speed, 0.01, 0.0))
    assert motor == (pytest.approx(-half * abs(speed), abs=1e-15), 0.0)
    rounded, joint = formula.torque(place)
    assert np.abs(np.asarray(rounded) + half * abs(speed)).max() <= 0.05 * abs(half)
    assert joint == 0.0


def test_behind_the_gear_friction_follows_the_joint():
    """The motor may stand or run on: the joint has the friction, `1 / r` times as large as a motor would."""
    ratio, speed, dry = 0.01, -0.3, (0.7, 0.4)
    # A joint that turns backward in front of a motor that turns forward, the gear bent by as much.
    law = friction_laws.BehindGear(laws.OneSidedFriction(*dry, 1e-6))
    formula = friction_formulas.BehindGear(formulas.OneSidedFriction(*dry, 1e-6))
    one = np.ones(1)
    place = Place(
        0.0, 30.0 * one, 100.0 * one, 0.2 * one, (100.0 * ratio - speed) * one, ratio, 1.0, 0.0
    )
    law.begin(1e-3)
    formula.begin(place, 1e-3)
    found = [
        law.torque(Axis(0.0, 30.0, 100.0, 30.0 * ratio - 0.2, speed, ratio, 0.0)),
        [float(np.asarray(x).squeeze()) for x in formula.torque(place)],
    ]
    for motor, joint in found:
        # Corners of a millionth of a radian a second of motors that would turn 30.
        assert (motor, joint) == (0.0, pytest.approx(dry[1] / ratio, rel=1e-6))
    # A bristle remembers where the joint was: it is not strained by a motor that turns alone.
    bristle = friction_formulas.BehindGear(formulas.DahlFriction(0.7, 350.0))
    still = Place(0.0, 0.0 * one, *[np.zeros(1)] * 3, ratio, 1.0, 0.0)
    bristle.begin(still, 1e-3)
    turned = Place(0.0, 0.1 * one, 0.0 * one, 0.1 * ratio * one, 0.0 * one, ratio, 1.0, 0.0)
    assert bristle.torque(turned)[1] == pytest.approx(0.0, abs=1e-9)
    bristle.moved(turned)
    assert abs(bristle.torque(Place(0.0, 0.1 * one, *[np.zeros(1)] * 3, ratio, 1.0, 0.0))[1]) > 1.0


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "asymmetric_friction"])
def test_a_third_of_dry_friction_is_drawn_behind_the_gear(engine: str, name: str):
    rng, scene = np.random.default_rng(4), Scene(load_robot("irb6600_like"), [])
    drawn = [ENGINES[engine][name].draw(rng, scene, 1) for _ in range(300)]
    there = [d for d in drawn if "arm_share" in d.parameters]
    # A hundred, give or take three standard deviations of eight.
    assert 76 < len(there) < 124
    kind = friction_laws.BehindGear if engine == "mujoco" else friction_formulas.BehindGear
    assert all(isinstance(law, kind) for d in there for law in d.laws)
    assert not any(isinstance(law, kind) for d in drawn if d not in there for law in d.laws)
    assert all(d.laws and not d.native.friction_nm for d in there)


@pytest.mark.parametrize("engine", ENGINES)
def test_both_are_drawn(engine: str):
    assert {"presliding_friction", "position_dependent_friction"} <= set(ENGINES[engine])


@pytest.mark.parametrize("arm", ["irb6600_like", "scara_like", "lever_like", "cobot_like"])
def test_what_yields_first_does_not_slip_as_soon_as_dry_friction(arm: str):
    """One effect is not drawn under the name of another: its way is many times the strain of dry friction."""
    rng, scene = np.random.default_rng(5), Scene(load_robot(arm), [])
    ways = [yielding(rng, scene, 1 + k % scene.robot.n_axes) for k in range(60)]
    assert min(ways) > 3 * DRY_STRAIN_RAD

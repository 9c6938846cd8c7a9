"""Formulas of the engine on Pinocchio: closed forms, and a lever that SciPy integrates."""

import itertools

import numpy as np
import pytest
import scipy.integrate

from axisight import Robot, load_robot
from axisight.blind import laws
from axisight.blind.drawing import scattered
from axisight.blind.formulas import (
    CurrentLimit,
    DahlFriction,
    DahlGear,
    DeadZone,
    DelayLine,
    Formula,
    GearError,
    HardeningSpring,
    Lag,
    Place,
    Play,
    Push,
    ResolverImbalance,
    ResonantLoop,
    RoundedKnee,
    StaleSensor,
    TanhStribeck,
    WrongReport,
)
from axisight.blind.machine import Machine
from axisight.blind.motions import multisines
from axisight.blind.pinocchio_engine import _Loop

RATIO, STIFFNESS, DAMPING = 0.01, 1e5, 50.0


def at(
    motor: float = 0.0, speed: float = 0.0, deflection: float = 0.0, rate: float = 0.0, t: float = 0
) -> Place:
    one = np.ones(1)
    return Place(
        t, motor * one, speed * one, deflection * one, rate * one, RATIO, STIFFNESS, DAMPING
    )


def on_joint(law: Formula, place: Place) -> float:
    motor, joint = law.torque(place)
    # A gear pushes both ways.
    assert np.asarray(motor) == pytest.approx(-RATIO * np.asarray(joint))
    return float(np.asarray(joint)[0])


def loop(law: DahlFriction | DahlGear, places: list[Place], joint: bool) -> list[float]:
    """Torques along places, each ending a step."""
    law.begin(places[0], 1e-3)
    out = []
    for place in places:
        law.moved(place)
        out.append(float(np.asarray(law.torque(place)[1 if joint else 0])[0]))
    return out


def test_dahls_friction_comes_with_displacement():
    law = DahlFriction(0.4, 400.0)
    path = np.concatenate([np.linspace(0, 0.1, 2001), np.linspace(0.1, -0.1, 4001)])
    torque = np.array(loop(law, [at(motor=x) for x in path], joint=False))
    # From rest: F = F_c (1 - exp(-sigma x / F_c)).
    assert torque[10] == pytest.approx(-0.4 * (1 - np.exp(-400 * path[10] / 0.4)), rel=1e-9)
    assert torque[2000] == pytest.approx(-0.4, rel=1e-9)
    assert torque[-1] == pytest.approx(0.4, rel=1e-9)


def test_a_gear_that_slips_does_not_depend_on_the_steps():
    ends = [0.0, 3e-4, -2e-4, 1e-4]
    found = []
    for steps in (1, 7):
        path = np.concatenate(
            [np.linspace(a, b, steps + 1)[1:] for a, b in itertools.pairwise(ends)]
        )
        torque = loop(DahlGear(2e5, 20.0), [at(deflection=x) for x in [0.0, *path]], joint=True)
        found.append(torque[-1])
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    assert abs(found[0]) < 20.0


def test_springs_are_what_they_say_far_from_their_corners():
    k, d = STIFFNESS, DAMPING
    play = Play(2e-4)
    # In contact it is a spring moved by the half width; without, spring and damper are gone.
    assert on_joint(play, at(deflection=2e-3, rate=0.3)) == pytest.approx(-k * 2e-4, rel=1e-2)
    assert on_joint(play, at(deflection=0.0, rate=0.3)) == pytest.approx(-d * 0.3, rel=5e-3)
    cube = HardeningSpring(1e10)
    assert on_joint(cube, at(deflection=1e-4)) == pytest.approx(1e10 * 1e-12, rel=1e-3)
    knee = RoundedKnee(4e4, 3e-4)
    assert on_joint(knee, at(deflection=-2e-3)) == pytest.approx(-4e4 * 1.7e-3, rel=1e-3)
    assert abs(on_joint(knee, at(deflection=1e-5))) < 0.01 * 4e4 * 3e-4


def test_stribeck_falls_to_its_dry_friction():
    law = TanhStribeck(0.4, 0.3, 5.0, 0.1)
    (fast, _), (slow, _) = law.torque(at(speed=200.0)), law.torque(at(speed=0.5))
    assert float(np.asarray(fast)[0]) == pytest.approx(-0.4, rel=1e-6)
    expected = -(0.4 + 0.3 * (1 - np.tanh(0.1)))
    assert float(np.asarray(slow)[0]) == pytest.approx(expected, rel=1e-3)


def test_an_error_of_the_gears_angle_takes_no_power():
    law = GearError(2.0, 1e-4, 0.3)
    # Energy of the spring is k (deflection + wave)^2 / 2: torques are its slopes in the angles.
    deflection, motor, h = 3e-4, 0.7, 1e-6

    def energy(phi: float) -> float:
        angle = 2.0 * phi + 0.3
        wave = 1e-4 * (np.sin(angle) + 0.03 * np.sin(2 * angle) - np.sin(0.3))
        return 0.5e5 * (deflection + RATIO * (phi - motor) + wave) ** 2

    slope = (energy(motor + h) - energy(motor - h)) / (2 * h)
    got, _ = law.torque(at(motor=motor, deflection=deflection))
    # The plain spring's own part of it is the engine's.
    assert -(RATIO * 1e5 * deflection) + float(np.asarray(got)[0]) == pytest.approx(
        -slope, rel=1e-6
    )


def test_a_resolver_with_unequal_windings_waves_at_twice_and_once_its_angle():
    law, motor = ResolverImbalance(3, 1e-3, 2e-3), np.linspace(0, 2 * np.pi, 721)
    expected = 1e-3 / 2 / 3 * np.sin(6 * motor) - 2e-3 / 3 * np.sin(3 * motor)
    # Second order of the imbalances is left out.
    assert np.abs(law.sensor(motor) - expected).max() < 4e-6


def test_drives_are_late_by_what_they_say():
    line = DelayLine(0.7e-3)
    line.begin(at(), 0.5e-3)
    ramp = [float(line.command(np.array([k * 1.0]))[0]) for k in range(10)]
    # A held ramp, one a step: late by the delay over the step, once the line is full.
    assert np.array(ramp[3:]) == pytest.approx(np.arange(3, 10) - 1.4)
    lag = Lag(2e-3)
    lag.begin(at(), 1e-3)
    lag.command(np.zeros(1))
    means = [float(lag.command(np.ones(1))[0]) for _ in range(5)]
    starts = 1e-3 * np.arange(5)
    # Mean of 1 - exp(-t / T) over each step.
    exact = 1 - 2.0 * (np.exp(-starts / 2e-3) - np.exp(-(starts + 1e-3) / 2e-3))
    assert means == pytest.approx(exact, rel=1e-12)
    loops = ResonantLoop(2e-3, 0.4), laws.ResonantLoop(2e-3, 0.4)
    loops[0].begin(at(), 1e-4)
    loops[1].begin(1e-4)
    loops[0].command(np.zeros(1))
    loops[1].command(0.0)
    found = [(float(loops[0].command(np.ones(1))[0]), loops[1].command(1.0)) for _ in range(200)]
    # Its step response (Ogata 2010, section 5.3), in the middle of every step; means over steps and the
    # midpoint rule are off by a share of the square of a step of a twentieth.
    t, swing = (np.arange(200) + 0.5) * 0.05, np.sqrt(1 - 0.4**2)
    wave = np.cos(swing * t) + 0.4 / swing * np.sin(swing * t)
    assert np.abs(np.array(found) - (1 - np.exp(-0.4 * t) * wave)[:, None]).max() < 1e-3
    stale = StaleSensor(2)
    stale.begin(at(), 1e-3)
    said = [k + float(np.asarray(stale.sensor(np.array([float(k)])))[0]) for k in range(6)]
    assert said == [0, 0, 0, 1, 2, 3]


def test_what_a_drive_makes_of_commands_and_says_of_them():
    torque = np.array([-3.0, -0.2, 0.1, 2.0])
    np.testing.assert_allclose(CurrentLimit(1.5).command(torque), [-1.5, -0.2, 0.1, 1.5])
    np.testing.assert_allclose(CurrentLimit(1.5).reported(torque), [-1.5, -0.2, 0.1, 1.5])
    np.testing.assert_allclose(DeadZone(0.5).command(torque), [-2.5, 0.0, 0.0, 1.5])
    np.testing.assert_allclose(WrongReport(1.1, 0.2).reported(torque), 1.1 * torque - 0.2)
    pushes = [Push(5.0, 1.0, 2.0).torque(at(t=t))[1] for t in (0.9, 2.0, 3.1)]
    assert pushes == pytest.approx([0.0, 5.0, 0.0])


def test_a_formula_does_nothing_unless_told():
    law, x = Formula(), np.ones(2)
    law.begin(at(), 1e-3)
    law.moved(at())
    assert law.torque(at()) == (0.0, 0.0)
    assert law.sensor(x) == 0.0
    assert law.command(x) is x and law.reported(x) is x


def test_a_lever_with_play_moves_as_scipy_says():
    # Nearly upright it carries little weight, and rattles through its play.
    preset = load_robot("lever_like")
    upright = Robot.from_toml(preset.toml.replace("joint_angle = [0.2]", "joint_angle = [1.5]"))
    robot = scattered(np.random.default_rng(2), upright)
    reference = 3.0 * multisines(np.random.default_rng(3), robot)["multisine_axis1"][1][:360]
    width, values = 2e-4, {k.partition(".")[2]: v for k, v in robot.parameters().items()}
    loop = _Loop(Machine(robot, laws={0: [Play(width)]}), 1)
    loop.follow(np.zeros((100, 1, 1)), np.zeros((100, 1, 1)))
    state = loop.state[0].copy()
    torque, angle = loop.follow(reference[:, None, :], np.zeros((360, 1, 1)))
    # One equation of motion, written out: a mass on a lever, its inertia about the mass.
    ratio, mass, arm = float(robot.gear_ratio[0]), values["mass"], values["com_x"]
    spring, damper = values["stiffness"], values["damping"]
    inertia = 5.0 * values["inertia_scale"] + mass * arm**2

    def rates(_t: float, y: np.ndarray, drive: float) -> list[float]:
        phi, q, dphi, dq = y
        deflection, rate = ratio * phi - q, ratio * dphi - dq
        above, below = (np.hypot(deflection + s * width, 0.05 * width) for s in (1, -1))
        contact = 1 - 0.5 * ((deflection + width) / above - (deflection - width) / below)
        gear = spring * (deflection - 0.5 * (above - below)) + damper * contact * rate
        weight = mass * 9.81 * arm * np.cos(q)
        free = drive - values["viscous_friction"] * dphi - ratio * gear
        return [dphi, dq, free / values["motor_inertia"], (gear + weight) / inertia]

    seen = []
    for k in range(len(reference)):
        # Steps cross the rounded corners of contact in one: a fifth of the play in all these impacts.
        assert angle[k, 0, 0] == pytest.approx(state[0], abs=0.2 * width / ratio)
        solved = scipy.integrate.solve_ivp(
            rates, (0, 5e-4), state, "DOP853", args=(torque[k, 0, 0],), rtol=1e-10, atol=1e-12
        )
        state = solved.y[:, -1]
        seen.append(abs(ratio * state[0] - state[1]) / width)
    # In contact and out of it.
    assert min(seen) < 0.5 and max(seen) > 2.0

"""Natural sizes: what is a lot on a large robot and on a small one, and what hangs on it."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, Robot, load_robot
from axisight.blind.motions import multisines, point_to_point
from axisight.effects import effect_info
from axisight.gap import Settings
from axisight.gap.screening.screening import Screening, ScreeningModel
from axisight.gap.simulator.natural_sizes import NaturalSizes
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import log_of


def logs_of(
    robot: Robot, effects: list[Effect], seconds: float = 4.0, *, moving: bool = False
) -> list[Log]:
    """A log of moves and one of a multisine; or logs of moves only."""
    rng = np.random.default_rng(1)
    moves = point_to_point(rng, robot)
    found = [moves["moves_1"], multisines(rng, robot)["multisine_fresh"]]
    if moving:
        found = [x for x in moves.values() if x[0] == "estimation"]
    n = round(seconds / robot.sample_time_s)
    return [log_of(robot, effects, ref[:n], run) for run, (_, ref) in enumerate(found)]


@pytest.fixture(scope="module")
def small() -> Robot:
    return load_robot("scara_like")


def test_a_large_robot_has_the_sizes_of_the_table():
    robot = load_robot("irb6600_like")
    sizes = NaturalSizes(robot, logs_of(robot, [], 2.0))
    for name in ("coulomb_friction", "backlash", "payload", "torque_ripple", "extra_mode"):
        info = effect_info(name)
        effect = Effect(name, None if info.scope == "arm" else 1)
        for p in info.parameters:
            # Two seconds do not show all of its torque; within a factor, the table's.
            assert 0.05 * p.typical < sizes.of(effect, p.name) <= p.typical


def test_a_small_robot_has_sizes_of_its_own(small: Robot):
    logs = logs_of(small, [], 2.0)
    sizes = NaturalSizes(small, logs)
    largest = [max(np.abs(log.torque_nm[:, i]).max() for log in logs) for i in range(3)]
    friction = sizes.of(Effect("coulomb_friction", 2), "coulomb_nm")
    assert friction == pytest.approx(0.02 * largest[1]) and friction < 0.01
    # A ball screw of 4e6 N/m gives way by micrometres; what a shape is, stays what it is.
    assert sizes.of(Effect("backlash", 3), "half_width_rad") < 2e-6
    assert sizes.of(Effect("coulomb_friction", 2), "smoothing_rad_s") == 0.1
    assert sizes.of(Effect("payload", None), "mass_kg") == pytest.approx(0.02 * 3.0)
    assert sizes.of(Effect("torque_constant", 2), "relative_error") == 0.05
    still = [replace(x, torque_nm=np.zeros_like(x.torque_nm)) for x in logs]
    at_rest = NaturalSizes(small, still)
    assert at_rest.of(Effect("coulomb_friction", 2), "coulomb_nm") == 0.5
    # Nor does an axis without torque divide by it.
    for name, size in (("nonlinear_stiffness", "cubic_nm_rad3"), ("power_supply_sag", "sag_1_w")):
        typical = next(p.typical for p in effect_info(name).parameters if p.name == size)
        assert at_rest.of(Effect(name, 2), size) == typical


def test_what_is_far_fetched_is_three_times_the_torque_of_the_motor(small: Robot):
    logs = logs_of(small, [], 2.0)
    sizes = NaturalSizes(small, logs)
    ratio = float(small.gear_ratio[1])
    torque = max(np.abs(log.torque_nm[:, 1]).max() for log in logs)
    turn = ratio * max(np.ptp(log.position_rad[:, 1]) for log in logs)
    assert sizes.largest(Effect("coulomb_friction", 2)) == {"coulomb_nm": pytest.approx(3 * torque)}
    spring = sizes.largest(Effect("cable_stiffness", 2))
    # Over the range in which the joint turned, the spring alone gives that torque on the joint side.
    assert spring["stiffness_nm_rad"] * turn == pytest.approx(3 * torque / ratio)
    assert spring["at_zero_nm"] == pytest.approx(3 * torque / ratio)
    # A simulator may state more, and a machine have none of that.
    placeholder = small.with_effects([Effect("coulomb_friction", 2, {"coulomb_nm": 50.0 * torque})])
    assert NaturalSizes(placeholder, logs).largest(Effect("coulomb_friction", 2)) == {
        "coulomb_nm": pytest.approx(50.0 * torque)
    }
    # Each number of an effect has its own.
    cable = Effect("cable_stiffness", 2, {"stiffness_nm_rad": 1e7, "at_zero_nm": 0.0})
    held = NaturalSizes(small.with_effects([cable]), logs).largest(Effect("cable_stiffness", 2))
    assert held == {"stiffness_nm_rad": 1e7, "at_zero_nm": spring["at_zero_nm"]}
    # What is no torque has no such size, and an axis without torque gives none.
    assert sizes.largest(Effect("payload", None)) == sizes.largest(Effect("backlash", 2)) == {}
    still = [replace(x, torque_nm=np.zeros_like(x.torque_nm)) for x in logs]
    assert NaturalSizes(small, still).largest(Effect("coulomb_friction", 2)) == {}


@pytest.mark.parametrize(
    ("truth", "moving"),
    [
        (Effect("friction_warmup", 1, {"viscous_nm_s_rad": -6e-4, "time_constant_s": 2.0}), False),
        # Of slow motions only, whose low frequencies are quiet.
        (Effect("viscous_friction", 3, {"viscous_nm_s_rad": 9e-5}), True),
    ],
)
def test_a_small_robots_friction_promises_what_a_fit_gains(
    truth: Effect, moving: bool, small: Robot
):
    # With sizes of large robots half of the blocks had no derivative, and friction no promise.
    assert_promised(small, truth, logs_of(small, [truth], 10.0 if moving else 4.0, moving=moving))


def test_a_sagging_supply_promises_what_a_fit_gains():
    # With a size for small powers the blocks with most of it had no derivative.
    robot = load_robot("irb6600_like")
    truth = Effect("power_supply_sag", 3, {"sag_1_w": 1e-4, "curvature": 0.0})
    assert_promised(robot, truth, logs_of(robot, [truth], 4.0))


TINY = """
schema = "axisight.robot/2"
name = "two rigid axes of a few hundred grams, the second without its rotor"
gravity = [0.0, 0.0, -9.81]
sample_time = 0.002
[[joint]]
name = "shoulder"
kind = "driven"
origin = [0.0, 0.0, 0.1]
axis = [0.0, 1.0, 0.0]
link = { mass = 0.6, com = [0.08, 0.01, 0.0], inertia = [3e-4, 2e-3, 2e-3, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.02, motor_inertia = 6e-6, viscous_friction = 2e-5 }
[[joint]]
name = "wrist"
kind = "driven"
origin = [0.16, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
link = { mass = 0.3, com = [0.03, 0.0, 0.01], inertia = [1e-4, 2e-4, 2e-4, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.03, motor_inertia = 0.0, viscous_friction = 8e-6 }
[controller]
kind = "pi_velocity"
kp = [1.6e-3, 4e-5]
ki = [1e-2, 2.4e-4]
[sensor]
position_noise_std = 8e-5
"""


def test_the_rotor_of_a_tiny_axis_promises_what_a_fit_gains():
    # With 0.01 kg m^2 as a size, fifty thousand times that rotor, no block of its own axis had a derivative.
    tiny = Robot.from_toml(TINY)
    truth = Effect("rotor_inertia", 2, {"inertia_kg_m2": 2e-7})
    logs = logs_of(tiny, [truth])
    assert_promised(tiny, truth, logs)
    ahead = [np.abs(np.diff(log.position_rad[::20, 1], 2)).max() / 0.04**2 for log in logs]
    torque = max(np.abs(log.torque_nm[:, 1]).max() for log in logs)
    size = NaturalSizes(tiny, logs).of(truth, "inertia_kg_m2")
    # The top acceleration of every twentieth sample is a little below that of all samples.
    assert 0.8 * 0.02 * torque / max(ahead) < size <= 0.02 * torque / max(ahead)


def assert_promised(robot: Robot, truth: Effect, logs: list[Log]) -> None:
    view = ClosedLoopView(robot, logs, Settings())
    base = view.fitter.fit([])
    option = next(c for c in view.candidates(base) if c.effect.label == truth.label)
    fitted = view.fitter.fit([option], base)
    gained = base.total - fitted.total
    assert gained > 0.9 * base.total
    # As it is screened: beside others, any of which could make a block count as chaotic.
    screen = Screening(ScreeningModel(view.fitter, base))
    starts = [s for group in screen.groups(view.candidates(base)) for s in screen.starts(group)]
    (promised,) = (s.gain for s in starts if s.option.effect.label == truth.label)
    assert promised > 0.8 * gained


def test_a_simulator_that_cannot_follow_as_it_is_does_not_end_a_diagnosis(small: Robot):
    view = ClosedLoopView(small, logs_of(small, []), Settings())
    base = view.fitter.fit([])
    logs = view.fitter.records
    # Angles as of a loop that swings up without end.
    wild = [(p * 1e9 * np.arange(len(p))[:, None] ** 2, t, c, *at) for p, t, c, *at in logs]
    bench = ScreeningModel(view.fitter.along(wild), base)
    bench.begin_nominal()
    assert bench.near_nominal is None
    # What can be simulated, is: without runs to follow.
    option = next(c for c in view.candidates(base, axes=[2]) if c.effect.axis == 2)
    assert ScreeningModel(view.fitter, base).attempt(view.fitter.evaluate, option, {}) is not None

"""A modelled remainder in a simulation: where its torque acts, and what a robot file keeps of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import axisight
import three_axes
from axisight import Effect, Log, Robot, RobotError, load_robot, simulate, simulate_batch
from axisight.errors import InputError, StudyError
from axisight.fitting import fit, robot_parameter
from axisight.remainder import Remainder, RunningRemainder, Term
from montecarlo_data import small_study

Array = NDArray[np.float64]


def term(axis: int, acts: str, variable: str, of_axis: int, x: Array, value: Array) -> Term:
    return Term(
        axis=axis,
        acts=acts,  # type: ignore[arg-type]
        variable=variable,
        of_axis=of_axis,
        x=x,
        value=value,
        standard_error=np.zeros_like(value),
        corner_rad_s=1.0,
        gain=0.5,
        significance=5.0,
    )


def remainder(*terms: Term, limit: float = 100.0) -> Remainder:
    return Remainder(terms, np.full(3, limit), np.full(3, 0.1))


def constant(axis: int, torque: float, acts: str = "torque") -> Term:
    return term(axis, acts, "constant", axis, np.zeros(1), np.array([torque]))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


def references(robot: Robot, seconds: float = 0.3) -> Array:
    t = np.arange(int(seconds / robot.sample_time_s)) * robot.sample_time_s
    return np.asarray(20 * np.sin(2 * np.pi * 3 * t)[:, None] * [1, -0.5, -1])


def differs(a: xr.Dataset, b: xr.Dataset, name: str) -> float:
    return float(np.abs(a[name] - b[name]).max())


def test_a_constant_is_carried_by_the_command_alone(robot: Robot) -> None:
    """What the simulator lacks acts against the motor, and the settled integrator holds it."""
    ref = references(robot)
    plain = simulate(robot, ref)
    with_it = simulate(robot.with_remainder(remainder(constant(2, 1.5))), ref)
    assert differs(plain, with_it, "position_rad") < 1e-12
    more = with_it["torque_cmd_nm"] - plain["torque_cmd_nm"]
    np.testing.assert_allclose(more, np.broadcast_to([0.0, 1.5, 0.0], more.shape), atol=1e-10)
    added = with_it["torque_disturbance_nm"] - plain["torque_disturbance_nm"]
    np.testing.assert_allclose(added, np.broadcast_to([0.0, -1.5, 0.0], added.shape), atol=1e-12)


def test_a_drive_with_other_constants_holds_it_too(robot: Robot) -> None:
    """At rest the command holds the remainder behind whatever the torque path does to it."""
    weak = [Effect("torque_constant", 2, {"relative_error": -0.2})]
    still = np.zeros((40, 3))
    run = simulate(robot.with_remainder(remainder(constant(2, 2.0))), still, effects=weak)
    plain = simulate(robot, still, effects=weak)
    assert differs(run, plain, "position_rad") < 1e-12
    more = (run["torque_cmd_nm"] - plain["torque_cmd_nm"]).to_numpy()[:, 1]
    np.testing.assert_allclose(more, 2.0 / 0.8, atol=1e-10)


def test_viscous_friction_by_two_ways(robot: Robot) -> None:
    """Held over a sample, a torque in proportion to speed is late by half a sample, so the error is first order."""
    friction = 0.02
    found = []
    for factor in (1, 2):
        other = robot.with_sample_time(robot.sample_time_s / factor)
        ref = references(other)
        by_effect = simulate(
            other, ref, effects=[Effect("viscous_friction", 2, {"viscous_nm_s_rad": friction})]
        )
        by_term = simulate(
            other, ref, remainder=RunningRemainder(remainder(constant(2, friction, "speed")))
        )
        plain = simulate(other, ref)
        size = differs(plain, by_effect, "torque_cmd_nm")
        found.append(differs(by_term, by_effect, "torque_cmd_nm") / size)
    # Half a sample of a 3 Hz sine is 0.5 % of its size; the loop of some 10 Hz may double it.
    assert found[0] < 0.02
    assert found[1] == pytest.approx(found[0] / 2, rel=0.2)


def test_a_simulation_adds_what_the_functions_say(robot: Robot) -> None:
    """The added torque is the function at the true angle of another axis, to rounding."""
    angle = term(1, "torque", "angle", 3, np.linspace(-40, 40, 9), np.sin(np.arange(9.0)))
    ref = references(robot)
    run = simulate(robot.with_remainder(remainder(angle)), ref)
    plain = simulate(robot, ref)
    at = run["motor_position_rad"].to_numpy()[:, 2]
    added = run["torque_disturbance_nm"] - plain["torque_disturbance_nm"]
    np.testing.assert_allclose(added[:, 0], -angle.function(at), atol=1e-12)


def test_the_load_at_rest_is_what_the_gear_carries(robot: Robot) -> None:
    """A term of the load sees the static torque, which at rest is all that the motor gives."""
    still = np.zeros((5, 3))
    share = 0.25
    run = simulate(robot.with_remainder(remainder(constant(2, share, "load"))), still)
    static = simulate(robot, still)["torque_cmd_nm"].to_numpy()
    np.testing.assert_allclose(
        run["torque_cmd_nm"].to_numpy()[:, 1], (1 + share) * static[:, 1], rtol=1e-9
    )


class Seen(RunningRemainder):
    """Keeps the motion that it is asked for."""

    def __call__(self, *now: object) -> Array:  # type: ignore[override]
        self.last = now
        return np.zeros(3)


def test_the_load_of_a_rigid_gear_is_that_of_the_bodies() -> None:
    """Motor balance in the simulation against the rigid-body inverse dynamics of the same motion."""
    arm = three_axes.robot()
    seen = Seen(remainder())
    torque = 5 * np.sin(np.outer(np.arange(30), [0.1, 0.2, 0.3]))
    simulate(arm, torque_nm=torque, remainder=seen)
    _, *motion, load = seen.last
    joint = [np.asarray(x) * arm.gear_ratio for x in motion]
    # Rounding of accelerations of some 1e3 rad/s^2.
    np.testing.assert_allclose(load, arm.inverse_dynamics(*joint) * arm.gear_ratio, atol=1e-9)


def test_a_file_keeps_every_bit(robot: Robot) -> None:
    rough = term(2, "way", "speed", 1, np.linspace(-30, 30, 7), np.arange(7.0) / 3)
    stated = robot.with_remainder(remainder(rough, constant(3, 0.1, "direction")))
    again = Robot.from_toml(stated.toml)
    assert again.remainder is not None
    ref = references(robot, 0.1)
    xr.testing.assert_identical(simulate(stated, ref), simulate(again, ref))
    assert again.with_remainder(None).remainder is None
    assert robot.with_remainder(None).toml == robot.toml
    assert stated.with_parameters({"axis1.stiffness": 1e6}).remainder is not None


def test_the_first_way_is_that_of_the_reference(robot: Robot) -> None:
    """A standing axis holds what its first motion will need, unless the call says how it moved last."""
    held = remainder(constant(2, 1.0, "way"))
    ref = np.zeros((50, 3))
    ref[20:, 1] = -5.0
    still = simulate(robot, np.zeros((5, 3)))["torque_cmd_nm"].to_numpy()[0, 1]
    by_reference = simulate(robot.with_remainder(held), ref)
    told = simulate(robot, ref, remainder=RunningRemainder(held, start_way=[0, 1, 0]))
    assert by_reference["torque_cmd_nm"].to_numpy()[0, 1] == pytest.approx(still - 1.0)
    assert told["torque_cmd_nm"].to_numpy()[0, 1] == pytest.approx(still + 1.0)


def test_a_batch_is_its_runs(robot: Robot) -> None:
    acting = remainder(term(2, "way", "travel", 2, np.array([0.0, 1.0]), np.array([0.2, 0.5])))
    stated = robot.with_remainder(acting)
    refs = np.stack([references(robot, 0.05), -references(robot, 0.05)])
    batch = simulate_batch(stated, refs, noise_seed=3)
    for i in range(2):
        alone = simulate(stated, refs[i], noise_seed=3, run=i)
        np.testing.assert_array_equal(batch["torque_cmd_nm"][i], alone["torque_cmd_nm"])


def test_misuse_is_refused(robot: Robot) -> None:
    ref = references(robot, 0.01)
    stated = robot.with_remainder(remainder(constant(1, 1.0)))
    with pytest.raises(InputError, match="model: expected nonlinear"):
        simulate(stated, ref, model="linear")
    with pytest.raises(InputError, match="remainder: expected one of 3 axes, got 2"):
        robot.with_remainder(Remainder((), np.ones(2), np.ones(2)))
    warm = remainder(term(1, "speed", "temperature", 1, np.array([20.0, 40]), np.ones(2)))
    with pytest.raises(InputError, match="temperature_c"):
        simulate(robot.with_remainder(warm), ref)
    told = RunningRemainder(warm, temperature_c=[30, 30, 30])
    assert simulate(robot, ref, remainder=told).attrs["status"] == "completed"
    with pytest.raises(RobotError, match="remainder: limits_nm"):
        Robot.from_toml(robot.toml.replace("robot/1", "robot/2") + "\n[remainder]\n")
    with pytest.raises(RobotError, match="unknown key"):
        Robot.from_toml(robot.toml + "\n[remainder]\n")


def test_what_cannot_simulate_a_remainder_refuses_it(robot: Robot, tmp_path: Path) -> None:
    """No result without the remainder that a robot states passes for one with it."""
    stated = robot.with_remainder(remainder(constant(1, 1.0)))
    log = Log(
        name="still",
        source=Path("still"),
        sample_time_s=robot.sample_time_s,
        time_s=np.arange(10) * robot.sample_time_s,
        torque_nm=np.zeros((10, 3)),
        position_rad=np.zeros((10, 3)),
        velocity_ref_rad_s=np.zeros((10, 3)),
    )
    friction = robot_parameter(robot, "axis1.viscous_friction")
    with pytest.raises(InputError, match="without a remainder for a fit to logs"):
        fit(stated, [log], [friction])
    path = tmp_path / "robot.toml"
    path.write_text(stated.toml)
    study = small_study(robot=str(path), runs=1)
    with pytest.raises(StudyError, match="without a remainder for a study"):
        axisight.montecarlo.run(study)


class Broken(RunningRemainder):
    def __call__(self, *_: object) -> Array:  # type: ignore[override]
        raise InputError("law: broken")


def test_an_error_of_a_law_is_raised(robot: Robot) -> None:
    with pytest.raises(InputError, match="law: broken"):
        simulate(robot, references(robot, 0.01), remainder=Broken(remainder()))

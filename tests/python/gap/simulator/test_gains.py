"""Gains of a controller of targets that nobody knows: fitted beside the simulator's own parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Log, Robot, Settings, diagnose, load_robot, simulate
from axisight.cli.diagnose import _tolerances
from axisight.errors import InputError
from axisight.explore.exports import robot_text
from axisight.explore.session import Session, Version
from axisight.fitting import robot_parameter
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.simulator.own_parameters import (
    absorbed,
    for_core,
    gain_names,
    uncertain_gains,
    with_values,
)
from servo_arm import (
    HOME_RAD,
    MACHINES,
    NOMINAL,
    ServoArm,
    check_unknown_gains,
    simulator,
    targets,
)

pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
UNKNOWN = {**DEFAULT_TOLERANCES, "kp": 0.5, "kd": 0.5}
# Of the stated gains, what the machine's are.
KP, KD = (1.5, 0.7, 1.9), (0.8, 1.6, 0.6)
CHANGES = {
    f"j{i + 1}.{gain}": factors[i] - 1
    for i in range(3)
    for gain, factors in (("kp", KP), ("kd", KD))
}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return simulator(tmp_path_factory.mktemp("servo"))


def with_own_gains(arm: ServoArm) -> ServoArm:
    kp = tuple(float(k * f) for k, f in zip(arm.kp, KP, strict=True))
    kd = tuple(float(k * f) for k, f in zip(arm.kd, KD, strict=True))
    return replace(arm, kp=kp, kd=kd)  # type: ignore[arg-type]


def positions(robot: Robot) -> Array:
    wanted = np.repeat(targets(2)[:60], 10, axis=0)
    rate = np.diff(wanted, axis=0, append=wanted[-1:]) / robot.sample_time_s
    at_home = robot.with_operating_point(HOME_RAD)
    return np.asarray(simulate(at_home, rate, method="rk4")["position_rad"].values)


def test_gains_that_have_not_changed_change_nothing(robot: Robot) -> None:
    same = with_values(robot, dict.fromkeys(gain_names(robot), 0.0))
    np.testing.assert_array_equal(positions(same), positions(robot))
    assert with_values(robot, {"j1.mass": 9.0}).parameters()["j1.mass"] == 9.0


def test_changed_gains_are_those_of_a_file_that_states_them(robot: Robot, tmp_path: Path) -> None:
    """Of the controller alone: what steps of the simulator make of its damping stays."""
    text = robot.toml.replace("kp = [1800.0, 1800.0, 500.0]", f"kp = {[2700.0, 1260.0, 950.0]}")
    other = text.replace("kd = [120.0, 110.0, 25.0]", f"kd = {[96.0, 176.0, 15.0]}")
    assert other != text != robot.toml
    stated = positions(Robot.from_toml(other))
    found = positions(with_values(robot, CHANGES))
    np.testing.assert_allclose(found, stated, rtol=0, atol=1e-12)
    assert np.abs(stated - positions(robot)).max() > 1e-3


def test_a_fit_has_them_as_effects_behind_the_others(robot: Robot) -> None:
    tolerances = {"mass": 0.1, "kp": 0.5, "j3.kd": 0.4}
    gains = uncertain_gains(robot, tolerances)
    assert [p.name for p in gains] == ["j1.kp", "j2.kp", "j3.kp", "j3.kd"]
    # Four tolerances, and no gain below a twentieth.
    assert (gains[0].lower, gains[0].upper, gains[0].prior) == (-0.95, 2.0, (0.0, 0.5))
    mass = robot_parameter(robot, "j2.mass", relative_tolerance=0.1)
    tried = [Effect("coulomb_friction", 1, {"coulomb_nm": 1.0})]
    moved = [mass, *(replace(p, initial=0.1 * i) for i, p in enumerate(gains))]
    effects, parameters = for_core(robot, tried, moved)
    assert [e.label for e in effects] == [
        "coulomb_friction@1",
        *(f"controller_gain@{i}" for i in (1, 2, 3)),
    ]
    assert parameters[0] is mass
    proportional, speed = "relative_proportional", "relative_integral"
    places = [(p.effect, p.name, p.initial) for p in parameters[1:]]
    assert places == [
        (1, proportional, 0.0), (2, proportional, 0.1), (3, proportional, 0.2),
        (3, speed, pytest.approx(0.3)),
    ]  # fmt: skip
    assert effects[3].parameters == {proportional: 0.2, speed: pytest.approx(0.3)}
    assert absorbed(robot, moved) == {f"controller_gain@{i}" for i in (1, 2, 3)}
    assert for_core(robot, tried, [mass]) == (tried, [mass])


@pytest.mark.parametrize("lacks", ["coulomb_friction@2", None])
def test_unknown_gains_are_found_beside_what_lacks(robot: Robot, lacks: str | None) -> None:
    """Off by up to a factor of two: without a tolerance they are causes, six of them."""
    machine = with_own_gains(NOMINAL if lacks is None else MACHINES[lacks])
    logs = [machine.log(run) for run in (1, 2, 3)]
    settings = Settings(tolerances=UNKNOWN)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings)
    check_unknown_gains(found, lacks, CHANGES)
    assert found.gap.before > 0.5
    assert found.to_verdict()["settings"]["tolerances"]["kp"] == 0.5


def test_the_command_line_takes_their_tolerance_where_there_are_such_gains(robot: Robot) -> None:
    given = _tolerances(["kp=0.5", "j3.kd=0.3", "mass=0.1"], robot)
    assert given == {"kp": 0.5, "j3.kd": 0.3, "mass": 0.1}
    with pytest.raises(InputError, match="viscous_friction, or one of a joint"):
        _tolerances(["kp=0.5"], load_robot("irb6600_like"))
    with pytest.raises(InputError, match="kp, kd, or one of a joint"):
        _tolerances(["ki=0.5"], robot)


def test_robot_files_state_their_tolerance(robot: Robot) -> None:
    wide = Robot.from_toml(robot.toml + "\n[tolerances]\nkp = 0.5\nkd = 0.4\n")
    assert wide.tolerances == {"kp": 0.5, "kd": 0.4}
    assert Settings().tolerances_of(wide)["kp"] == 0.5


def test_other_gains_are_stated_once(robot: Robot) -> None:
    other = robot.with_effects([Effect("controller_gain", 2, {"relative_proportional": 0.3})])
    logs = [short_log(run) for run in (1, 2, 3)]
    with pytest.raises(InputError, match=r"without controller_gain@2 .*j1\.kp.*got both"):
        diagnose(
            robot=other, estimation=logs[:2], validation=logs[2:],
            settings=Settings(tolerances=UNKNOWN),
        )  # fmt: skip
    assert uncertain_gains(other, DEFAULT_TOLERANCES) == []
    assert uncertain_gains(load_robot("irb6600_like"), UNKNOWN) == []


def short_log(run: int) -> Log:
    return NOMINAL.log(run).part(0.0, 8.0)


def test_the_explorer_puts_found_gains_in_and_exports_them(robot: Robot) -> None:
    session = Session("servo", robot, [short_log(1)], [short_log(2)])
    values = session.known_parameters({"j1.kp": 0.5, "j2.mass": 0.01})
    assert values["j1.kp"] == 0.5
    assert values["j2.mass"] == pytest.approx(1.01 * robot.parameters()["j2.mass"])
    version = Version.of([], values)
    session.check(version)
    assert not np.allclose(session.see(0, version).simulated, session.see(0).simulated)
    read = Robot.from_toml(robot_text(session, version))
    (effect,) = read.effects
    assert effect.label == "controller_gain@1"
    assert effect.parameters is not None
    assert effect.parameters["relative_proportional"] == 0.5
    # One by hand takes the place of what was found.
    by_hand = Effect("controller_gain", 1, {"relative_proportional": 0.2})
    (effect,) = Robot.from_toml(robot_text(session, Version.of([by_hand], values))).effects
    assert effect.parameters is not None
    assert effect.parameters["relative_proportional"] == 0.2

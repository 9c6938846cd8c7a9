"""Diagnosis from positions and the targets they were told, without torque."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from axisight import Effect, Log, Robot, Settings, diagnose, load_robot, read_log, simulate
from axisight.effects.stated import VISCOUS_FRICTION
from axisight.errors import InputError, LogError, RobotError
from axisight.gap import RefusedInputError
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.gate.by_controller.follows_target import check_follows_target
from axisight.gap.prepare.position_targets import _earlier, between, with_commands
from axisight.gap.simulator.closed_loop_runs import simulated_positions
from axisight.logs.log import not_logged
from servo_arm import HOME_RAD, MACHINES, NOMINAL, RATE_HZ, ServoArm, simulator, targets

pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
ROUNDING_NM = 1e-9


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return simulator(tmp_path_factory.mktemp("servo"))


def test_actuators_that_are_told_positions_are_the_controller(robot: Robot) -> None:
    assert robot.controller_kind == "pd_position"
    assert robot.controller_gains["kp"].tolist() == list(NOMINAL.kp)
    assert robot.controller_gains["kd"].tolist() == list(NOMINAL.kd)
    assert not robot.velocity_feedforward
    # A tenth of the logs' sample time: no longer than 2 ms, and damping slows no joint by half in it.
    assert robot.sample_time_s == pytest.approx(0.002)
    assert "no plain motor" not in robot.toml


def test_the_command_follows_from_targets_and_positions(tmp_path: Path) -> None:
    """Of a robot that is simulated here, sampled as its controller runs: what it did command."""
    path = tmp_path / "robot.toml"
    text = simulator(tmp_path).toml.replace("continuous = true", "continuous = false")
    path.write_text(re.sub(r"step(_inertia)? = .*\n", "", text))
    robot = load_robot(path).with_operating_point(HOME_RAD)
    time = robot.sample_time_s
    wanted = targets(1)[:200]
    rate = np.diff(wanted, axis=0, append=wanted[-1:]) / time
    out = simulate(robot, rate, method="rk4")
    # Actuators hold the arm by being off their targets.
    held = out["torque_cmd_nm"].values[0] / robot.controller_gains["kp"]
    log = log_of(out["position_rad"].values, wanted + held - wanted[0] + HOME_RAD, time)
    found = with_commands(robot, [log])
    assert found is not None
    assert found.step == 1
    assert np.abs(found.logs[0].torque_nm - out["torque_cmd_nm"].values).max() < ROUNDING_NM


def log_of(position: Array, target: Array | None, time: float, name: str = "run") -> Log:
    return Log(
        name=name,
        sample_time_s=time,
        time_s=time * np.arange(len(position)),
        torque_nm=not_logged(position.shape),
        position_rad=position,
        position_ref_rad=target,
        source=Path(f"{name}.parquet"),
    )


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_commands_that_are_late_are_targets_that_are(robot: Robot, model: str) -> None:
    """Two and a half samples late: between targets in a line."""
    time = robot.sample_time_s
    wanted = np.repeat(targets(2)[:60], 10, axis=0)
    late = [Effect("input_delay", axis, {"delay_s": 2.5 * time}) for axis in (1, 2, 3)]
    shifted = [np.vstack([np.repeat(wanted[:1], k, axis=0), wanted[:-k]]) for k in (2, 3)]
    rates = [
        np.diff(x, axis=0, append=x[-1:]) / time for x in (wanted, (shifted[0] + shifted[1]) / 2)
    ]
    at_home = robot.with_operating_point(HOME_RAD)
    found = [
        simulate(at_home, r, effects=e, model=model, method="rk4")["position_rad"].values  # type: ignore[arg-type]
        for r, e in zip(rates, (late, []), strict=True)
    ]
    assert np.abs(found[0] - found[1]).max() < 1e-12
    on_time = simulate(at_home, rates[0], model=model, method="rk4")["position_rad"].values  # type: ignore[arg-type]
    assert np.abs(on_time - found[0]).max() > 1e-4


def test_a_law_that_holds_between_samples_is_that_of_short_samples(tmp_path: Path) -> None:
    """Halfway values are of second order: four times as long samples are sixteen times as far off."""
    text = simulator(tmp_path).toml
    wanted = targets(3)[:150]

    def positions(step: int, continuous: str) -> Array:
        path = tmp_path / "robot.toml"
        changed = text.replace("sample_time = 0.002", f"sample_time = {0.02 / step}")
        path.write_text(changed.replace("continuous = true", f"continuous = {continuous}"))
        robot = load_robot(path).with_operating_point(HOME_RAD)
        fine = np.repeat(wanted, step, axis=0)
        rate = np.diff(fine, axis=0, append=fine[-1:]) * step / 0.02
        return np.asarray(simulate(robot, rate, method="rk4")["position_rad"].values[::step])

    exact = positions(640, "true")
    errors = [np.abs(positions(step, "true") - exact).max() for step in (10, 40)]
    sampled = np.abs(positions(10, "false") - exact).max()
    assert errors[0] < 0.1 * sampled
    assert errors[1] < errors[0] / 10


@pytest.mark.parametrize("lacks", ["coulomb_friction@2", "controller_gain@3", "input_delay"])
def test_what_a_machine_lacks_is_named(robot: Robot, lacks: str) -> None:
    logs = [MACHINES[lacks].log(run) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "explained"
    assert found.causes[0].label.startswith(lacks)
    assert found.mode == "closed_loop"
    assert any("No torque was logged" in check for check in found.checks)
    assert found.to_verdict()["gap"]["compared"] == "positions"
    assert "the gap of positions on validation logs" in found.headline
    if lacks == "coulomb_friction@2":
        value = found.causes[0].parameters["coulomb_nm"]
        assert value.value == pytest.approx(2.5, rel=0.1)


def test_friction_that_is_stated_is_known_within_scatter(robot: Robot) -> None:
    """A quarter off, where three tolerances are 27 per cent."""
    logs = [MACHINES["coulomb_friction@2"].log(run) for run in (1, 2, 3)]
    stated = Effect("coulomb_friction", 2, {"coulomb_nm": 2.5 / 1.25, "smoothing_rad_s": 0.01})
    found = diagnose(
        robot=robot.with_effects([stated]),
        estimation=logs[:2],
        validation=logs[2:],
        settings=Settings(tolerances={**DEFAULT_TOLERANCES, VISCOUS_FRICTION: 0.09}),
    )
    assert (found.verdict, found.causes) == ("none", ())
    assert [f.axis for f in found.findings if f.name == "effect_within_scatter"] == [2]


@pytest.mark.parametrize("limit_nm", [45.0, 60.0])
def test_a_limit_of_torque_is_named(robot: Robot, limit_nm: float) -> None:
    """Reached in a fiftieth of the time, and in a hundredth: what is cut the positions lack."""
    arm = NOMINAL.with_changed("limit", 2, limit_nm)
    logs = [arm.log(run) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == ["torque_saturation@2"]
    # Half a percent is the noise of an encoder times the gain of position, 0.36 Nm.
    assert found.causes[0].parameters["limit_nm"].value == pytest.approx(limit_nm, abs=0.36)


def test_nothing_is_named_where_nothing_lacks(robot: Robot) -> None:
    logs = [NOMINAL.log(run) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "none"
    assert not found.causes


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "RK4"])
@pytest.mark.parametrize("step_s", [0.0005, 0.002, 0.004])
def test_steps_of_mujoco_are_in_the_model(tmp_path: Path, integrator: str, step_s: float) -> None:
    """To the square of the share of a step in the fastest motion, well below the noise of an encoder."""
    arm = replace(NOMINAL, integrator=integrator, step_s=step_s)
    robot = simulator(tmp_path, arm)
    log = arm.log(1, noise_rad=0.0)
    found = with_commands(robot, [log])
    assert found is not None
    (angle,) = simulated_positions(found.robot, AS_GIVEN, found.logs)
    error = angle[:: found.step] - log.position_rad
    assert (error - error.mean(axis=0)).std(axis=0).max() < 1e-4
    if integrator == "RK4":
        assert robot.stepped is None
        return
    assert robot.stepped is not None
    step, inertia = robot.stepped
    assert step == step_s
    gains = -1 if integrator == "Euler" else 1
    damping = np.array(arm.damping) + gains * np.array(arm.kd)
    assert inertia == pytest.approx(0.5 * step_s * damping)


def test_a_machine_in_steps_of_2_ms_is_diagnosed(tmp_path: Path) -> None:
    """MuJoCo's usual step; friction came out as unknown without what its steps do."""
    robot = simulator(tmp_path, replace(NOMINAL, step_s=0.002))
    for lacks in ("coulomb_friction@2", ""):
        arm = replace(MACHINES[lacks] if lacks else NOMINAL, step_s=0.002)
        logs = [arm.log(run) for run in (1, 2, 3)]
        found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
        assert found.verdict == ("explained" if lacks else "none")
        assert [c.label for c in found.causes] == ([lacks] if lacks else [])


def test_targets_that_act_earlier_are_means_of_what_holds() -> None:
    target = np.arange(6.0)[:, None]
    assert np.array_equal(_earlier(target, 0.0), target)
    assert _earlier(target, 2.0)[:, 0].tolist() == [2, 3, 4, 5, 5, 5]
    assert _earlier(target, 0.25)[:, 0].tolist() == [0.25, 1.25, 2.25, 3.25, 4.25, 5]


def test_slow_logs_of_a_complete_simulator_name_nothing(tmp_path: Path) -> None:
    """At 25 Hz a joint answers a step of its target within a sample: a spline does not know that."""
    slow = replace(NOMINAL, rate_hz=25.0)
    logs = [slow.log(run) for run in (1, 2, 3)]
    found = diagnose(robot=simulator(tmp_path, slow), estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "none"
    assert not found.findings


@pytest.mark.parametrize("lacks", ["payload", None])
def test_logs_at_30_hz_are_diagnosed(tmp_path: Path, lacks: str | None) -> None:
    """As slow as cameras and teleoperation log: the load that is not in the file, and nothing else."""
    machine = NOMINAL if lacks is None else MACHINES[lacks]
    arm = replace(machine, rate_hz=30.0, step_s=1 / 30 / 64)
    robot = simulator(tmp_path, replace(NOMINAL, rate_hz=30.0, step_s=1 / 30 / 64))
    logs = [arm.log(run) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == ("none" if lacks is None else "explained")
    assert [c.label for c in found.causes] == ([] if lacks is None else [lacks])
    for cause in found.causes:
        assert cause.parameters["mass_kg"].value == pytest.approx(arm.load_kg, rel=0.05)
    assert not found.findings
    motion = found.gap.motion
    assert motion is not None and motion.velocity_from == "positions"
    for errors in (motion.position_rad, motion.velocity_rad_s):
        # Noise is left: an rms of 600 samples, two fifths of them passed, is known to a twentieth. The load is
        # right to a twentieth, and so is what it did.
        left = np.hypot(1.25 * errors.floor, 0.05 * errors.before)
        assert np.all(errors.after < left)
        assert (errors.before[1] > 5 * errors.floor[1]) == (lacks is not None)


@pytest.mark.parametrize("lacks", ["coulomb_friction@2", "payload", None])
def test_logs_that_begin_in_motion_are_run_up_to(robot: Robot, lacks: str | None) -> None:
    """Cut where all axes move: named as from rest, of the same size."""
    machine = NOMINAL if lacks is None else MACHINES[lacks]
    logs = [machine.log(run).part(6.5) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == ("none" if lacks is None else "explained")
    assert [c.effect for c in found.causes] == ([lacks.split("@")[0]] if lacks else [])
    for cause, name, value in zip(found.causes, NAMES[lacks], VALUES[lacks], strict=True):
        assert cause.parameters[name].value == pytest.approx(value, rel=0.05)
    assert [f.name for f in found.findings] == ["begins_in_motion"] * 3
    assert "run up from rest" in found.findings[0].message
    # One that begins at rest beside it has no run-up.
    told = with_commands(robot, [machine.log(1), logs[1]])
    assert told is not None and told.logs[0].run_up is None and told.logs[1].run_up is not None
    whole, cut = told.from_s
    assert whole == 0.0 < cut and told.logs[1].lead > round(cut / robot.sample_time_s)
    assert [log.run_up for log in told.as_logged()] == [None, None]
    own = told.taken([machine.log(1), logs[1]])
    assert [x.n_samples for x in own] == [x.n_samples for x in told.as_logged()]
    assert told.of(own)[1].run_up is told.logs[1].run_up


NAMES = {"coulomb_friction@2": ["coulomb_nm"], "payload": ["mass_kg"], None: []}
VALUES = {"coulomb_friction@2": [2.5], "payload": [0.8], None: []}


def test_positions_between_samples_lie_on_a_cubic() -> None:
    k = np.arange(12.0)
    fine = np.arange(0, 11.01, 0.25)
    values = between(np.column_stack([k**3, 2 - k]), 4)
    assert np.allclose(values, np.column_stack([fine**3, 2 - fine]), rtol=0, atol=1e-9)


def still(n: int = 100) -> Array:
    return np.tile(HOME_RAD, (n, 1))


def test_logs_that_tell_no_command_are_refused(robot: Robot) -> None:
    time = 1 / RATE_HZ
    good = log_of(still(), still(), time)
    with pytest.raises(InputError, match=r"position_ref.*'bare'"):
        with_commands(robot, [good, log_of(still(), None, time, "bare")])
    with pytest.raises(InputError, match="multiple of the controller's"):
        with_commands(robot, [log_of(still(), still(), 0.003)])
    moving = still(60) + 0.1 * time * np.arange(60)[:, None]
    with pytest.raises(InputError, match=r"at rest.*takes .* s to forget.*--from"):
        with_commands(robot, [log_of(moving, still(60), time)])
    with pytest.raises(InputError, match="in all logs or in none"):
        with_commands(robot, [good, replace(good, torque_nm=np.zeros((100, 3)))])
    with pytest.raises(InputError, match="pd_position"):
        with_commands(load_robot("irb6600_like"), [good])


def test_logs_are_read_without_torque_where_they_have_targets(tmp_path: Path) -> None:
    logged = ServoArm().log(4)
    table = {"time_s": logged.time_s}
    for axis in range(3):
        assert logged.position_ref_rad is not None
        table[f"position_{axis + 1}"] = logged.position_rad[:, axis]
        table[f"position_ref_{axis + 1}"] = logged.position_ref_rad[:, axis]
    path = tmp_path / "run.parquet"
    pd.DataFrame(table).to_parquet(path)
    found = read_log(path)
    assert not found.has_torque
    assert found.position_ref_rad is not None
    assert np.array_equal(found.position_ref_rad, logged.position_ref_rad)
    pd.DataFrame({**table, "torque_cmd_1": table["position_1"]}).to_parquet(path)
    with pytest.raises(LogError, match="torque_cmd_2"):
        read_log(path)
    del table["position_ref_2"]
    pd.DataFrame(table).to_parquet(path)
    with pytest.raises(LogError, match="position_ref_2"):
        read_log(path)


def test_steps_are_stated_whole(tmp_path: Path) -> None:
    text = simulator(tmp_path).toml
    for key in ("step", "step_inertia"):
        path = tmp_path / f"without_{key}.toml"
        path.write_text(re.sub(rf"^{key} = .*\n", "", text, flags=re.MULTILINE))
        with pytest.raises(RobotError, match=rf"missing key `controller.{key}`"):
            load_robot(path)


def test_inertia_that_steps_take_and_no_motor_has_is_told(tmp_path: Path) -> None:
    """Explicit gains of speed at 2 ms take 0.117 kg m^2 from the first motor, here of 0.05."""
    arm = replace(NOMINAL, step_s=0.002, integrator="Euler").with_changed("armature", 1, 0.05)
    found = with_commands(simulator(tmp_path, arm), [arm.log(1)])
    assert found is not None
    assert found.short_of_inertia == (1,)
    assert found.robot.parameters()["j1.motor_inertia"] == 0.0


def test_channels_that_are_another_axis_or_turned_are_refused(robot: Robot) -> None:
    log = NOMINAL.log(1)
    assert check_follows_target(robot, log) == []
    swapped = replace(log, position_rad=np.ascontiguousarray(log.position_rad[:, [1, 0, 2]]))
    found = check_follows_target(robot, swapped)
    assert [(f.name, f.axis) for f in found] == [("axes_swapped", 1), ("axes_swapped", 2)]
    turned = replace(log, position_rad=log.position_rad * [1.0, -1.0, 1.0])
    assert [(f.name, f.axis) for f in check_follows_target(robot, turned)] == [("sign_flipped", 2)]
    degrees = replace(log, position_rad=log.position_rad * [1.0, 1.0, np.degrees(1.0)])
    (one,) = check_follows_target(robot, degrees)
    assert (one.name, one.axis, one.severity) == ("position_in_degrees", 3, "refuse")
    with pytest.raises(RefusedInputError, match="axes_swapped"):
        diagnose(robot=robot, estimation=[log, swapped], validation=[NOMINAL.log(2)])


@pytest.mark.parametrize("gap", sorted(MACHINES))
def test_what_a_machine_lacks_is_no_wrong_channel(robot: Robot, gap: str) -> None:
    assert check_follows_target(robot, MACHINES[gap].log(1)) == []

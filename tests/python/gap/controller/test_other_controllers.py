"""Controllers that are not the stated ones, as logs show them by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Robot, Settings, simulate
from axisight.errors import InputError
from axisight.gap.controller.other_controllers import other_controllers
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import HELD, PLAN, bare_axis, logs_of, reference, scattered

GAINS = {"relative_proportional": 0.3, "relative_integral": -0.2}


def shown(effects):
    return other_controllers(bare_axis(), logs_of(scattered(bare_axis(), 4), effects, PLAN))


def test_the_effect_is_a_controller_with_other_gains():
    """A loop 1.2 times as fast has 1.2 times the proportional and 1.44 times the integral gain."""
    robot = bare_axis()
    ref = reference("multisine", 1, 2000, robot.sample_time_s)
    changed = Effect(
        "controller_gain", 1, {"relative_proportional": 0.2, "relative_integral": 0.44}
    )
    by_effect = simulate(robot, ref, effects=[changed]).torque_cmd_nm.values
    by_gains = simulate(robot.with_controller_speed(1.2), ref).torque_cmd_nm.values
    nominal = simulate(robot, ref).torque_cmd_nm.values
    # The integrator's error bound decides, 1e-7 of the state through the gains.
    np.testing.assert_allclose(by_effect, by_gains, atol=1e-5)
    assert np.abs(by_effect - nominal).max() > 0.1


def test_a_filter_is_the_low_pass_that_it_says():
    """The command follows from the measured positions alone, by the law written out."""
    robot = bare_axis()
    time, lag = robot.sample_time_s, 3e-3
    ref = reference("multisine", 1, 2000, time)
    effect = Effect("velocity_filter", 1, {"time_constant_s": lag})
    run = simulate(robot, ref, effects=[effect], noise_seed=1)
    measured, command = run.position_rad.values[:, 0], run.torque_cmd_nm.values[:, 0]
    gains = robot.controller_gains
    filtered, wanted, out = 0.0, measured[0], []
    for k in range(len(measured)):
        speed = (measured[k] - measured[k - 1]) / time if k else 0.0
        filtered += time / (time + lag) * (speed - filtered)
        out.append(
            gains["kp"][0] * (ref[k, 0] - filtered) + gains["ki"][0] * (wanted - measured[k])
        )
        wanted += time * ref[k, 0]
    asked = np.array(out)
    # But for the torque that the loop starts from.
    off = command - asked - (command[0] - asked[0])
    # The start angle is known from a noisy reading here: a constant share of the integral gain.
    assert np.ptp(off) < 1e-9 * np.abs(command).max()


def test_a_gain_that_is_all_but_off_is_said_not_taken_for_an_effect():
    """No effect stands for it: its bounds are a twentieth and eleven times the stated gain."""
    text = scattered(bare_axis(), 4).toml
    assert "ki = [180.0]" in text
    machine = Robot.from_toml(text.replace("ki = [180.0]", "ki = [1.8]"))
    with pytest.raises(
        InputError, match=r"axis 1: expected gains .* got 0\.01 times the integral one"
    ):
        ClosedLoopView(bare_axis(), logs_of(machine, [], PLAN), Settings())


@pytest.mark.parametrize(
    "effect",
    [
        Effect("controller_gain", 1, GAINS),
        Effect("velocity_filter", 1, {"time_constant_s": 3e-3}),
        Effect("feedforward_missing", 1, {"acceleration_nm_s2_rad": 0.2, "speed_nm_s_rad": 0.3}),
    ],
    ids=lambda e: e.name,
)
def test_another_controller_is_found_whatever_the_machine_has_besides(effect):
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
    (found,) = shown([effect, friction])
    assert found.effect.label == effect.label
    assert found.explained > 0.99
    for name, value in effect.parameters.items():
        # The law is exact; a filter is written in several ways.
        assert found.values[name].value == pytest.approx(value, abs=0.002 * max(abs(value), 1e-2))
        assert found.values[name].low <= value <= found.values[name].high


FORWARD = {"acceleration_nm_s2_rad": 0.006, "speed_nm_s_rad": 0.01}


def test_torque_is_fed_forward_for_the_reference_and_its_rate():
    """On a machine that is far too heavy to move, the command is what is fed forward alone."""
    robot = bare_axis()
    heavy = robot.with_parameters({"axis1.motor_inertia": 1e9})
    ref = reference("multisine", 1, 500, robot.sample_time_s)
    forward = Effect("feedforward_missing", 1, FORWARD)
    with_it = simulate(heavy, ref, effects=[forward]).torque_cmd_nm.values[:, 0]
    without = simulate(heavy, ref).torque_cmd_nm.values[:, 0]
    rate = np.diff(ref[:, 0], prepend=ref[0, 0]) / robot.sample_time_s
    expected = 0.006 * rate + 0.01 * ref[:, 0]
    np.testing.assert_allclose(with_it - without, expected, atol=1e-6 * np.abs(expected).max())


def test_a_gain_is_no_feedforward_and_feedforward_no_gain():
    (found,) = shown([Effect("feedforward_missing", 1, FORWARD)])
    assert found.effect.label == "feedforward_missing@1"
    for name, value in FORWARD.items():
        assert found.values[name].value == pytest.approx(value, rel=0.02)
        assert found.values[name].low <= value <= found.values[name].high


def test_gains_and_a_filter_together():
    both = [
        Effect("controller_gain", 1, GAINS),
        Effect("velocity_filter", 1, {"time_constant_s": 3e-3}),
    ]
    assert [x.name for x in shown(both)] == ["controller_gain", "velocity_filter"]


@pytest.mark.parametrize(
    "effects",
    [
        [],
        [Effect("input_delay", 1, {"delay_s": 2e-3})],
        [Effect("resolver_ripple", 1, {"order_1": 2.0, "cosine_1_rad": 2e-3})],
        [Effect("backlash", 1, {"half_width_rad": 2e-4})],
    ],
    ids=lambda effects: effects[0].name if effects else "nothing",
)
def test_what_the_machine_has_is_no_controller(effects):
    assert shown(effects) == ()


def test_positions_read_late_are_no_filter():
    """The controller saw positions a sample before the logged ones."""
    logs = logs_of(scattered(bare_axis(), 4), [], PLAN | HELD)
    late = [
        replace(x, position_rad=np.concatenate([x.position_rad[1:], x.position_rad[-1:]]))
        for x in logs
    ]
    assert other_controllers(bare_axis(), late) == ()


@pytest.mark.parametrize(("damping", "order"), [(np.sqrt(0.5), "second"), (1.0, "first")])
def test_a_filter_of_the_second_order_is_told_by_its_lag(damping: float, order: str):
    """Written out as two states whose steps use what was just computed: they lag slow motion a sample less.

    Two of the first order in a row are all but one of the first, as far as these logs tell.
    """
    lag = 3e-3
    out = []
    for log in logs_of(scattered(bare_axis(), 4), [], PLAN | HELD):
        time, measured = log.sample_time_s, log.position_rad[:, 0]
        speed = np.diff(measured, prepend=measured[:1]) / time
        corner, passed, rate, filtered = 2 * damping / lag, 0.0, 0.0, []
        for wanted in speed:
            rate += time * (corner**2 * (wanted - passed) - 2 * damping * corner * rate)
            passed += time * rate
            filtered.append(passed)
        (gain,) = bare_axis().controller_gains["kp"]
        torque = log.torque_nm + gain * (speed - filtered)[:, None]
        out.append(replace(log, torque_nm=torque))
    (cause,) = other_controllers(bare_axis(), out)
    assert cause.name == "velocity_filter"
    value = cause.values["time_constant_s"]
    assert value.value == pytest.approx(lag - bare_axis().sample_time_s, rel=0.02)
    assert ("second order" in cause.says) is (order == "second")


def test_where_a_log_begins_commands_may_follow_from_what_it_does_not_hold():
    """Gains 4 % off, and a first speed that the controller knew of: in the log there is none."""
    off = {"relative_proportional": -0.04, "relative_integral": -0.04}
    machine = scattered(bare_axis(), 4)
    logs = logs_of(machine, [Effect("controller_gain", 1, off)], PLAN)
    kick = 0.2 * np.ptp(logs[0].torque_nm) * np.exp(-np.arange(len(logs[0].time_s)) / 3)
    begun = [replace(log, torque_nm=log.torque_nm + kick[:, None]) for log in logs]
    (found,) = other_controllers(bare_axis(), begun)
    assert found.values["relative_proportional"].value == pytest.approx(-0.04, abs=1e-3)
    assert found.values["relative_integral"].value == pytest.approx(-0.04, abs=1e-3)

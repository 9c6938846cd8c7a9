"""Plausible mistakes in a simulator and its logs: each a function with the name of the expected finding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from axisight import Log, Robot
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from rigid_arm import arm, arm_toml
from spoiled_cases import (
    Case,
    busy,
    channel,
    each,
    every,
    first,
    late,
    mistake,
    one,
    rows,
    swapped,
)

# Units.


@mistake("position_in_degrees", axis=1)
def position_in_degrees(case: Case) -> Case:
    return every(case, "position_rad", None, np.degrees)


@mistake("position_in_degrees", kind="arm")
def position_in_degrees_arm(case: Case) -> Case:
    return every(case, "position_rad", None, np.degrees)


@mistake("position_in_degrees", axis=2)
def position_of_one_axis_in_degrees(case: Case) -> Case:
    return every(case, "position_rad", 1, np.degrees)


@mistake("position_in_degrees", axis=1)
def all_angles_in_degrees(case: Case) -> Case:
    return every(
        every(case, "position_rad", None, np.degrees), "velocity_ref_rad_s", None, np.degrees
    )


@mistake("velocity_ref_in_rpm", axis=1)
def reference_in_rpm(case: Case) -> Case:
    return every(case, "velocity_ref_rad_s", None, lambda x: x * 30 / np.pi)


@mistake("velocity_ref_in_deg_s", axis=1)
def reference_in_degrees_per_second(case: Case) -> Case:
    return every(case, "velocity_ref_rad_s", None, np.degrees)


@mistake("torque_in_mnm", axis=1)
def torque_in_millinewtonmetres(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: 1000 * x)


@mistake("torque_in_mnm", kind="arm", axis=2)
def torque_in_millinewtonmetres_arm(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: 1000 * x)


@mistake("torque_scaled", axis=1, severity="flag")
def torque_in_percent_of_rated(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: 100 * x / 26.0)


@mistake("torque_scaled", kind="arm", axis=2)
def torque_in_percent_of_rated_arm(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: 100 * x / 15.0)


@mistake("torque_scaled", axis=1, severity="flag")
def current_in_amperes_called_torque(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: x / 0.38)


@mistake("torque_scaled", kind="arm", axis=2, severity="flag")
def current_in_amperes_called_torque_arm(case: Case) -> Case:
    return every(case, "torque_nm", None, lambda x: x / 0.3)


@mistake("position_in_counts", axis=1)
def position_in_encoder_counts(case: Case) -> Case:
    return every(case, "position_rad", None, lambda x: np.round(x * 65536 / (2 * np.pi)))


@mistake("position_in_counts", kind="arm", axis=1)
def position_in_encoder_counts_arm(case: Case) -> Case:
    return every(case, "position_rad", None, lambda x: np.round(x * 131072 / (2 * np.pi)))


@mistake("position_joint_side", axis=1)
def joint_side_position(case: Case) -> Case:
    ratio = case.robot.gear_ratio
    return each(case, lambda log: replace(log, position_rad=log.position_rad * ratio))


@mistake("position_in_revolutions", axis=1)
def position_in_revolutions(case: Case) -> Case:
    return every(case, "position_rad", None, lambda x: x / (2 * np.pi))


@mistake("time_in_ms")
def time_in_milliseconds(case: Case) -> Case:
    return each(
        case, lambda g: replace(g, time_s=1e3 * g.time_s, sample_time_s=1e3 * g.sample_time_s)
    )


@mistake("time_in_us", kind="arm")
def time_in_microseconds(case: Case) -> Case:
    return each(
        case, lambda g: replace(g, time_s=1e6 * g.time_s, sample_time_s=1e6 * g.sample_time_s)
    )


# Columns and signs.


@mistake("axes_swapped", axis=1)
def positions_swapped(case: Case) -> Case:
    return each(case, swapped("position_rad"))


@mistake("axes_swapped", kind="arm", axis=1)
def positions_swapped_arm(case: Case) -> Case:
    return each(case, swapped("position_rad"))


@mistake("axes_swapped", axis=1)
def torques_swapped(case: Case) -> Case:
    return each(case, swapped("torque_nm"))


@mistake("axes_swapped", kind="arm", axis=1)
def torques_swapped_arm(case: Case) -> Case:
    return each(case, swapped("torque_nm"))


@mistake("axes_swapped", axis=1)
def references_swapped(case: Case) -> Case:
    return each(case, swapped("velocity_ref_rad_s"))


@mistake("axes_swapped", axis=1)
def torques_swapped_in_one_validation_log(case: Case) -> Case:
    swap = swapped("torque_nm")
    return replace(case, validation=(swap(case.validation[0]), *case.validation[1:]))


@mistake("sign_flipped", axis=2)
def position_turned_round(case: Case) -> Case:
    return every(case, "position_rad", 1, np.negative)


@mistake("sign_flipped", kind="arm", axis=2)
def position_turned_round_arm(case: Case) -> Case:
    return every(case, "position_rad", 1, np.negative)


@mistake("sign_flipped", axis=3)
def torque_turned_round(case: Case) -> Case:
    return every(case, "torque_nm", 2, np.negative)


@mistake("sign_flipped", kind="arm", axis=3)
def torque_turned_round_arm(case: Case) -> Case:
    return every(case, "torque_nm", 2, np.negative)


@mistake("sign_flipped", kind="arm", axis=1)
def torque_of_a_vertical_axis_turned_round_arm(case: Case) -> Case:
    return every(case, "torque_nm", 0, np.negative)


@mistake("sign_flipped", kind="arm", axis=6)
def position_of_the_flange_turned_round_arm(case: Case) -> Case:
    return every(case, "position_rad", 5, np.negative)


@mistake("sign_flipped", axis=1)
def reference_turned_round(case: Case) -> Case:
    return every(case, "velocity_ref_rad_s", 0, np.negative)


# Time.


@mistake("time_shifted", axis=1)
def torque_late_by_20_ms(case: Case) -> Case:
    return each(case, lambda log: late(log, 40, None, "torque_nm"))


@mistake("time_shifted", kind="arm", severity="flag")
def torque_late_by_20_ms_arm(case: Case) -> Case:
    return each(case, lambda log: late(log, 2, None, "torque_nm"))


@mistake("axis_delayed", axis=2)
def one_axis_late_by_50_ms(case: Case) -> Case:
    return each(case, lambda log: late(log, 100, 1, "position_rad", "torque_nm"))


@mistake("axis_delayed", kind="arm", severity="flag", axis=2)
def one_axis_late_by_50_ms_arm(case: Case) -> Case:
    return each(case, lambda log: late(log, 5, 1, "position_rad", "torque_nm"))


@mistake("sample_time_differs")
def sample_time_of_the_robot_halved(case: Case) -> Case:
    text = case.robot.toml
    assert "sample_time = 0.0005" in text or "sample_time = 5" in text
    half = "\n".join(
        "sample_time = 2.5e-4" if line.startswith("sample_time") else line
        for line in text.splitlines()
    )
    return replace(case, robot=Robot.from_toml(half))


@mistake("sample_time_differs")
def resampled_to_another_rate(case: Case) -> Case:
    def slower(log: Log) -> Log:
        thin = rows(log, np.arange(0, log.n_samples, 4))
        step = 4 * log.sample_time_s
        return replace(thin, sample_time_s=step, time_s=np.arange(thin.n_samples) * step)

    return each(case, slower)


# Rows.


@mistake("rows_missing")
def rows_dropped_and_stamped_anew(case: Case) -> Case:
    def drop(log: Log) -> Log:
        start, _ = busy(log)
        return rows(log, np.delete(np.arange(log.n_samples), np.s_[start : start + 60]))

    return first(case, drop)


@mistake("rows_missing", kind="arm")
def rows_dropped_and_stamped_anew_arm(case: Case) -> Case:
    def drop(log: Log) -> Log:
        start, _ = busy(log)
        return rows(log, np.delete(np.arange(log.n_samples), np.s_[start : start + 20]))

    return first(case, drop)


@mistake("rows_missing")
def single_rows_dropped_here_and_there(case: Case) -> Case:
    def drop(log: Log) -> Log:
        lost = np.random.default_rng(3).choice(log.n_samples, 100, replace=False)
        return rows(log, np.delete(np.arange(log.n_samples), lost))

    return first(case, drop)


@mistake("rows_repeated")
def rows_given_twice(case: Case) -> Case:
    def repeat(log: Log) -> Log:
        start, end = busy(log)
        index = np.sort(np.concatenate((np.arange(log.n_samples), np.arange(start, end, 7))))
        return rows(log, index)

    return first(case, repeat)


def freeze(x: np.ndarray, start: int, end: int) -> np.ndarray:
    x[start:end] = x[start]
    return x


@mistake("samples_frozen", axis=2)
def position_frozen_for_200_ms(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: freeze(x, *busy(case.estimation[0])))


@mistake("samples_frozen", kind="arm", axis=2)
def position_frozen_for_200_ms_arm(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: freeze(x, *busy(case.estimation[0])))


@mistake("samples_frozen", axis=2)
def torque_frozen_for_200_ms(case: Case) -> Case:
    return one(case, "torque_nm", 1, lambda x: freeze(x, *busy(case.estimation[0])))


@mistake("samples_frozen", axis=1)
def everything_frozen_for_200_ms(case: Case) -> Case:
    def still(log: Log) -> Log:
        index = freeze(np.arange(log.n_samples), *busy(log))
        return rows(log, index)

    return first(case, still)


@mistake("rows_shuffled")
def rows_shuffled_in_a_stretch(case: Case) -> Case:
    def shuffle(log: Log) -> Log:
        start, end = busy(log)
        index = np.arange(log.n_samples)
        np.random.default_rng(1).shuffle(index[start:end])
        return rows(log, index)

    return first(case, shuffle)


@mistake("rows_shuffled", kind="arm")
def rows_shuffled_in_a_stretch_arm(case: Case) -> Case:
    def shuffle(log: Log) -> Log:
        start, end = busy(log, 0.5)
        index = np.arange(log.n_samples)
        np.random.default_rng(1).shuffle(index[start:end])
        return rows(log, index)

    return first(case, shuffle)


@mistake("time_not_increasing")
def stamps_of_an_array_run_back(case: Case) -> Case:
    def back(log: Log) -> Log:
        time = log.time_s.copy()
        time[[100, 101]] = time[[101, 100]]
        return replace(log, time_s=time)

    return first(case, back)


# Values.


def spike(x: np.ndarray, at: int, size: float) -> np.ndarray:
    x[at] += size
    return x


@mistake("position_spike", axis=2)
def one_glitch_of_a_position(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: spike(x, 3333, 0.02))


@mistake("position_spike", kind="arm", axis=2)
def one_glitch_of_a_position_arm(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: spike(x, 700, 0.02))


@mistake("position_spike", axis=1)
def one_large_glitch_of_a_position(case: Case) -> Case:
    return one(case, "position_rad", 0, lambda x: spike(x, 2500, 6.0))


@mistake("torque_spike", severity="flag", axis=1)
def one_spike_of_a_torque(case: Case) -> Case:
    return one(case, "torque_nm", 0, lambda x: spike(x, 3333, 90.0))


@mistake("not_finite", axis=1)
def not_a_number_in_a_position(case: Case) -> Case:
    return one(case, "position_rad", 0, lambda x: spike(x, 50, np.nan))


@mistake("not_finite", axis=3)
def infinite_torque(case: Case) -> Case:
    return one(case, "torque_nm", 2, lambda x: spike(x, 50, np.inf))


@mistake("not_finite", kind="arm", axis=3)
def not_a_number_in_a_torque_arm(case: Case) -> Case:
    return one(case, "torque_nm", 2, lambda x: spike(x, 50, np.nan))


@mistake("channel_constant", axis=2)
def position_constant(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: np.full_like(x, x[0]))


@mistake("channel_constant", kind="arm", severity="flag", axis=2)
def position_constant_arm(case: Case) -> Case:
    return one(case, "position_rad", 1, lambda x: np.full_like(x, x[0]))


@mistake("channel_constant", axis=3)
def torque_zero(case: Case) -> Case:
    return one(case, "torque_nm", 2, np.zeros_like)


@mistake("channel_constant", kind="arm", axis=3)
def torque_zero_arm(case: Case) -> Case:
    return one(case, "torque_nm", 2, np.zeros_like)


@mistake("torque_saturated", severity="flag", axis=1)
def torque_with_flat_tops(case: Case) -> Case:
    return one(case, "torque_nm", 0, lambda x: np.clip(x, -0.5 * x.max(), 0.5 * x.max()))


@mistake("quantized_position", severity="flag", axis=1)
def position_of_a_12_bit_encoder(case: Case) -> Case:
    step = 2 * np.pi / 4096
    return every(case, "position_rad", None, lambda x: np.round(x / step) * step)


@mistake("quantized_position", kind="arm", severity="flag", axis=1)
def position_of_a_12_bit_encoder_arm(case: Case) -> Case:
    step = 2 * np.pi / 4096
    return every(case, "position_rad", None, lambda x: np.round(x / step) * step)


@mistake("position_wrapped", axis=1)
def position_wrapped_at_pi(case: Case) -> Case:
    return every(case, "position_rad", None, lambda x: (x + np.pi) % (2 * np.pi) - np.pi)


@mistake("position_clipped", severity="flag", axis=2)
def position_cut_at_the_range_of_its_sensor(case: Case) -> Case:
    def cut(log: Log) -> Log:
        x = log.position_rad[:, 1]
        limit = 0.7 * np.ptp(x) + x.min()
        noise = 0.0
        return channel(log, "position_rad", 1, lambda y: np.minimum(y, limit + noise))

    return first(case, cut)


@mistake("velocity_inconsistent", severity="flag", axis=1)
def measured_velocity_in_rpm(case: Case) -> Case:
    def with_velocity(log: Log) -> Log:
        speed = np.gradient(log.position_rad, log.sample_time_s, axis=0)
        return replace(log, velocity_rad_s=speed * 30 / np.pi)

    return each(case, with_velocity)


# The robot file.


def edited(case: Case, change: Callable[[str], str]) -> Case:
    text = case.robot.toml
    new = change(text)
    assert new != text
    return replace(case, robot=Robot.from_toml(new))


def each_line(text: str, key: str, change: Callable[[str], str]) -> str:
    out = []
    for line in text.splitlines():
        name, equals, value = line.partition("=")
        out.append(f"{key} = {change(value)}" if equals and name.strip() == key else line)
    return "\n".join(out)


@mistake("gear_ratio_inverted", axis=1)
def gear_ratio_upside_down(case: Case) -> Case:
    return edited(case, lambda t: each_line(t, "gear_ratio", lambda v: repr(1 / float(v))))


def second_turned(text: str) -> str:
    """Return a robot file with the gear ratio of its second axis times -1."""
    lines, seen = text.splitlines(), 0
    for i, line in enumerate(lines):
        name, equals, value = line.partition("=")
        if equals and name.strip() == "gear_ratio":
            seen += 1
            lines[i] = f"gear_ratio = {-float(value)!r}" if seen == 2 else line
    return "\n".join(lines)


@mistake("axis_turned", axis=2)
def axis_turns_the_other_way(case: Case) -> Case:
    return edited(case, second_turned)


@mistake("axis_turned", kind="arm", axis=2)
def axis_of_arm_turns_the_other_way(case: Case) -> Case:
    return edited(case, second_turned)


@mistake("gravity_flipped", kind="arm")
def gravity_upwards_arm(case: Case) -> Case:
    text = arm_toml().replace("-9.81", "9.81")
    return replace(case, robot=Robot.from_toml(text))


@mistake("gravity_flipped")
def gravity_upwards(case: Case) -> Case:
    return edited(case, lambda t: each_line(t, "gravity", lambda _: "[0.0, 0.0, 9.81]"))


@mistake("torque_without_gravity", kind="arm")
def torque_of_a_driver_that_takes_gravity_off(case: Case) -> Case:
    robot = case.robot

    def without(log: Log) -> Log:
        still = np.zeros_like(log.position_rad)
        weight = predict(robot.with_effects([]), (log.position_rad, still, still, log.torque_nm))
        return replace(log, torque_nm=log.torque_nm - weight)

    return each(case, without)


@mistake("position_offset", kind="arm", severity="flag", axis=2)
def zero_of_one_axis_off_arm(case: Case) -> Case:
    return every(case, "position_rad", 1, lambda x: x + 0.15)


@mistake("position_offset", severity="flag", axis=2)
def zero_of_one_axis_off(case: Case) -> Case:
    return every(case, "position_rad", 1, lambda x: x + 0.15 / case.robot.gear_ratio[1])


@mistake("axes_differ")
def log_of_another_robot(case: Case) -> Case:
    return replace(case, robot=arm())


# Logs against one another.


@mistake("validation_copies_estimation")
def validation_copied_from_estimation(case: Case) -> Case:
    return replace(case, validation=(replace(case.estimation[0], name="fresh"),))


@mistake("validation_copies_estimation", kind="arm")
def validation_is_the_end_of_an_estimation_log(case: Case) -> Case:
    log = case.estimation[0]
    return replace(case, validation=(rows(log, np.arange(log.n_samples // 2, log.n_samples)),))


@mistake("log_repeated")
def same_log_twice(case: Case) -> Case:
    return replace(case, estimation=(*case.estimation, replace(case.estimation[0], name="again")))


@mistake("sample_time_differs")
def unequal_rates(case: Case) -> Case:
    return first(case, lambda g: replace(g, sample_time_s=2 * g.sample_time_s, time_s=2 * g.time_s))


@mistake("reference_missing", severity="flag")
def references_missing_in_one_log(case: Case) -> Case:
    return first(case, lambda log: replace(log, velocity_ref_rad_s=None))


@mistake("reference_missing", axis=2)
def references_missing_on_one_axis(case: Case) -> Case:
    return one(case, "velocity_ref_rad_s", 1, lambda x: np.full_like(x, np.nan))

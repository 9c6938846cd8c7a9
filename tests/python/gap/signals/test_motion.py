"""What inverse dynamics makes of logs: whose velocity, how far standing axes count, what repeats say."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Settings, diagnose
from axisight.errors import InputError
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.signals.lowpass_cutoff import chosen_filtering, rigid_below_hz
from axisight.gap.signals.motion import Filtering, motion
from axisight.gap.signals.repeated_motions import repeated_std_nm
from axisight.gap.signals.standstill import certainty, dry_friction_nm, open_torque_nm
from axisight.gap.simulator.inverse_noise import InverseNoise
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.choice import view_of
from axisight.gap.views.inverse_dynamics import InverseView
from gap_data import bare_axis
from rigid_arm import COULOMB_NM, RATE_HZ, TORQUE_NOISE_NM, arm, log_of
from rigid_arm import motion as exact_motion

ROBOT = arm()
FRICTION = np.array(COULOMB_NM)


def rigid_torque(at):
    return predicted_torque(ROBOT, AS_GIVEN, at)


def with_velocity(log, seed, late=0):
    """Return a log with its exact velocity, so many samples late."""
    speed = exact_motion(seed, log.duration_s)[1]
    return replace(log, velocity_rad_s=np.roll(speed, late, axis=0))


def coarse(log, step_rad=2e-3):
    """Return a log whose position is read in steps."""
    return replace(log, position_rad=step_rad * np.round(log.position_rad / step_rad))


def test_a_measured_velocity_is_used_where_it_predicts_better():
    log = coarse(log_of(ROBOT, 0, seconds=20.0))
    assert chosen_filtering([log], rigid_torque).measured == ()
    # The lightest axis hardly feels its acceleration.
    assert sum(chosen_filtering([with_velocity(log, 0)], rigid_torque).measured) >= 5
    # A velocity that is late by a sixth of the fastest period is worse than what the steps leave.
    late = with_velocity(log, 0, late=int(0.3 * RATE_HZ))
    assert not any(chosen_filtering([late], rigid_torque).measured)


def test_an_axis_without_a_velocity_keeps_its_position():
    log = with_velocity(coarse(log_of(ROBOT, 0, seconds=20.0)), 0)
    log.velocity_rad_s[:, 2] = np.nan
    chosen = chosen_filtering([log], rigid_torque)
    assert chosen.measured[0] and not chosen.measured[2]
    at, plain = motion(log, 5.0, chosen.measured), motion(log, 5.0)
    np.testing.assert_array_equal(at[1][:, 2], plain[1][:, 2])
    exact = exact_motion(0, 20.0)
    inner = slice(100, -100)
    for k in (1, 2):
        error = [np.std((x[k] - exact[k])[inner, 0]) for x in (at, plain)]
        assert error[0] < 0.5 * error[1]


def test_logs_are_treated_alike_though_one_has_no_velocity():
    logs = [with_velocity(coarse(log_of(ROBOT, k, seconds=20.0)), k) for k in range(2)]
    bare = coarse(log_of(ROBOT, 2, seconds=20.0))
    both = view_of(ROBOT, logs[:1], logs[1:], Settings())
    assert isinstance(both, InverseView) and both.filtering.measured[0]
    alone = view_of(ROBOT, logs[:1], [bare], Settings())
    assert isinstance(alone, InverseView) and not any(alone.filtering.measured)
    with pytest.raises(InputError, match="motion 2: expected a measured velocity"):
        motion(bare, 5.0, (True,) * 6)


def test_dry_friction_is_found_on_every_axis():
    at = Filtering(10.0)(log_of(ROBOT, 0, seconds=20.0))
    # The corner takes a hundredth of the top speed, where the axis is a few percent of the time.
    assert dry_friction_nm([at], rigid_torque) == pytest.approx(FRICTION, rel=0.1)


def test_a_standing_axis_counts_by_what_friction_leaves_open():
    speed = np.concatenate([np.zeros(10), np.full(10, 1.0)])[:, None]
    at = (speed, speed, speed, speed)
    (opened,) = open_torque_nm([at], np.array([3.0]))
    # A band of +-3 Nm, evenly filled; nothing of it at a hundred times the corner.
    np.testing.assert_allclose(opened[:10], np.sqrt(3.0))
    np.testing.assert_allclose(opened[10:], 3.0 / np.sqrt(3) * 1e-4, rtol=1e-3)
    factor = certainty(opened, np.array([1.0]))
    np.testing.assert_allclose(factor[:10], 0.5)
    np.testing.assert_allclose(factor[10:], 1.0, atol=1e-7)


def standing_log(seed):
    """Return a log of a machine with friction that stops three times, stuck at any torque in its band."""
    log = log_of(ROBOT, seed, seconds=20.0)
    rng = np.random.default_rng([seed, 3])
    position, torque, at = [], [], 0
    for cut in (500, 1100, 1700):
        hold = np.full((300, 1), 1.0) * log.position_rad[cut]
        zero = np.zeros((1, 6))
        weight = ROBOT.inverse_dynamics(log.position_rad[cut][None], zero, zero)
        stuck = weight + FRICTION * rng.uniform(-1, 1, 6)
        position += [log.position_rad[at:cut], hold]
        torque += [
            log.torque_nm[at:cut],
            stuck + np.array(TORQUE_NOISE_NM) * rng.normal(size=(300, 6)),
        ]
        at = cut
    position, torque = np.concatenate(position), np.concatenate(torque)
    position = position + 2e-6 * rng.normal(size=position.shape)
    return replace(
        log, position_rad=position, torque_nm=torque, time_s=np.arange(len(position)) / RATE_HZ
    )


def test_standing_axes_make_no_causes_and_hide_none():
    logs = [standing_log(seed) for seed in range(3)]
    found = diagnose(
        robot=ROBOT, estimation=logs[:2], validation=logs[2:], settings=Settings(bootstrap=50)
    )
    named = {(c.effect, c.axis): c for c in found.causes}
    wanted = [(e, a) for e in ("coulomb_friction", "viscous_friction") for a in range(1, 7)]
    assert sorted(named) == sorted(wanted)
    for axis, level in enumerate(COULOMB_NM, start=1):
        value = named["coulomb_friction", axis].parameters["coulomb_nm"].value
        assert value == pytest.approx(level, rel=0.05)


def test_repeats_are_the_floor():
    def repeat(k):
        log = log_of(ROBOT, 0, seconds=20.0)
        rng = np.random.default_rng([k, 11])
        # Something slow that no two runs share, and no spectrum takes for noise.
        drift = np.cumsum(rng.normal(size=(log.n_samples, 6)), axis=0) * 0.02
        return replace(log, name=f"run {k}", torque_nm=log.torque_nm + drift)

    logs = [repeat(k) for k in range(3)]
    filtering = Filtering(10.0)
    torques = np.array([filtering.compared(log.torque_nm, log.sample_time_s) for log in logs])
    expected = np.sqrt(np.mean(np.var(torques, axis=0, ddof=1), axis=0))
    assert repeated_std_nm(logs, filtering) == pytest.approx(expected, rel=1e-12)
    noise = InverseNoise.of(ROBOT, logs, filtering, 0)
    assert noise.repeated
    assert np.std(noise.error(logs[0], 0), axis=0) == pytest.approx(expected, rel=1e-9)
    other = log_of(ROBOT, 1, seconds=20.0)
    assert repeated_std_nm([logs[0], other], filtering) is None
    assert not InverseNoise.of(ROBOT, [logs[0], other], filtering, 0).repeated


def test_other_multisines_on_one_square_wave_are_no_repeats():
    # Positions follow the wave, within a hundredth of it whatever the multisine.
    def riding(seed):
        log = log_of(ROBOT, 0, seconds=20.0)
        lines = np.arange(2.0, 8.0, 0.1)
        phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
        wave = np.cos(2 * np.pi * np.outer(log.time_s, lines) + phases).sum(axis=1)
        ride = 0.01 * np.ptp(log.position_rad, axis=0) * wave[:, None] / np.abs(wave).max()
        return replace(log, name=f"run {seed}", position_rad=log.position_rad + ride)

    logs, filtering = [riding(seed) for seed in range(2)], Filtering(10.0)
    apart = np.std(logs[0].position_rad - logs[1].position_rad, axis=0)
    assert np.all(apart < 0.01 * np.ptp(logs[0].position_rad, axis=0))
    assert repeated_std_nm(logs, filtering) is None
    assert repeated_std_nm([logs[0], logs[0]], filtering) is not None


def test_periods_of_a_log_are_repeats():
    log = replace(log_of(ROBOT, 0, seconds=50.0), period_s=10.0)
    # Four periods after the first; a low-passed white noise keeps the share of the band it passes.
    found = repeated_std_nm([log], Filtering(5.0))
    assert found == pytest.approx(np.sqrt(5.0 / 50.0) * np.array(TORQUE_NOISE_NM), rel=0.1)


def test_elastic_gears_are_rigid_up_to_a_third_of_their_first_mode():
    """Closed form of the two-mass axis: both masses against each other on the spring between them."""
    robot = bare_axis()
    at, ratio = robot.parameters(), float(robot.gear_ratio[0])
    link = next(j.link for j in robot.joints if j.link is not None)
    arm_inertia = link.inertia_kg_m2[2] + link.mass_kg * np.sum(np.square(link.com_m[:2]))
    both = 1 / arm_inertia + ratio**2 / at["axis1.motor_inertia"]
    # The damper of the gear takes little off it: 4 % of the critical damping.
    first = np.sqrt(at["axis1.stiffness"] * both) / (2 * np.pi)
    assert rigid_below_hz(robot) == pytest.approx(first / 3, rel=0.01)
    assert rigid_below_hz(ROBOT) == np.inf
    log = log_of(ROBOT, 0, seconds=10.0)
    free, capped = (chosen_filtering([log], rigid_torque, highest_hz=f) for f in (np.inf, 4.0))
    assert 2.0 <= capped.cutoff_hz <= 4.0 < free.cutoff_hz

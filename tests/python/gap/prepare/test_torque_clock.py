"""Commands that are held act after they are logged, and late torques before: the time is found, and corrected."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Robot, diagnose
from axisight.gap.prepare.torque_clock import TorqueClock, torque_clock, where_they_act
from rigid_arm import COULOMB_NM, RATE_HZ, VISCOUS, arm, arm_toml, log_of

STEP_S = 2 / RATE_HZ


def held(log, samples: int = 1, axes=slice(None)):
    """Return every second row, with the torques of ``axes`` that act ``samples`` rows of the log later."""
    torque = log.torque_nm.copy()
    torque[:-samples, axes] = log.torque_nm[samples:, axes]
    return replace(
        log,
        sample_time_s=STEP_S,
        time_s=log.time_s[: len(log.time_s) // 2] * 2,
        torque_nm=torque[::2],
        position_rad=log.position_rad[::2],
    )


def robot() -> Robot:
    return Robot.from_toml(
        arm_toml().replace(f"sample_time = {1 / RATE_HZ}", f"sample_time = {STEP_S}")
    )


def logs(n: int = 3, **kind):
    return [held(log_of(arm(), seed, seconds=30.0), **kind) for seed in range(1, n + 1)]


def test_half_a_sample_is_found():
    """Within a tenth: friction reverses with another formula, so that its rate is that of a similar torque."""
    found = torque_clock(robot(), logs())
    assert found is not None
    assert found.acts_later_s == pytest.approx(STEP_S / 2, rel=0.1)
    assert "samples) later than they are logged" in found.says()


@pytest.mark.filterwarnings("error")
def test_a_constant_torque_tells_nothing():
    """It is that of a dead channel or of an axis at rest; the others tell the same as without it."""

    def with_axis(value):
        for log in logs():
            torque = log.torque_nm.copy()
            torque[:, 1] = value
            yield replace(log, torque_nm=torque)

    none, some = (torque_clock(robot(), list(with_axis(nm))) for nm in (0.0, 5.0))
    assert none is not None
    assert some == none


def test_torques_on_the_clock_of_the_motion_are_left_alone():
    plain = [log_of(arm(), seed, seconds=30.0) for seed in (1, 2, 3)]
    assert torque_clock(arm(), plain) is None
    # The shift of the corrected logs is gone.
    found = torque_clock(robot(), logs())
    assert found is not None
    assert torque_clock(robot(), where_they_act(logs(), found)) is None


@pytest.mark.parametrize(
    "kind",
    [
        {"axes": [1]},
        {"axes": [0, 1, 2]},
        # Three samples are no command that is held.
        {"samples": 6},
    ],
    ids=["one axis", "half the axes", "too far"],
)
def test_what_is_no_held_command_is_left_alone(kind):
    assert torque_clock(robot(), logs(**kind)) is None


def late(log, rows: int):
    """Return a log whose torques are written ``rows`` later than they act."""
    torque = np.concatenate([np.repeat(log.torque_nm[:1], rows, axis=0), log.torque_nm[:-rows]])
    return replace(log, torque_nm=torque)


@pytest.mark.parametrize("rows", [1, 4])
def test_late_torques_are_found(rows):
    """Within a tenth, as above; four rows are 40 ms, where one estimate to first order falls short."""
    found = torque_clock(arm(), [late(log_of(arm(), seed, seconds=30.0), rows) for seed in (1, 2)])
    assert found is not None
    assert found.acts_later_s == pytest.approx(-rows / RATE_HZ, rel=0.1)
    assert "logged" in found.says() and "later than they act" in found.says()


def test_late_torques_are_no_viscous_friction():
    """40 ms add about w^2 M T to the friction of an inertia M, more than the 5 % of its tolerance."""
    friction = [
        Effect("coulomb_friction", i + 1, {"coulomb_nm": c, "smoothing_rad_s": 0.002})
        for i, c in enumerate(COULOMB_NM)
    ]
    friction += [
        Effect("viscous_friction", i + 1, {"viscous_nm_s_rad": v}) for i, v in enumerate(VISCOUS)
    ]
    logs_of_it = [late(log_of(arm(), seed, seconds=30.0), 4) for seed in (1, 2, 3, 4)]
    said = diagnose(
        robot=arm().with_effects(friction), estimation=logs_of_it[:3], validation=logs_of_it[3:]
    )
    assert (said.verdict, said.causes) == ("none", ())
    assert any("later than they act" in check for check in said.checks)
    assert "time_shifted" in {f.name for f in said.findings}


def test_elastic_arms_are_left_alone():
    gear = 'motion = "revolute"\nstiffness = 1e5\ndamping = 10.0'
    elastic = Robot.from_toml(robot().toml.replace('motion = "revolute"', gear))
    assert not all(elastic.axis_is_rigid)
    assert torque_clock(elastic, logs()) is None


def test_torques_are_taken_from_where_they_act():
    """A line is moved to rounding, a wave between the ends to 1e-3, and noise keeps its size at all frequencies."""
    log = logs(1)[0]
    held_s = TorqueClock(0.3 * STEP_S, STEP_S)

    def moved(signal):
        (out,) = where_they_act([replace(log, torque_nm=np.tile(signal[:, None], 6))], held_s)
        return out.torque_nm[:, 0]

    time = log.time_s
    np.testing.assert_allclose(
        moved(3.0 * time + 1.0), 3.0 * (time - 0.3 * STEP_S) + 1.0, atol=1e-9
    )
    wave = moved(np.sin(5.0 * time) + 2.0 * time)
    inner = slice(20, -20)
    expected = np.sin(5.0 * (time - 0.3 * STEP_S)) + 2.0 * (time - 0.3 * STEP_S)
    np.testing.assert_allclose(wave[inner], expected[inner], atol=1e-3)
    noise = np.random.default_rng(1).normal(size=len(time))
    assert np.diff(moved(noise), n=2).std() == pytest.approx(np.diff(noise, n=2).std(), rel=0.02)


def test_friction_of_held_commands_is_not_too_small():
    """Half a sample of 20 ms takes about w^2 M T / 2 off viscous friction."""
    viscous = (0.0, 12.0, 0.0, 0.0, 0.0, 0.0)
    kept = [held(log_of(arm(), seed, (0.0,) * 6, viscous, seconds=30.0)) for seed in (1, 2, 3, 4)]
    said = diagnose(robot=robot(), estimation=kept[:3], validation=kept[3:])
    assert [c.label for c in said.causes] == ["viscous_friction@2"]
    value = said.causes[0].parameters["viscous_nm_s_rad"]
    assert value.low <= 12.0 <= value.high
    assert any("held for a sample" in check for check in said.checks)

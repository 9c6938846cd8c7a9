"""The noise of inverse dynamics has the colour of the logs: white, or rising as a differentiated encoder's."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import InputError, Log, Settings, diagnose
from axisight.gap.signals.motion import Filtering
from axisight.gap.signals.noise_colour import noise_colour
from axisight.gap.simulator.inverse_noise import InverseNoise
from rigid_arm import RATE_HZ, TORQUE_NOISE_NM, arm, log_of

ROBOT = arm()
# Friction on axes 1 and 2 alone [Nm], so that the noise of the others is all that they leave.
COULOMB = (2.4, 3.3, 0.0, 0.0, 0.0, 0.0)


def quiet(seed: int) -> Log:
    """Return a log of the arm with friction on two axes."""
    return log_of(ROBOT, seed, coulomb=COULOMB, viscous=[0.0] * 6, seconds=30.0)


def differentiated(seed: int) -> Log:
    """Return a log with the torque noise of a loop that differentiates an encoder, 30 % of each torque."""
    log = quiet(seed)
    steps = np.diff(np.random.default_rng([seed, 99]).normal(size=(log.n_samples + 1, 6)), axis=0)
    return replace(log, torque_nm=log.torque_nm + 0.3 * log.torque_nm.std(axis=0) * steps)


def whining(seed: int) -> Log:
    """Return a log with a tone of 44.3 Hz on each torque, above every band that is compared."""
    log = quiet(seed)
    phase = np.random.default_rng([seed, 98]).uniform(0, 2 * np.pi, 6)
    tone = np.sin(2 * np.pi * 44.3 * log.time_s[:, None] + phase)
    return replace(log, torque_nm=log.torque_nm + 0.3 * log.torque_nm.std(axis=0) * tone)


def noise_alone(x: np.ndarray) -> Log:
    """Return a log of signals (n, 6) without motion."""
    time = np.arange(len(x)) / RATE_HZ
    return replace(quiet(0), position_rad=np.zeros_like(x), torque_nm=x, time_s=time, axis_kinds=())


@pytest.mark.parametrize("n", [1500, 4000, 20000])
def test_white_noise_stays_white(n: int) -> None:
    rng = np.random.default_rng(n)
    logs = [noise_alone(rng.normal(size=(n, 6))) for _ in range(5)]
    found = [noise_colour(log, log.torque_nm, 20.0) for log in logs]
    # The criterion takes white noise for coloured once in a hundred, at these lengths.
    assert np.sum([x.stepwise > 0 for x in found]) <= 2
    # Scatter of the top fifth: some 40 frequencies of the shortest log.
    assert np.mean([x.white for x in found]) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("above_hz", [10.0, 40.0])
@pytest.mark.parametrize("n", [6, 7, 8, 9, 10, 16, 20, 21])
def test_short_logs_have_noise_too(n: int, above_hz: float) -> None:
    """A log of 21 samples has no frequency in the top fifth of its spectrum."""
    log = noise_alone(np.random.default_rng(n).normal(size=(n, 300)))
    found = noise_colour(log, log.torque_nm, above_hz)
    assert not found.stepwise.any()
    # Mean of three hundred roots of two to six squares: up to a fifth less than the root of the mean square, and less
    # by what the differences without their largest ones leave out.
    assert 0.6 < found.white.mean() < 1.05


def test_a_log_without_frequencies_is_refused_by_name() -> None:
    log = replace(noise_alone(np.zeros((5, 6))), name="blink")
    with pytest.raises(InputError, match=r"blink: samples: expected at least 6 .* got 5"):
        noise_colour(log, log.torque_nm, 20.0)


def test_a_differentiated_encoder_is_told_from_white_noise() -> None:
    n, rng = 4000, np.random.default_rng(0)
    log = noise_alone(np.diff(rng.normal(size=(n + 1, 6)), axis=0))
    found = noise_colour(log, log.torque_nm, 20.0)
    # Scatter between axes is 5 %, that of their mean half of it.
    assert found.stepwise.mean() == pytest.approx(1.0, abs=0.08)
    unit = rng.normal(size=(2 * n, 6))
    assert found.drawn(unit).std(axis=0) == pytest.approx(np.sqrt(2), rel=0.1)


def test_the_noise_in_the_compared_band_is_that_of_the_logs() -> None:
    """Taken as white, the noise was three times too large there."""
    filtering = Filtering(20.0)
    log, clean = differentiated(0), quiet(0)
    noise = InverseNoise.of(ROBOT, [log], filtering, 0).error(log, 0).std(axis=0)
    steps = filtering.compared(log.torque_nm - clean.torque_nm, log.sample_time_s).std(axis=0)
    # The low-pass keeps 20 of the 50 Hz of white noise.
    true = np.hypot(steps, np.sqrt(20 / 50) * np.array(TORQUE_NOISE_NM))
    # The two kinds are told apart less surely than their sum is: up to a half on single axes.
    assert np.all((noise > 0.6 * true) & (noise < 1.6 * true)), noise / true


def test_friction_shows_beside_differentiated_noise() -> None:
    found = diagnose(ROBOT, [differentiated(s) for s in range(3)], validation=[differentiated(3)])
    assert {("coulomb_friction", 1), ("coulomb_friction", 2)} == {
        (c.effect, c.axis) for c in found.causes
    }


def test_a_floor_above_what_the_model_leaves_is_refuted() -> None:
    logs = [whining(s) for s in range(3)]
    found = diagnose(ROBOT, logs, validation=[whining(3)], settings=Settings())
    assert found.verdict == "explained"
    assert all(a.verdict != "unknown" for a in found.axes)
    # The floor and the gap with the causes are both measured: a tenth of scatter.
    assert np.all(found.gap.floor_per_axis[:3] < 1.2 * found.gap.after_per_axis[:3])
    assert any("more than what the model leaves" in x for x in found.checks)

"""The floor of a simulator that is kept on logs, and what in a torque answers noise."""

import numpy as np
import pytest

from axisight import Effect, Settings
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.signals.noise import segment_of, smoothed, torque_density
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.gap.views.tracking_weights import TrackingWeights, tracking_floor
from gap_data import PLAN, bare_axis, logs_of

# Bounded moves: above ten hertz or so their torque is what the controller makes of the sensor's noise.
MOVES = {"moves": ("moves", 0), "again": ("moves", 1)}
LAG_S = 1e-3


def test_weights_by_few_segments_count_no_noise_more_than_other_noise():
    """A density of ``k`` degrees of freedom: its inverse is too large by k / (k - 2) on average."""
    rng, k = np.random.default_rng(0), 10
    shape = 1.0 + np.cos(np.linspace(0, 3, 400)) ** 2
    sampled = np.array([shape * rng.chisquare(k, 400) / k for _ in range(200)])
    by_itself = np.mean(shape / sampled)
    by_neighbours = np.mean(shape / smoothed(sampled, np.tile(shape, (200, 1))))
    assert by_itself == pytest.approx(k / (k - 2), rel=0.02)
    # Of 51 neighbours: 1 + 2 / (51 k), more at the ends, where fewer of them are new.
    assert by_neighbours == pytest.approx(1.0, abs=0.01)


def test_a_smooth_ratio_to_the_shape_stays():
    f = np.linspace(0, 1, 1025)
    shape = np.tile(1.0 + 50 * np.exp(-(((f - 0.2) / 0.01) ** 2)), (2, 1))
    density = shape * (1.0 + 0.3 * f)
    assert smoothed(density, shape) == pytest.approx(density, rel=0.01)


@pytest.mark.parametrize("seconds", [3.0, 10.0])
def test_noise_leaves_what_it_is_said_to(seconds: float):
    """Of a simulator that is the machine.

    Of its few thousand residuals a tenth have weight, at frequencies that are driven; they and the noise that the
    floor was taken from have 8 % of deviation together.
    """
    robot = bare_axis()
    view = ClosedLoopView(robot, logs_of(robot, [], PLAN, seconds), Settings())
    found = view.fitter.fit([], max_iterations=0)
    left = found.loss.sum() / found.samples.sum()
    assert left == pytest.approx(view.floor.expected[0], rel=0.25)


def test_logs_may_be_shorter_than_the_segments_of_others():
    robot = bare_axis()
    (long,) = logs_of(robot, [], {"multisine": ("multisine", 1)}, 3.0)
    (short,) = logs_of(robot, [], {"moves": ("moves", 0)}, 0.6)
    floors = [
        ClosedLoopView(robot, list(x), Settings()).floor for x in ((long, short), (short, long))
    ]
    assert floors[0].frequency_hz == pytest.approx(floors[1].frequency_hz)
    # Of the same torques; noise is drawn by the place of a log.
    assert floors[0].expected == pytest.approx(floors[1].expected, rel=0.3)


def fitted_lag(view: ClosedLoopView) -> float:
    begin = Hypothesis(
        Effect("actuator_bandwidth", 1, {"time_constant_s": LAG_S / 2}), ("time_constant_s",)
    )
    return view.fitter.fit([begin], refreshes=1).effects[0].values()[0]


def test_answers_to_noise_do_not_tell_of_the_machine(monkeypatch: pytest.MonkeyPatch):
    """A drive's lag in moves: fitted to all of the torque it is off by an eighth, and says it is sure."""
    robot = bare_axis()
    lag = Effect("actuator_bandwidth", 1, {"time_constant_s": LAG_S})
    logs = logs_of(robot, [lag], MOVES)
    found = fitted_lag(ClosedLoopView(robot, logs, Settings()))
    monkeypatch.setattr(TrackingWeights, "driven", lambda _, torque: np.ones_like(torque))
    biased = fitted_lag(ClosedLoopView(robot, logs, Settings()))
    assert abs(biased / LAG_S - 1) > 0.1
    assert abs(found / LAG_S - 1) < 0.5 * abs(biased / LAG_S - 1)


def test_what_the_references_drive_is_told_from_answers_to_noise():
    """Multisines to 40 Hz: there the torque is driven; far above it is what the noise makes of it."""
    robot = bare_axis()
    logs = logs_of(robot, [], {"one": ("multisine", 1), "two": ("multisine", 2)})
    floor, weights = tracking_floor(robot, robot, logs, Settings())
    f = floor.frequency_hz
    rate, segment = 1 / robot.sample_time_s, segment_of(logs[0])
    torque = np.mean([torque_density(x.torque_nm, rate, segment)[1] for x in logs], axis=0)
    share = weights.driven(torque)[0]
    assert share[(f > 2) & (f < 38)].min() > 0.9
    assert np.median(share[(f > 60) & (f < 120)]) < 0.1
    # Weight and other slow torque count, whatever the density of segments without their mean says.
    assert share[0] == 1.0


@pytest.mark.parametrize(
    ("name", "parameter", "size"),
    [("torque_deadband", "width_nm", 0.3), ("torque_saturation", "limit_nm", 1.5)],
)
def test_a_drive_meets_noise_as_it_was(name: str, parameter: str, size: float):
    """Noise dithers a deadband and a limit: the drive made its torque of what is in the log.

    Of commands that hold what keeps the simulator there too, noise would be another, and a deadband came
    out a seventh too narrow.
    """
    effect = Effect(name, 1, {parameter: size})
    robot = bare_axis()
    view = ClosedLoopView(robot, logs_of(robot, [effect], MOVES, 6.0), Settings())
    begin = Hypothesis(Effect(name, 1, {parameter: 0.8 * size}), (parameter,))
    found = view.fitter.fit([begin], refreshes=1)
    assert found.effects[0].values()[0] == pytest.approx(size, rel=5e-3)
    left = found.loss.sum() / found.samples.sum()
    assert left == pytest.approx(view.floor.expected[0], rel=0.25)

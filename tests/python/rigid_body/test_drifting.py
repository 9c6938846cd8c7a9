"""Parameters over time: the filter against least squares, the smoother against one dense system, recovery, coverage."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from axisight.errors import IdentifiabilityError, InputError
from axisight.rigid_body import USUAL_TERMS, TorqueModel, identify_rigid_body, track_parameters
from axisight.statistics.random_walk import random_walk
from rigid_body_data import drive_values, robot_of, smooth_motion, three_axes

STEP_S = 5e-3


def equations(seed: int, blocks: int, rows: int, size: int):
    """Random blocks [Phi | y] of unit noise, and the parameters that walk."""
    rng = np.random.default_rng(seed)
    drift = np.where(np.arange(size) < 2, 0.3, 0.0)
    walk = np.cumsum(drift * rng.normal(size=(blocks, size)), axis=0) + 1.0
    regressor = rng.normal(size=(blocks, rows, size))
    right = np.einsum("bij,bj->bi", regressor, walk) + rng.normal(size=(blocks, rows))
    return np.concatenate([regressor, right[..., None]], axis=-1), drift, walk


def dense(system, drift):
    """Values and covariance of all blocks at once: the normal equations of data and walk."""
    count, _, size = len(system), *system.shape[1:2], system.shape[2] - 1
    moving = np.flatnonzero(drift)
    fixed = np.flatnonzero(drift == 0)
    # Unknowns: the moving parameters of each block, then the constant ones.
    total = count * len(moving) + len(fixed)
    lines = []
    for k, block in enumerate(system):
        line = np.zeros((len(block), total + 1))
        line[:, k * len(moving) : (k + 1) * len(moving)] = block[:, moving]
        line[:, count * len(moving) : total] = block[:, fixed]
        line[:, -1] = block[:, -1]
        lines.append(line)
    for k in range(count - 1):
        line = np.zeros((len(moving), total + 1))
        for i, parameter in enumerate(moving):
            line[i, k * len(moving) + i] = -1 / drift[parameter]
            line[i, (k + 1) * len(moving) + i] = 1 / drift[parameter]
        lines.append(line)
    a = np.concatenate(lines)
    inverse = np.linalg.inv(a[:, :-1].T @ a[:, :-1])
    values = inverse @ a[:, :-1].T @ a[:, -1]
    found, spread = np.empty((count, size)), np.empty((count, size))
    error = np.sqrt(np.diag(inverse))
    for k in range(count):
        part = slice(k * len(moving), (k + 1) * len(moving))
        found[k, moving], spread[k, moving] = values[part], error[part]
        found[k, fixed], spread[k, fixed] = (
            values[count * len(moving) :],
            error[count * len(moving) :],
        )
    return found, spread


def test_the_smoother_is_the_dense_least_squares_solution():
    system, drift, _ = equations(0, 12, 3, 4)
    track = random_walk(system, drift)
    values, error = dense(system, drift)
    # Rounding times the condition number, below 1e3.
    assert track.smoothed == pytest.approx(values, abs=1e-10)
    found = np.sqrt(np.diagonal(track.smoothed_covariance, axis1=1, axis2=2))
    assert found == pytest.approx(error, rel=1e-9)


def test_the_filter_is_the_dense_solution_of_the_past():
    system, drift, _ = equations(1, 9, 3, 4)
    track = random_walk(system, drift)
    # Three equations cannot determine four parameters.
    assert np.isnan(track.filtered[0]).all()
    for k in range(2, 9):
        values, error = dense(system[:k], drift)
        assert track.filtered[k - 1] == pytest.approx(values[-1], abs=1e-10)
        found = np.sqrt(np.diag(track.filtered_covariance[k - 1]))
        assert found == pytest.approx(error[-1], rel=1e-9)


def test_without_drift_all_blocks_are_one_least_squares_problem():
    system, _, _ = equations(2, 10, 3, 4)
    track = random_walk(system, np.zeros(4))
    rows = system.reshape(-1, 5)
    expected = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
    assert track.filtered[-1] == pytest.approx(expected, abs=1e-12)
    assert track.smoothed == pytest.approx(np.tile(expected, (10, 1)), abs=1e-12)


def test_smoothed_intervals_hold_the_walk():
    """95 % intervals of 40 walks of 30 blocks; constant parameters give 40 independent numbers each."""
    inside = []
    for seed in range(40):
        system, drift, walk = equations(10 + seed, 30, 6, 4)
        track = random_walk(system, drift)
        error = np.sqrt(np.diagonal(track.smoothed_covariance, axis1=1, axis2=2))
        inside.append(np.abs(track.smoothed - walk) < 1.96 * error)
    # Neighbouring blocks are correlated: about 40 * 30 / 5 independent numbers, so 0.95 +- 3 * 0.014.
    assert np.mean(inside) == pytest.approx(0.95, abs=0.042)


@cache
def warming():
    """A three-axis arm whose viscous friction of axis 2 falls by a third within 20 s."""
    robot = robot_of(three_axes())
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    values = drive_values(model.names, model.nominal)
    q, v, a = smooth_motion(robot, 6000, STEP_S)
    moved = np.tile(values, (len(q), 1))
    name = next(n for n in model.names if n.endswith("viscous_friction"))
    column = model.names.index(name)
    time_s = np.arange(len(q)) * STEP_S
    moved[:, column] *= 1 - (1 - np.exp(-time_s / 8)) / 3
    exact = np.einsum("nij,nj->ni", model.matrix(q, v, a), moved)
    rng = np.random.default_rng(3)
    torque = exact + 0.01 * exact.std(axis=0) * rng.normal(size=exact.shape)
    return model, name, moved[:, column], (q, v, a), torque


def test_friction_that_warms_up_is_followed():
    model, name, truth, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    size = truth[0]
    # A change by a third in 20 s: a twentieth in one second.
    track = track_parameters(
        fixed, *motion, torque, sample_time_s=STEP_S, drift_per_sqrt_s={name: 0.05 * size}
    ).sel(parameter=name)
    at = (track["time"].values / STEP_S).round().astype(int) - 1
    error = (track["smoothed"].values - truth[at]) / track["smoothed_standard_error"].values
    assert np.abs(error).max() < 4  # 60 blocks of a normal error
    assert np.abs(track["smoothed"].values - truth[at]).max() < 0.1 * size
    constant = fixed.values[fixed.names.index(name)]
    assert np.abs(constant - truth[[0, -1]]).min() > 0.05 * size


def test_without_drift_the_last_values_are_those_of_weighted_least_squares():
    model, _, _, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    track = track_parameters(fixed, *motion, torque, sample_time_s=STEP_S, drift_per_sqrt_s={})
    last = track["filtered"].values[-1]
    # Row weights are iterated to 1e-8; the rest is rounding.
    assert last == pytest.approx(fixed.values, rel=1e-6, abs=1e-6 * np.abs(fixed.values).max())


def test_threads_change_nothing():
    model, name, _, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    runs = [
        track_parameters(
            fixed,
            *motion,
            torque,
            sample_time_s=STEP_S,
            drift_per_sqrt_s={name: 1e-3},
            threads=threads,
        )
        for threads in (1, 2)
    ]
    assert runs[0].identical(runs[1])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"drift_per_sqrt_s": {"axis9.mass": 1.0}}, "names of base parameters"),
        ({"block_s": 20.0}, "less than half"),
        ({"sample_time_s": 0.0}, "sample_time_s"),
    ],
)
def test_wrong_arguments_are_refused(changed, message):
    model, name, _, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    given = {"sample_time_s": STEP_S, "drift_per_sqrt_s": {name: 1e-3}} | changed
    with pytest.raises(InputError, match=message):
        track_parameters(fixed, *motion, torque, **given)


def test_a_negative_drift_is_refused():
    model, name, _, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    with pytest.raises(InputError, match="no negative number"):
        track_parameters(
            fixed, *motion, torque, sample_time_s=STEP_S, drift_per_sqrt_s={name: -1.0}
        )


def test_a_motion_that_shows_too_little_is_refused():
    model, name, _, motion, torque = warming()
    fixed = identify_rigid_body(model, *motion, torque)
    still = [np.zeros_like(x) for x in motion]
    with pytest.raises(IdentifiabilityError, match="does not determine"):
        track_parameters(fixed, *still, torque, sample_time_s=STEP_S, drift_per_sqrt_s={name: 1e-3})

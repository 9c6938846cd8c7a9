"""Excitation trajectories: exact derivatives, limits, what the optimisation gains, misuse."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from axisight.errors import InputError
from axisight.excitation import read_references
from axisight.rigid_body import USUAL_TERMS, TorqueModel
from axisight.rigid_body.sensitivity import regressor_sensitivity
from axisight.rigid_body.trajectories import MotionLimits, _bounds, _Problem, optimize_trajectory
from three_axes import robot

LIMITS = MotionLimits([(-2, 2), (-1, 1), (-1.5, 0.5)], 2.0, [6.0, 5.0, 8.0], [0.8, 1.4, 0.25])
QUICK = {"fundamental_hz": 0.2, "harmonics": 3, "starts": 2, "max_iterations": 25}


@pytest.fixture(scope="module")
def model():
    return TorqueModel(robot(), terms=USUAL_TERMS, side="motor")


@pytest.fixture(scope="module")
def design(model):
    return optimize_trajectory(model, LIMITS, **QUICK)


@pytest.mark.parametrize("motion", ["", 'motion = "prismatic"'])
@pytest.mark.parametrize("side", ["motor", "joint"])
def test_derivatives_of_the_regressor_are_exact(motion, side):
    terms = dataclasses.replace(USUAL_TERMS, smoothing_rad_s=30.0)
    model = TorqueModel(robot(motion), terms=terms, side=side)
    q, v, a = np.random.default_rng(2).normal(size=(3, 20, 3))
    found = regressor_sensitivity(model, q, v, a)
    value = model.matrix(q, v, a)
    size = np.abs(value).max()
    assert np.abs(found.value - value).max() < 1e-13 * size
    step = 1e-5
    for k in range(3):
        for kind, got in enumerate((found.position, found.velocity, found.acceleration)):
            up, down = [np.array([q, v, a]) for _ in range(2)]
            up[kind, :, k] += step
            down[kind, :, k] -= step
            want = (model.matrix(*up) - model.matrix(*down)) / (2 * step)
            # What central differences are worth: rounding over the step, curvature.
            assert np.abs(got[k] - want).max() < 1e-9 * size


@pytest.mark.parametrize("criterion", ["condition", "log_det"])
def test_gradients_of_criterion_and_limits(model, criterion):
    problem = _Problem(model, _bounds(model, LIMITS), 0.2, 3, 40, True)
    problem.aim(criterion, None, None, np.full(3, 0.1), model.nominal, 0)
    x = problem.start(np.random.default_rng(4))
    _, gradient, _, jacobian = problem.evaluate(x, 16.0)
    want = approx_fprime(x, lambda y: problem.evaluate(y, 16.0)[0], 1e-7)
    assert np.abs(gradient - want).max() < 1e-4 * np.abs(want).max()
    want = approx_fprime(x, lambda y: problem.evaluate(y, 16.0)[2], 1e-7)
    assert np.abs(jacobian - want).max() < 1e-5 * np.abs(want).max()


def test_limits_hold_between_the_samples_too(design, model):
    assert design.status in ("converged", "max_iterations")
    time = np.linspace(0, 5, 20_001)
    q, v, a = design.trajectory.motion(time)
    low, high = np.array(LIMITS.position_rad).T
    assert np.all(q > low) and np.all(q < high)
    assert np.abs(v).max() < 2.0
    assert np.all(np.abs(a).max(axis=0) < LIMITS.acceleration_rad_s2)
    torque = model.matrix(q, v, a) @ model.nominal
    # The margin of torque is sampled, a thousand times a period.
    assert np.all(np.abs(torque).max(axis=0) < 1.001 * np.array(LIMITS.torque_nm))
    margins = design.margins
    assert float(margins.max()) <= 1.0 + 1e-6
    assert float(margins.sel(quantity="velocity", axis=1)) == pytest.approx(
        np.abs(v[:, 0]).max() / 2, rel=1e-4
    )
    # Something limits it, torque among others: a larger motion determines more.
    assert float(margins.sel(quantity="torque").max()) > 0.9


def test_motion_starts_at_rest_and_is_its_own_derivative(design):
    path = design.trajectory
    q, v, a = path.motion([0.0, path.period_s])
    assert np.abs(v[0]).max() < 1e-12 and np.abs(a[0]).max() < 1e-11
    assert np.abs(q[1] - q[0]).max() < 1e-12
    step = 1e-4
    t = np.linspace(0, 5, 50)
    for lower, upper in ((0, 1), (1, 2)):
        slope = (path.motion(t + step)[lower] - path.motion(t - step)[lower]) / (2 * step)
        # Curvature (3 2 pi 0.2)^2 step^2 / 6 of amplitudes below ten.
        assert np.abs(slope - path.motion(t)[upper]).max() < 1e-6


def test_parameters_come_out_better_than_from_a_random_trajectory(design, model):
    assert design.condition_after < 0.3 * design.condition_before
    assert design.after == design.condition_after
    # Recovery: the spread of an estimate over the same noise.
    time = np.arange(200) / 200 * 5
    phi = model.matrix(*design.trajectory.motion(time))[..., list(design.columns)]
    s = np.linalg.svd(phi.reshape(-1, len(design.columns)), compute_uv=False)
    assert s[-1] > 0
    # The number of base parameters is that of independent columns at random motions.
    q, v, a = np.random.default_rng(0).normal(size=(3, 500, 3))
    rank = np.linalg.matrix_rank(model.matrix(q, v, a).reshape(-1, model.n_parameters))
    assert len(design.columns) == rank


def test_log_det_makes_the_estimate_less_uncertain(model):
    found = optimize_trajectory(model, LIMITS, criterion="log_det", torque_std_nm=0.1, **QUICK)
    b = len(found.columns)

    def spread(path):
        """Log of the volume of the confidence ellipsoid, per parameter."""
        time = np.arange(60) / 60 * path.period_s
        phi = model.matrix(*path.motion(time))[..., list(found.columns)].reshape(-1, b) / 0.1
        return -np.linalg.slogdet(phi.T @ phi)[1] / b

    # Its own figure, computed another way, on another grid and without the smoothing.
    assert found.after == pytest.approx(spread(found.trajectory), abs=0.05)
    assert found.after < found.before - 0.5


def test_same_seed_same_trajectory(model):
    quick = QUICK | {"max_iterations": 3, "starts": 1}
    one = optimize_trajectory(model, LIMITS, seed=3, **quick)
    two = optimize_trajectory(model, LIMITS, seed=3, **quick)
    other = optimize_trajectory(model, LIMITS, seed=4, **quick)
    assert np.array_equal(one.trajectory.sine, two.trajectory.sine)
    assert not np.array_equal(one.trajectory.sine, other.trajectory.sine)


def test_cut_short_and_impossible_say_so(model):
    short = optimize_trajectory(model, LIMITS, **QUICK | {"max_iterations": 20, "starts": 1})
    assert short.status == "max_iterations" and "more iterations" in short.advice
    weak = dataclasses.replace(LIMITS, torque_nm=[4.0, 1e-3, 1e-3])
    none = optimize_trajectory(model, weak, **QUICK | {"max_iterations": 3, "starts": 1})
    assert none.status == "infeasible" and "gravity" in none.advice
    assert float(none.margins.max()) > 1


def test_files_hold_the_references_and_the_design(design, model, tmp_path):
    files = design.trajectory.write(tmp_path / "path.csv", model.robot, design=design.design)
    assert {f.name for f in files} == {"path.csv", "path.design.json"}
    back = read_references(tmp_path / "path.csv")
    time = np.arange(back.n_samples) * back.sample_time_s
    q, v, _ = design.trajectory.motion(time)
    assert np.abs(back.period[0] - 100 * v).max() < 1e-12
    assert back.design["start_rad"] == q[0].tolist()
    assert back.design["condition"] == design.condition_after
    assert np.array_equal(back.design["sine_rad_s"], design.trajectory.sine)
    odd = dataclasses.replace(design.trajectory, fundamental_hz=0.3)
    with pytest.raises(InputError, match="period_s: expected a positive whole number"):
        odd.references(model.robot)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fundamental_hz": 0.0}, "fundamental_hz: expected a positive"),
        ({"fundamental_hz": np.nan}, "fundamental_hz: expected a positive"),
        ({"harmonics": 1}, "harmonics: expected a whole number from 2"),
        ({"harmonics": 2.5}, "harmonics: expected a whole number"),
        ({"samples": 10}, "samples: expected at least 12"),
        ({"criterion": "trace"}, "criterion: expected"),
        ({"columns": [500]}, "columns: expected positions"),
        ({"columns": [0.5]}, "columns: expected positions"),
        ({"scale": [1.0]}, "scale: expected"),
        ({"torque_std_nm": -1.0}, "torque_std_nm: expected"),
        ({"theta": np.zeros(3)}, "theta: expected"),
        ({"starts": 0}, "starts: expected a whole number from 1"),
        ({"max_iterations": True}, "max_iterations: expected a whole number"),
        ({"position_rad": np.zeros((3, 2))}, "position_rad: expected upper above lower"),
        ({"position_rad": [(-1, 1)]}, "position_rad: expected finite shape"),
        ({"velocity_rad_s": -1.0}, "velocity_rad_s: expected positive"),
        ({"velocity_rad_s": None}, "velocity_rad_s: expected positive"),
        ({"acceleration_rad_s2": np.inf}, "acceleration_rad_s2: expected positive"),
        ({"torque_nm": [1.0, 2.0]}, "torque_nm: expected positive"),
    ],
)
def test_misuse_is_named(model, change, message):
    fields = {f.name for f in dataclasses.fields(MotionLimits)}
    limits = dataclasses.replace(LIMITS, **{k: v for k, v in change.items() if k in fields})
    options = QUICK | {k: v for k, v in change.items() if k not in fields}
    with pytest.raises(InputError, match=message):
        optimize_trajectory(model, limits, **options)

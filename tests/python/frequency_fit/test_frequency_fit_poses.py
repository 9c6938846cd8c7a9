"""D-optimal operating points: certificate, brute force, use."""

from itertools import combinations, combinations_with_replacement

import numpy as np
import pytest

from axisight import InputError, Parameter, _core
from axisight.frequency_fit import choose_poses, planned_information
from axisight.identifiability import identifiability
from frequency_fit_data import ELASTIC, LINES_HZ, ROBOT, TRUTH

LINES = LINES_HZ[::4]
POINTS = np.array([[0.0, a, b] for a in (-0.8, 0.0, 0.8) for b in (-1.0, 0.0, 0.8)])


def log_det(matrix: np.ndarray) -> float:
    return float(np.linalg.slogdet(matrix)[1])


def information() -> np.ndarray:
    """Per logarithm of the parameters."""
    plans = [planned_information(ROBOT, ELASTIC, [point], LINES) for point in POINTS]
    return np.array([plan.matrix * np.outer(plan.scales, plan.scales) for plan in plans])


@pytest.mark.parametrize("repeats", [False, True])
def test_choice_is_the_best_of_all(repeats: bool) -> None:
    matrices = information()
    ways = combinations_with_replacement if repeats else combinations
    best = max(log_det(matrices[list(way)].sum(axis=0)) for way in ways(range(9), 3))
    found = choose_poses(ROBOT, ELASTIC, POINTS, LINES, 3, repeats=repeats)
    assert found.log_det == pytest.approx(best, abs=1e-9)
    assert found.log_det == pytest.approx(log_det(matrices[list(found.chosen)].sum(axis=0)))
    assert found.efficiency <= 1 + 1e-9
    np.testing.assert_array_equal(found.operating_points_rad, POINTS[list(found.chosen)])


def test_relaxed_optimum_is_certified() -> None:
    """Kiefer and Wolfowitz: the sensitivity is p where there is weight and below it elsewhere."""
    found = choose_poses(ROBOT, ELASTIC, POINTS, LINES, 4, gap_tolerance=1e-7)
    p = len(ELASTIC)
    assert found.gap <= 1e-7
    assert found.sensitivity.max() <= p + 1e-6
    matrices = information()
    total = np.einsum("i,ijk->jk", found.weights, matrices)
    wanted = [np.trace(np.linalg.solve(total, matrix)) for matrix in matrices]
    np.testing.assert_allclose(found.sensitivity, wanted, rtol=1e-6)
    assert found.weights.sum() == pytest.approx(1.0)
    assert found.weights @ found.sensitivity == pytest.approx(p, rel=1e-9)
    assert set(found.to_xarray().data_vars) == {"weight", "sensitivity", "chosen"}


def test_relaxation_of_random_matrices_meets_a_closed_form() -> None:
    """Information c_i on one parameter each: equal weights, whatever the c_i."""
    matrices = np.array([np.diag([3.0, 0, 0]), np.diag([0, 50.0, 0]), np.diag([0, 0, 0.2])])
    found = _core.design_poses(
        matrices, np.zeros((3, 3)), 3, repeats=False, gap_tolerance=1e-9, max_iterations=1000
    )
    np.testing.assert_allclose(found["weights"], 1 / 3, atol=1e-8)
    assert found["chosen"] == [0, 1, 2]
    assert found["bound"] == pytest.approx(np.log(3 * 50 * 0.2), abs=1e-8)


def test_chosen_points_are_better_than_others() -> None:
    found = choose_poses(ROBOT, ELASTIC, POINTS, LINES, 3)
    rng = np.random.default_rng(1)
    others = [
        identifiability(planned_information(ROBOT, ELASTIC, points, LINES))
        for points in (POINTS[rng.choice(9, 3, replace=False)] for _ in range(10))
    ]
    own = np.log(found.identifiability.relative_std).mean()
    assert own < np.median([np.log(other.relative_std).mean() for other in others])


def test_what_is_known_already_counts() -> None:
    matrices = information()
    known = matrices[0] * 10
    found = choose_poses(ROBOT, ELASTIC, POINTS, LINES, 2, measured_information=known)
    best = max(log_det(known + matrices[list(w)].sum(axis=0)) for w in combinations(range(9), 2))
    assert found.log_det == pytest.approx(best, abs=1e-9)


def test_misuse_is_refused_by_name() -> None:
    for n_poses in (0, 2.5, 10, True):
        with pytest.raises(InputError, match="n_poses"):
            choose_poses(ROBOT, ELASTIC, POINTS, LINES, n_poses)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="measured_information"):
        choose_poses(ROBOT, ELASTIC, POINTS, LINES, 2, measured_information=np.eye(3))
    # One line of a symmetric response holds 12 numbers.
    many = (*ELASTIC, "axis3.motor_inertia", "axis3.viscous_friction")
    with pytest.raises(InputError, match=r"determine all parameters.*not each of"):
        choose_poses(ROBOT, many, POINTS[:1], [8.0], 1)
    known = [
        Parameter(name, TRUTH[name], 1e-4, 1e8, 1.0, prior=(TRUTH[name], 0.1 * TRUTH[name]))
        for name in many
    ]
    assert choose_poses(ROBOT, known, POINTS[:1], [8.0], 1).chosen == (0,)

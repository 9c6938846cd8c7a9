"""Bodies that can exist: closed forms, SciPy, recovery, misuse."""

import warnings

import numpy as np
import pytest
from scipy.optimize import minimize

from axisight.errors import InputError
from axisight.rigid_body import (
    USUAL_TERMS,
    TorqueModel,
    consistent_parameters,
    identify_consistent,
    identify_rigid_body,
    prior_spread,
    pseudo_inertia,
)
from three_axes import robot

LINK = np.arange(10)


def body(seed, mass=8.0, points=30):
    """Parameters of a cloud of point masses: a body that exists."""
    rng = np.random.default_rng(seed)
    m = rng.uniform(0.5, 1.5, points)
    m *= mass / m.sum()
    x = np.array([0.1, -0.2, 0.3]) + rng.normal(0, 0.2, (points, 3))
    inertia = (m[:, None, None] * ((x**2).sum(1)[:, None, None] * np.eye(3))).sum(0)
    inertia -= np.einsum("n,na,nb->ab", m, x, x)
    terms = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return np.array([mass, *(m @ x), *terms]), np.einsum("n,na,nb->ab", m, x, x)


def flat(matrix):
    """Entries of a symmetric matrix such that sums of squares are Frobenius norms."""
    rows, columns = np.triu_indices(4)
    return np.array(
        [matrix[i, j] * (1 if i == j else np.sqrt(2)) for i, j in zip(rows, columns, strict=True)]
    )


def as_matrix():
    """The linear map from link parameters to ``flat`` of the pseudo-inertia."""
    return np.array([flat(pseudo_inertia(e)) for e in np.eye(10)]).T


def test_pseudo_inertia_is_that_of_the_points():
    theta, second_moments = body(0)
    j = pseudo_inertia(theta)
    assert np.abs(j[:3, :3] - second_moments).max() < 1e-14
    assert np.array_equal(j[:3, 3], theta[1:4]) and j[3, 3] == theta[0]
    assert np.linalg.eigvalsh(j)[0] > 0
    # Of a body that cannot be: the triangle inequality of its principal moments is broken.
    assert np.linalg.eigvalsh(pseudo_inertia([1, 0, 0, 0, 1, 1, 3, 0, 0, 0]))[0] < 0


def test_consistent_fit_is_left_as_it_is():
    theta, _ = body(1)
    factor = np.random.default_rng(0).normal(size=(14, 11))
    theta = np.append(theta, 0.3)
    found = consistent_parameters(
        factor, factor @ theta, links=[LINK], nonnegative=[10], prior=1.1 * theta
    )
    assert found.status == "already_consistent" and found.iterations == 0
    # The prior weighs 1e-12 of the best direction; the condition number is near ten.
    assert np.abs(found.theta - theta).max() < 1e-9
    assert found.boundary_links == () and found.boundary_parameters == ()


def test_projection_is_the_clipping_of_eigenvalues():
    # In the Frobenius norm the nearest positive semidefinite matrix has its negative
    # eigenvalues set to zero (Higham 1988); here to the margin.
    for seed in range(5):
        theta, _ = body(seed)
        j = pseudo_inertia(theta)
        middle = np.linalg.eigvalsh(j)[1:3].mean()
        j = j - middle * np.eye(4)
        values, vectors = np.linalg.eigh(j)
        assert values[1] < 0 < values[2]
        margin = 1e-6 * 10.0  # of the typical mass; the typical length makes 2.5
        found = consistent_parameters(
            as_matrix(), flat(j), links=[LINK], prior=np.zeros(10), margin=1e-6
        )
        assert (found.mass, found.length_m) == (10.0, 0.5)
        want = vectors @ np.diag(np.maximum(values, 0.0)) @ vectors.T
        assert found.status == "solved"
        # The margin moves the solution by itself; the solver's tolerance is 1e-10 of 10.
        assert np.abs(pseudo_inertia(found.theta) - want).max() < 2 * margin
        assert found.boundary_links == (0,)
        assert found.loss == pytest.approx((values[values < 0] ** 2).sum(), rel=1e-3)


def test_agrees_with_a_general_optimiser():
    rng = np.random.default_rng(4)
    theta, _ = body(4)
    factor = rng.normal(size=(12, 11))
    target = factor @ np.append(theta, -0.5) + rng.normal(0, 2.0, 12)
    found = consistent_parameters(factor, target, links=[LINK], nonnegative=[10], margin=1e-9)
    assert found.status == "solved"
    assert found.boundary_parameters == (10,)

    def parameters(x):
        """Any body as a Cholesky factor, any coefficient as a square."""
        low = np.zeros((4, 4))
        low[np.tril_indices(4)] = x[:10]
        return np.append(np.linalg.solve(as_matrix(), flat(low @ low.T)), x[10] ** 2)

    best = min(
        minimize(
            lambda x: np.sum((factor @ parameters(x) - target) ** 2),
            np.random.default_rng(run).normal(0, 1, 11),
            method="BFGS",
            options={"gtol": 1e-10, "maxiter": 4000},
        ).fun
        for run in range(2)
    )
    # A local search from above: it may stop a little short of the minimum.
    assert found.loss == pytest.approx(best, rel=1e-4)
    assert found.loss < best * (1 + 1e-6)


def test_known_values_are_those_of_the_regression_without_them():
    """A coefficient goes to the target; a first moment held where it is changes nothing."""
    rng = np.random.default_rng(4)
    theta, _ = body(4)
    factor = rng.normal(size=(14, 12))
    target = factor @ np.append(theta, [-0.5, 0.3]) + rng.normal(0, 2.0, 14)
    found = consistent_parameters(factor, target, links=[LINK], nonnegative=[10], known={11: 0.7})
    less = consistent_parameters(
        factor[:, :11], target - 0.7 * factor[:, 11], links=[LINK], nonnegative=[10]
    )
    assert found.status == less.status == "solved" and found.theta[11] == 0.7
    # Tolerances of the solver are 1e-9 of the target; the condition number is near ten.
    np.testing.assert_allclose(found.theta[:11], less.theta, atol=1e-6 * np.abs(theta).max())
    assert found.loss_unconstrained == pytest.approx(less.loss_unconstrained, rel=1e-9)

    free = consistent_parameters(factor, target, links=[LINK], nonnegative=[10])
    at = float(free.theta[1])
    held = consistent_parameters(factor, target, links=[LINK], nonnegative=[10], known={1: at})
    assert held.status == free.status == "solved" and held.theta[1] == at
    np.testing.assert_allclose(held.theta, free.theta, atol=1e-5 * np.abs(theta).max())
    # Away from there it costs, and all the more the further.
    losses = []
    for step in (0.5, 1.0, 1.5):
        away = consistent_parameters(
            factor, target, links=[LINK], nonnegative=[10], known={1: at + step}
        )
        assert away.theta[1] == at + step and away.least_eigenvalue[0] > 0
        losses.append(away.loss)
    assert free.loss < losses[0] < losses[1] < losses[2]
    # Convex.
    assert losses[0] - free.loss < losses[1] - losses[0] < losses[2] - losses[1]


def test_known_values_of_a_consistent_fit_and_of_none():
    theta, _ = body(1)
    factor = np.random.default_rng(0).normal(size=(14, 10))
    found = consistent_parameters(factor, factor @ theta, links=[LINK], known={0: theta[0]})
    assert found.status == "already_consistent" and found.theta[0] == theta[0]
    assert np.abs(found.theta - theta).max() < 1e-9
    # No body has a negative inertia.
    none = consistent_parameters(factor, factor @ theta, links=[LINK], known={4: -1.0})
    assert none.status == "failed" and np.isnan(none.theta).all()
    assert "perhaps no body has them" in none.advice


def test_prior_decides_what_data_leave_open():
    # Only three combinations are measured, exactly: those must hold, the rest is CAD.
    theta, _ = body(2)
    cad, _ = body(3)
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(3, 10))
    found = consistent_parameters(factor, factor @ theta, links=[LINK], prior=cad)
    assert np.abs(factor @ (found.theta - theta)).max() < 1e-5
    # The nearest to CAD that fits, if it exists: a projection in typical units.
    scale = np.array([found.mass] + [found.mass * found.length_m] * 3)
    scale = np.append(scale, [found.mass * found.length_m**2] * 6)
    want = cad + scale * (np.linalg.pinv(factor * scale) @ (factor @ (theta - cad)))
    if found.status == "already_consistent":
        assert np.abs(found.theta - want).max() < 1e-5
    else:
        assert np.linalg.eigvalsh(pseudo_inertia(want))[0] < 0
    # With standard deviations the prior is a measurement like any other.
    std = np.full(10, 0.5)
    bayes = consistent_parameters(factor, factor @ theta, links=[LINK], prior=cad, prior_std=std)
    both = np.concatenate([factor, np.diag(1 / std)])
    least = np.linalg.lstsq(both, np.concatenate([factor @ theta, cad / std]), rcond=None)[0]
    assert bayes.status == "already_consistent"
    assert np.abs(bayes.theta - least).max() < 1e-10


def test_prior_counts_like_a_measurement_on_the_boundary_too():
    theta, _ = body(6)
    target = flat(pseudo_inertia(theta) - 3.0 * np.eye(4))
    prior, std = 0.5 * theta, np.linspace(1.0, 3.0, 10)
    one = consistent_parameters(as_matrix(), target, links=[LINK], prior=prior, prior_std=std)
    stacked = np.concatenate([as_matrix(), np.diag(1 / std)])
    two = consistent_parameters(stacked, np.concatenate([target, prior / std]), links=[LINK])
    assert one.status == two.status == "solved"
    # Typical sizes differ, so do the margins: 1e-6 of some 10 kg.
    assert np.abs(one.theta - two.theta).max() < 1e-4
    assert np.abs(one.theta - theta).max() > 0.1


def test_noisy_links_become_possible_and_come_nearer_to_the_truth():
    rng = np.random.default_rng(11)
    truth = np.concatenate([body(k)[0] for k in range(4)] + [[0.2, 0.0, 1.0]])
    links = np.arange(40).reshape(4, 10)
    better = 0
    for run in range(10):
        factor = np.random.default_rng((5, run)).normal(size=(60, 43))
        noise = rng.normal(0, 3.0, 60)
        free = np.linalg.lstsq(factor, factor @ truth + noise, rcond=None)[0]
        q, r = np.linalg.qr(factor)
        found = consistent_parameters(
            r, q.T @ (factor @ truth + noise), links=links, nonnegative=[40, 41, 42]
        )
        assert found.status == "solved"
        assert np.all(found.least_eigenvalue > 0.99e-6)
        assert np.all(found.theta[40:] > -1e-8)
        assert found.loss >= found.loss_unconstrained
        better += np.linalg.norm(r @ (found.theta - truth)) < np.linalg.norm(r @ (free - truth))
    # Projection onto a convex set that holds the truth, in the metric of the fit: always.
    assert better == 10


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"factor": np.full((12, 11), np.nan)}, "factor: expected finite"),
        ({"factor": np.zeros(11)}, "factor: expected finite real numbers in 2"),
        ({"factor": np.ones((12, 11)) * 1j}, "factor: expected finite real"),
        ({"target": np.zeros(5)}, r"target: expected shape \(12,\)"),
        ({"links": [np.arange(9)]}, "links: expected positions"),
        ({"links": [np.arange(2, 12)]}, "links: expected positions from 0 to 10"),
        ({"links": [LINK, LINK]}, "links: expected positions"),
        ({"links": [LINK * 1.0]}, "links: expected positions"),
        ({"nonnegative": [-1]}, "nonnegative: expected positions"),
        ({"nonnegative": [10, 10]}, "nonnegative: expected positions"),
        ({"known": {11: 1.0}}, "known: expected positions"),
        ({"known": {0.5: 1.0}}, "known: expected positions"),
        ({"known": {0: np.nan}}, "known: expected finite"),
        ({"known": {10: -1.0}}, "known: expected no negative number"),
        ({"prior": np.zeros(3)}, r"prior: expected shape \(11,\)"),
        ({"prior": np.full(11, np.inf)}, "prior: expected finite"),
        ({"prior_std": 0.0}, "prior_std: expected one positive"),
        ({"prior_std": np.ones(4)}, "prior_std: expected one positive"),
        ({"prior_std": np.nan}, "prior_std: expected one positive"),
        ({"margin": -1e-6}, "margin: expected a positive"),
        ({"margin": np.inf}, "margin: expected a positive"),
        ({"max_iterations": 0}, "max_iterations: expected a positive"),
        ({"max_iterations": 2.5}, "max_iterations: expected a positive"),
    ],
)
def test_misuse_is_named(change, message):
    rng = np.random.default_rng(0)
    given = {
        "factor": rng.normal(size=(12, 11)),
        "target": np.ones(12),
        "links": [LINK],
        "nonnegative": [10],
    } | change
    with pytest.raises(InputError, match=message):
        consistent_parameters(given.pop("factor"), given.pop("target"), **given)


def test_a_solver_that_is_cut_short_says_so():
    rng = np.random.default_rng(4)
    factor = rng.normal(size=(12, 11))
    found = consistent_parameters(
        factor, rng.normal(size=12) * 10, links=[LINK], nonnegative=[10], max_iterations=2
    )
    assert found.status == "inaccurate"
    assert "solver" in found.advice


@pytest.fixture(scope="module")
def three_axes():
    return TorqueModel(robot(), terms=USUAL_TERMS, side="motor")


def motion(n, seed):
    return np.random.default_rng(seed).normal(size=(3, n, 3)) * [[[1.0]], [[2.0]], [[5.0]]]


def true_parameters(model):
    theta = model.nominal
    for name, value in (("coulomb_friction", 0.1), ("torque_offset", -0.05)):
        for k, full in enumerate(model.names):
            if full.endswith(name):
                theta[k] = value
    return theta


def test_true_robot_comes_back_from_its_torques(three_axes):
    theta = true_parameters(three_axes)
    q, v, a = motion(300, 0)
    torque = three_axes.matrix(q, v, a) @ theta
    found = identify_consistent(three_axes, q, v, a, torque, torque_std_nm=0.1)
    # The robot's own file is the prior, and what it lacks is identifiable.
    assert found.status == "already_consistent"
    assert np.abs(found.theta - theta).max() < 1e-6
    # A wrong prior changes what cannot be seen, and nothing that can.
    wrong = np.where(np.arange(len(theta)) < 30, 1.2 * theta, theta)
    other = identify_consistent(three_axes, q, v, a, torque, torque_std_nm=0.1, prior=wrong)
    assert np.abs(other.theta - theta).max() > 0.1
    q, v, a = motion(100, 1)
    predicted = three_axes.matrix(q, v, a) @ other.theta
    assert np.abs(predicted - three_axes.matrix(q, v, a) @ theta).max() < 1e-4


def test_factors_are_those_of_the_weighted_regression(three_axes):
    q, v, a = motion(60, 3)
    phi = three_axes.matrix(q, v, a)
    noise = np.random.default_rng(0).normal(0, 1.0, (60, 3))
    torque = phi @ true_parameters(three_axes) + noise
    std = np.array([0.1, 1.0, 3.0])
    spread = prior_spread(three_axes)
    found = identify_consistent(three_axes, q, v, a, torque, torque_std_nm=std, prior_std=spread)
    dense = consistent_parameters(
        (phi / std[:, None]).reshape(180, -1),
        (torque / std).ravel(),
        links=np.arange(30).reshape(3, 10),
        nonnegative=[30, 31, 32, 34, 35, 36, 38, 39, 40],
        prior=three_axes.nominal,
        prior_std=spread,
    )
    assert found.status == dense.status
    # The solver ends within 1e-9 of the squared target, and the loss is flat at its minimum.
    assert np.abs(found.theta - dense.theta).max() < 1e-3
    # Loss and prior trade off to first order in the solver's error, 1e-6 of what the noise is.
    assert dense.loss == pytest.approx(found.loss, rel=1e-6)
    assert dense.loss_unconstrained == pytest.approx(found.loss_unconstrained, rel=1e-9)


def test_spread_of_a_prior_is_that_of_its_links(three_axes):
    spread = dict(zip(three_axes.names, prior_spread(three_axes, 0.5), strict=True))
    nominal = dict(zip(three_axes.names, three_axes.nominal, strict=True))
    assert spread["turn.mass"] == pytest.approx(10.0)
    # m L^2 is the sum of second moments, half the trace of the inertia.
    trace = sum(nominal[f"turn.inertia_{k}"] for k in ("xx", "yy", "zz"))
    assert spread["turn.inertia_xy"] == pytest.approx(0.5 * 0.5 * trace)
    assert spread["turn.mass_x"] == pytest.approx(0.5 * np.sqrt(20.0 * 0.5 * trace))
    assert spread["turn.motor_inertia"] == pytest.approx(0.5 * nominal["turn.motor_inertia"])
    assert np.isinf(spread["turn.coulomb_friction"])
    with pytest.raises(InputError, match="share: expected a positive"):
        prior_spread(three_axes, 0.0)


def test_short_noisy_record_is_predicted_better_by_bodies_that_exist(three_axes):
    theta = true_parameters(three_axes)
    t = np.linspace(0, 2, 80)[:, None]
    w = np.array([2.0, 3.0, 4.0])
    q, v, a = 0.5 * np.sin(w * t), 0.5 * w * np.cos(w * t), -0.5 * w**2 * np.sin(w * t)
    held = motion(300, 5)
    exact = three_axes.matrix(*held) @ theta
    errors = []
    for run in range(5):
        noise = np.random.default_rng((9, run)).normal(0, 0.05, (80, 3))
        torque = three_axes.matrix(q, v, a) @ theta + noise
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            free = identify_rigid_body(three_axes, q, v, a, torque, deficient="group")
        found = identify_consistent(
            three_axes, q, v, a, torque, torque_std_nm=0.05, prior=1.3 * theta
        )
        assert found.status == "solved"
        errors.append(
            [
                np.std(free.predict(*held) - exact),
                np.std(three_axes.matrix(*held) @ found.theta - exact),
            ]
        )
    plain, possible = np.mean(errors, axis=0)
    assert possible < 0.5 * plain


def test_misuse_of_a_motion_is_named(three_axes):
    q, v, a = motion(50, 0)
    torque = np.zeros((50, 3))
    for given, options, message in (
        ((q, v, a, torque[:9]), {}, "torque_nm: expected 50 rows"),
        ((q, v, a, torque * np.nan), {}, "torque_nm: expected finite"),
        ((q[:, :2], v, a, torque), {}, "q: expected shape"),
        ((q, v, a, torque), {"torque_std_nm": 0.0}, "torque_std_nm: expected positive"),
        ((q, v, a, torque), {"torque_std_nm": [1.0, 2.0]}, "torque_std_nm: expected positive"),
        ((q, v, a, torque), {"prior": np.zeros(4)}, "prior: expected shape"),
        ((q, v, a, torque), {"known": {"axis9.mass": 1.0}}, "known: expected names"),
        ((q, v, a, torque), {"known": {"axis1.mass": "x"}}, "known: expected a finite number"),
    ):
        with pytest.raises(InputError, match=message):
            identify_consistent(three_axes, *given, **options)

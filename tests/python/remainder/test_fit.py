"""Terms of a remainder: the right variable, the right function, nothing from noise or from causes."""

from dataclasses import replace

import numpy as np
import pytest
from remainder_data import motion, records
from scipy.stats import norm

from axisight.errors import InputError
from axisight.remainder import Motion, Record, Remainder, fit_remainder
from axisight.remainder.penalised import Joint, block
from axisight.remainder.splines import basis, penalty, scale_of
from axisight.remainder.variables import direction

Array = np.ndarray


def coupled(at: Motion) -> Array:
    """Dry friction of axis 1 that grows with the speed of axis 2."""
    return np.asarray(np.tanh(20 * at.velocity_rad_s[:, 0]) * np.abs(at.velocity_rad_s[:, 1]))


@pytest.fixture(scope="module")
def found() -> Remainder:
    return fit_remainder(records(coupled))


def test_the_variable_of_a_coupled_friction_is_found(found: Remainder) -> None:
    (term,) = [t for t in found.terms if t.axis == 1][:1]
    assert (term.acts, term.variable, term.of_axis) == ("direction", "speed", 2)
    assert not found.of_axis(2)  # noise alone


def test_it_carries_to_another_motion(found: Remainder) -> None:
    other = motion(99)
    left = coupled(other) - found.torque(other)[:, 0]
    # The smoothed sign of the model turns at 1 % of the top speed, that of the law at 5 %: that and the noise
    # of 0.1 Nm over 6,000 samples leave a few per cent.
    assert np.std(left) < 0.12 * np.std(coupled(other))


def test_the_band_holds_the_truth() -> None:
    """Without a smoothed sign, 95 % of the points lie in the 95 % band; the band may be wide, not narrow."""
    inside = []
    for seed in range(8):
        given = records(lambda at: 0.3 * np.cos(at.position_rad[:, 1]), seed=seed + 1)
        found = fit_remainder(given, most_terms=1)
        (term,) = found.of_axis(1)
        assert (term.acts, term.variable, term.of_axis) == ("torque", "angle", 2)
        off = np.abs(term.value - 0.3 * np.cos(term.x))
        inside.append(np.mean(off <= norm.ppf(0.975) * term.standard_error))
    # Eight runs of about ten free coefficients: three standard errors of 95 % of 80 are 7 %.
    assert np.mean(inside) > 0.88


def test_white_noise_has_no_remainder() -> None:
    for seed in range(4):
        found = fit_remainder(records(lambda at: np.zeros(len(at.time_s)), seed=seed))
        assert found.terms == ()
        np.testing.assert_array_equal(found.torque(motion(5)), 0.0)


def test_what_is_protected_does_not_move() -> None:
    """The least squares of the causes change by nothing when the remainder is taken off their residual."""
    plain = records(coupled)
    columns = [_plain_friction(r.motion) for r in plain]
    x = np.concatenate([c[:, 0] for c in columns])
    y = np.concatenate([r.residual_nm[:, 0] for r in plain])
    causes = np.linalg.lstsq(x, y, rcond=None)[0]
    given = [
        replace(r, residual_nm=r.residual_nm - [1, 0] * (c @ causes), protected=c)
        for r, c in zip(plain, columns, strict=True)
    ]
    found = fit_remainder(given)
    assert found.of_axis(1)
    taken = np.concatenate([found.torque(r.motion)[:, 0] for r in given])
    moved = np.linalg.lstsq(x, taken, rcond=None)[0]
    # Free coefficients make the products zero; the table of a term interpolates its spline to about 1e-3, and the
    # bound may cut single samples.
    assert np.abs(x @ moved).max() < 5e-3 * np.abs(taken).max()
    free = fit_remainder(plain)
    stolen = np.concatenate([free.torque(r.motion)[:, 0] for r in given])
    assert np.abs(x @ np.linalg.lstsq(x, stolen, rcond=None)[0]).max() > 0.1 * np.abs(taken).max()


def _plain_friction(at: Motion) -> Array:
    """Torques by unit of viscous and dry friction and of an offset (n, 2, 3)."""
    speed = at.velocity_rad_s
    return np.stack([speed, direction(speed, 0.05), np.ones_like(speed)], axis=2)


def test_a_period_along_the_angle_is_found() -> None:
    def teeth(at: Motion) -> Array:
        return np.asarray(np.sin(2 * np.pi * at.position_rad[:, 0] / 0.31))

    (term,) = fit_remainder(records(teeth), most_terms=1).of_axis(1)
    assert (term.acts, term.variable, term.of_axis) == ("torque", "angle", 1)
    # Lines are a quarter of a period of the travel apart, and the search between them is twenty times finer.
    travel = max(float(np.ptp(r.motion.position_rad[:, 0])) for r in records(teeth))
    assert term.period == pytest.approx(0.31, rel=0.31 / travel / 40)


def test_a_function_stays_at_its_edge_and_within_its_bound(found: Remainder) -> None:
    fast = motion(3)
    fast = replace(fast, velocity_rad_s=1e3 * fast.velocity_rad_s)
    torque = found.torque(fast)
    assert np.all(np.abs(torque) <= found.limits_nm)
    term = found.terms[0]
    ends = term.function(np.array([-1e9, 1e9]))
    np.testing.assert_array_equal(ends, term.value[[0, -1]])


def test_held_out_errors_are_those_of_fits_without_the_fold() -> None:
    """The products of all data less those of a fold give the same as a fit without the fold."""
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 1, 300)
    scale = scale_of(x, None)
    assert scale is not None
    y = np.sin(3 * x) + rng.normal(0, 0.1, 300)
    made = block(basis(scale, x), penalty(scale), np.zeros((0, 13)))
    assert made is not None
    joint = Joint.of([made.smoothed(0.1)])
    fold = np.arange(300) // 100
    predicted = joint.held_out(y, fold)
    for k in range(3):
        rest, mine = joint.columns[fold != k], joint.columns[fold == k]
        # Ridge regression as ordinary least squares with rows of the penalty.
        root = np.linalg.cholesky(joint.penalty).T
        found = np.linalg.lstsq(
            np.vstack([rest, root]), np.concatenate([y[fold != k], np.zeros(len(root))]), rcond=None
        )[0]
        np.testing.assert_allclose(predicted[fold == k], mine @ found, atol=1e-8)
    loss = joint.held_out_loss(y, fold, [joint.penalty])
    assert loss[0] == pytest.approx(np.sum((y - predicted) ** 2), rel=1e-9)


def test_misuse_is_named() -> None:
    at = motion(1)
    with pytest.raises(InputError, match="records: expected at least one"):
        fit_remainder([])
    with pytest.raises(InputError, match="residual_nm: expected shape"):
        Record(motion=at, residual_nm=np.zeros(3))
    with pytest.raises(InputError, match="smallest_gain"):
        fit_remainder(records(coupled), smallest_gain=2.0)
    warm = records(coupled)
    lacking = fit_remainder(warm)
    alone = replace(
        at,
        position_rad=at.position_rad[:, :1],
        velocity_rad_s=at.velocity_rad_s[:, :1],
        acceleration_rad_s2=at.acceleration_rad_s2[:, :1],
        load_nm=at.load_nm[:, :1],
    )
    with pytest.raises(InputError, match="expected 2 axes"):
        lacking.torque(alone)

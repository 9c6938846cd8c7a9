"""Estimation of base parameters: recovery, other solvers, coverage, advice."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
import pytest
import scipy.optimize
import scipy.signal
from numpy.typing import NDArray

from axisight.errors import IdentifiabilityError, IdentificationWarning, InputError
from axisight.rigid_body import (
    USUAL_TERMS,
    BaseParameters,
    DriveTerms,
    FindingKind,
    MotorCoupling,
    TorqueModel,
    base_parameters,
    identify_rigid_body,
)
from axisight.rigid_body.least_squares import (
    Factors,
    block_covariance,
    solve_total,
    solve_weighted,
    triangle,
    white_covariance,
)
from rigid_body_data import drive_values, motion, robot_of, smooth_motion, three_axes, wrist_arm

Array = NDArray[np.float64]


@cache
def arm(text: str = "three") -> tuple[TorqueModel, BaseParameters, Array]:
    """A model with all usual terms, its base parameters and their true values."""
    robot = robot_of(three_axes() if text == "three" else wrist_arm())
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    base = base_parameters(model)
    return model, base, drive_values(model.names, model.nominal)


def noisy(torque: Array, seed: int, share: float = 0.05, colour: float = 0.0) -> Array:
    """Noise in proportion to each axis, white or first-order with pole ``colour``."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=(len(torque) + 200, torque.shape[1]))
    noise = scipy.signal.lfilter([np.sqrt(1 - colour**2)], [1, -colour], white, axis=0)[200:]
    return np.asarray(torque + share * torque.std(axis=0) * noise)


@pytest.mark.parametrize("method", ["ls", "wls", "tls"])
@pytest.mark.parametrize("side", ["motor", "joint"])
def test_exact_data_give_exact_parameters(method: str, side: str) -> None:
    robot = robot_of(wrist_arm())
    gears = np.diag(1 / robot.gear_ratio)
    gears[5, 4] = 32.0
    model = TorqueModel(robot, terms=USUAL_TERMS, side=side, coupling=MotorCoupling(gears))
    values = drive_values(model.names, model.nominal)
    q, v, a = smooth_motion(robot, 2000, 5e-3)
    torque = model.matrix(q, v, a) @ values
    found = identify_rigid_body(model, q, v, a, torque, method=method)
    want = found.base.from_standard(values)
    # Rounding times the condition number of the scaled regressor, here below 1e3, and for
    # the squared one of total least squares, whose smallest singular value is zero.
    size = np.abs(want).max()
    np.testing.assert_allclose(found.values, want, rtol=0, atol=1e-9 * size)
    assert found.condition_number_scaled < 1e3
    other = motion(robot, 30, 5)
    want = model.matrix(*other) @ values
    np.testing.assert_allclose(found.predict(*other), want, rtol=0, atol=1e-9 * np.abs(want).max())
    assert found.torque_error(*other, want).relative_error.max() < 1e-9
    standard = found.standard()
    np.testing.assert_allclose(found.base.from_standard(standard), found.values, atol=1e-9 * size)


def test_the_same_as_numpy_on_the_whole_regressor() -> None:
    """Least squares and weighted least squares with explicit weights, all samples at once."""
    model, base, values = arm()
    q, v, a = motion(model.robot, 1500, 3)
    torque = noisy(model.matrix(q, v, a) @ values, 1)
    h = base.regressor(q, v, a)
    flat, right = h.reshape(-1, len(base)), torque.ravel()
    want, *_ = np.linalg.lstsq(flat, right, rcond=None)
    found = identify_rigid_body(model, q, v, a, torque, base=base, method="ls")
    scale = np.abs(want) + found.standard_error
    assert np.abs((found.values - want) / scale).max() < 1e-9
    residual = (right - flat @ want).reshape(torque.shape)
    rms = np.sqrt((residual**2).mean(axis=0))
    np.testing.assert_allclose(found.residual_rms_nm, rms, rtol=1e-9)
    relative = rms / np.sqrt((torque**2).mean(axis=0))
    np.testing.assert_allclose(found.relative_error, relative, rtol=1e-9)
    weight = np.random.default_rng(2).uniform(0, 2, torque.shape)
    weight[weight < 0.2] = 0
    w = weight.ravel()
    want, *_ = np.linalg.lstsq(flat * w[:, None], right * w, rcond=None)
    found = identify_rigid_body(
        model, q, v, a, torque, base=base, method="ls", sample_weight=weight
    )
    assert np.abs((found.values - want) / scale).max() < 1e-9
    np.testing.assert_allclose(np.linalg.cond(flat * w[:, None]), found.condition_number, rtol=1e-8)
    # The weights of wls: one over the standard deviation of each row's residual.
    found = identify_rigid_body(model, q, v, a, torque, base=base)
    w = np.broadcast_to(1 / found.residual_std_nm, torque.shape).ravel()
    want, *_ = np.linalg.lstsq(flat * w[:, None], right * w, rcond=None)
    assert np.abs((found.values - want) / scale).max() < 1e-7
    white = np.linalg.inv((flat * w[:, None]).T @ (flat * w[:, None]))
    np.testing.assert_allclose(np.diag(found.covariance_white), np.diag(white), rtol=1e-6)


def test_total_least_squares_against_its_definition() -> None:
    """The correction of smallest norm, from an SVD of all samples, and by iteration in SciPy."""
    robot = robot_of(three_axes())
    model = TorqueModel(robot)
    base = base_parameters(model)
    q, v, a = motion(robot, 400, 8)
    torque = noisy(model.matrix(q, v, a) @ model.nominal, 4)
    error = {name: 0.1 * (i + 1) for i, name in enumerate(base.names)}
    options = {"base": base, "column_noise": error}
    found = identify_rigid_body(model, q, v, a, torque, method="tls", **options)
    std = identify_rigid_body(model, q, v, a, torque, base=base).residual_std_nm
    flat = (base.regressor(q, v, a) / std[:, None]).reshape(-1, len(base))
    right = (torque / std).ravel()
    d = np.array(list(error.values()))
    direction = np.linalg.svd(np.column_stack([flat / d, right]), full_matrices=False)[2][-1]
    want = -direction[:-1] / direction[-1] / d
    np.testing.assert_allclose(found.values, want, rtol=1e-8, atol=1e-8 * np.abs(want).max())
    # With some columns exact: minimize residual over the length of (1, d x).
    some = dict(list(error.items())[:4])
    options = {"base": base, "column_noise": some}
    found = identify_rigid_body(model, q, v, a, torque, method="tls", **options)
    d = np.array([some.get(name, 0.0) for name in base.names])
    scale = np.abs(found.values) + 1

    def loss(x: Array) -> Array:
        return (flat @ (x * scale) - right) / np.sqrt(1 + ((d * x * scale) ** 2).sum())

    other = scipy.optimize.least_squares(loss, want / scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    np.testing.assert_allclose(found.values / scale, other.x, rtol=0, atol=1e-6)


def test_total_least_squares_removes_the_bias_of_noisy_columns() -> None:
    """Errors in two of three columns: least squares is off, total least squares is not.

    Its standard errors describe its scatter over 200 realizations.
    """
    rng = np.random.default_rng(5)
    clean = rng.normal(size=(1500, 3)) @ np.array([[1, 0.4, 0], [0, 1, 0.2], [0, 0, 1.0]])
    truth = np.array([2.0, -1.0, 0.5])
    noise = np.array([0.8, 0.0, 1.5])
    level = 0.4
    z, bias = [], []
    for _ in range(200):
        columns = clean + level * noise * rng.normal(size=clean.shape)
        right = clean @ truth + level * rng.normal(size=len(clean))
        pieces = np.column_stack([columns, right]).reshape(30, 1, 50, 4)
        factors = Factors(triangle(pieces), np.array([1500.0]))
        plain = solve_weighted(factors, np.ones(1))
        total = solve_total(factors, plain, noise)
        covariance, _ = block_covariance(factors, total)
        z.append((total.values - truth) / np.sqrt(np.diag(covariance)))
        bias.append((plain.values - truth) / np.sqrt(np.diag(white_covariance(factors, plain))))
    # Means of 200 scatter by 1 / sqrt(200) = 0.07, mean squares by sqrt(2 / 200) = 0.1; 29
    # degrees of freedom widen them by 29 / 27.
    assert np.abs(np.mean(z, axis=0)).max() < 0.3
    np.testing.assert_allclose(np.square(z).mean(axis=0), 29 / 27, atol=0.4)
    assert np.abs(np.mean(bias, axis=0)).max() > 3


def test_block_covariance_is_the_plain_one_for_white_noise() -> None:
    model, base, values = arm()
    q, v, a = motion(model.robot, 6000, 6)
    torque = noisy(model.matrix(q, v, a) @ values, 2)
    found = identify_rigid_body(model, q, v, a, torque, base=base, blocks=200)
    ratio = np.diag(found.covariance) / np.diag(found.covariance_white)
    # Each ratio scatters by sqrt(2 / 200) = 10 %, their mean by less.
    assert abs(ratio.mean() - 1) < 0.1
    assert ratio.min() > 0.6
    assert ratio.max() < 1.5
    assert found.degrees_of_freedom.max() < 200


def test_block_covariance_is_unbiased_with_few_blocks() -> None:
    """Ten blocks that weigh unequally: on average the variance of white noise."""
    rng = np.random.default_rng(8)
    columns = rng.normal(size=(200, 6)) * np.linspace(0.2, 2, 200)[:, None]
    white = np.diag(np.linalg.inv(columns.T @ columns))
    ratio = []
    for _ in range(400):
        rows = np.column_stack([columns, rng.normal(size=200)])
        factors = Factors(triangle(rows.reshape(10, 1, 20, 7)), np.array([200.0]))
        covariance, freedom = block_covariance(factors, solve_weighted(factors, np.ones(1)))
        ratio.append(np.diag(covariance) / white)
    # Five to nine degrees of freedom: each mean scatters by sqrt(2 / 5 / 400) = 3 %.
    assert freedom.max() < 9
    assert abs(np.mean(ratio) - 1) < 0.04
    np.testing.assert_allclose(np.mean(ratio, axis=0), 1.0, atol=0.12)


def test_block_covariance_knows_where_no_scatter_shows() -> None:
    rng = np.random.default_rng(9)

    def of(blocks: int, rows: int, columns: Array) -> tuple[Array, Array]:
        stack = np.column_stack([columns, rng.normal(size=blocks * rows)])
        factors = Factors(
            triangle(stack.reshape(blocks, 1, rows, -1)), np.array([float(blocks * rows)])
        )
        return block_covariance(factors, solve_weighted(factors, np.ones(1)))

    # As many equations as parameters; all in one block.
    for blocks, rows in ((3, 2), (1, 60)):
        covariance, freedom = of(blocks, rows, rng.normal(size=(blocks * rows, 6)))
        assert np.isnan(covariance).all()
        assert not freedom.any()
    # The second parameter shows in one block only, the others everywhere.
    columns = rng.normal(size=(200, 3))
    columns[20:, 1] = 0.0
    covariance, freedom = of(10, 20, columns)
    assert np.isnan(covariance[1]).all()
    assert np.isnan(covariance[:, 1]).all()
    assert np.isfinite(covariance[np.ix_([0, 2], [0, 2])]).all()
    assert freedom[1] == 0
    assert freedom[[0, 2]].min() > 5


def test_two_blocks_are_told_and_their_intervals_hold() -> None:
    model, base, values = arm()
    q, v, a = smooth_motion(model.robot, 400, 0.02, 1)
    torque = model.matrix(q, v, a) @ values
    truth = base.from_standard(values)
    inside = []
    for run in range(40):
        data = noisy(torque, run)
        found = identify_rigid_body(model, q, v, a, data, base=base, blocks=2)
        (finding,) = [f for f in found.findings if f.kind is FindingKind.FREEDOM]
        assert not finding.serious
        assert "expected 3 or more degrees of freedom, got 1" in finding.message
        lower, upper = found.interval()
        inside.append((lower <= truth) & (truth <= upper))
    # One degree of freedom, intervals of 12.7 standard errors: 95 % or a little more.
    assert np.mean(inside) > 0.92
    full = identify_rigid_body(model, q, v, a, noisy(torque, 0), base=base, blocks=20)
    assert all(f.kind is not FindingKind.FREEDOM for f in full.findings)


def test_elimination_takes_what_shows_no_scatter_first() -> None:
    model, base, values = arm()
    q, v, a = smooth_motion(model.robot, 400, 0.02, 1)
    torque = noisy(model.matrix(q, v, a) @ values, 0)
    half = np.repeat([1.0, 0.0], 200)  # one of two blocks has no weight: no scatter at all
    options = {"base": base, "blocks": 2, "sample_weight": half}
    found = identify_rigid_body(model, q, v, a, torque, **options)
    assert np.isnan(found.standard_error).all()
    assert np.isnan(found.interval()).all()
    few = [f for f in found.findings if f.kind is FindingKind.FREEDOM]
    assert [f.names for f in few] == [tuple(base.names)]
    less = identify_rigid_body(model, q, v, a, torque, eliminate=0.3, **options)
    assert len(less.eliminated) == len(base) - 1


def coverage(colour: float, n: int, blocks: int) -> Array:
    """Share of 300 realizations whose 95 % interval holds the truth, per parameter."""
    model, base, values = arm()
    q, v, a = smooth_motion(model.robot, n, 0.02, 1)
    torque = model.matrix(q, v, a) @ values
    truth = base.from_standard(values)
    inside = np.zeros(len(base))
    for run in range(300):
        data = noisy(torque, run, colour=colour)
        found = identify_rigid_body(model, q, v, a, data, base=base, blocks=blocks)
        lower, upper = found.interval()
        inside += (lower <= truth) & (truth <= upper)
    return inside / 300


@pytest.mark.parametrize(("colour", "n"), [(0.0, 1000), (0.8, 3000)])
def test_intervals_cover(colour: float, n: int) -> None:
    """White noise, and noise correlated over five samples in blocks of a hundred."""
    share = coverage(colour, n, 30)
    assert 0.93 < share.mean() < 0.97
    # A share of 300 has a standard deviation of 1.3 %: four of them.
    assert share.min() > 0.90


def test_white_intervals_would_not_cover_coloured_noise() -> None:
    model, base, values = arm()
    q, v, a = smooth_motion(model.robot, 3000, 0.02, 1)
    data = noisy(model.matrix(q, v, a) @ values, 0, colour=0.8)
    found = identify_rigid_body(model, q, v, a, data, base=base)
    ratio = np.diag(found.covariance) / np.diag(found.covariance_white)
    # Slow columns see the noise at low frequency: (1 + 0.8) / (1 - 0.8) = 9 times the variance.
    assert 4 < np.median(ratio) < 14


def test_known_parameters_are_held() -> None:
    model, _, values = arm()
    q, v, a = motion(model.robot, 500)
    torque = model.matrix(q, v, a) @ values
    known = {name: values[model.names.index(name)] for name in ("axis1.inertia_zz", "axis3.mass")}
    found = identify_rigid_body(model, q, v, a, torque, known=known)
    # With link 1 known the rotor of axis 1 is among the parameters that show.
    assert "axis1.motor_inertia" in " ".join(found.base.combinations)
    np.testing.assert_allclose(found.predict(q, v, a), torque, atol=1e-9 * np.abs(torque).max())
    standard = found.standard()
    for name, value in known.items():
        assert standard[model.names.index(name)] == value


def test_insignificant_parameters_are_eliminated() -> None:
    model, base, values = arm()
    changed = values.copy()
    changed[model.names.index("axis2.torque_offset")] = 0.0
    q, v, a = motion(model.robot, 1000, 1)
    torque = noisy(model.matrix(q, v, a) @ changed, 5, share=0.02)
    found = identify_rigid_body(model, q, v, a, torque, base=base, eliminate=0.3)
    assert "axis2.torque_offset" in found.eliminated
    index = found.names.index("axis2.torque_offset")
    assert found.values[index] == found.standard_error[index] == 0
    rest = np.delete(
        found.relative_standard_error, [found.names.index(n) for n in found.eliminated]
    )
    assert rest.max() <= 0.3
    kinds = {finding.kind: finding for finding in found.findings}
    assert not kinds[FindingKind.ELIMINATED].serious


def test_threads_change_no_bit() -> None:
    model, base, values = arm()
    q, v, a = motion(model.robot, 3000)
    torque = noisy(model.matrix(q, v, a) @ values, 0)
    one, two = (identify_rigid_body(model, q, v, a, torque, base=base, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.values, two.values)
    np.testing.assert_array_equal(one.covariance, two.covariance)


def test_an_axis_that_never_reverses() -> None:
    model, base, values = arm()
    q, v, a = motion(model.robot, 500)
    v[:, 1] = np.abs(v[:, 1]) + 0.1
    torque = noisy(model.matrix(q, v, a) @ values, 0)
    with pytest.raises(IdentifiabilityError, match=r"axis2\.torque_offset from axis2\.coulomb_f"):
        identify_rigid_body(model, q, v, a, torque, base=base)
    with pytest.raises(IdentifiabilityError, match="move axis2 both ways"):
        identify_rigid_body(model, q, v, a, torque, base=base)
    with pytest.warns(IdentificationWarning) as caught:
        found = identify_rigid_body(model, q, v, a, torque, base=base, deficient="group")
    assert {FindingKind.RANK, FindingKind.REVERSAL} <= {f.kind for f in found.findings}
    assert any("Coulomb friction is hardly told from" in str(w.message) for w in caught)
    assert "axis2.coulomb_friction + axis2.torque_offset" in found.base.combinations
    sum_of_both = found.values[
        found.base.combinations.index("axis2.coulomb_friction + axis2.torque_offset")
    ]
    assert abs(sum_of_both - (0.4 - 0.07)) < 0.2
    # Without the offset there is no deficiency, but a warning all the same.
    terms = DriveTerms(coulomb="motor")
    with pytest.warns(IdentificationWarning, match="move axis2 both ways"):
        identify_rigid_body(model.robot, q, v, a, torque, terms=terms, side="motor")


def test_an_axis_that_stands_still() -> None:
    model, base, _ = arm()
    q, v, a = motion(model.robot, 500)
    q[:, 2], v[:, 2], a[:, 2] = 0.3, 0.0, 0.0
    with pytest.raises(IdentifiabilityError, match="move axis3 at changing speeds"):
        identify_rigid_body(model, q, v, a, np.ones_like(q), base=base)
    q, v, a = motion(model.robot, 500)
    with pytest.raises(IdentifiabilityError, match="accelerate"):
        identify_rigid_body(model, q, v, 0 * a, np.ones_like(q), base=base)


def test_a_wrong_sign_is_named() -> None:
    model, base, values = arm("six")
    q, v, a = motion(model.robot, 800, 2)
    torque = noisy(model.matrix(q, v, a) @ values, 0, share=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = identify_rigid_body(model, q, v, a, torque, base=base)
    assert fine.findings == ()
    torque[:, 3] *= -1
    with pytest.warns(IdentificationWarning) as caught:
        found = identify_rigid_body(model, q, v, a, torque, base=base)
    wrong = [f for f in found.findings if f.kind is FindingKind.GEAR_SIGN]
    assert [f.names for f in wrong] == [("axis4",)]
    assert "Check the sign of its gear ratio" in wrong[0].message
    assert any("negative inertia" in str(w.message) for w in caught)
    assert any(f.kind is FindingKind.NEGATIVE_FRICTION for f in found.findings)


def test_bad_conditioning_is_told() -> None:
    model, base, values = arm()
    rng = np.random.default_rng(0)
    q, v, a = (1e-3 * rng.normal(size=(800, 3)) for _ in range(3))
    torque = model.matrix(q, v, a) @ values
    with pytest.warns(IdentificationWarning, match="condition number .* of the scaled regressor"):
        found = identify_rigid_body(model, q, v, a, torque, base=base)
    assert found.condition_number_scaled > 1e3


def test_table_and_text() -> None:
    model, base, values = arm()
    q, v, a = motion(model.robot, 500)
    found = identify_rigid_body(model, q, v, a, noisy(model.matrix(q, v, a) @ values, 0), base=base)
    table = found.table()
    row = table.sel(parameter="axis1.inertia_zz")
    assert row.unit == "kg m^2"
    assert "axis2.inertia_zz" in str(row.combination.item())
    assert row.lower < row.value < row.upper
    text = str(found)
    assert "axis2.mass_x" in text
    assert "of the torque" in text
    wide = np.subtract(*found.interval(0.99)[::-1])
    assert (wide > np.subtract(*found.interval(0.5)[::-1])).all()
    with pytest.raises(InputError, match="level"):
        found.interval(1.5)
    with pytest.raises(InputError, match="torque_nm: expected 500 rows"):
        found.torque_error(q, v, a, np.zeros((3, 3)))


def test_misuse_names_the_field() -> None:
    model, base, values = arm()
    q, v, a = motion(model.robot, 200)
    torque = model.matrix(q, v, a) @ values
    bad = torque.copy()
    bad[7, 1] = np.nan
    for arguments, options, message in [
        ((q, v, a, bad), {}, "torque_nm: expected finite numbers, got 1 rows .* row 7"),
        ((q, v, a, torque[:9]), {}, "torque_nm: expected 200 rows as q, got 9"),
        ((q, v, a, torque[:, :2]), {}, r"torque_nm: expected shape \(n, 3\)"),
        ((q[:1], v[:1], a[:1], torque[:1]), {}, "torque_nm: expected more than"),
        ((q, v, a, torque), {"method": "ridge"}, "method: expected one of ls, wls, tls"),
        ((q, v, a, torque), {"deficient": "ok"}, "deficient: expected one of"),
        ((q, v, a, torque), {"eliminate": -1.0}, "eliminate: expected a positive"),
        ((q, v, a, torque), {"blocks": 1}, "blocks: expected 2 to 200"),
        ((q, v, a, torque), {"blocks": 2.5}, "blocks: expected an integer"),
        ((q, v, a, torque), {"sample_weight": -np.ones(200)}, "sample_weight: .*not below zero"),
        ((q, v, a, torque), {"sample_weight": np.ones(3)}, "sample_weight: expected shape"),
        ((q, v, a, torque), {"known": {"axis1.mass": np.inf}}, "known: expected a finite number"),
        ((q, v, a, torque), {"known": {"axis1.mas": 1.0}}, "known: expected names"),
        ((q, v, a, torque), {"base": base, "known": {"axis1.mass": 1.0}}, "base: .*known"),
        (
            (q, v, a, torque),
            {"method": "tls", "column_noise": {"axis1.mass": 1.0}},
            "column_noise: expected positive numbers",
        ),
    ]:
        with pytest.raises(InputError, match=message):
            identify_rigid_body(model, *arguments, **options)
    other = TorqueModel(model.robot, side="motor")
    with pytest.raises(InputError, match="base: expected base parameters of the same model"):
        identify_rigid_body(other, q, v, a, torque, base=base)
    with pytest.raises(InputError, match="all fixed"):
        identify_rigid_body(model, q, v, a, torque, known=dict.fromkeys(model.names, 1.0))


@pytest.mark.parametrize("method", ["ls", "wls", "tls"])
def test_zero_torques_are_refused_by_every_method(method):
    model, base, _ = arm()
    q, v, a = motion(model.robot, 200)
    with pytest.raises(InputError, match="torque_nm: expected measured torques, got zeros only"):
        identify_rigid_body(model, q, v, a, np.zeros((200, 3)), base=base, method=method)

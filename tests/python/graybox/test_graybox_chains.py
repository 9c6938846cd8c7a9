"""Chains of masses: the inverse eigenvalue problem and its fit to noisy responses."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg
import xarray as xr

from axisight.errors import InputError
from axisight.frf import frequency_response
from axisight.graybox.chain_fit import _start, fit_chain
from axisight.graybox.collocated import Collocated, collocated, sandwich, standard_errors
from axisight.graybox.spring_masses import SpringMassChain, reconstruct_chain
from axisight.robot import load_robot

FREQUENCY_HZ = np.arange(5, 201) / 5
RATIO = 1 / 224.3
VISCOUS = 0.05  # friction of the motor [Nm s/rad]


def chain(n: int, rng: np.random.Generator) -> SpringMassChain:
    """Masses and springs within a factor three."""
    inertia, stiffness, damping = (
        10 ** rng.uniform(-0.25, 0.25, size) for size in (n, n - 1, n - 1)
    )
    return SpringMassChain(1e3 * inertia, 1e6 * stiffness, 2e3 * damping, RATIO)


def response(
    true: SpringMassChain, noise: float = 0.0, rng: np.random.Generator | None = None
) -> xr.Dataset:
    """Its response with noise relative to the median."""
    value = true.acceleration_response(FREQUENCY_HZ)
    level = noise * float(np.median(np.abs(value)))
    if rng is not None:
        value = value + level * (rng.normal(size=(2, len(value))) / np.sqrt(2)).T @ [1, 1j]
    return frequency_response(
        FREQUENCY_HZ,
        value[:, None, None],
        estimator="given",
        variance=np.full((len(value), 1, 1), level**2),
        output_unit="rad/s^2",
        attrs={"quantity": "acceleration"},
    )


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_two_to_six_masses_are_recovered(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(20):
        true = chain(n, rng)
        found = reconstruct_chain(
            true.poles_rad_s,
            true.zeros_rad_s,
            motor_inertia_kg_m2=true.motor_inertia_kg_m2,
            gear_ratio=RATIO,
            pole_damping=true.pole_damping,
            zero_damping=true.zero_damping,
        )
        # Rounding of the frequencies grows with each mass; 1e-8 leaves a decade at six.
        for name in ("inertia_kg_m2", "stiffness_nm_rad", "damping_nm_s_rad"):
            np.testing.assert_allclose(getattr(found, name), getattr(true, name), rtol=1e-8)


def test_the_rigid_inertia_serves_as_well_as_that_of_the_motor() -> None:
    true = chain(4, np.random.default_rng(0))
    rigid = RATIO**2 * float(true.inertia_kg_m2.sum())
    found = reconstruct_chain(
        true.poles_rad_s, true.zeros_rad_s, rigid_inertia_kg_m2=rigid, gear_ratio=RATIO
    )
    np.testing.assert_allclose(found.inertia_kg_m2, true.inertia_kg_m2, rtol=1e-10)


def test_stieltjes_continued_fraction_gives_the_same_chain() -> None:
    # Independent: torque over angle at the motor is, with x = s^2, the continued fraction
    # m1 x + 1 / (1 / k1 + 1 / (m2 x + 1 / (1 / k2 + ...))), expanded in exact fractions.
    poles, zeros = np.array([3.0, 5.0, 8.0]), np.array([2.0, 4.0, 7.0])

    def polynomial(squares: np.ndarray) -> list[Fraction]:
        out = [Fraction(1)]
        for square in squares:
            shifted = [Fraction(0), *out]
            out = [
                a + Fraction(int(square)) * b
                for a, b in zip(shifted, [*out, Fraction(0)], strict=True)
            ]
        return out

    # Coefficients ascending in x: x prod (x + p^2) over prod (x + z^2).
    top, bottom = [Fraction(0), *polynomial(poles**2)], polynomial(zeros**2)
    masses, springs = [], []
    while True:
        factor = top[-1] / bottom[-1]
        masses.append(float(factor))
        shifted = [Fraction(0), *bottom]
        top = [a - factor * b for a, b in zip(top, shifted, strict=True)][:-1]
        if not any(top):
            break
        top, bottom = bottom, top
        factor = top[-1] / bottom[-1]
        springs.append(1 / float(factor))
        top = [a - factor * b for a, b in zip(top, bottom, strict=True)][:-1]
        top, bottom = bottom, top
    found = reconstruct_chain(poles, zeros, motor_inertia_kg_m2=1.0)
    np.testing.assert_allclose(found.inertia_kg_m2, masses, rtol=1e-10)
    np.testing.assert_allclose(found.stiffness_nm_rad, springs, rtol=1e-10)


def test_response_of_two_masses_is_that_of_the_preset() -> None:
    # The preset's small motion: m3 without friction at standstill; a held torque is half a
    # sample late and, at 40 Hz and 0.5 ms, 0.07 % weaker.
    robot = load_robot("two_mass_axis")
    two = SpringMassChain(
        np.array([0.0121 / RATIO**2, 1130.0]), np.array([1.46e6]), np.array([2.63e3]), RATIO
    )
    f = np.linspace(3.0, 40.0, 30)
    iw = 2j * np.pi * f
    # Friction acts on the motor: taken out as feedback, 1 / G - F s.
    held = robot.zoh_response(f).values[:, 0, 0] * np.exp(iw * 2.5e-4)
    viscous = 0.013 + 0.644 / 0.01
    free = iw**2 / (1 / held - viscous * iw)
    near = f > 0
    ratio = free[near] / two.acceleration_response(f[near])
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)


def test_damped_poles_are_those_of_the_equations_of_motion() -> None:
    true = chain(4, np.random.default_rng(5))
    n = true.n_masses
    stretch = np.eye(n - 1, n) - np.eye(n - 1, n, k=1)
    inverse = np.diag(1 / true.inertia_kg_m2)
    stiffness, damping = (
        stretch.T @ np.diag(v) @ stretch for v in (true.stiffness_nm_rad, true.damping_nm_s_rad)
    )
    for held, frequency, ratio in (
        (0, true.poles_rad_s, true.pole_damping),
        (1, true.zeros_rad_s, true.zero_damping),
    ):
        part = slice(held, n)
        zero = np.zeros((n - held, n - held))
        system = np.block(
            [
                [zero, np.eye(n - held)],
                [
                    -(inverse @ stiffness)[part, part],
                    -(inverse @ damping)[part, part],
                ],
            ]
        )
        values = np.linalg.eigvals(system)
        modes = values[values.imag > 1.0]
        modes = modes[np.argsort(np.abs(modes))]
        # First order in the damping: the square of 5 % is left.
        np.testing.assert_allclose(np.abs(modes), frequency, rtol=0.01)
        np.testing.assert_allclose(-modes.real / np.abs(modes), ratio, rtol=0.02)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_fit_recovers_a_chain_without_noise(n: int) -> None:
    true = chain(n, np.random.default_rng(n))
    found = fit_chain(response(true), n, gear_ratio=RATIO)
    assert found.status == "converged" and not found.findings
    np.testing.assert_allclose(found.chain.inertia_kg_m2, true.inertia_kg_m2, rtol=1e-8)
    np.testing.assert_allclose(found.chain.stiffness_nm_rad, true.stiffness_nm_rad, rtol=1e-8)
    np.testing.assert_allclose(found.chain.damping_nm_s_rad, true.damping_nm_s_rad, rtol=1e-6)
    assert abs(found.delay_s) < 1e-10 and found.viscous_friction_nm_s_rad < 1e-8


def test_standard_errors_of_the_fit_are_right() -> None:
    true = chain(3, np.random.default_rng(3))
    rng = np.random.default_rng(11)
    score = []
    for _ in range(60):
        found = fit_chain(response(true, 0.02, rng), 3, gear_ratio=RATIO)
        assert found.status == "converged"
        apart = found.chain.stiffness_nm_rad - true.stiffness_nm_rad
        score.append(apart / found.stiffness_standard_error)
    # Mean square of 120 normal scores: one within 0.26 at two deviations; the weights add
    # a tolerance to the noise, so that the scatter is that of a slightly different problem.
    assert 0.6 < np.mean(np.square(score)) < 1.5


def rubbed_response(
    true: SpringMassChain, relative: float, rng: np.random.Generator, periods: int | None = None
) -> xr.Dataset:
    """Response with viscous friction, noise relative to it; variance known, or of a few periods."""
    free = true.acceleration_response(FREQUENCY_HZ)
    value = 1 / (1 / free + VISCOUS / (2j * np.pi * FREQUENCY_HZ))
    std = relative * np.abs(value)
    count = periods or 1
    error = rng.normal(size=(2, count, len(value))) * np.sqrt(count / 2)
    every = value + std * (error[0] + 1j * error[1])
    mean, variance, freedom = every.mean(axis=0), std**2, None
    if periods:
        variance = (np.abs(every - mean) ** 2).sum(axis=0) / (periods * (periods - 1))
        freedom = np.full((len(value), 1, 1), periods - 1.0)
    return frequency_response(
        FREQUENCY_HZ,
        mean[:, None, None],
        estimator="given",
        variance=variance[:, None, None],
        degrees_of_freedom=freedom,
        output_unit="rad/s^2",
    )


@pytest.mark.parametrize(("relative", "periods"), [(0.01, None), (0.1, None), (0.1, 2)])
def test_fit_is_unbiased_and_its_intervals_hold(relative: float, periods: int | None) -> None:
    true = chain(3, np.random.default_rng(3))
    names = ("inertia", "stiffness", "damping")
    units = ("_kg_m2", "_nm_rad", "_nm_s_rad")
    scores = []
    for run in range(60):
        rng = np.random.default_rng([13, run])
        found = fit_chain(rubbed_response(true, relative, rng, periods), 3, gear_ratio=RATIO)
        assert found.status == "converged"
        score = [
            (getattr(found.chain, n + u) - getattr(true, n + u))
            / getattr(found, f"{n}_standard_error")
            for n, u in zip(names, units, strict=True)
        ]
        scores.append(np.concatenate(score))
    z = np.array(scores)
    # The mean of 60 scores is normal with 1 / sqrt(60) = 0.13; 3.5 of these for seven of them.
    # Weights from the measured magnitude put five of the seven at -0.6 to -1.3 for 10 %.
    assert np.abs(z.mean(axis=0)).max() < 0.45
    # Coverage 95 %; 60 runs of some four independent parameters: 1.4 %, three of these.
    assert 0.905 < np.mean(np.abs(z) < 1.96) < 0.99


def test_friction_leaves_the_start_its_pairs() -> None:
    """Friction is a real pole: without one of its own it took a pair of a weak mode."""
    for run in (1, 3, 5):
        true = chain(4, np.random.default_rng([4, run]))
        data = collocated(rubbed_response(true, 0.003, np.random.default_rng(run)))
        findings: list[str] = []
        start = _start(data, 3, RATIO, findings)
        assert not findings
        np.testing.assert_allclose(start.poles_rad_s, true.poles_rad_s, rtol=0.01)
        np.testing.assert_allclose(start.zeros_rad_s, true.zeros_rad_s, rtol=0.01)


def test_a_variance_of_few_periods_is_pooled_relative_to_the_model() -> None:
    n = 4000
    rng = np.random.default_rng(0)
    model = np.geomspace(0.1, 10.0, n) * (1.2 + np.sin(np.arange(n)))
    # One degree of freedom: exponential, the least of them is 1 / 4000 of their mean.
    variance = 0.04 * model**2 * rng.exponential(size=n)
    frequency = np.arange(1.0, n + 1)
    noise = Collocated(frequency, model.astype(complex), variance, 1.0).noise(model)
    # Fifty logarithms of variance pi^2 / 6 leave 0.18, at the ends twice that.
    assert np.std(np.log(noise / 0.04)) == pytest.approx(0.18, abs=0.03)
    assert noise.min() > 0.2 * 0.04
    for freedom in (None, 30.0):
        known = Collocated(frequency, model.astype(complex), variance, freedom)
        np.testing.assert_array_equal(known.noise(model), variance / model**2)
    # Lines of unknown variance have none, and do not spoil their neighbours.
    variance[::7] = np.nan
    some = Collocated(frequency, model.astype(complex), variance, 1.0).noise(model)
    assert not some[::7].any() and (some[1::7] > 0).all()


def regression() -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (2 n, 3) and residuals (2 n,) of twelve lines."""
    rng = np.random.default_rng(4)
    slope = rng.normal(size=(24, 3)) * [1.0, 1e-6, 1e6]
    noise = rng.normal(size=24)
    return slope, noise - slope @ np.linalg.lstsq(slope, noise)[0]


def test_sandwich_is_that_of_the_definition() -> None:
    slope, residual = regression()
    inverse = np.linalg.inv(slope.T @ slope)
    want = np.zeros((3, 3))
    for line in range(12):
        own = [line, line + 12]
        part = slope[own]
        left = np.eye(2) - part @ inverse @ part.T
        score = part.T @ np.linalg.inv(scipy.linalg.sqrtm(left)) @ residual[own]
        want += np.outer(inverse @ score, inverse @ score)
    size = np.sqrt(np.diag(want))
    # Rounding, and that of a condition of a few units once the columns are scaled.
    np.testing.assert_allclose(
        sandwich(slope, residual) / np.outer(size, size), want / np.outer(size, size), atol=1e-12
    )


def test_what_lines_do_not_show_is_infinite() -> None:
    slope, residual = regression()
    known = sandwich(slope, residual)
    # A parameter without effect, and two with the same effect.
    more = np.column_stack([slope, np.zeros(24), 2 * slope[:, 2]])
    found = sandwich(more, residual)
    assert np.isinf(np.diag(found)[2:]).all() and np.isnan(found[3, :3]).all()
    np.testing.assert_allclose(found[:2, :2], known[:2, :2], rtol=1e-10)
    for noise in (0.0, 1.0):
        errors = standard_errors(more, residual, np.full(12, noise))
        assert np.isinf(errors[2:]).all() and np.isfinite(errors[:2]).all()


def test_what_one_line_decides_has_no_error() -> None:
    slope, residual = regression()
    alone = np.zeros(24)
    alone[5] = 1e-3
    found = sandwich(np.column_stack([slope, alone]), residual)
    assert np.isnan(found[3]).all() and np.isnan(found[:, 3]).all()
    # The others do without that row.
    without = slope.copy()
    without[5] = 0.0
    np.testing.assert_allclose(found[:3, :3], sandwich(without, residual), rtol=1e-10)
    errors = standard_errors(np.column_stack([slope, alone]), residual, np.ones(12))
    assert np.isnan(errors[3]) and np.isfinite(errors[:3]).all()


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize(("spring", "mass"), [(1e12, 1e-3), (1e15, 1e-6)])
def test_a_mass_far_beyond_the_band_has_no_finite_error(
    noise: float, spring: float, mass: float
) -> None:
    true = chain(2, np.random.default_rng(0))
    start = SpringMassChain(
        np.append(true.inertia_kg_m2, mass),
        np.append(true.stiffness_nm_rad, spring),
        np.append(true.damping_nm_s_rad, 2e3),
        RATIO,
    )
    data = response(true, noise, np.random.default_rng(1))
    found = fit_chain(data, 3, gear_ratio=RATIO, start=start)
    # Only the sum of both arms is seen, and their spring moves nothing.
    assert np.isinf(found.inertia_standard_error[1:]).all()
    assert found.stiffness_standard_error[1] > found.chain.stiffness_nm_rad[1]
    assert np.isfinite([found.inertia_standard_error[0], found.stiffness_standard_error[0]]).all()
    assert "inertia 2, inertia 3, spring 2: hardly seen" in " ".join(found.findings)


def test_a_search_that_ends_on_its_bound_says_so() -> None:
    true = chain(2, np.random.default_rng(0))
    data = response(true, 0.02, np.random.default_rng(1))
    for far, status in ((5000.0, "on_bound"), (100.0, "converged")):
        start = SpringMassChain(
            true.inertia_kg_m2 * [1.0, far], true.stiffness_nm_rad, true.damping_nm_s_rad, RATIO
        )
        found = fit_chain(data, 2, gear_ratio=RATIO, start=start)
        assert found.status == status
        words = "inertia 2, spring 1: on a bound, a thousandfold from the start"
        assert (words in " ".join(found.findings)) is (status == "on_bound")
        if status == "converged":
            # Two per cent of noise on 196 lines.
            np.testing.assert_allclose(found.chain.inertia_kg_m2, true.inertia_kg_m2, rtol=0.02)


def test_quantity_is_read_and_never_assumed() -> None:
    true = chain(2, np.random.default_rng(0))
    acceleration = true.acceleration_response(FREQUENCY_HZ)
    iw = 2j * np.pi * FREQUENCY_HZ
    attrs = {"quantity": "acceleration"}

    def data(order: int, unit: str, attrs: dict[str, str] | None = None) -> xr.Dataset:
        value = (acceleration / iw ** (2 - order))[:, None, None]
        return frequency_response(
            FREQUENCY_HZ, value, estimator="given", output_unit=unit, input_unit="A", attrs=attrs
        )

    for given in (data(0, "rad"), data(1, "rad/s"), data(2, "rad/s^2"), data(2, "g", attrs)):
        np.testing.assert_allclose(collocated(given).acceleration, acceleration, rtol=1e-12)
    silent = data(1, "deg/s")
    for call in (collocated, lambda d: fit_chain(d, 2)):
        with pytest.raises(InputError, match=r"quantity: expected position.*units are 'deg/s/A'"):
            call(silent)
    silent["response"].attrs.clear()
    with pytest.raises(InputError, match="units are None"):
        collocated(silent)
    np.testing.assert_allclose(collocated(silent, quantity="velocity").acceleration, acceleration)
    with pytest.raises(InputError, match=r"units and attribute quantity that agree, got 'rad/A'"):
        collocated(data(0, "rad", attrs))
    with pytest.raises(InputError, match="quantity: expected one of position, velocity"):
        collocated(silent, quantity="speed")
    with pytest.raises(InputError, match="attribute quantity: expected one of position"):
        collocated(data(0, "rad", {"quantity": "jerk"}))


def test_very_noisy_response_still_gives_a_chain_and_says_so() -> None:
    true = chain(4, np.random.default_rng(7))
    rng = np.random.default_rng(1)
    found = [fit_chain(response(true, 0.5, rng), 4, gear_ratio=RATIO) for _ in range(3)]
    assert all(np.isfinite(f.chain.stiffness_nm_rad).all() for f in found)
    assert any(f.findings for f in found)


@pytest.mark.parametrize(
    ("poles", "zeros", "message"),
    [
        ([3.0, 5.0], [2.0, 6.0], "notch 2 between 3 and 5 rad/s, got 6"),
        ([3.0, 5.0], [3.5, 4.0], "notch 1 between 0 and 3"),
        ([3.0, 5.0], [2.0], "expected 2 as the poles, got 1"),
        ([5.0, 3.0], [2.0, 4.0], "poles_rad_s: expected positive, ascending"),
        ([3.0, np.nan], [2.0, 4.0], "poles_rad_s: expected positive, ascending"),
        ([3.0, 5.0], [-2.0, 4.0], "zeros_rad_s: expected positive, ascending"),
    ],
)
def test_poles_and_zeros_of_no_chain(poles: list[float], zeros: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        reconstruct_chain(poles, zeros, motor_inertia_kg_m2=1.0)


def test_misuse() -> None:
    good = {"poles_rad_s": [3.0], "zeros_rad_s": [2.0]}
    with pytest.raises(InputError, match="exactly one of them"):
        reconstruct_chain(**good)
    with pytest.raises(InputError, match="exactly one of them"):
        reconstruct_chain(**good, motor_inertia_kg_m2=1.0, rigid_inertia_kg_m2=2.0)
    with pytest.raises(InputError, match="rigid_inertia_kg_m2: expected a positive"):
        reconstruct_chain(**good, rigid_inertia_kg_m2=-2.0)
    with pytest.raises(InputError, match="gear_ratio: expected a finite"):
        reconstruct_chain(**good, motor_inertia_kg_m2=1.0, gear_ratio=0.0)
    with pytest.raises(InputError, match="pole_damping: expected 1 finite"):
        reconstruct_chain(**good, motor_inertia_kg_m2=1.0, pole_damping=[0.1, 0.1])
    with pytest.raises(InputError, match="stiffness_nm_rad: expected positive"):
        SpringMassChain(np.ones(2), -np.ones(1), np.zeros(1))
    true = response(chain(2, np.random.default_rng(0)))
    with pytest.raises(InputError, match="n_masses: expected a whole number of at least 2, got 1"):
        fit_chain(true, 1)
    with pytest.raises(InputError, match="axis: expected one of 1, got 2"):
        fit_chain(true, 2, axis=2)
    with pytest.raises(InputError, match="expected at least 20 lines for 6 masses, got 11"):
        fit_chain(true, 6, band_hz=(1.0, 3.0))
    with pytest.raises(InputError, match="start: expected 3 masses, got 2"):
        fit_chain(true, 3, start=chain(2, np.random.default_rng(0)))

"""Bands hold what they say, variances add up, averages have the bias they are known for."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import frf
from axisight.records.periodic import PeriodicRecords
from frf_data import T, loop_records, plant

RUNS = 500


@pytest.mark.parametrize(
    ("name", "n_realizations", "n_periods"),
    [
        ("mfrf", 1, 2),
        ("mfrf", 1, 6),
        ("mfrf", 3, 1),
        ("joint_input_output", 3, 2),
        ("h1", 1, 4),
        ("h1", 4, 2),
        ("arithmetic_mean", 4, 1),
        ("logarithmic_mean", 4, 2),
        ("harmonic_mean", 4, 1),
    ],
)
def test_bands_of_95_percent(name: str, n_realizations: int, n_periods: int) -> None:
    """500 closed-loop runs, few degrees of freedom, noise on both input and output."""
    runs = loop_records(n_realizations, n_periods, noise=0.003, n_runs=RUNS, seed=7)
    truth = plant(runs[0].frequency_hz)
    inside = []
    for records in runs:
        found = getattr(frf, name)(records)
        radius = frf.confidence_radius(found).values
        inside.append(np.abs(found["response"].values - truth) <= radius)
    # 26,000 discs; neighbours share records, runs do not: standard error about 0.4 %.
    assert 0.93 < np.mean(inside) < 0.97
    # One element at one line has 500 discs: standard error 1 %, the extremes of 52 within four.
    each = np.mean(inside, axis=0)
    assert each.min() > 0.90 and each.max() < 0.995


def test_known_variance_needs_no_students_widening() -> None:
    frequency = np.array([1.0])
    g = np.ones((1, 1, 1), complex)
    known = frf.frequency_response(frequency, g, estimator="x", variance=np.full((1, 1, 1), 4.0))
    radius = frf.confidence_radius(known).values.item()
    assert abs(radius - 2 * np.sqrt(np.log(20))) < 1e-12


def test_variance_of_periods_is_that_of_independent_runs() -> None:
    runs = loop_records(1, 4, noise=0.01, n_runs=RUNS, seed=11)
    found = [frf.mfrf(records) for records in runs]
    truth = plant(runs[0].frequency_hz)
    actual = np.mean([np.abs(f["response"].values - truth) ** 2 for f in found], axis=0)
    stated = np.mean([f["variance"].values for f in found], axis=0)
    # 500 squared errors: relative standard error 4.5 %; five of them.
    np.testing.assert_allclose(stated, actual, rtol=0.23)


def test_noise_and_distortion_are_told_apart() -> None:
    """An output that depends on the realization, but repeats with the period."""
    records = loop_records(6, 4, noise=1e-4)[0]
    rng = np.random.default_rng(2)
    shape = (records.n_experiments, 1, records.n_samples, 2)
    distorted = replace(records, output=records.output + 0.05 * rng.normal(size=shape))
    for name in ("mfrf", "arithmetic_mean", "logarithmic_mean", "harmonic_mean", "h1"):
        found = getattr(frf, name)(distorted)
        ratio = found["noise_variance"].values.mean() / found["variance"].values.mean()
        assert ratio < 1e-3, name


def test_logarithmic_phase_survives_wrapping() -> None:
    """Angles scattered about 180 degrees average to 180 degrees, not to zero."""
    angle = np.pi + np.array([0.3, -0.3, 0.1, -0.1])
    given = [
        frf.frequency_response(
            np.array([1.0]), np.full((1, 1, 1), 2 * np.exp(1j * a)), estimator="given"
        )
        for a in angle
    ]
    found = frf.logarithmic_mean(given)["response"].values.item()
    assert abs(found + 2) < 1e-12


def test_averages_of_numbers() -> None:
    """The three means of 1, 2 and 4: 7/3, 2 and 12/7."""
    given = [
        frf.frequency_response(np.array([1.0]), np.full((1, 1, 1), v + 0j), estimator="given")
        for v in (1, 2, 4)
    ]
    for name, mean in (("arithmetic", 7 / 3), ("logarithmic", 2.0), ("harmonic", 12 / 7)):
        found = getattr(frf, f"{name}_mean")(given)
        assert abs(found["response"].values.item() - mean) < 1e-12
        assert found["degrees_of_freedom"].values.item() == 2
    # Variance of the arithmetic mean: sample variance 7/3 over 3.
    assert abs(frf.arithmetic_mean(given)["variance"].values.item() - 7 / 9) < 1e-12


def test_h1_is_too_small_with_noise_on_the_input_and_h2_is_not() -> None:
    """Open loop, G = 1, white noise of power q on U: H1 = 1 / (1 + q)."""
    rng = np.random.default_rng(1)
    u = rng.normal(size=(1, 200, 64, 1))
    noisy = PeriodicRecords(T, u + 0.5 * rng.normal(size=u.shape), u, np.arange(1, 32))
    small, right = frf.h1(noisy), frf.h2(noisy)
    # Mean over 31 lines of 200 records: standard error below 1 %.
    assert abs(np.abs(small["response"].values).mean() - 1 / 1.25) < 0.03
    assert abs(np.abs(right["response"].values).mean() - 1) < 0.03
    assert abs(small["coherence"].values.mean() - 1 / 1.25) < 0.03

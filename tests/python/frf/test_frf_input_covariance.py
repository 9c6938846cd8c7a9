"""Covariance of the elements of a response from the measured input."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from axisight.errors import InputError
from axisight.frf import errors, mfrf, with_input_covariance
from axisight.records import PeriodicRecords

N, PERIODS, STD = 128, 4, 0.01
LINES = np.arange(2, 34)


def records_of(seed: int) -> PeriodicRecords:
    """Return two experiments of a static 2 x 2 system with white noise; the inputs nearly coincide."""
    rng = np.random.default_rng(7)
    directions = np.array([[1.0, 0.9], [0.9, 1.0]])
    scale = rng.uniform(0.2, 2.0, len(LINES)) * np.exp(2j * np.pi * rng.random(len(LINES)))
    spectrum = np.zeros((2, N // 2 + 1, 2), np.complex128)
    spectrum[:, LINES] = N / 2 * scale[None, :, None] * directions.T[:, None, :]
    u = np.repeat(np.fft.irfft(spectrum, N, axis=1)[:, None], PERIODS, axis=1)
    y = u @ np.array([[1.0, 0.5], [0.2, 2.0]]).T
    noise = STD * np.array([1.0, 3.0]) * np.random.default_rng(seed).standard_normal(y.shape)
    return PeriodicRecords(0.01, u, y + noise, LINES)


def estimate(seed: int) -> xr.Dataset:
    records = records_of(seed)
    return with_input_covariance(mfrf(records, remove_drift=False), records)


def test_covariance_is_that_of_many_repetitions() -> None:
    # 400 complex samples, 32 lines: the mean over lines of a ratio scatters by about 1 / sqrt(400 * 32),
    # below 1 %; the stated one by 1 / sqrt(32 * 3 * 2), 7 %.
    found = [estimate(seed) for seed in range(400)]
    g = np.array([x["response"].values.reshape(len(LINES), 4) for x in found])
    off = g - g.mean(axis=0)
    sample = np.einsum("rki,rkj->kij", off, off.conj()) / (len(found) - 1)
    stated = found[0]["covariance"].values
    own = np.sqrt(np.einsum("kii,kjj->kij", sample, sample).real)
    assert np.mean((stated - sample).real / own, axis=0) == pytest.approx(
        np.zeros((4, 4)), abs=0.25
    )
    correlation = np.mean(sample / own, axis=0)
    assert correlation[0, 1].real < -0.9
    said = np.sqrt(np.einsum("kii,kjj->kij", stated, stated).real)
    assert np.mean(stated / said, axis=0) == pytest.approx(correlation, abs=0.05)


def test_diagonal_is_the_error_variance() -> None:
    # Oracle: `errors.error_variance` for the same noise, which is white: the mean over 21 lines, 3 complex
    # degrees of freedom and 2 experiments scatters by 1 / sqrt(126), 9 %; four times that.
    records = records_of(0)
    found = with_input_covariance(mfrf(records, remove_drift=False), records)
    u = np.moveaxis(np.fft.rfft(records.input.mean(axis=1), axis=1)[:, LINES], 0, -1)
    power = np.tile(N * STD**2 * np.array([1.0, 9.0]) / PERIODS, (len(LINES), 1))
    expected = errors.error_variance(power, u)
    assert found["variance"].values / expected == pytest.approx(np.ones(expected.shape), abs=0.36)
    diagonal = np.einsum("kii->ki", found["covariance"].values).real.reshape(-1, 2, 2)
    assert diagonal == pytest.approx(found["variance"].values)
    assert (found["degrees_of_freedom"] > mfrf(records)["degrees_of_freedom"].values).all()


def test_derivatives_scale_the_covariance() -> None:
    records = records_of(0)
    position, velocity = (
        with_input_covariance(mfrf(records, quantity=q, remove_drift=False), records)
        for q in ("position", "velocity")
    )
    w = 2 * np.pi * records.frequency_hz
    assert velocity["covariance"].values == pytest.approx(
        position["covariance"].values * w[:, None, None] ** 2
    )


def test_other_records_are_refused() -> None:
    records = records_of(0)
    with pytest.raises(InputError, match="expected a response of these records"):
        with_input_covariance(mfrf(records).isel(input=[0]), records)

"""Bad input: typed errors that name the field, flags with reasons, never an infinite number."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from axisight import frf
from axisight.errors import InputError
from axisight.records.periodic import PeriodicRecords
from frf_data import T, loop_records, plant

ALL: list[Callable[[PeriodicRecords], xr.Dataset]] = [
    frf.mfrf,
    frf.h1,
    frf.h2,
    frf.joint_input_output,
    frf.arithmetic_mean,
    frf.logarithmic_mean,
    frf.harmonic_mean,
]


def nothing_infinite(dataset: xr.Dataset) -> None:
    for name, values in dataset.data_vars.items():
        assert not np.isinf(values.values).any(), name


def spectrum_edited(
    records: PeriodicRecords, edit: Callable[[np.ndarray], None]
) -> PeriodicRecords:
    """Edit the input DFT (experiment, line, input) of every period; output follows G."""
    spectrum = np.fft.rfft(records.input[:, 0], axis=1)
    edit(spectrum)
    g = plant(np.fft.rfftfreq(records.n_samples, T))
    output = np.einsum("fij,efj->efi", g, spectrum)
    signals = [np.fft.irfft(s, records.n_samples, axis=1) for s in (spectrum, output)]
    shape = records.input.shape
    u, y = (np.broadcast_to(s[:, None], shape) for s in signals)
    return replace(records, input=u, output=y, reference=u)


@pytest.mark.parametrize("estimator", ALL)
@pytest.mark.parametrize("n_realizations", [1, 2])
def test_lines_of_deficient_rank(
    estimator: Callable[[PeriodicRecords], xr.Dataset], n_realizations: int
) -> None:
    """At two lines all experiments excite the same combination, at one an input is silent."""
    records = loop_records(n_realizations, 2)[0]

    def edit(u: np.ndarray) -> None:
        for k in records.lines[[2, 3]]:
            u[:, k, 1] = (0.5 - 0.5j) * u[:, k, 0]
        u[:, records.lines[7], 1] = 0

    bad = spectrum_edited(records, edit)
    found = estimator(bad)
    expected = np.zeros(len(records.lines), int)
    expected[[2, 3]] = frf.Flag.RANK_DEFICIENT
    expected[7] = frf.Flag.NO_EXCITATION
    np.testing.assert_array_equal(found["flag"].values, expected)
    nothing_infinite(found)
    lost = expected != 0
    assert np.isnan(found["response"].values[lost]).all()
    truth = plant(records.frequency_hz)
    np.testing.assert_allclose(found["response"].values[~lost], truth[~lost], rtol=1e-7)
    rank, silent = frf.explain_flags(found, bad)
    low, high = records.frequency_hz[[2, 3]]
    assert rank.startswith(f"{low:g} to {high:g} Hz (2 lines): rank deficient")
    assert "least excited" in rank and "u1" in rank and "u2" in rank
    assert silent.startswith(f"{records.frequency_hz[7]:g} Hz: no excitation")
    assert silent.endswith("input 2")
    assert len(frf.explain_flags(found)) == 2
    assert frf.explain_flags(frf.mfrf(records)) == []


@pytest.mark.parametrize("level", [0.0, 0.3])
def test_an_output_that_never_changes_is_explained(level: float) -> None:
    """Its response is zero or rounding at every line, which no flag of a line says."""
    records = loop_records()[0]
    output = records.output.copy()
    output[..., 1] = level
    bad = replace(records, output=output)
    found = frf.mfrf(bad)
    assert (found["flag"] == frf.Flag.GOOD).all()
    (said,) = frf.explain_flags(found, bad)
    assert said.startswith(f"output 2: expected it to change, got {level:g} throughout")
    if level == 0.0:
        assert frf.explain_flags(found) == [
            "output 2: expected a response, got zero at every line: the channel is dead"
        ]


def test_badly_conditioned_lines_are_given_and_flagged() -> None:
    records = loop_records()[0]

    def edit(u: np.ndarray) -> None:
        k = records.lines[4]
        u[:, k, 1] = u[:, k, 0] * (1 + 1e-5 * np.array([1, -1]))

    found = frf.mfrf(spectrum_edited(records, edit))
    assert found["flag"].values[4] == frf.Flag.ILL_CONDITIONED
    # Rows of unit norm, 1e-5 apart: singular values sqrt(2) and 1e-5.
    assert 1e4 < found["condition"].values[4] < 1e6
    assert np.isfinite(found["response"].values).all()


def test_direction_lost_in_noise_is_flagged() -> None:
    """Every experiment the same: what tells them apart is noise."""
    records = loop_records(1, 6, noise=0.01)[0]
    same = replace(records, reference=None)
    same.input[1], same.output[1] = records.input[0], records.output[0]
    same.input[1] += 1e-3 * np.random.default_rng(1).normal(size=same.input[1].shape)
    same.input[:, :, :, 1] = same.input[:, :, :, 0] + 1e-3 * np.random.default_rng(2).normal(
        size=same.input.shape[:3]
    )
    found = frf.mfrf(same)
    assert (found["flag"] == frf.Flag.ILL_CONDITIONED).mean() > 0.9
    nothing_infinite(found)


@pytest.mark.parametrize("estimator", ALL)
def test_one_experiment_short(estimator: Callable[[PeriodicRecords], xr.Dataset]) -> None:
    records = loop_records()[0]
    short = replace(
        records, input=records.input[:1], output=records.output[:1], reference=records.input[:1]
    )
    with pytest.raises(InputError, match="records: expected at least 2 experiments for 2 inputs"):
        estimator(short)


def test_half_a_realization_is_refused() -> None:
    records = loop_records(2)[0]
    odd = replace(records, input=records.input[:3], output=records.output[:3], reference=None)
    with pytest.raises(InputError, match="1 left over"):
        frf.arithmetic_mean(odd)


def test_missing_and_unsuitable_references() -> None:
    records = loop_records()[0]
    with pytest.raises(InputError, match="reference: expected the recorded reference, got None"):
        frf.joint_input_output(replace(records, reference=None))
    assert records.reference is not None
    with pytest.raises(InputError, match=r"one channel per input \(2\), got 1"):
        frf.joint_input_output(replace(records, reference=records.reference[..., :1]))


def test_nan_is_refused_with_its_place() -> None:
    records = loop_records()[0]
    broken = records.output.copy()
    broken[1, 0, 5, 1] = np.nan
    with pytest.raises(InputError, match=r"output: .*experiment 2, period 1, sample 6, channel 2"):
        replace(records, output=broken)


def test_wrong_choices_are_named() -> None:
    records = loop_records(2)[0]
    with pytest.raises(InputError, match="quantity: expected one of position"):
        frf.mfrf(records, quantity="jerk")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="phase: expected one of angle"):
        frf.logarithmic_mean(records, phase="x")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="ETFE expects one input, got 2"):
        frf.etfe(records)
    with pytest.raises(InputError, match="bandwidth_hz: expected a positive"):
        frf.spectral_analysis(records, bandwidth_hz=0.0)
    with pytest.raises(InputError, match="bandwidth_hz: expected more than 2 independent"):
        one = replace(
            records, input=records.input[:1, :1], output=records.output[:1, :1], reference=None
        )
        frf.spectral_analysis(one, bandwidth_hz=10.0)
    with pytest.raises(InputError, match="at least one realization"):
        frf.arithmetic_mean([])
    with pytest.raises(InputError, match="realization 2 differs"):
        frf.arithmetic_mean([frf.mfrf(records), frf.mfrf(records).isel(frequency_hz=slice(3))])
    with pytest.raises(InputError, match="probability"):
        frf.confidence_radius(frf.mfrf(records), 1.0)


@pytest.mark.parametrize("n", [3, 6])
def test_pieces_of_a_long_batch_fit_together(n: int) -> None:
    rng = np.random.default_rng(2)
    count = 2**18 // n**2 * 2 + 11  # the binding cuts at 2**18 numbers or so
    a = rng.normal(size=(count, n, n)) + 1j * rng.normal(size=(count, n, n))
    a[count - 3] = 0.0
    inverse, singular = frf.invert(a)
    assert np.flatnonzero(singular).tolist() == [count - 3]
    ends = np.r_[0:20, 2**18 // n**2 - 99 : 2**18 // n**2 + 99, count - 20 : count]
    for i in ends:
        np.testing.assert_array_equal(frf.invert(a[i])[0], inverse[i])


def test_matrices() -> None:
    rng = np.random.default_rng(1)
    a = rng.normal(size=(5, 7, 3, 3)) + 1j * rng.normal(size=(5, 7, 3, 3))
    y = rng.normal(size=(5, 7, 2, 3)) + 0j
    a[2, 3] = 1.0
    inverse, singular = frf.invert(a)
    quotient, also = frf.right_divide(y, a, threads=2)
    assert singular.sum() == 1 and singular[2, 3] and (singular == also).all()
    truth = np.linalg.inv(a[~singular])
    np.testing.assert_allclose(inverse[~singular], truth, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(quotient[~singular], y[~singular] @ truth, rtol=1e-9, atol=1e-12)
    assert np.isnan(inverse[2, 3]).all() and np.isnan(quotient[2, 3]).all()
    again = np.empty_like(a)
    assert frf.invert(a, out=again, threads=2)[0] is again
    np.testing.assert_array_equal(again, inverse)
    for wrong in (a, again[..., :2], again.real, again.swapaxes(0, 1).copy().swapaxes(0, 1)):
        with pytest.raises(InputError, match="out: expected a writeable"):
            frf.invert(a, out=wrong)
    with pytest.raises(InputError, match="matrices: expected shape"):
        frf.invert(a[..., :2])
    with pytest.raises(InputError, match="u: expected shape"):
        frf.right_divide(y, a[0])

"""Options that every estimator has: derivatives, drift, covariances, phases, smoothing, flags."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import frf
from axisight.errors import InputError
from axisight.records import ArbitraryRecords, PeriodicRecords
from frf_data import T, loop_records, plant

METHODS = {
    "robust_method": frf.robust_method,
    "fast_method": lambda r, **o: frf.fast_method(one_realization(r), **o).response,
    "local_polynomial": frf.local_polynomial,
    "local_rational": frf.local_rational,
}


def one_realization(records: PeriodicRecords) -> PeriodicRecords:
    return replace(records, input=records.input[:2], output=records.output[:2], reference=None)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(("quantity", "power"), [("velocity", 1), ("acceleration", 2)])
def test_derivatives_are_those_of_the_position(name, quantity, power):
    records = loop_records(2, 4, noise=1e-3)[0]
    position, found = METHODS[name](records), METHODS[name](records, quantity=quantity)
    factor = (2j * np.pi * records.frequency_hz)[:, None, None] ** power
    for variable, scale in (
        ("response", factor),
        ("variance", np.abs(factor) ** 2),
        ("noise_variance", np.abs(factor) ** 2),
    ):
        np.testing.assert_allclose(
            found[variable].values, position[variable].values * scale, rtol=1e-9, err_msg=variable
        )
    unit = {"velocity": "rad/s/Nm", "acceleration": "rad/s^2/Nm"}[quantity]
    assert found["response"].attrs["units"] == unit
    assert found.attrs["quantity"] == quantity and position.attrs["quantity"] == "position"


@pytest.mark.parametrize("name", METHODS)
def test_drift_is_removed(name):
    """A ramp over all periods, up to a thousand times the rest."""
    records = loop_records(2, 4)[0]
    shape = records.output.shape
    time = np.arange(shape[1] * shape[2]).reshape(1, shape[1], shape[2], 1) * T
    slope = np.array([0.7, -2.0]) * np.arange(1, 5)[:, None, None, None]
    drifting = replace(records, output=records.output + slope * time)
    truth = METHODS[name](records, remove_drift=False)["response"].values
    found = METHODS[name](drifting, remove_drift=True)["response"].values
    assert np.abs(found / truth - 1).max() < 1e-8
    left = METHODS[name](drifting, remove_drift=False)["response"].values
    if not name.startswith("local"):  # to those a ramp is a transient
        assert np.abs(left / truth - 1).max() > 1e-3


def test_distortion_of_a_derivative():
    lines, free = np.array([2, 5, 11]), np.array([3, 4])
    records = one_realization(loop_records(1, 3, noise=0.01, lines=lines)[0])
    records = replace(records, detection_lines=free)
    position = frf.fast_method(records).distortion
    velocity = frf.fast_method(records, quantity="velocity").distortion
    factor = 2j * np.pi * position["frequency_hz"].values[:, None, None]
    for name, scale in (
        ("distortion", factor),
        ("uncorrected", factor),
        ("noise_variance", np.abs(factor) ** 2),
        ("input_amplitude", 1.0),
    ):
        np.testing.assert_allclose(
            velocity[name].values, scale * position[name].values, rtol=1e-9, err_msg=name
        )
    assert velocity["distortion"].attrs["units"] == "rad/s"


@pytest.mark.parametrize(("n_realizations", "n_periods"), [(1, 4), (3, 2), (3, 1)])
def test_covariance_of_the_elements(n_realizations, n_periods):
    """Stated against the scatter of 200 runs; the diagonal is the variance, bit for bit alike."""
    runs = loop_records(n_realizations, n_periods, noise=0.01, n_runs=200, seed=3)
    found = [frf.mfrf(records, covariance="full") for records in runs]
    first = found[0]
    assert first["covariance"].dims == ("frequency_hz", "element", "element_2")
    assert list(first["element"].values) == ["1,1", "1,2", "2,1", "2,2"]
    n = len(first["frequency_hz"])
    for matrix, diagonal in (("covariance", "variance"), ("noise_covariance", "noise_variance")):
        if matrix not in first:
            assert n_periods == 1 and matrix == "noise_covariance"
            continue
        values = first[matrix].values
        np.testing.assert_allclose(values, values.conj().swapaxes(1, 2), rtol=1e-9, atol=1e-18)
        own = np.einsum("fkk->fk", values)
        np.testing.assert_allclose(own, first[diagonal].values.reshape(n, 4), rtol=1e-9)
    response = np.array([f["response"].values.reshape(n, 4) for f in found])
    error = response - plant(runs[0].frequency_hz).reshape(n, 4)
    actual = np.einsum("rfa,rfb->fab", error, error.conj()) / len(runs)
    stated = np.mean([f["covariance"].values for f in found], axis=0)
    size = np.sqrt(np.einsum("fkk->fk", actual).real)
    scaled = (stated - actual) / size[:, :, None] / size[:, None, :]
    # Each is a mean of 200: 0.07 for the runs, 0.05 to 0.07 for those stated from two to six
    # degrees of freedom; five of both together over 13 lines and 16 elements.
    assert np.abs(scaled).max() < 0.5
    assert np.sqrt(np.mean(np.abs(scaled) ** 2)) < 0.13
    off = np.abs(actual[:, 0, 1] / size[:, 0] / size[:, 1])
    assert off.max() > 0.3  # else there is nothing to see off the diagonal


def test_plain_estimates_hold_no_covariance():
    records = loop_records(1, 2)[0]
    assert "covariance" not in frf.mfrf(records)
    with pytest.raises(InputError, match="covariance: expected one of elements, full"):
        frf.mfrf(records, covariance="all")
    unknown = frf.mfrf(loop_records(1, 1)[0], covariance="full")
    assert np.isnan(unknown["covariance"].values).all() and "noise_covariance" not in unknown


def one_input(count: int, noise: float) -> PeriodicRecords:
    """Delay of 3 samples and sign minus; inputs of very different size, noise on the output."""
    rng = np.random.default_rng(4)
    u = rng.normal(size=(count, 1, 64, 1)) * np.logspace(0, 2, count)[:, None, None, None]
    y = -np.roll(u, 3, axis=2) + noise * rng.normal(size=u.shape)
    return PeriodicRecords(T, u, y, np.arange(1, 32))


def test_phase_by_cross_spectra():
    """(7.9): each realization weighs with the power of its input, so large ones rule."""
    records = one_input(5, 0.5)
    found = frf.logarithmic_mean(records, phase="cross_spectrum")["response"].values[:, 0, 0]
    spectrum = [np.fft.rfft(a[:, 0, :, 0])[:, 1:32] for a in (records.input, records.output)]
    phase = np.angle(np.sum(spectrum[1] * spectrum[0].conj(), axis=0))
    size = np.exp(np.mean(np.log(np.abs(spectrum[1] / spectrum[0])), axis=0))
    np.testing.assert_allclose(found, size * np.exp(1j * phase), rtol=1e-9)
    truth = -np.exp(-2j * np.pi * np.arange(1, 32) * 3 / 64)
    other = frf.logarithmic_mean(records)["response"].values[:, 0, 0]
    errors = [np.abs(np.angle(g / truth)).max() for g in (found, other)]
    assert errors[0] < 0.1 < errors[1]
    split = [
        replace(records, input=records.input[i], output=records.output[i])
        for i in (slice(0, 2), slice(2, 5))
    ]
    again = frf.logarithmic_mean(split, phase="cross_spectrum")["response"].values[:, 0, 0]
    np.testing.assert_allclose(again, found, rtol=1e-12)


def test_phase_by_cross_spectra_is_for_one_input():
    with pytest.raises(InputError, match=r"phase: .*got 2 inputs"):
        frf.logarithmic_mean(loop_records(2)[0], phase="cross_spectrum")
    with pytest.raises(InputError, match=r"phase: .*got Dataset"):
        frf.logarithmic_mean([frf.mfrf(loop_records()[0])], phase="cross_spectrum")


def test_etfe_smoothed_flat_and_by_the_power_of_the_input():
    rng = np.random.default_rng(6)
    n, lines, width = 256, np.arange(1, 128), 12.0
    u, y = rng.normal(size=(2, 1, 1, n, 1))
    records = PeriodicRecords(T, u, y, lines)
    spectrum = [np.fft.rfft(a[0, 0, :, 0])[lines] for a in (u, y)]
    quotient, power = spectrum[1] / spectrum[0], np.abs(spectrum[0]) ** 2
    at, spacing = 60, 1 / (n * T)
    apart = (lines - lines[at]) * spacing
    hann = np.where(np.abs(apart) < width, 1 + np.cos(np.pi * apart / width), 0.0)
    for weighting, alpha in (("flat", hann), ("input_power", hann * power)):
        found = frf.etfe(records, bandwidth_hz=width, weighting=weighting)
        expected = np.sum(alpha * quotient) / np.sum(alpha)
        # The window ends 1e-9 early.
        assert abs(found["response"].values[at, 0, 0] - expected) < 1e-7 * abs(expected)
        assert found.attrs["estimator"] == "etfe"
    # The latter is spectral analysis, (3.49).
    other = frf.spectral_analysis(records, bandwidth_hz=width)["response"].values
    wide = slice(1, -1)  # a single line is none to spectral analysis
    np.testing.assert_allclose(found["response"].values[wide], other[wide], rtol=1e-9)
    plain = frf.etfe(records)["response"].values[:, 0, 0]
    np.testing.assert_allclose(plain, quotient, rtol=1e-9)
    with pytest.raises(InputError, match="weighting: expected a bandwidth_hz"):
        frf.etfe(records, weighting="input_power")


def lost_direction() -> PeriodicRecords:
    """Both experiments the same, both inputs the same: what tells them apart is noise."""
    records = replace(loop_records(1, 6, noise=0.01)[0], reference=None)
    rng = np.random.default_rng(1)
    u, y = records.input.copy(), records.output.copy()
    u[1], y[1] = u[0], y[0]
    u[..., 1] = u[..., 0]
    return replace(records, input=u + 0.1 * rng.normal(size=u.shape), output=y)


@pytest.mark.parametrize("name", ["h1", "h2", "mfrf"])
def test_a_direction_lost_in_noise_is_flagged(name):
    lost = getattr(frf, name)(lost_direction())
    # A direction of pure noise is above twice its root mean square with probability
    # exp(-4) and less, for the smaller of two.
    assert (lost["flag"] == frf.Flag.ILL_CONDITIONED).mean() > 0.9
    good = getattr(frf, name)(loop_records(1, 6, noise=0.01)[0])
    assert (good["flag"] == frf.Flag.GOOD).all()


def test_records_that_do_not_repeat_have_no_such_noise():
    rng = np.random.default_rng(2)
    u = rng.normal(size=(3, 8, 64, 2))
    found = frf.h1(PeriodicRecords(T, u, u @ [[1.0, 0.3], [0.0, 2.0]], np.arange(1, 32)))
    assert (found["flag"] == frf.Flag.GOOD).all()


def test_local_methods_of_a_single_record_have_derivatives_too():
    rng = np.random.default_rng(3)
    u = rng.normal(size=(1, 300, 1))
    records = ArbitraryRecords(T, u, np.roll(u, 1, axis=1))
    position = frf.local_rational(records)
    velocity = frf.local_rational(records, quantity="velocity")
    factor = 2j * np.pi * position["frequency_hz"].values[:, None, None]
    np.testing.assert_allclose(
        velocity["response"].values, factor * position["response"].values, rtol=1e-12
    )

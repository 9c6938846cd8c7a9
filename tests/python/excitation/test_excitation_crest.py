"""The search for low crest factors."""

import numpy as np
import pytest

from axisight.errors import InputError
from axisight.excitation import Clipping, LpRefinement, Multisine, multisine, optimize_crest_factor

T = 5e-4


def flat(period_s: float = 2.0) -> Multisine:
    return multisine(period_s, T, band_hz=(1.0, 40.0))


def clipped_with_numpy(signal: Multisine, iterations: int) -> np.ndarray:
    """Algorithm 5.1 in full, from the phases of the signal; the phases it ends with."""
    n = int(2 ** np.ceil(np.log2(8 * signal.lines.max()))) * 2
    d = signal.amplitude * np.exp(1j * signal.phase_rad) / 1j
    for level in 1 - np.geomspace(0.3, 0.001, iterations):
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[signal.lines] = d
        x = np.fft.irfft(spectrum, n)
        bound = level * np.abs(x).max()
        d = np.fft.rfft(np.clip(x, -bound, bound))[signal.lines]
        d *= signal.amplitude / np.abs(d)
    return np.asarray(np.angle(1j * d))


def test_clipping_is_the_published_algorithm() -> None:
    signal = flat()
    found = optimize_crest_factor(
        signal,
        clipping=Clipping(iterations=20, relaxation=1.0),
        refinement="none",
        from_signal=True,
    )
    expected = clipped_with_numpy(signal, 20)
    # Single precision, 20 iterations: a few 1e-7 each, grown by the iteration.
    np.testing.assert_allclose(
        np.exp(1j * found.signal.phase_rad), np.exp(1j * expected), atol=2e-4
    )
    assert found.clipping_iterations == 20 and found.start == -1


def test_refinement_ends_where_many_peaks_are_equal() -> None:
    # At a local minimum of the largest value of F phases, about F extrema are equally high.
    signal = flat()
    found = optimize_crest_factor(signal, starts=1).signal
    n = 256 * int(found.lines.max())
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[found.lines] = np.exp(1j * found.phase_rad) / 1j
    x = np.abs(np.fft.irfft(spectrum, n))
    extrema = x[(x > np.roll(x, 1)) & (x >= np.roll(x, -1))]
    high = np.sum(extrema > 0.995 * extrema.max())
    assert high > 0.8 * len(found.lines), high


def test_reported_figure_is_that_of_the_signal() -> None:
    found = optimize_crest_factor(flat(), starts=3)
    assert found.crest_factor == pytest.approx(found.signal.crest_factor, rel=1e-9)
    assert found.crest_factor == found.crest_factors.min()
    assert found.crest_factors[found.start] == found.crest_factor
    np.testing.assert_array_equal(found.signal.amplitude, flat().amplitude)
    assert found.status == "completed"


def test_better_than_schroeder_and_near_the_best_known() -> None:
    found = optimize_crest_factor(flat(5.0), starts=4)
    # Plain clipping with 3000 iterations gets 1.393 to 1.416 for these 196 lines.
    assert found.crest_factor < 1.40


def test_threads_do_not_matter() -> None:
    one, two = (optimize_crest_factor(flat(), starts=5, seed=9, threads=n) for n in (1, 2))
    assert one.start == two.start
    np.testing.assert_array_equal(one.signal.phase_rad, two.signal.phase_rad)
    np.testing.assert_array_equal(one.crest_factors, two.crest_factors)


def test_more_starts_repeat_the_first_ones() -> None:
    few, more = (optimize_crest_factor(flat(), starts=n, seed=2) for n in (2, 4))
    np.testing.assert_array_equal(more.crest_factors[:2], few.crest_factors)


def test_any_amplitude_spectrum() -> None:
    signal = multisine(2.0, T, band_hz=(1.0, 40.0), amplitude=lambda f: 1 / np.sqrt(f), grid="odd")
    found = optimize_crest_factor(signal, starts=4)
    assert (
        found.crest_factor
        < 0.85
        * multisine(
            2.0,
            T,
            band_hz=(1.0, 40.0),
            amplitude=lambda f: 1 / np.sqrt(f),
            grid="odd",
            phases="schroeder",
        ).crest_factor
    )
    np.testing.assert_array_equal(found.signal.detection_lines, signal.detection_lines)


def test_snow_lowers_the_crest_factor() -> None:
    signal = flat()
    plain = optimize_crest_factor(signal, starts=4)
    snowy = optimize_crest_factor(signal, starts=4, snow_lines=np.arange(81, 121))
    assert snowy.crest_factor < plain.crest_factor - 0.01
    assert snowy.signal.snow_amplitude.max() <= 1 + 1e-12
    assert snowy.signal.rms == pytest.approx(signal.rms)
    # The snow is in the signal, and in the figure.
    assert snowy.crest_factor == pytest.approx(snowy.signal.crest_factor, rel=1e-9)
    spectrum = np.abs(np.fft.rfft(snowy.signal.period)) * 2 / snowy.signal.n_samples
    np.testing.assert_allclose(spectrum[81:121], snowy.signal.snow_amplitude, atol=1e-12)


def test_crest_factor_of_the_output() -> None:
    signal = flat()
    f = signal.frequency_hz
    gain = 1 / (1 - (f / 15) ** 2 + 0.1j * f / 15)
    found = optimize_crest_factor(signal, starts=4, response=gain)
    output = found.signal.through(gain)
    assert found.crest_factor == pytest.approx(output.crest_factor, rel=1e-9)
    random = [multisine(2.0, T, band_hz=(1.0, 40.0), seed=s).through(gain) for s in range(8)]
    assert found.crest_factor < 0.75 * min(x.crest_factor for x in random)
    np.testing.assert_array_equal(found.signal.amplitude, signal.amplitude)


def test_time_ends_a_search() -> None:
    found = optimize_crest_factor(flat(10.0), starts=100_000, time_s=0.3)
    assert found.status == "out_of_time"
    assert 1 <= len(found.crest_factors) < 100_000


def test_single_line_and_two_lines() -> None:
    one = Multisine(T, 1000, [5], [2.0], [0.3])
    assert optimize_crest_factor(one, starts=2).crest_factor == pytest.approx(
        np.sqrt(2), rel=1.3e-3
    )
    # sin x + a sin 3x with equal amplitudes: the least peak over phases is 8 / (3 sqrt 3)
    # (phase zero), so the crest factor is that over one.
    two = Multisine(T, 1000, [1, 3], [1.0, 1.0], [0.3, 2.0])
    found = optimize_crest_factor(two, starts=8)
    assert found.crest_factor == pytest.approx(8 / (3 * np.sqrt(3)), abs=2e-3)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"starts": 0}, "starts"),
        ({"time_s": -1.0}, "time_s"),
        ({"threads": -1}, "threads"),
        ({"seed": -1}, "seed"),
        ({"clipping": Clipping(first_level=1.0)}, "clipping.first_level"),
        ({"clipping": Clipping(last_level=float("nan"))}, "clipping.last_level"),
        ({"clipping": Clipping(relaxation=0.0)}, "clipping.relaxation"),
        ({"clipping": Clipping(oversampling=1)}, "clipping.oversampling"),
        ({"refinement": LpRefinement(first_exponent=7)}, "refinement.exponent"),
        ({"refinement": LpRefinement(oversampling=1000)}, "refinement.oversampling"),
        ({"snow_lines": [3]}, "lines that are not excited"),
        ({"snow_lines": [5000]}, "snow_lines: expected lines from 1 to below"),
        ({"snow_limit": -1.0}, "snow_limit"),
        ({"response": [1.0]}, "response: expected 79"),
        ({"response": np.zeros(79)}, "other than zero"),
        ({"response": np.ones(79), "snow_lines": [200]}, "at most one"),
    ],
)
def test_misuse(settings: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        optimize_crest_factor(flat(), **settings)  # type: ignore[arg-type]

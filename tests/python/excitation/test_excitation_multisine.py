"""Multisines: lines, phases, figures, and the same conventions as the Monte Carlo study."""

import numpy as np
import pytest

from axisight import load_robot
from axisight.errors import InputError
from axisight.excitation import Multisine, line_set, multisine, random_phases, schroeder_phases
from axisight.montecarlo.design import core_study, freeze
from axisight.montecarlo.study import Study

T = 5e-4


def direct(signal: Multisine, t: np.ndarray) -> np.ndarray:
    """(5.5) as it stands, with snow."""
    lines = np.concatenate([signal.lines, signal.snow_lines])
    amplitude = np.concatenate([signal.amplitude, signal.snow_amplitude])
    phase = np.concatenate([signal.phase_rad, signal.snow_phase_rad])
    angle = 2 * np.pi * np.outer(t, lines) / signal.period_s + phase
    return np.asarray(np.sin(angle) @ amplitude)


@pytest.mark.parametrize("n_samples", [1000, 1001])
def test_period_is_the_sum_of_sines(n_samples: int) -> None:
    signal = Multisine(
        T,
        n_samples,
        [3, 7, 40],
        [1.0, 0.2, 3.0],
        [0.1, -2.0, 5.0],
        snow_lines=[50],
        snow_amplitude=[0.5],
        snow_phase_rad=[1.0],
    )
    t = np.arange(n_samples) * T
    np.testing.assert_allclose(signal.period, direct(signal, t), atol=1e-12)


def test_lines_of_a_band() -> None:
    full, none = line_set(10.0, T, band_hz=(1.0, 40.0))
    assert len(full) == 391 and full[0] == 10 and full[-1] == 400 and none.size == 0
    odd, even = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd")
    assert np.all(odd % 2 == 1) and np.all(even % 2 == 0)
    special, rest = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd_odd")
    assert np.all(special % 4 == 1) and len(special) + len(rest) == 391


def test_odd_random_leaves_one_line_of_every_group() -> None:
    kept, free = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd_random", group=5, seed=3)
    odd, _ = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd")
    groups = odd[: len(odd) // 5 * 5].reshape(-1, 5)
    assert np.all(np.isin(groups, kept).sum(axis=1) == 4)
    np.testing.assert_array_equal(np.sort(np.concatenate([kept, free])), np.arange(10, 401))
    again, _ = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd_random", group=5, seed=3)
    other, _ = line_set(10.0, T, band_hz=(1.0, 40.0), grid="odd_random", group=5, seed=3, run=1)
    np.testing.assert_array_equal(kept, again)
    assert not np.array_equal(kept, other)


def test_peak_is_that_between_the_samples() -> None:
    # Four samples per cycle at 45 degrees: every sample is 1/sqrt(2) of the peak.
    signal = Multisine(1.0, 16, [4], [2.0], [np.pi / 4])
    assert np.abs(signal.period).max() == pytest.approx(np.sqrt(2))
    assert signal.peak == pytest.approx(2.0)
    assert signal.crest_factor == pytest.approx(np.sqrt(2))


def test_peak_agrees_with_a_direct_grid() -> None:
    signal = multisine(5.0, T, band_hz=(1.0, 40.0), seed=4)
    # 256 points per cycle of the highest line: up to 1 - cos(pi / 256) < 1e-4 below the truth.
    t = np.arange(256 * 200) / (256 * 200) * 5.0
    highest = np.abs(direct(signal, t)).max()
    assert highest * (1 - 1e-5) <= signal.peak <= highest * (1 + 1e-4)


def test_rms_is_that_of_the_samples_and_leaves_snow_out() -> None:
    signal = multisine(5.0, T, band_hz=(1.0, 40.0), amplitude=lambda f: 1 / f)
    assert signal.rms == pytest.approx(np.sqrt(np.mean(signal.period**2)), rel=1e-12)
    snowy = Multisine(
        T, 1000, [3], [1.0], [0.0], snow_lines=[9], snow_amplitude=[1.0], snow_phase_rad=[0.0]
    )
    assert snowy.rms == pytest.approx(np.sqrt(0.5))


def test_scaling() -> None:
    signal = multisine(5.0, T, band_hz=(1.0, 40.0), seed=4)
    assert signal.scaled(peak=12.0).peak == pytest.approx(12.0)
    assert signal.scaled(rms=3.0).rms == pytest.approx(3.0)
    assert signal.scaled(peak=12.0).crest_factor == pytest.approx(signal.crest_factor)


def test_schroeder_phases_of_a_flat_spectrum() -> None:
    k = np.arange(1, 392)
    # phi_1 is arbitrary: zero here; the general formula gives -k (k-1) pi / F.
    expected = -k * (k - 1) * np.pi / 391
    np.testing.assert_allclose(schroeder_phases(np.ones(391)), expected, atol=1e-9)


@pytest.mark.parametrize(("period_s", "known"), [(10.0, 1.8808), (5.0, 1.9051)])
def test_schroeder_crest_factor_is_the_known_one(period_s: float, known: float) -> None:
    # Known for cosines with these phases, from NumPy on a 32x grid, which misses up to 0.12 %.
    signal = multisine(period_s, T, band_hz=(1.0, 40.0), phases="schroeder")
    cosines = multisine(period_s, T, band_hz=(1.0, 40.0), phases=signal.phase_rad + np.pi / 2)
    assert known - 1e-4 <= cosines.crest_factor <= known * 1.0012


def test_random_phases_are_those_of_the_monte_carlo_study() -> None:
    study = Study(
        robot="irb6600_like",
        excitation={"multisine": {"period_s": 1.0, "band_hz": (1, 40), "peak_rad_s": 8.0}},
    )
    wanted = core_study(freeze(study)).reference(7, 2, 0)[:2000, 0]
    signal = multisine(
        1.0, load_robot("irb6600_like").sample_time_s, band_hz=(1, 40), seed=7, run=2
    )
    np.testing.assert_allclose(
        8.0 * signal.period / np.abs(signal.period).max(), wanted, atol=1e-12
    )


def test_phases_are_uniform() -> None:
    # Mean resultant length of n uniform phases is about 1/sqrt(n); 5 times that is beyond chance.
    phases = random_phases(10_000, 1)
    assert abs(np.exp(1j * phases).mean()) < 0.05
    assert phases.min() >= 0 and phases.max() < 2 * np.pi


def test_output_of_a_response() -> None:
    signal = multisine(1.0, 1e-3, band_hz=(1.0, 40.0), seed=1)
    # A delay of 5 samples with gain 3 is known in the time domain.
    gain = 3 * np.exp(-2j * np.pi * signal.frequency_hz * 5e-3)
    np.testing.assert_allclose(
        signal.through(gain).period, 3 * np.roll(signal.period, 5), atol=1e-11
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"period_s": 1.00005}, "period_s: expected a positive whole number of samples"),
        ({"band_hz": (1.0, 1000.0)}, "Nyquist"),
        ({"band_hz": (1.2, 1.3)}, "band that holds lines"),
        ({"band_hz": None}, "band_hz, lines: expected exactly one"),
        ({"band_hz": None, "lines": [0, 1]}, "lines: expected lines from 1"),
        ({"band_hz": None, "lines": [5, 5]}, "ascending"),
        ({"band_hz": None, "lines": [1000]}, "below 1000"),
        ({"amplitude": 0.0}, "amplitude: expected positive"),
        ({"amplitude": [1.0, 2.0]}, "amplitude: expected 40 finite numbers"),
        ({"amplitude": float("nan")}, "amplitude: expected 40 finite"),
        ({"phases": "nice"}, "phases: expected schroeder"),
        ({"phases": [1.0]}, "phases: expected 40"),
        ({"grid": "even"}, "grid: expected one of"),
        ({"seed": -1}, "seed: expected a whole number, 0 to"),
    ],
)
def test_misuse(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        multisine(**({"period_s": 1.0, "sample_time_s": T, "band_hz": (1.0, 40.0)} | changes))  # type: ignore[arg-type]

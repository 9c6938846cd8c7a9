"""Recursive filters and spectral densities against those of SciPy, and that a diagnosis loads no others."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from axisight.errors import InputError
from axisight.statistics.recursion import butterworth, recursive, states, zero_phase
from axisight.statistics.spectral_density import welch

WALK = np.cumsum(np.random.default_rng(0).standard_normal((3000, 3)), axis=0)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("cutoff", [1e-3, 0.1, 0.9])
def test_a_low_pass_is_that_of_scipy(order: int, cutoff: float):
    sections = scipy.signal.butter(order, cutoff, output="sos")
    expected = scipy.signal.sosfiltfilt(sections, WALK, axis=0, padtype=None)
    # Up to three sections of five products, forward and backward; a section of the second order divides their rounding
    # by the square of its cutoff [rad a sample].
    rounding = 30 * np.finfo(float).eps * (1 + (np.pi * cutoff) ** -2)
    np.testing.assert_allclose(
        zero_phase(order, cutoff, WALK), expected, rtol=0, atol=rounding * np.abs(WALK).max()
    )


def test_half_the_power_passes_at_the_cutoff():
    gain = 1.0 + 0.0j
    for above, below in butterworth(3, 0.3):
        gain *= np.polyval(above[::-1], np.exp(-0.3j * np.pi)) / np.polyval(
            below[::-1], np.exp(-0.3j * np.pi)
        )
    assert abs(gain) ** 2 == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("shape", [(3000,), (3000, 3)])
def test_a_difference_equation_is_solved_from_rest(shape: tuple[int, ...]):
    x = WALK[:, 0] if len(shape) == 1 else WALK
    above, below = [2.0, -1.0, 0.5], [4.0, -2.8, 0.6]
    expected = scipy.signal.lfilter(above, below, x, axis=0)
    np.testing.assert_allclose(recursive(above, below, x), expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("n", [0, 1, 2, 7])
@pytest.mark.parametrize("samples", [0, 1, 37])
def test_states_are_those_of_the_recursion(n: int, samples: int):
    """Oracle: one sample after the other."""
    rng = np.random.default_rng([n, samples])
    a, start = rng.normal(size=(n, n)) / max(n, 1) ** 0.5, rng.normal(size=(n, 3))
    drive = rng.normal(size=(samples, n, 3))
    wanted = [start]
    for push in drive:
        wanted.append(a @ wanted[-1] + push)
    # Rounding of some 40 sums of 7 products, on values that grow to the largest.
    bound = 1e-13 * max(np.abs(x).max(initial=1.0) for x in wanted)
    np.testing.assert_allclose(states(a, drive, start), wanted, rtol=0, atol=bound)


def test_states_of_other_shapes_are_refused():
    with pytest.raises(InputError, match=r"a, drive: expected shapes \(2, 2\)"):
        states(np.eye(3), np.zeros((5, 2, 1)), np.zeros((2, 1)))


@pytest.mark.parametrize("segment", [256, 255, 3000])
def test_a_density_is_that_of_scipy(segment: int):
    expected = scipy.signal.welch(WALK, 2000.0, nperseg=segment, axis=0)
    for ours, theirs in zip(welch(WALK, 2000.0, segment), expected, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)


@pytest.mark.parametrize("room", ["gap", "logs"])
def test_a_diagnosis_does_not_wait_for_modules_it_hardly_uses(repository: Path, room: str):
    # Both take longer to load than all that a diagnosis would ask of them takes to run.
    sources = (repository / "python" / "axisight" / room).rglob("*.py")
    texts = {path.name: path.read_text("utf-8") for path in sources}
    loading = [
        name for name, text in texts.items() if "scipy.signal" in text or "scipy.stats" in text
    ]
    assert not loading


@pytest.mark.parametrize(("above", "below"), [([1.0], [0.0, 1.0]), ([1.0], []), ([], [1.0])])
def test_an_equation_without_a_present_is_refused(above: list[float], below: list[float]):
    with pytest.raises(InputError, match="below: expected a first factor that is not zero"):
        recursive(above, below, WALK)

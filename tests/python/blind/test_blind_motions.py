"""Motions of the benchmark."""

import numpy as np

from axisight.blind.motions import _cosines


def test_cosines_in_blocks_are_cosines():
    """Against the sum itself; rounding of phases up to 2 pi 40 Hz 10 s is 5e-13 a line, of random sign."""
    rng = np.random.default_rng(2)
    for n, step in ((20000, 5e-4), (14286, 7e-4), (2, 1e-3)):
        time, lines = step * np.arange(n), np.arange(1.0, 40.0, 0.1)
        phases = rng.uniform(0, 2 * np.pi, len(lines))
        expected = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
        np.testing.assert_allclose(_cosines(time, lines, phases), expected, rtol=0, atol=1e-10)

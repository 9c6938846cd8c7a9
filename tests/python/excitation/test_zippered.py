"""Multisines that share the lines of one signal."""

from __future__ import annotations

import numpy as np
import pytest

from axisight.errors import InputError
from axisight.excitation import multisine, simultaneous_references, square, zippered

STEP_S = 1e-3


def test_parts_add_up_to_the_signal() -> None:
    signal = multisine(1.0, STEP_S, band_hz=(1.0, 60.0), grid="odd_random", seed=3)
    parts = zippered(signal, 3)
    assert sum(p.period for p in parts) == pytest.approx(signal.period, abs=1e-12)
    assert sum(p.rms**2 for p in parts) == pytest.approx(signal.rms**2)
    assert np.array_equal(np.sort(np.concatenate([p.lines for p in parts])), signal.lines)
    assert all(np.array_equal(p.detection_lines, signal.detection_lines) for p in parts)


def test_one_experiment_with_a_signal_per_input() -> None:
    parts = zippered(multisine(1.0, STEP_S, band_hz=(1.0, 60.0), grid="odd"), 2)
    wave = square(0.5, STEP_S, amplitude=3.0)
    made = simultaneous_references(parts, square=wave, dc_level=[0.5, 0.0])
    assert made.period.shape == (1, 1000, 2)
    expected = np.stack([p.period for p in parts], axis=1) + np.tile(wave.period, 2)[:, None]
    assert made.period[0] == pytest.approx(expected + np.array([0.5, 0.0]))
    assert np.array_equal(made.lines, np.arange(1, 61, 2))
    # Even lines stay free to detect distortion.
    assert np.array_equal(made.detection_lines, np.arange(2, 61, 2))
    assert [s["kind"] for s in made.design["signals"]] == ["multisine", "multisine"]


def test_misuse_is_named() -> None:
    signal = multisine(1.0, STEP_S, lines=[1, 2])
    with pytest.raises(InputError, match="at least 3 lines, got 2"):
        zippered(signal, 3)
    with pytest.raises(InputError, match="for input 2"):
        simultaneous_references([signal, multisine(2.0, STEP_S, lines=[1])])
    with pytest.raises(InputError, match="at least one multisine"):
        simultaneous_references([])

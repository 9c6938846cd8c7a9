"""Records of repeated experiments under a periodic excitation, cut into whole periods.

The one DFT convention, for records of N samples a period at sample time T:
``X(k) = sum_n x(n T) exp(-2 pi i k n / N)``, without scale; line k lies at ``k / (N T)`` Hz.
Ratios of DFTs (frequency responses) do not depend on the scale; amplitudes are
``2 |X(k)| / N``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]
Lines = NDArray[np.int64]


@dataclass(frozen=True)
class PeriodicRecords:
    """Whole periods of several experiments at one operating point.

    All arrays are float64 with axes (experiment, period, sample, channel); a realization of
    the excitation is n_inputs experiments in a row.

    sample_time_s
        Sample time T [s].
    input, output
        Input u, (n_experiments, n_periods, n_samples, n_inputs), and output y with n_outputs
        channels.
    lines
        Excited lines k, ascending, 1 <= k < n_samples / 2; frequencies ``k / (N T)``.
    reference
        Reference r, as the input with n_references channels; None if it was not recorded.
    input_unit, output_unit
        Units, for labels.
    detection_lines
        Lines left free of excitation to detect nonlinear distortion.

    Raises InputError naming the field for a wrong shape, a non-finite value (with its
    place), lines out of range or out of order, and a sample time that is not positive.
    """

    sample_time_s: float
    input: Real
    output: Real
    lines: Lines
    reference: Real | None = None
    input_unit: str = "Nm"
    output_unit: str = "rad"
    detection_lines: Lines = field(default_factory=lambda: np.empty(0, np.int64))

    def __post_init__(self) -> None:
        """Check everything and hold contiguous float64 arrays."""
        if not (np.isfinite(self.sample_time_s) and self.sample_time_s > 0):
            raise InputError(f"sample_time_s: expected a positive time, got {self.sample_time_s}")
        for name in ("input", "output", "reference"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _signal(name, value))
        for name in ("output", "reference"):
            value = getattr(self, name)
            if value is not None and value.shape[:3] != self.input.shape[:3]:
                raise InputError(
                    f"{name}: expected (experiment, period, sample) {self.input.shape[:3]} "
                    f"as the input, got {value.shape[:3]}"
                )
        for name in ("lines", "detection_lines"):
            object.__setattr__(self, name, self._lines(name))
        if not len(self.lines):
            raise InputError("lines: expected at least one excited line, got none")

    def _lines(self, name: str) -> Lines:
        lines = np.asarray(getattr(self, name))
        if lines.ndim != 1 or (lines.size and not np.array_equal(lines, lines.astype(np.int64))):
            raise InputError(f"{name}: expected a list of whole numbers, got {lines!r}")
        lines = lines.astype(np.int64)
        limit = self.n_samples / 2
        outside = lines[(lines < 1) | (lines >= limit)]
        if outside.size:
            raise InputError(
                f"{name}: expected lines from 1 to below {limit:g} (Nyquist), got {outside[0]}"
            )
        if np.any(np.diff(lines) <= 0):
            raise InputError(f"{name}: expected ascending lines without repetition")
        return lines

    @property
    def n_experiments(self) -> int:
        """Number of experiments."""
        return int(self.input.shape[0])

    @property
    def n_periods(self) -> int:
        """Number of periods of each experiment."""
        return int(self.input.shape[1])

    @property
    def n_samples(self) -> int:
        """Samples N of a period."""
        return int(self.input.shape[2])

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return int(self.input.shape[3])

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return int(self.output.shape[3])

    @property
    def frequency_hz(self) -> Real:
        """Frequencies of the excited lines [Hz]."""
        return np.asarray(self.lines / (self.n_samples * self.sample_time_s))


def _signal(name: str, value: Real) -> Real:
    array = np.ascontiguousarray(value, dtype=np.float64)
    if array.ndim != 4 or 0 in array.shape:
        raise InputError(
            f"{name}: expected axes (experiment, period, sample, channel), none empty, "
            f"got shape {array.shape}"
        )
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        e, p, n, c = bad[0]
        raise InputError(
            f"{name}: expected finite numbers, got {array[e, p, n, c]} in experiment {e + 1}, "
            f"period {p + 1}, sample {n + 1}, channel {c + 1} ({len(bad)} in all)"
        )
    return array

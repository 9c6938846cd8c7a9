"""Records of repeated experiments under a periodic excitation, cut into whole periods.

The DFT convention everywhere, for records of N samples per period at sample time T:
``X(k) = sum_n x(n T) exp(-2 pi i k n / N)``, without scale; line k lies at ``k / (N T)`` Hz.
Ratios of DFTs (frequency responses) do not depend on the scale; amplitudes are
``2 |X(k)| / N``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from axisight.arguments import Lines, Real, lines_below, positive, words
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.records.signal_checks import recorded

_AXES = ("experiment", "period", "sample", "channel")


@summarized
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
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        for name in ("input", "output", "reference"):
            value = getattr(self, name)
            if value is not None or name != "reference":
                object.__setattr__(self, name, recorded(name, value, _AXES))
        for name in ("output", "reference"):
            value = getattr(self, name)
            if value is not None and value.shape[:3] != self.input.shape[:3]:
                raise InputError(
                    f"{name}: expected (experiment, period, sample) {self.input.shape[:3]} "
                    f"as the input, got {value.shape[:3]}"
                )
        for name in ("lines", "detection_lines"):
            object.__setattr__(self, name, lines_below(name, getattr(self, name), self.n_samples))
        if not len(self.lines):
            raise InputError("lines: expected at least one excited line, got none")
        twice = np.intersect1d(self.lines, self.detection_lines)
        if twice.size:
            raise InputError(f"detection_lines: expected lines without excitation, got {twice[0]}")
        for name in ("input_unit", "output_unit"):
            words(name, getattr(self, name))

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

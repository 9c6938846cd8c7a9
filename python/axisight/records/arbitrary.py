"""Records of experiments under any excitation, periodic or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]


@dataclass(frozen=True)
class ArbitraryRecords:
    """Experiments of equal length at one operating point, under any excitation.

    Arrays are float64 with axes (experiment, sample, channel); a single experiment may be
    given as (sample, channel). Line k of a record of N samples lies at ``k / (N T)`` Hz.

    sample_time_s
        Sample time T [s].
    input, output
        Input u, (n_experiments, n_samples, n_inputs), and output y with n_outputs channels.
    input_unit, output_unit
        Units, for labels.

    Raises InputError naming the field for a wrong shape, a non-finite value (with its
    place) and a sample time that is not positive.
    """

    sample_time_s: float
    input: Real
    output: Real
    input_unit: str = "Nm"
    output_unit: str = "rad"

    def __post_init__(self) -> None:
        """Check everything and hold contiguous float64 arrays."""
        if not (np.isfinite(self.sample_time_s) and self.sample_time_s > 0):
            raise InputError(f"sample_time_s: expected a positive time, got {self.sample_time_s}")
        for name in ("input", "output"):
            object.__setattr__(self, name, _signal(name, getattr(self, name)))
        if self.output.shape[:2] != self.input.shape[:2]:
            raise InputError(
                f"output: expected (experiment, sample) {self.input.shape[:2]} as the input, "
                f"got {self.output.shape[:2]}"
            )

    @property
    def n_experiments(self) -> int:
        """Number of experiments."""
        return int(self.input.shape[0])

    @property
    def n_samples(self) -> int:
        """Samples N of a record."""
        return int(self.input.shape[1])

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return int(self.input.shape[2])

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return int(self.output.shape[2])


def _signal(name: str, value: Real) -> Real:
    array = np.asarray(value, dtype=np.float64)
    array = np.ascontiguousarray(array[None] if array.ndim == 2 else array)
    if array.ndim != 3 or 0 in array.shape:
        raise InputError(
            f"{name}: expected axes (experiment, sample, channel), none empty, "
            f"got shape {np.shape(value)}"
        )
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        e, n, c = bad[0]
        raise InputError(
            f"{name}: expected finite numbers, got {array[e, n, c]} in experiment {e + 1}, "
            f"sample {n + 1}, channel {c + 1} ({len(bad)} in all)"
        )
    return array

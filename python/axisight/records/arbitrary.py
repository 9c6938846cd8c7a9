"""Records of experiments under any excitation, periodic or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from axisight.arguments import Real, positive, words
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.records.signal_checks import recorded

_AXES = ("experiment", "sample", "channel")


@summarized
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
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        for name in ("input", "output"):
            value = getattr(self, name)
            single = isinstance(value, np.ndarray) and value.ndim == 2
            value = recorded(name, value[None] if single else value, _AXES)
            object.__setattr__(self, name, value)
        for name in ("input_unit", "output_unit"):
            words(name, getattr(self, name))
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

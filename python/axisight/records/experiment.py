"""One experiment as it was recorded, before it is cut into periods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs import Log

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Experiment:
    """Signals of one experiment on a uniform time grid.

    sample_time_s
        Sample time T [s].
    input, output
        Input u, (n, n_inputs), and output y, (n, n_outputs); (n,) is one channel.
    reference
        Reference r, (n, n_references); None if it was not recorded.
    name
        For messages.

    Raises InputError naming the field for a wrong shape, signals of different lengths, a
    non-finite value (with its place) and a sample time that is not positive.
    """

    sample_time_s: float
    input: Real
    output: Real
    reference: Real | None = None
    name: str = ""

    def __post_init__(self) -> None:
        """Check everything and hold float64 arrays (n, channels)."""
        if not (np.isfinite(self.sample_time_s) and self.sample_time_s > 0):
            raise InputError(f"sample_time_s: expected a positive time, got {self.sample_time_s}")
        for name in ("input", "output", "reference"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _signal(name, value))
        for name in ("output", "reference"):
            value = getattr(self, name)
            if value is not None and len(value) != len(self.input):
                raise InputError(
                    f"{name}: expected {len(self.input)} samples as the input, got {len(value)}"
                )

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return int(self.input.shape[0])


def _signal(name: str, value: Real) -> Real:
    array = np.array(value, dtype=np.float64)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or 0 in array.shape:
        raise InputError(f"{name}: expected shape (n, channels), none empty, got {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        n, c = bad[0]
        raise InputError(
            f"{name}: expected finite numbers, got {array[n, c]} at sample {n + 1}, "
            f"channel {c + 1} ({len(bad)} in all)"
        )
    return array


def experiment_of_log(
    log: Log, *, output: Literal["position", "velocity", "joint_position"] = "position"
) -> Experiment:
    """Return the experiment a log holds: torque as input, velocity reference as reference.

    Channels are the log's axes. ``output`` names what is the output. Raises InputError if
    the log does not have it, or has it on some axes only.
    """
    field = {"velocity": "velocity_rad_s"}.get(output, f"{output}_rad")
    if field not in ("position_rad", "velocity_rad_s", "joint_position_rad"):
        raise InputError(
            f"output: expected 'position', 'velocity' or 'joint_position', got {output!r}"
        )
    values = getattr(log, field)
    if values is None:
        raise InputError(f"output: log {log.name!r} has no {output}")
    return Experiment(
        log.sample_time_s, log.torque_nm, values, log.velocity_ref_rad_s, name=log.name
    )

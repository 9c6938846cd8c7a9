"""One experiment as it was recorded, before it is cut into periods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from axisight.arguments import Real, instance, one_of, positive, real_array, words
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.logs import Log
from axisight.records.signal_checks import recorded


@summarized
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
        Name for messages.

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
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        words("name", self.name)
        for name in ("input", "output", "reference"):
            value = getattr(self, name)
            if value is not None or name != "reference":
                array = real_array(value)
                rows = array[:, None] if array is not None and array.ndim == 1 else value
                copy = recorded(name, rows, ("sample", "channel")).copy()
                object.__setattr__(self, name, copy)
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


def experiment_of_log(
    log: Log, *, output: Literal["position", "velocity", "joint_position"] = "position"
) -> Experiment:
    """Return the experiment in a ``log``: torque [Nm] as input, velocity reference [rad/s] as reference.

    The channels are the axes of the log. ``output`` selects its output: position [rad], velocity [rad/s] or
    joint_position [rad]. Raises InputError if the log lacks that signal on any axis, and if it has no torque.
    """
    instance("log", log, Log)
    one_of("output", output, ("position", "velocity", "joint_position"))
    field = {"velocity": "velocity_rad_s"}.get(output, f"{output}_rad")
    values = getattr(log, field)
    if values is None:
        raise InputError(f"output: log {log.name!r} has no {output}")
    return Experiment(
        log.sample_time_s, log.torque_nm, values, log.velocity_ref_rad_s, name=log.name
    )

"""The estimators by name, the automatic choice among them, and their call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

from axisight import frf
from axisight.arguments import Lines, counted
from axisight.errors import InputError
from axisight.frf.quantity import Quantity
from axisight.records import ArbitraryRecords, PeriodicRecords

Estimator = Literal[
    "auto",
    "mfrf",
    "h1",
    "h2",
    "joint_input_output",
    "robust",
    "fast",
    "local_polynomial",
    "local_rational",
    "local_joint_input_output",
    "spectral",
]
Mean = Literal["arithmetic", "logarithmic", "harmonic", "none"]
ESTIMATORS: tuple[str, ...] = get_args(Estimator)
MEANS: tuple[str, ...] = get_args(Mean)

FROM_REFERENCES = ("joint_input_output", "local_joint_input_output")
"""Estimators that need the references."""

_LOCAL = ("local_polynomial", "local_rational")
_OF_ANY = ("auto", *_LOCAL, "spectral")
# Free lines of the same parity from which the fast method takes the distortion at a line.
_LEAST_FREE = 6
# Lines of a spectral window for each input, so that its spectra have an inverse and some freedom is left.
_LINES_PER_INPUT = 8
_MEANS: dict[str, Callable[..., xr.Dataset]] = {
    "arithmetic": frf.arithmetic_mean,
    "logarithmic": frf.logarithmic_mean,
    "harmonic": frf.harmonic_mean,
}
_PERIODIC: dict[str, Callable[..., xr.Dataset]] = {
    "mfrf": frf.mfrf,
    "h1": frf.h1,
    "h2": frf.h2,
    "joint_input_output": frf.joint_input_output,
    "local_joint_input_output": frf.local_joint_input_output,
    "robust": frf.robust_method,
}


@dataclass(frozen=True)
class Choice:
    """An estimator, the mean over realizations, and the reason of the choice; empty if both were given."""

    estimator: str
    mean: str
    reason: str = ""


def chosen_of_periodic(
    records: PeriodicRecords, *, estimator: str, mean: str | None, count: int, settled: bool
) -> Choice:
    """Return the estimator of periodic records.

    ``count`` is the number of whole realizations; ``settled``: whether a steady state was reached. Raises
    InputError for a mean without two realizations or with another estimator than MFRF.
    """
    n, total = records.n_inputs, records.n_experiments
    if mean not in (None, "none"):
        if estimator not in ("auto", "mfrf"):
            raise InputError(
                f"average: expected the estimator mfrf beside it, got {estimator}; {estimator} does not "
                "average responses"
            )
        if count < 1:
            raise InputError(
                f"average: expected whole realizations, {counted(n, 'experiment')} each that excite all "
                f"axes, got {counted(total, 'experiment')}"
            )
        return Choice("mfrf", str(mean))
    if estimator != "auto":
        return Choice(estimator, "none")
    if total < n:
        return Choice(
            # From the references there is no bias by noise in the loop.
            "local_rational" if records.reference is None else "local_joint_input_output",
            "none",
            f"{counted(total, 'experiment')} for {n} axes: neighbouring lines have to tell the axes apart",
        )
    if count > 1 and mean is None:
        return Choice("mfrf", "logarithmic", f"{count} realizations")
    if total > n:
        return Choice("mfrf", "none", "more experiments than axes, fitted by least squares")
    return _of_one_realization(records, settled)


def _of_one_realization(records: PeriodicRecords, settled: bool) -> Choice:
    if records.n_periods < 2:
        reason = "one period: the scatter over neighbouring lines gives the variance"
        return Choice("local_rational", "none", reason)
    if not settled:
        reason = "no steady state was reached: the estimator removes the transient"
        return Choice("local_polynomial", "none", reason)
    if _free_enough(records):
        reason = "one realization with lines that are free of excitation, which show distortion"
        return Choice("fast", "none", reason)
    return Choice("mfrf", "none", "one realization, all lines of the band excited")


def _free_enough(records: PeriodicRecords) -> bool:
    """Whether the free lines in the band have the parity of every excited line, and are several."""
    free = records.detection_lines
    if not free.size:
        free = np.setdiff1d(np.arange(records.lines[0], records.lines[-1]), records.lines)
    counts = [np.sum(free % 2 == parity) for parity in set((records.lines % 2).tolist())]
    return bool(min(counts) >= _LEAST_FREE)


def chosen_of_arbitrary(estimator: str, mean: str | None) -> Choice:
    """Return the estimator of records without a period; raise InputError for one that needs a period."""
    if estimator not in _OF_ANY or mean not in (None, "none"):
        given = estimator if estimator not in _OF_ANY else f"average {mean}"
        raise InputError(
            f"estimator: expected {', '.join(_OF_ANY[1:])} for logs that do not repeat, got {given}; give "
            "period_s if they do"
        )
    if estimator != "auto":
        return Choice(estimator, "none")
    return Choice("local_rational", "none", "the logs do not repeat")


def estimate_periodic(
    records: PeriodicRecords,
    choice: Choice,
    quantity: Quantity,
    bandwidth_hz: float | None,
) -> xr.Dataset:
    """Return the response of periodic records in steady state.

    Raises InputError as the estimators do, and for fewer experiments than inputs whose lines do not tell the
    inputs apart.
    """
    name = choice.estimator
    options: dict[str, Any] = {"quantity": quantity}
    if choice.mean != "none":
        return _MEANS[choice.mean](records, **options)
    if name == "fast":
        return frf.fast_method(records, **options).response
    if name == "spectral":
        width = _bandwidth(records.frequency_hz, records.n_inputs, bandwidth_hz)
        return frf.spectral_analysis(records, bandwidth_hz=width, **options)
    if name in _LOCAL:
        few = records.n_experiments < records.n_inputs or records.n_periods == 1
        if not few:
            return _local(name)(records, **options)
        return _by_neighbours(records, name, options)
    if name == "local_joint_input_output":
        _expect_told_apart(records, _told_apart(records))
    return _PERIODIC[name](records, **options)


def _by_neighbours(records: PeriodicRecords, name: str, options: dict[str, Any]) -> xr.Dataset:
    """Return the response from one mean period of each experiment, whose neighbouring lines differ."""
    mean = ArbitraryRecords(
        records.sample_time_s,
        records.input.mean(axis=1),
        records.output.mean(axis=1),
        input_unit=records.input_unit,
        output_unit=records.output_unit,
    )
    found = _local(name)(mean, lines=records.lines, **options)
    by_inputs = float(np.mean(found["condition"].values < _WORST_CONDITION))
    by_references = 1.0 if records.reference is None else _told_apart(records)
    _expect_told_apart(records, min(by_inputs, by_references))
    return found


def _expect_told_apart(records: PeriodicRecords, share: float) -> None:
    """Raise InputError for fewer experiments than axes that tell the axes apart at too small a share of the lines."""
    if records.n_experiments < records.n_inputs and share < _TOLD_APART:
        raise InputError(
            f"logs: expected at least {counted(records.n_inputs, 'experiment')} for {records.n_inputs} axes, or "
            f"axes excited at different lines, got {counted(records.n_experiments, 'experiment')} that excite "
            f"too few directions at neighbouring lines; record the missing experiments, or estimate fewer axes"
        )


def _told_apart(records: PeriodicRecords) -> float:
    """Return the share of the lines around which the references excite all axes, each in its own way.

    Noise and friction make torques differ from line to line. References tell what the experiments excite.
    """
    assert records.reference is not None  # checked before
    mean = records.reference.mean(axis=1)
    spectra = np.fft.rfft(mean, axis=1)[:, records.lines]
    spectra /= np.maximum(np.sqrt((np.abs(spectra) ** 2).mean(axis=(0, 1))), 1e-300)
    reach = _NEIGHBOURS * records.n_inputs
    windows = (
        spectra[:, max(k - reach, 0) : k + reach + 1].reshape(-1, spectra.shape[2])
        for k in range(spectra.shape[1])
    )
    return float(np.mean([np.linalg.cond(x) < _WORST_OF_REFERENCES for x in windows]))


# Smallest share of the lines at which fewer experiments than axes have to tell the axes apart.
_TOLD_APART = 0.5
# Lines on either side for each axis in which references must differ, and the worst condition number of a window.
_NEIGHBOURS = 3
_WORST_OF_REFERENCES = 30.0
# Beyond, the inputs within a window are the same but for noise.
_WORST_CONDITION = 1e3


def estimate_arbitrary(
    records: ArbitraryRecords,
    lines: Lines,
    choice: Choice,
    quantity: Quantity,
    bandwidth_hz: float | None,
) -> xr.Dataset:
    """Return the response of records without a period, at the given lines of the record."""
    if choice.estimator != "spectral":
        return _local(choice.estimator)(records, lines=lines, quantity=quantity)
    whole = PeriodicRecords(
        records.sample_time_s,
        records.input[:, None],
        records.output[:, None],
        lines,
        input_unit=records.input_unit,
        output_unit=records.output_unit,
    )
    width = _bandwidth(whole.frequency_hz, records.n_inputs, bandwidth_hz)
    return frf.spectral_analysis(whole, bandwidth_hz=width, taper="hann", quantity=quantity)


def _local(name: str) -> Callable[..., xr.Dataset]:
    return frf.local_rational if name == "local_rational" else frf.local_polynomial


def _bandwidth(frequency_hz: np.ndarray[Any, Any], n_inputs: int, given: float | None) -> float:
    """Return the given half width of the spectral window [Hz], or one of eight lines for each input."""
    if given is not None:
        return given
    if len(frequency_hz) < 2:
        raise InputError("bandwidth_hz: expected one, as there is only one line, got none")
    return float(_LINES_PER_INPUT * n_inputs * np.median(np.diff(frequency_hz)) / 2)

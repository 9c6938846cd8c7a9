"""Measured frequency responses from logs, for comparison with the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.frf import invert, right_divide, spectral_analysis
from axisight.logs import Log
from axisight.records.periodic import PeriodicRecords

Array = NDArray[np.float64]

# Half width of the frequency window, and the least number of lines it must span.
_BANDWIDTH_HZ = 1.0
_LEAST_LINES = 8
# Largest relative standard error of a gain that is shown.
_UNSURE = 0.3
# Most dots per curve.
_DOTS = 120


def measured_gains(logs: Sequence[Log]) -> tuple[Array, Array] | None:
    """Return frequencies [Hz] (n_freq,) and gains (n_freq, n_outputs, n_inputs) [rad/Nm] from logs.

    The gain from motor torques to motor angles is the response of the angles to the velocity references,
    divided by that of the torques (joint input-output method, Wernholt (2004), section 3.4.2). Each response
    is a spectral analysis of all logs that have the most common length. Any excitation will do, and noise in
    the loop causes no bias. A gain is NaN if its standard error is above 0.3 of it, with noise and distortion
    taken as independent.

    Returns None without references, and if logs are too few or too short to separate the axes.
    """
    lengths = [len(log.time_s) for log in logs if log.velocity_ref_rad_s is not None]
    if not lengths:
        return None
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    kept = [log for log in logs if len(log.time_s) == usual and log.velocity_ref_rad_s is not None]
    try:
        torque, angle = (
            _by_references(kept, [getattr(log, name) for log in kept])
            for name in ("torque_nm", "position_rad")
        )
    except InputError:
        return None
    frequency_hz, to_torque, torque_variance = torque
    _, to_angle, angle_variance = angle
    response, _ = right_divide(to_angle, to_torque)
    # First order: dG = (dY - G dU) U^-1.
    spread = np.abs(invert(to_torque)[0]) ** 2
    power = np.abs(response) ** 2
    variance = (angle_variance + power @ torque_variance) @ spread
    return frequency_hz, np.where(variance <= _UNSURE**2 * power, np.abs(response), np.nan)


def _by_references(
    logs: Sequence[Log], signals: Sequence[Array]
) -> tuple[Array, NDArray[np.complex128], Array]:
    """Return the response of signals to references at some frequencies, and its variance."""
    n, step_s = len(signals[0]), logs[0].sample_time_s
    lines = np.arange(1, (n + 1) // 2)
    references = np.array([log.velocity_ref_rad_s for log in logs])
    records = PeriodicRecords(step_s, references[:, None], np.array(signals)[:, None], lines)
    width = max(_BANDWIDTH_HZ, _LEAST_LINES / (n * step_s))
    found = spectral_analysis(records, bandwidth_hz=width, taper="hann")
    # Lower frequencies would contain static parts smeared by the window.
    first = min(round(1.5 * width * n * step_s), len(lines))
    at = np.unique(np.geomspace(first, len(lines), _DOTS).astype(int) - 1)
    response, variance = (
        np.ascontiguousarray(found[k].values[at]) for k in ("response", "variance")
    )
    return np.asarray(found["frequency_hz"].values[at]), response, variance

"""Make one uniform time grid from time stamps and a declared rate."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field

import numpy as np

from axisight.logs.findings import Finding
from axisight.logs.log import RESAMPLED, Floats
from axisight.logs.mean_rate import whole_rate

JITTER_SAMPLES = 0.01
"""Largest tolerated error of a time stamp, in samples."""
RATE_TOLERANCE = 1e-4
"""Largest relative difference between two rates that still count as equal."""
SHORTEST_S = 1.0
"""Shortest log that is read (s)."""
STEPS_S = (1e-9, 1e6)
"""Shortest and longest sample time that is read (s); logs of machines lie well inside."""


@dataclass
class Grid:
    """A uniform grid; `stamps_s` is None unless signals must be interpolated from the stamps onto it.

    `sample_time_s` is None if the rate could not be determined.
    """

    sample_time_s: float | None = None
    n_samples: int = 0
    stamps_s: Floats | None = None
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def error(self, column: str, message: str, name: str) -> None:
        """Add an error with its stable name to the findings."""
        self.findings.append(Finding("error", column, message, name))


def make_grid(
    time_s: Floats | None,
    rate_hz: float | None,
    n_samples: int,
    *,
    label: str = "time",
    unmapped: str | None = None,
    resample_hz: float | None = None,
    most_samples: int = 2**62,
) -> Grid:
    """Return the uniform grid of a log, with findings about its time stamps.

    `time_s` (n,) (s) are the stamps, `rate_hz` (Hz) the declared rate, each None if unknown; `n_samples` is
    the length of the signals. Stamps that are off by up to 1 % of a sample are replaced by the uniform grid.
    `resample_hz` (Hz) resamples irregular stamps, unless that gives more than `most_samples`. Findings call
    the stamps `label`. `unmapped` is the file of a log without a column map, for the advice in a message.
    """
    grid = Grid(n_samples=n_samples)
    for name, rate in (("sample_rate_hz", rate_hz), ("resample_hz", resample_hz)):
        if rate is not None and not STEPS_S[0] <= 1.0 / rate <= STEPS_S[1]:
            message = f"expected {1 / STEPS_S[1]:g} to {1 / STEPS_S[0]:g} Hz, got {rate:g} Hz"
            grid.error(name, message, "sample_time_differs")
            return grid
    if time_s is None:
        if rate_hz is not None:
            grid.sample_time_s = 1.0 / rate_hz
    elif _usable(grid, time_s, label):
        if resample_hz is None:
            _check_uniform(grid, time_s, label, unmapped)
            grid.n_samples = time_s.size
        else:
            _resample(grid, time_s, resample_hz, label, most_samples)
        if rate_hz is not None:
            _agree(grid, rate_hz, label)
    if grid.sample_time_s is not None:
        duration = grid.n_samples * grid.sample_time_s
        if duration < SHORTEST_S * (1.0 - 1e-6):
            grid.error(
                label,
                f"expected at least {SHORTEST_S:g} s of samples, got {duration:.6g} s",
                "log_too_short",
            )
    return grid


def _usable(grid: Grid, time_s: Floats, label: str) -> bool:
    """Return whether stamps are finite, increase strictly and have plausible steps; add the error if not."""
    if time_s.size < 2:
        grid.error(label, f"expected at least 2 time stamps, got {time_s.size}", "log_too_short")
        return False
    bad = np.flatnonzero(~np.isfinite(time_s))
    if bad.size:
        grid.error(
            label,
            f"expected finite time stamps, got {bad.size} NaN/inf, first at index {bad[0]}",
            "not_finite",
        )
        return False
    with np.errstate(
        over="ignore"
    ):  # an infinite step is positive, so it passes here and fails below
        back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        first = int(back[0])
        grid.error(
            label,
            f"expected strictly increasing time, got {back.size} steps that do not increase, first "
            f"at index {first + 1} ({time_s[first]:.9g} s then {time_s[first + 1]:.9g} s)",
            "time_not_increasing",
        )
        return False
    step = (time_s[-1] / time_s.size) - (
        time_s[0] / time_s.size
    )  # the difference first might overflow
    if not STEPS_S[0] <= step <= STEPS_S[1]:
        grid.error(
            label,
            f"expected steps of {STEPS_S[0]:g} to {STEPS_S[1]:g} s, got {step:.6g} s: another unit of time?",
            "sample_time_differs",
        )
        return False
    return True


def _check_uniform(grid: Grid, time_s: Floats, label: str, unmapped: str | None) -> None:
    steps = np.diff(time_s)
    typical = float(np.median(steps))
    gaps = np.flatnonzero(steps > 1.5 * typical)
    if gaps.size:
        first = int(gaps[0])
        lost = int(np.rint(steps[gaps] / typical - 1.0).sum())
        grid.sample_time_s = typical
        grid.error(
            label,
            f"expected uniform sampling, got {gaps.size} gaps ({lost} samples missing), first "
            f"after index {first} ({steps[first]:.6g} s instead of {typical:.6g} s)",
            "rows_missing",
        )
        return
    mean = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    drift = np.abs(time_s - time_s[0] - mean * np.arange(time_s.size)) / mean
    # Two stamps bound a step, so its error may be twice that of one stamp.
    jitter = np.abs(steps / mean - 1.0) / 2.0
    grid.sample_time_s = _round(mean)
    if jitter.max() > JITTER_SAMPLES * (1.0 + 1e-6) or drift.max() > 0.5:
        worst = int(jitter.argmax())
        grid.error(
            label,
            f"expected uniform sampling within {JITTER_SAMPLES:.0%} of a sample, got a step of "
            f"{steps[worst]:.6g} s instead of {mean:.6g} s after index {worst}; "
            f"{_remedy(1.0 / mean, unmapped)}",
            "time_jitter",
        )
    elif jitter.max() > 1e-6:
        grid.notes.append(
            f"time stamps replaced by the uniform grid (jitter {jitter.max():.2g} of a sample)"
        )


def _remedy(rate_hz: float, unmapped: str | None) -> str:
    """Return advice for stamps that are not uniform, with the lines of a column map."""
    rate = f"{whole_rate(rate_hz):.6g}"
    where = "of the column map"
    if unmapped is not None:
        where = (
            f"of a column map for --columns, which `axisight columns guess {shlex.quote(unmapped)} "
            f"-o columns.toml` proposes"
        )
    return (
        f"put them on a grid by the line resample_hz = {rate} in [time] {where}; if the samples are in truth "
        f"uniform, by sample_rate_hz = {rate} at its top instead of [time]"
    )


def _resample(
    grid: Grid, time_s: Floats, resample_hz: float, label: str, most_samples: int
) -> None:
    span = float(time_s[-1] - time_s[0])
    n_samples = int(np.floor(span * resample_hz * (1.0 + 1e-12))) + 1
    if n_samples > most_samples:
        message = (
            f"expected at most {most_samples} samples from a log of this size, got {span:g} s at "
            f"{resample_hz:g} Hz; max_bytes (--max-bytes) raises the limit"
        )
        grid.error("resample_hz", message, "sample_time_differs")
        return
    grid.sample_time_s = 1.0 / resample_hz
    grid.n_samples = n_samples
    grid.stamps_s = time_s - time_s[0]
    steps = np.diff(time_s)
    if steps.max() > 1.5 * np.median(steps):
        message = (
            f"steps of up to {steps.max():.4g} s (typically {np.median(steps):.4g} s) bridged by a "
            "straight line"
        )
        grid.findings.append(Finding("warning", label, message))
        grid.notes.append(message)
    grid.notes.append(f"{RESAMPLED} from {time_s.size} irregular stamps to {resample_hz:g} Hz")


def _agree(grid: Grid, rate_hz: float, label: str) -> None:
    if grid.sample_time_s is None or grid.stamps_s is not None:
        return
    measured = 1.0 / grid.sample_time_s
    if abs(measured / rate_hz - 1.0) > RATE_TOLERANCE:
        grid.error(
            label,
            f"expected time stamps at sample_rate_hz = {rate_hz:g} Hz, got {measured:.6g} Hz",
            "sample_time_differs",
        )
    else:
        grid.sample_time_s = 1.0 / rate_hz


def _round(step_s: float) -> float:
    """Return the step of the nearest whole rate if it differs by less than 1 ppm, else the step itself.

    Single-precision stamps round by as much, and no clock of a controller is more accurate.
    """
    rate = round(1.0 / step_s)
    if rate > 0 and abs(step_s * rate - 1.0) < 1e-6:
        return 1.0 / rate
    return step_s

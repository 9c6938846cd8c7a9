"""Explanation of flags in words."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import Complex, instance
from axisight.errors import InputError
from axisight.frf._lines import SMALLEST, spectra
from axisight.frf.response import Flag, estimate_of
from axisight.records.periodic import PeriodicRecords

REASON = {
    Flag.RANK_DEFICIENT: "the experiments do not excite all inputs independently; no estimate",
    Flag.ILL_CONDITIONED: "estimated, but errors are amplified more than a thousandfold or the "
    "weakest direction of the input is lost in noise",
    Flag.NO_EXCITATION: "an input has no amplitude; no estimate",
}


def explain_flags(dataset: xr.Dataset, records: PeriodicRecords | None = None) -> list[str]:
    """Return one sentence for each run of flagged lines, with the reason, and for each dead output.

    dataset
        The Dataset of an estimator.
    records
        The records of the estimate. With them the sentences name the inputs without amplitude, or the
        combination of inputs that no experiment excites (each input scaled to its own amplitude).

    A dead output does not change: its response is zero, though the lines are good. Returns an empty list if
    every line is good and no output is dead. Raises InputError if ``dataset`` has no flags or
    ``records`` has other lines.
    """
    estimate_of("dataset", dataset)
    frequency = dataset["frequency_hz"].values
    flag = dataset["flag"].values
    u = None
    if records is not None:
        instance("records", records, PeriodicRecords)
        if records.frequency_hz.shape != frequency.shape or not np.allclose(
            records.frequency_hz, frequency, rtol=1e-9, atol=0
        ):
            raise InputError("records: expected the lines of the dataset")
        u, _ = spectra(records, "position", remove_drift=False, threads=1)
        u = u.mean(axis=3)
    edges = np.flatnonzero(np.diff(flag)) + 1
    runs = np.split(np.arange(len(flag)), edges)
    flagged = [
        _sentence(run, Flag(flag[run[0]]), frequency, u)
        for run in runs
        if len(run) and flag[run[0]] != Flag.GOOD
    ]
    return flagged + (_still(dataset) if records is None else _constant(records))


def _constant(records: PeriodicRecords) -> list[str]:
    """Return a sentence for each recorded output that does not change in any experiment."""
    flat = records.output.reshape(-1, records.n_outputs)
    return [
        f"output {o + 1}: expected it to change, got {flat[0, o]:g} throughout: the channel is dead, its "
        f"response says nothing about the robot"
        for o in np.flatnonzero(np.ptp(flat, axis=0) == 0.0)
    ]


def _still(dataset: xr.Dataset) -> list[str]:
    """Return a sentence for each output whose response is zero wherever there is one."""
    response = dataset["response"].values
    known = np.isfinite(response).all(axis=(1, 2))
    zero = (response[known] == 0).all(axis=(0, 2)) & bool(known.any())
    return [
        f"output {o + 1}: expected a response, got zero at every line: the channel is dead"
        for o in np.flatnonzero(zero)
    ]


def _sentence(
    run: NDArray[np.int64], flag: Flag, frequency: NDArray[np.float64], u: Complex | None
) -> str:
    first, last = frequency[run[0]], frequency[run[-1]]
    where = f"{first:g} Hz" if len(run) == 1 else f"{first:g} to {last:g} Hz ({len(run)} lines)"
    text = f"{where}: {flag.name.lower().replace('_', ' ')}: {REASON[flag]}"
    return text if u is None else f"{text}; {_blame(u, run, flag)}"


def _blame(u: Complex, run: NDArray[np.int64], flag: Flag) -> str:
    norm = np.linalg.norm(u, axis=2)
    if flag == Flag.NO_EXCITATION:
        silent = np.any(norm[run] <= SMALLEST * norm.max(axis=0), axis=0)
        return "input " + ", ".join(str(i + 1) for i in np.flatnonzero(silent))
    line = run[len(run) // 2]
    scaled = u[line] / norm[line][:, None]
    if u.shape[2] < u.shape[1]:
        return f"{u.shape[2]} experiments for {u.shape[1]} inputs"
    left, value, _ = np.linalg.svd(scaled)
    # The phase of the vector is arbitrary, so its largest entry is made real and positive.
    weakest = left[:, -1].conj()
    weakest = weakest * np.exp(-1j * np.angle(weakest[np.argmax(np.abs(weakest))]))
    terms = [
        f"{abs(w):.2g} u{i + 1}"
        + (f" at {np.degrees(np.angle(w)):.0f} deg" if i or abs(np.angle(w)) > 0.01 else "")
        for i, w in enumerate(weakest)
        if abs(w) > 0.05
    ]
    share = value[-1] / value[0]
    return f"least excited: {' + '.join(terms)}, {share:.1e} of the most excited combination"

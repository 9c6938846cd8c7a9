"""Finds logs that are copies of each other: a validation log must not be used for fitting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding, GateSeverity
from axisight.logs import Log

Hashes = NDArray[np.uint64]

# Bits of the finalizer of MurmurHash3 (Appleby, public domain).
_SHIFT = np.uint64(33)
# Share of common rows from which a log is flagged. Rows of different runs are equal only with coarse sensors at
# rest, never with noise.
_SHARED_ROWS = 0.05
# Share of common rows from which a log counts as a copy.
_COPY = 0.5


def check_copies(estimation: Sequence[Log], validation: Sequence[Log]) -> list[Finding]:
    """Return findings about logs that share exactly equal rows of position and torque."""
    out = []
    tables = [_rows(log) for log in (*estimation, *validation)]
    every = np.sort(np.concatenate(tables))
    if not np.any(every[1:] == every[:-1]):  # the normal case
        return []
    fitted, held = tables[: len(estimation)], tables[len(estimation) :]
    for logs, own_tables in ((estimation, fitted), (validation, held)):
        for i, log in enumerate(logs):
            for j in range(i):
                if _shared(own_tables[i], own_tables[j]) >= _COPY:
                    message = (
                        f"expected a new run, got the content of {logs[j].name}. It would count twice. Leave "
                        "this log out"
                    )
                    out.append(Finding("log_repeated", "refuse", message, log.name, None, "file"))
    for log, own in zip(validation, held, strict=True):
        for other, rows in zip(estimation, fitted, strict=True):
            share = _shared(own, rows)
            if share < _SHARED_ROWS:
                continue
            severity: GateSeverity = "refuse" if share >= _COPY else "flag"
            message = (
                f"expected a run that is not used for fitting, got {100 * share:.3g} % of its rows in "
                f"{other.name}. Its gap would be that of the fit. Use another run for validation"
            )
            out.append(
                Finding("validation_copies_estimation", severity, message, log.name, None, "role")
            )
    return out


def _rows(log: Log) -> Hashes:
    """Return the distinct rows of position and torque of a log as hashes of 64 bits, sorted."""
    bits = np.hstack((log.position_rad, log.torque_nm)).view(np.uint64)
    out = np.zeros(len(bits), dtype=np.uint64)
    for column in bits.T:
        # Each bit of a row changes half of the bits of its hash. Two different rows have the same hash with a
        # chance of 1 in 2^64.
        out = _mixed(out ^ column)
    return np.unique(out)


def _mixed(x: Hashes) -> Hashes:
    """Return the finalizer of MurmurHash3 (Appleby, 2008), modulo 2^64."""
    x = (x ^ (x >> _SHIFT)) * np.uint64(0xFF51AFD7ED558CCD)
    x = (x ^ (x >> _SHIFT)) * np.uint64(0xC4CEB9FE1A85EC53)
    return x ^ (x >> _SHIFT)


def _shared(rows: Hashes, other: Hashes) -> float:
    """Return the share of ``rows`` that are also in ``other``."""
    if not rows.size:
        return 0.0
    return np.intersect1d(rows, other, assume_unique=True).size / rows.size

"""Logs that are one another's copies: a validation log must not have been fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.faults import Finding, GateSeverity
from axisight.logs import Log

# Rows of different runs agree to the last bit where sensors are coarse and the machine rests, at
# most; rows with noise never do.
_SHARED_ROWS = 0.05
_COPY = 0.5


def check_copies(estimation: Sequence[Log], validation: Sequence[Log]) -> list[Finding]:
    """Return findings about logs that share rows of position and torque, exactly."""
    out = []
    fitted = [_rows(log) for log in estimation]
    held = [_rows(log) for log in validation]
    for logs, tables in ((estimation, fitted), (validation, held)):
        for i, log in enumerate(logs):
            for j in range(i):
                if _shared(tables[i], tables[j]) >= _COPY:
                    message = (
                        f"expected a new run, got the content of {logs[j].name}: it would count "
                        "twice; take it out"
                    )
                    out.append(Finding("log_repeated", "refuse", message, log.name, None, "file"))
    for log, own in zip(validation, held, strict=True):
        for other, rows in zip(estimation, fitted, strict=True):
            share = _shared(own, rows)
            if share < _SHARED_ROWS:
                continue
            severity: GateSeverity = "refuse" if share >= _COPY else "flag"
            message = (
                f"expected a run that took no part in the fit, got {100 * share:.3g} % of its rows "
                f"in {other.name}: the gap would be that of the fit; hold out another run"
            )
            out.append(
                Finding("validation_copies_estimation", severity, message, log.name, None, "role")
            )
    return out


def _rows(log: Log) -> NDArray[np.void]:
    """Return the distinct rows of position and torque, sorted, as raw bytes."""
    table = np.ascontiguousarray(np.hstack((log.position_rad, log.torque_nm)))
    return np.unique(table.view(np.dtype((np.void, table.shape[1] * 8))).ravel())


def _shared(rows: NDArray[np.void], other: NDArray[np.void]) -> float:
    """Return the share of ``rows`` that ``other`` has too."""
    if not rows.size or rows.dtype != other.dtype:
        return 0.0
    return float(np.isin(rows, other).mean())

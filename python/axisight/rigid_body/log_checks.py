"""Checks of logs against each other, and of fits to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.logs import Log
from axisight.rigid_body.base import BaseParameters
from axisight.rigid_body.findings import FindingKind, IdentificationFinding

Array = NDArray[np.float64]

LEAST_PER_PARAMETER = 5.0
"""Least number of samples of an axis per parameter; with fewer a fit is refused. The filter leaves about
two independent numbers of four samples. With fewer samples the fit of an axis could be nearly exact, and
weights from residuals would then follow that axis alone."""
USUAL_PER_PARAMETER = 10.0
"""With fewer samples per parameter, residuals are clearly too small."""
MISFIT = 0.45
"""Relative torque error above which the model does not explain a log."""
DISAGREEMENT = 10.0
"""Ratio between the torque errors of two logs that noise does not explain."""
DISAGREEMENT_LEAST = 0.05
"""Torque error below which that ratio does not count."""

_REASONS = (
    "check units, signs, the side of the gear and the order of its columns, and whether it is a "
    "log of this robot with this load"
)


def refuse_repeated(logs: Sequence[Log], held_out: Sequence[Log]) -> None:
    """Raise InputError for a log given twice under any name, because the second adds no information."""
    given = [*logs, *held_out]
    for i, log in enumerate(given):
        for other in given[:i]:
            if not _same(log, other):
                continue
            if i < len(logs):
                raise InputError(
                    f"logs: expected different logs, got {log.name} with the content of {other.name}: "
                    "standard errors would come out too small"
                )
            raise InputError(
                f"held_out: expected logs that nothing else uses, got {log.name} with the content "
                f"of {other.name}"
            )


def _same(log: Log, other: Log) -> bool:
    return np.array_equal(log.position_rad, other.position_rad) and np.array_equal(
        log.torque_nm, other.torque_nm
    )


def few_samples(
    base: BaseParameters, motion: tuple[Array, Array, Array], weight: Array
) -> list[IdentificationFinding]:
    """Return a finding if an axis has few samples for its parameters; raises InputError for far too few.

    ``motion`` are q, v, a (n, n_joints), and ``weight`` (n, n_axes) is zero for samples left out. A
    parameter that shows on several axes counts as a fraction on each.
    """
    thinned = (x[:: max(1, len(x) // 200)] for x in motion)
    size = np.abs(base.regressor(*thinned)).max(axis=0)
    shows = size > 1e-9 * size.max(axis=0)
    parameters = (shows / np.maximum(shows.sum(axis=0), 1)).sum(axis=1)
    kept = np.count_nonzero(weight, axis=0)
    per = kept / np.maximum(parameters, 1e-12)
    worst = int(per.argmin())
    if per[worst] >= USUAL_PER_PARAMETER:
        return []
    refused = per[worst] < LEAST_PER_PARAMETER
    least = LEAST_PER_PARAMETER if refused else USUAL_PER_PARAMETER
    text = (
        f"expected {least:g} or more samples per parameter, got {per[worst]:.2g} on "
        f"axis {worst + 1} ({kept[worst]} samples outside reversals for its share of "
        f"{parameters[worst]:.2g} parameters): the fit would follow their noise; take longer or more "
        "logs, a higher cutoff, or a smaller reversal_s"
    )
    if refused:
        raise InputError(f"logs: {text}")
    return [IdentificationFinding(FindingKind.FEW_SAMPLES, text)]


def misfit(errors: xr.Dataset) -> list[IdentificationFinding]:
    """Return findings for logs that the parameters do not explain, or explain far worse than others.

    ``errors`` is that of :class:`LogIdentification`; the check uses its last set of parameters.
    """
    relative = np.nan_to_num(errors["relative_error"].isel(parameters=-1).values)
    logs = [
        f"{name}{' (held out)' if held else ''}"
        for name, held in zip(errors["log"].values, errors["held_out"].values, strict=True)
    ]
    axes = [str(axis) for axis in errors["axis"].values]
    out = []
    for log, row in zip(logs, relative, strict=True):
        bad = np.flatnonzero(row >= MISFIT)
        if len(bad):
            shares = ", ".join(f"{100 * row[i]:.3g} % on axis {axes[i]}" for i in bad)
            text = f"{log}: torque errors are {shares} of the torque; {_REASONS}"
            out.append(IdentificationFinding(FindingKind.MISFIT, text, names=(log,)))
    worst, best = relative.argmax(axis=0), relative.argmin(axis=0)
    columns = np.arange(relative.shape[1])
    high, low = relative[worst, columns], relative[best, columns]
    far = (high >= DISAGREEMENT_LEAST) & (high >= DISAGREEMENT * low) & (low > 0)
    for i in np.flatnonzero(far & (high < MISFIT)):
        text = (
            f"axis {axes[i]}: torque errors of {100 * high[i]:.3g} % on {logs[worst[i]]} and of "
            f"{100 * low[i]:.3g} % on {logs[best[i]]}; {_REASONS}"
        )
        out.append(
            IdentificationFinding(FindingKind.MISFIT, text, names=(logs[worst[i]], logs[best[i]]))
        )
    return out

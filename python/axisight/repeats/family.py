"""One family of tests over axes and parameters, and echoes of a large change in other parameters."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.statistics.holm import holm

Array = NDArray[np.float64]

ECHO = 0.05
"""A change below this share of the largest one may be its echo, both as torques relative to that of the axis.

No regression is exact: a part of every change shows in other parameters, and in closed loop on other axes.
"""


def judged(
    parameters: xr.Dataset, torque: xr.Dataset, level: float
) -> tuple[xr.Dataset, xr.Dataset]:
    """Return both tables with ``p_adjusted`` of one family (Holm), ``echo`` and ``moved``.

    What differs, with a probability ``level`` of any false finding, has moved if it is not an echo.
    """
    n = parameters.sizes["parameter"]
    adjusted = holm(np.concatenate([parameters["p_value"].values, torque["p_value"].values]))
    differs = np.nan_to_num(adjusted, nan=1.0) < level
    on_axis = torque["smooth_between_nm"].values / torque["torque_nm"].values
    size = np.concatenate([parameters["torque_share"].values, on_axis])
    echo = np.zeros(len(size), dtype=bool)
    for part in (slice(None, n), slice(n, None)):
        largest = np.max(size[part], where=differs[part], initial=0.0)
        echo[part] = differs[part] & (size[part] < ECHO * largest)
    moved = differs & ~echo
    parts = {"p_adjusted": adjusted, "echo": echo, "moved": moved}
    return (
        parameters.assign({name: ("parameter", x[:n]) for name, x in parts.items()}),
        torque.assign({name: ("axis", x[n:]) for name, x in parts.items()}),
    )

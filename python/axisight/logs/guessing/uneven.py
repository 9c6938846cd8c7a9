"""The map for a log with native columns and irregular stamps: it adds the rate for resampling."""

from __future__ import annotations

import json
from pathlib import Path

from axisight.logs.columns import AxisColumns
from axisight.logs.lazy import LazyArrays
from axisight.logs.mean_rate import mean_rate_hz
from axisight.logs.native import native_map


def uneven_text(arrays: LazyArrays, path: Path) -> str | None:
    """Return the TOML of the map; None if the stamps are uniform and need no map.

    Raises LogError for a hole in the stamps, and as `native_map`.
    """
    rate = mean_rate_hz(arrays["time_s"], f"{path}: time_s")
    if rate is None:
        return None
    lines = [
        f"# The columns of {json.dumps(path.name)} are the native ones; its stamps are not uniform.",
        'schema = "axisight.columns/1"',
        "",
        "[time]",
        'name = "time_s"',
        'unit = "s"',
        f"resample_hz = {rate:.9g}",
    ]
    for axis in native_map(arrays, str(path)).axis:
        lines += ["", "[[axis]]"]
        for field in AxisColumns.model_fields:
            signal = getattr(axis, field)
            if signal is not None:
                lines.append(f'{field} = {{ name = "{signal.name}", unit = "{signal.unit}" }}')
    return "\n".join(lines) + "\n"

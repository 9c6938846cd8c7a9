"""What is said beside signals: joints, units, how simulator and logs were compared."""

from __future__ import annotations

import json
from collections.abc import Sequence

import xarray as xr

# Of a log, not of all.
_OF_A_LOG = ("log", "role")


def about(signals: Sequence[xr.Dataset]) -> str:
    """Return the metadata of signals as JSON."""
    first = signals[0]
    said = {key: value for key, value in first.attrs.items() if key not in _OF_A_LOG}
    if "lowpass_hz" in said:
        said["note"] = f"all signals are low-passed at {said['lowpass_hz']:.4g} Hz"
    said["joints"] = [str(name) for name in first["joint"].values]
    said["units"] = [str(unit) for unit in first["unit"].values]
    said["signals"] = {str(name): first[name].attrs["long_name"] for name in first.data_vars}
    return json.dumps(said)

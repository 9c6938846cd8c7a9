"""Metadata of signal files: joints, units, and how simulator and logs were compared."""

from __future__ import annotations

import json
from collections.abc import Sequence

import xarray as xr

# Attributes of single logs, which metadata of the whole file must not state.
_OF_A_LOG = ("log", "role")


def about(signals: Sequence[xr.Dataset]) -> str:
    """Return the metadata of the signals of all logs as JSON."""
    first = signals[0]
    said = {key: value for key, value in first.attrs.items() if key not in _OF_A_LOG}
    if "lowpass_hz" in said:
        said["note"] = f"all signals are low-passed at {said['lowpass_hz']:.4g} Hz"
    said["joints"] = [str(name) for name in first["joint"].values]
    said["units"] = [str(unit) for unit in first["unit"].values]
    said["signals"] = {str(name): first[name].attrs["long_name"] for name in first.data_vars}
    return json.dumps(said)

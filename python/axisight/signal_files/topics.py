"""Names of logs in recordings: one prefix for the topics of each log."""

from __future__ import annotations

import re
from collections.abc import Sequence

import xarray as xr

TORQUE, POSITION = "_torque_nm", "_position_rad"
"""Endings of the names of signals, by quantity."""


def prefixes(signals: Sequence[xr.Dataset]) -> list[str]:
    """Return a unique prefix ``/ROLE/LOG`` for the topics of each log, with characters that topics allow."""
    seen: list[str] = []
    for data in signals:
        name = re.sub(r"\W", "_", str(data.attrs["log"]), flags=re.ASCII)
        # In ROS each part of a topic must begin with a letter.
        base = f"/{data.attrs['role']}/{name if name[:1].isalpha() else f'log_{name}'}"
        found, number = base, 1
        while found in seen:
            number += 1
            found = f"{base}_{number}"
        seen.append(found)
    return seen

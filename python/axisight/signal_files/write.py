"""Signals into a file, by how its name ends."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from axisight.errors import InputError
from axisight.signal_files.recording import recording
from axisight.signal_files.table import table
from axisight.signal_files.target import check_target
from axisight.storage import write_bytes


def write_signals(
    signals: Sequence[xr.Dataset], target: Path | str, *, overwrite: bool = False
) -> Path:
    """Write ``signals``, those of `Diagnosis.signals`, and return the file; it appears whole or not at all.

    target
        ``.parquet``: one table of all logs with the columns ``log``, ``role``, ``time_s`` and, by axis,
        ``measured_torque_nm_1``, ``simulated_before_torque_nm_1`` and so on; names of joints, units and how
        simulator and logs were compared stand in its metadata under ``axisight``, as JSON. ``.mcap``: topics
        ``/ROLE/LOG/measured``, ``/ROLE/LOG/simulated_before``, ``simulated_after``, ``residual_before`` and
        ``residual_after`` of ``sensor_msgs/JointState``, torques as effort by the names of joints; every log
        begins at 1 s. What stands in the table's metadata is the message of ``/axisight``.
    overwrite
        Replace a file that exists.

    Raises InputError as `check_target`, and where there are no signals; MissingExtraError for ``.mcap`` without
    rosbags.
    """
    path = Path(target)
    check_target(path, overwrite=overwrite)
    if not signals:
        raise InputError("signals: expected those of diagnose(..., signals=True), got none")
    made = table(signals) if path.suffix.lower() == ".parquet" else recording(signals)
    write_bytes(path, made)
    return path

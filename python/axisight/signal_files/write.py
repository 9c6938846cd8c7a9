"""Write signals to a file in the format of its suffix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from axisight.errors import InputError
from axisight.signal_files.foxglove import layout
from axisight.signal_files.recording import recording
from axisight.signal_files.rerun_file import rerun_file
from axisight.signal_files.table import table
from axisight.signal_files.target import check_target, files_of
from axisight.storage import write_bytes, write_whole


def write_signals(
    signals: Sequence[xr.Dataset], target: Path | str, *, overwrite: bool = False
) -> Path:
    """Write ``signals`` and return the path of the file; each file appears whole or not at all.

    signals
        The datasets of `Diagnosis.signals`, one per log.
    target
        File to write; its suffix chooses the format.

        ``.parquet`` is one table of all logs. Its columns are ``log``, ``role``, ``time_s`` [s] and, by axis
        from 1, ``measured_torque_nm_1``, ``measured_position_rad_1`` and so on [Nm or N, rad or m]. Its metadata
        under ``axisight``, in JSON, hold the joint names, the units, and how simulator and logs were
        compared.

        ``.mcap`` has the topics ``/ROLE/LOG/measured``, ``simulated_before``, ``simulated_after``,
        ``residual_before`` and ``residual_after`` of ``sensor_msgs/JointState``, with torques as effort by
        joint name, and positions as position. Every log begins at 1 s. The topic ``/axisight`` has the same
        metadata as one message. Beside it, ``NAME.foxglove.json`` is a layout for Foxglove.

        ``.rrd`` is a recording of Rerun with a blueprint. Entities are named such as
        ``/ROLE/LOG/axis_1/torque/measured``; ``time`` is the time of each log, and ``/axisight`` has the metadata.
    overwrite
        Whether to replace files that exist.

    Raises InputError and MissingExtraError as `check_target`, and InputError without signals.
    """
    path = Path(target)
    check_target(path, overwrite=overwrite)
    if not signals:
        raise InputError("signals: expected those of diagnose(..., signals=True), got none")
    kind = path.suffix.lower()
    if kind == ".mcap":
        made, beside = recording(signals), layout(signals)
        write_whole(files_of(path)[1], beside)
    else:
        made = rerun_file(signals) if kind == ".rrd" else table(signals)
    write_bytes(path, made)
    return path

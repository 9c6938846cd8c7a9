"""Check before a diagnosis that its signals can be written."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from axisight import storage
from axisight.errors import InputError, MissingExtraError
from axisight.signal_files.foxglove import ENDING

KINDS = (".parquet", ".mcap", ".rrd")
# What writes files of these kinds, with the extra that installs it.
_WRITERS = {
    ".mcap": ("rosbags", "MCAP files are written by rosbags: pip install 'axisight[ros]'"),
    ".rrd": ("rerun", "Rerun files are written by rerun-sdk: pip install 'axisight[rerun]'"),
}


def files_of(target: Path | str) -> list[Path]:
    """Return the files that are written for ``target``: itself, and beside an MCAP file a layout of Foxglove."""
    path = Path(target)
    return [path, path.with_suffix(ENDING)] if path.suffix.lower() == ".mcap" else [path]


def check_target(
    target: Path | str, *, overwrite: bool = False, inputs: Sequence[Path] = ()
) -> None:
    """Raise an error if signals cannot be written to ``target``.

    ``target`` must end in .parquet, .mcap or .rrd. It and the layout beside it (`files_of`) must be writable,
    and none of the ``inputs``. Without ``overwrite`` they must not exist. Raises InputError for another ending,
    OutputError (an InputError) for a file that cannot be written, and MissingExtraError for .mcap without
    rosbags and .rrd without rerun-sdk.
    """
    path = Path(target)
    kind = path.suffix.lower()
    if kind not in KINDS:
        known = f"{', '.join(KINDS[:-1])} or {KINDS[-1]}"
        raise InputError(f"{path}: expected {known} for signals, got {kind!r}")
    for file in files_of(path):
        storage.check_target(file, inputs=inputs, overwrite=overwrite)
    if kind in _WRITERS:
        module, missing = _WRITERS[kind]
        if find_spec(module) is None:
            raise MissingExtraError(missing)

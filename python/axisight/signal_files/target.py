"""Check before a diagnosis that its signals can be written."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from axisight import storage
from axisight.errors import InputError, MissingExtraError

KINDS = (".parquet", ".mcap")


def check_target(
    target: Path | str, *, overwrite: bool = False, inputs: Sequence[Path] = ()
) -> None:
    """Raise an error if signals cannot be written to ``target``.

    ``target`` must end in .parquet or .mcap, be writable, and be none of the ``inputs``. Without
    ``overwrite`` it must not exist. Raises InputError for another ending, OutputError (an InputError) for a
    file that cannot be written, and MissingExtraError for .mcap if rosbags is not installed.
    """
    path = Path(target)
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise InputError(f"{path}: expected {' or '.join(KINDS)} for signals, got {kind!r}")
    storage.check_target(path, inputs=inputs, overwrite=overwrite)
    if kind == ".mcap" and find_spec("rosbags") is None:
        raise MissingExtraError("MCAP files are written by rosbags: pip install 'axisight[ros]'")

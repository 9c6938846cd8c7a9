"""Where signals may be written: said before the work."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from axisight.errors import InputError, MissingExtraError

KINDS = (".parquet", ".mcap")


def check_target(
    target: Path | str, *, overwrite: bool = False, inputs: Sequence[Path | str] = ()
) -> None:
    """Raise InputError for a file that signals cannot be written to, MissingExtraError without its library.

    ``target`` has to end in .parquet or .mcap, in a folder that is there or can be made, and be none of the
    ``inputs``; ``overwrite``: a file that exists is no obstacle.
    """
    path = Path(target)
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise InputError(f"{path}: expected {' or '.join(KINDS)} for signals, got {kind!r}")
    if any(path.resolve() == Path(name).resolve() for name in inputs):
        raise InputError(f"{path}: expected another file than what was read, got an input")
    if path.is_dir() or (path.exists() and not overwrite):
        raise InputError(f"{path} exists: choose another name")
    folder = next(above for above in path.absolute().parents if above.exists())
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"{path}: expected a folder to write into, got {folder}")
    if kind == ".mcap" and find_spec("rosbags") is None:
        raise MissingExtraError("MCAP files are written by rosbags: pip install 'axisight[ros]'")

"""Where signals may be written: said before the work."""

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
    """Raise InputError for a file that signals cannot be written to, MissingExtraError without its library.

    ``target`` has to end in .parquet or .mcap and to be a file that may be written, none of the ``inputs``;
    with ``overwrite`` one that exists is no obstacle.
    """
    path = Path(target)
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise InputError(f"{path}: expected {' or '.join(KINDS)} for signals, got {kind!r}")
    storage.check_target(path, inputs=inputs, overwrite=overwrite)
    if kind == ".mcap" and find_spec("rosbags") is None:
        raise MissingExtraError("MCAP files are written by rosbags: pip install 'axisight[ros]'")

"""Write files whole or not at all, and check before the work that they can be written."""

from __future__ import annotations

import os
import secrets
import stat
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from axisight.errors import InputError, OutputError

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` in UTF-8; otherwise as `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write ``data`` to a file beside ``path`` and rename it, so that no partial file remains.

    Links are followed. An existing file keeps its permissions; a new one gets those of the umask. Raises
    OutputError if ``path`` exists but is not a file, and if the system refuses to write.
    """
    target = _followed(path)
    try:
        before = _in_the_way(target, path)
        target.parent.mkdir(parents=True, exist_ok=True)
        # A name of its own: the target's name may already have the longest length allowed.
        beside = target.parent / f".{secrets.token_hex(8)}.part"
        # Not `tempfile`, which ignores the umask and makes files that only the owner can read.
        handle = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                if before is not None:
                    beside.chmod(stat.S_IMODE(before.st_mode))
            beside.replace(target)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {_reason(error)}") from None


def check_targets(
    targets: Mapping[str, Path | None],
    *,
    inputs: Iterable[Path] = (),
    replaces: Mapping[str, Sequence[str]] | None = None,
    force: bool = False,
) -> None:
    """Raise OutputError, naming the option, if a command could not write one of its outputs.

    targets
        Output files by option, None for options not given. No two may be the same file.
    inputs
        Files that the command reads, see `check_target`.
    replaces
        Suffixes, by option, of earlier results that may be replaced. Other existing files need ``force``. An
        empty list protects every existing file, as for models and maps. Options that are missing here may
        always replace their files, because the command itself chose the names.
    force
        Whether to allow replacing any file.
    """
    read = list(inputs)
    seen: dict[Path, str] = {}
    for option, target in targets.items():
        if target is None:
            continue
        try:
            if str(target) == "-":
                raise OutputError("expected a file, got -, the standard output")
            check_target(target, inputs=read)
            if not force and replaces is not None and option in replaces:
                _check_replaced(target, replaces[option])
        except OutputError as error:
            raise OutputError(f"{option}: {error}") from None
        other = seen.setdefault(_followed(target), option)
        if other != option:
            raise OutputError(
                f"{option}: expected another file than {other}, got {target} for both"
            )


def _check_replaced(target: Path, endings: Sequence[str]) -> None:
    """Raise OutputError for an existing file whose suffix is not among ``endings``."""
    path = _followed(target)
    if path.is_file() and path.suffix.lower() not in endings:
        kind = f" and is no {' or '.join(endings)}" if endings else ""
        raise OutputError(f"{target} exists{kind}: choose another name, or --force replaces it")


def check_target(
    target: Path | str, *, inputs: Iterable[Path] = (), overwrite: bool = True
) -> None:
    """Raise OutputError if ``target`` could not be written.

    ``target`` must be a writable file or not exist, in a folder that is writable or can be made. It must not
    be one of the ``inputs``, even under another name. Without ``overwrite`` it must not exist.
    """
    path = _followed(target)
    try:
        there = _in_the_way(path, target)
        for name in inputs:
            if path == _followed(name) or (there is not None and _same(name, there)):
                raise OutputError(
                    f"{target}: expected another file than what is read, got an input"
                )
        if there is not None and not overwrite:
            raise OutputError(f"{target} exists: choose another name")
        if there is not None and not os.access(path, os.W_OK):
            raise OutputError(f"{target}: expected a file that may be written, got a read-only one")
        _try_folder(path.parent, target)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{target}: cannot be written: {_reason(error)}") from None


def check_folder(folder: Path | str) -> None:
    """Raise OutputError if ``folder`` is not a folder, or could not be made or written to."""
    try:
        _try_folder(_followed(folder), folder)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written to: {_reason(error)}") from None


def _followed(path: Path | str) -> Path:
    """Return a path with links followed, without the RuntimeError of `Path.resolve` for circular links."""
    try:
        return Path(os.path.realpath(path))
    except ValueError as error:
        raise InputError(f"{str(path)!r}: expected a path: {error}") from None


def _in_the_way(path: Path, said: Path | str) -> os.stat_result | None:
    """Return the status of an existing file, None without one; raise OutputError for other objects."""
    try:
        there = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        # `_try_folder` checks the folders above.
        return None
    if not stat.S_ISREG(there.st_mode):
        kind = _KINDS.get(stat.S_IFMT(there.st_mode), "something else")
        raise OutputError(f"{said}: expected a file to write, got {kind}")
    return there


def _same(path: Path, there: os.stat_result) -> bool:
    try:
        return os.path.samestat(Path(path).stat(), there)
    except OSError:
        # An input may be the name of a preset, for which there is no file.
        return False


def _try_folder(folder: Path, said: Path | str) -> None:
    """Raise OSError unless files can be made in a folder, or in its nearest existing parent."""
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise OutputError(f"{said}: expected a folder to write into, got {folder}")
    # Try to write, because permissions do not show everything that a file system refuses.
    with tempfile.TemporaryFile(dir=folder):
        pass


def _reason(error: OSError) -> str:
    return error.strerror or str(error)

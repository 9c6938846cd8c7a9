"""Files written whole or not at all, and the one law of where they may be written, tried before the work."""

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
    """Write ``text`` as `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write ``data`` beside ``path`` and rename it, so no half file is ever left.

    A link is followed, a file keeps its permissions, a new one has those that the umask leaves. Raises
    OutputError for anything but a file in the way, and for what the disk refuses.
    """
    target = _followed(path)
    try:
        before = _in_the_way(target, path)
        target.parent.mkdir(parents=True, exist_ok=True)
        # Short, for the name of the file may be as long as names can be.
        beside = target.parent / f".{secrets.token_hex(8)}.part"
        # Not `tempfile`, whose files nobody else may read, whatever the umask says.
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
    """Raise OutputError, naming the option, for outputs of a command that could not be written after its work.

    ``targets``: by option, None where it was not given; no two may be one file. ``inputs`` as in `check_target`.
    ``replaces``: by option, how files end that are earlier results of it; other files are replaced with
    ``force`` only, and what people work on, a model or a map, has none that are. Options that are not in it have
    names, or endings, that are the command's own.
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
    """Raise OutputError for a file that is there and does not end as a result that may be made anew."""
    path = _followed(target)
    if path.is_file() and path.suffix.lower() not in endings:
        kind = f" and is no {' or '.join(endings)}" if endings else ""
        raise OutputError(f"{target} exists{kind}: choose another name, or --force replaces it")


def check_target(
    target: Path | str, *, inputs: Iterable[Path] = (), overwrite: bool = True
) -> None:
    """Raise OutputError for a file that could not be written.

    ``target`` is a file or nothing yet, none of the ``inputs`` by whatever name, in a folder that can be written
    to or made. Without ``overwrite`` there must be nothing.
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
    """Raise OutputError for a folder that is none, or that could not be made or written to."""
    try:
        _try_folder(_followed(folder), folder)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written to: {_reason(error)}") from None


def _followed(path: Path | str) -> Path:
    """Return where a path leads; not `Path.resolve`, which raises another error for links in a circle."""
    try:
        return Path(os.path.realpath(path))
    except ValueError as error:
        raise InputError(f"{str(path)!r}: expected a path: {error}") from None


def _in_the_way(path: Path, said: Path | str) -> os.stat_result | None:
    """Return what is known of a file that is there, None of nothing; raises OutputError for what is no file."""
    try:
        there = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        # What lies above it is looked at with its folder.
        return None
    if not stat.S_ISREG(there.st_mode):
        kind = _KINDS.get(stat.S_IFMT(there.st_mode), "something else")
        raise OutputError(f"{said}: expected a file to write, got {kind}")
    return there


def _same(path: Path, there: os.stat_result) -> bool:
    try:
        return os.path.samestat(Path(path).stat(), there)
    except OSError:
        # Inputs may be names of presets.
        return False


def _try_folder(folder: Path, said: Path | str) -> None:
    """Raise OSError unless files can be made in a folder, or in the nearest above it that is there."""
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise OutputError(f"{said}: expected a folder to write into, got {folder}")
    # Tried and not asked for: permissions do not say all of what a file system refuses.
    with tempfile.TemporaryFile(dir=folder):
        pass


def _reason(error: OSError) -> str:
    return error.strerror or str(error)

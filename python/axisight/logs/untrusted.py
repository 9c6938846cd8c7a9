"""Refuse cases and logs from strangers that would open anything outside their folder."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

import h5py

from axisight.errors import CaseError, LogError
from axisight.logs.sources import files_of, is_folder_log
from axisight.logs.sources_hdf5 import walk


def check_folder(folder: Path) -> None:
    """Raise CaseError for links that lead out of a folder, and for devices and pipes in it."""
    top = folder.resolve()
    for path in _below(folder):
        target = path.resolve()
        if not target.is_relative_to(top):
            raise CaseError(
                f"{path}: expected nothing outside the case folder, got a link to {target}"
            )
        try:
            kind = target.stat().st_mode
        except FileNotFoundError:
            # A dangling link cannot open anything.
            continue
        if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
            raise CaseError(f"{path}: expected files and folders only, got a device or a pipe")


def check_name(name: str, said: str) -> None:
    """Raise CaseError, beginning with ``said``, for a name in a case that may lead out of its folder."""
    # By the rules of POSIX and of Windows, so that a case means the same on both.
    for path in (PurePosixPath(name), PureWindowsPath(name)):
        if path.anchor or ".." in path.parts:
            raise CaseError(f"{said}: expected a path inside the case folder, got {name!r}")


def check_log_inside(path: Path) -> None:
    """Raise LogError for a log that would open files outside its folder, or an HDF5 file with data in others.

    Links in the folder of a recording must stay inside, and an HDF5 file (also MATLAB v7.3) must not refer to
    another file.
    """
    files = files_of(path) if path.exists() or is_folder_log(path) else []
    top = path.parent.resolve()
    for file in files:
        if file != path and not file.resolve().is_relative_to(top):
            raise LogError(
                f"{file}: expected nothing outside {top}, got a link to {file.resolve()}"
            )
        if file.is_file() and h5py.is_hdf5(file):
            _check_hdf5(file)


def _check_hdf5(path: Path) -> None:
    """Raise LogError for an HDF5 file with data in other files, without opening them."""
    try:
        with h5py.File(path, "r") as file:
            found = next(filter(None, (_elsewhere(*one) for one in walk(file))), None)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise LogError(f"{path}: cannot be read as HDF5: {error}") from None
    if found is not None:
        raise LogError(f"{path}: {found}")


def _elsewhere(name: str, link: object, item: object) -> str | None:
    """Return the message for a link or object with data in another file; None if its data is here."""
    if isinstance(link, h5py.ExternalLink):
        return f"{name}: expected data in this file, got a link to {link.filename}"
    if not isinstance(item, h5py.Dataset):
        return None
    others = [entry[0] for entry in item.external or ()]
    if item.is_virtual:
        others += [s.file_name for s in item.virtual_sources() if s.file_name != "."]
    return f"{name}: expected data in this file, got data of {others[0]}" if others else None


def _below(folder: Path) -> Iterator[Path]:
    for place, inner, files in os.walk(folder):
        yield from (Path(place, name) for name in (*inner, *files))

"""The folder that an assistant may see: every path of a tool is a name inside it."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath, PureWindowsPath

from axisight.arguments import did_you_mean, shown, usable_path
from axisight.errors import InputError, OutputError
from axisight.logs.map_files import AnyMap, load_column_map, parse_column_map
from axisight.logs.maps import MAPS
from axisight.logs.sources import is_folder_log
from axisight.logs.untrusted import check_log_inside
from axisight.robot.presets import PRESETS

READ_ONLY = "the server was started without --allow-write and only reads"


class Folder:
    """A folder whose files tools may read, and write to if ``may_write``.

    Raises InputError for a path that is no folder.
    """

    def __init__(self, root: Path, *, may_write: bool = False) -> None:
        self.root = usable_path(root, InputError).resolve()
        self.may_write = may_write
        if not self.root.is_dir():
            raise InputError(f"FOLDER: expected a folder, got {root}")

    def read(self, field: str, name: str) -> Path:
        """Return the path of a file or folder to read.

        Raises InputError, naming ``field``, for absolute names, names with ``..``, and links that lead out.
        """
        path = self._inside(field, name)
        if not path.exists() and not is_folder_log(path):
            beside = path.parent.iterdir() if path.parent.is_dir() else ()
            known = [self.relative(p) for p in beside if not p.name.startswith(".")]
            raise InputError(
                f"{field}: expected a file or folder in the server's folder, got {shown(name)}"
                f"{did_you_mean(name, known)}"
            )
        return path

    def log(self, field: str, name: str) -> Path:
        """Return the path of a log; raise also for a log that keeps its data in other files."""
        path = self.read(field, name)
        check_log_inside(path)
        return path

    def model(self, field: str, name: str) -> str:
        """Return the name of a preset, or the path of a robot or model file.

        The files that are read beside it, such as drive data and an identification, must not lead out either.
        """
        if name in PRESETS:
            return name
        path = self.read(field, name)
        for beside in path.parent.iterdir():
            if beside.name.startswith(path.stem):
                self._check(field, beside, self.shown(str(beside)))
        return str(path)

    def columns(self, name: str | None, text: str | None) -> AnyMap | None:
        """Return a column map: a file of the folder or a shipped map by ``name``, or its own ``text``."""
        if name is not None and text is not None:
            raise InputError("columns, columns_text: expected one of them, got both")
        if text is not None:
            return parse_column_map(text, where="columns_text")
        if name is None:
            return None
        return load_column_map(name if name in MAPS else self.read("columns", name))

    def write(self, field: str, name: str | None) -> Path | None:
        """Return the path of a file to write, None for None; raise OutputError unless writing is allowed."""
        if name is None:
            return None
        if not self.may_write:
            raise OutputError(f"{field}: expected none, got {shown(name)}: {READ_ONLY}")
        return self._inside(field, name)

    def relative(self, path: Path) -> str:
        """Return the name of a path inside the folder, with forward slashes."""
        return path.relative_to(self.root).as_posix()

    def shown(self, text: str) -> str:
        """Return a text with paths inside the folder as names relative to it."""
        return text.replace(f"{self.root}{os.sep}", "").replace(str(self.root), ".")

    def _inside(self, field: str, name: str) -> Path:
        # By the rules of POSIX and of Windows, so that a name means the same on both.
        for pure in (PurePosixPath(name), PureWindowsPath(name)):
            if pure.anchor or ".." in pure.parts:
                raise InputError(
                    f"{field}: expected a path relative to the server's folder, without .., got {shown(name)}"
                )
        inside = usable_path(self.root / name, InputError, field)
        # ``folder#3`` is an episode of a folder, which itself may be a link.
        for path in (inside, self.root / name.partition("#")[0]):
            self._check(field, path, name)
        return inside

    def _check(self, field: str, path: Path, name: str) -> None:
        """Raise InputError for a path that leads out of the folder through a link."""
        try:
            target = path.resolve()
        except RuntimeError:  # links in a circle
            target = Path("/")
        if not target.is_relative_to(self.root):
            raise InputError(
                f"{field}: expected a path inside the server's folder, got {shown(name)}, a link out of it"
            )

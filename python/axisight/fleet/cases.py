"""Cases of a folder, and a fingerprint of everything that a diagnosis depends on."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from axisight.errors import InputError


@dataclass(frozen=True)
class FleetCase:
    """One case (`axisight.case/1`) of a fleet.

    ``name``: path of its folder below the fleet's, with slashes. ``machine``: the parent folder, which all
    cases of one machine share; empty for the fleet's folder. The order of names is the order in time.
    """

    name: str
    machine: str
    path: Path

    def files(self) -> dict[str, bytes]:
        """Return the content of every file of the case, by its path with slashes."""
        paths = sorted(_files_below(self.path))
        return {p.relative_to(self.path).as_posix(): p.read_bytes() for p in paths}


def fleet_cases(folder: Path) -> list[FleetCase]:
    """Return the cases anywhere below a folder, sorted by name.

    Links to folders are followed. Raises InputError for a folder without cases.
    """
    paths = sorted(p.parent for p in _files_below(folder) if p.name == "case.toml")
    if not paths:
        raise InputError(f"{folder}: expected folders with a case.toml, got none")
    names = [p.relative_to(folder) for p in paths]
    return [
        FleetCase(n.as_posix(), n.parent.as_posix() if len(n.parts) > 1 else "", p)
        for n, p in zip(names, paths, strict=True)
    ]


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield every file below a folder, through links too, except links that lead back up."""
    for place, inner, files in os.walk(folder, followlinks=True):
        here = Path(place)
        above = {here.resolve(), *here.resolve().parents}
        inner[:] = [name for name in inner if (here / name).resolve() not in above]
        yield from (here / name for name in files if (here / name).is_file())


def fingerprint(files: dict[str, bytes], also: str) -> str:
    """Return a digest of a case's files and of ``also``, everything else that its verdict depends on."""
    digest = hashlib.sha256(also.encode())
    for name, data in files.items():
        digest.update(f"{name}\0{len(data)}\0".encode())
        digest.update(data)
    return digest.hexdigest()

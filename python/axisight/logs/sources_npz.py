"""Read NPZ files: arrays in a zip archive, each with a header that declares its size."""

from __future__ import annotations

import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import short
from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader, refusing

_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def load_npz(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every array, by name; raise LogError for two arrays of one name."""
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    names = [member.filename.removesuffix(".npy") for member in members]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise LogError(f"{short(twice[0])}: expected one array of that name, got several")
    return {
        name: _reader(path, member, budget)
        if member.filename.endswith(".npy")
        else refusing("expected an array, got another member of the archive")
        for name, member in zip(names, members, strict=True)
    }


def _reader(path: Path, member: zipfile.ZipInfo, budget: Budget) -> Reader:
    def read() -> NDArray[Any]:
        if member.compress_type not in _METHODS:
            raise LogError("expected an array stored or deflated, as NumPy does")
        with zipfile.ZipFile(path) as archive:
            with archive.open(member) as file:
                version = np.lib.format.read_magic(file)
                if version not in _HEADERS:
                    raise LogError(f"expected version 1.0 or 2.0 of arrays, got {version}")
                shape, _, dtype = _HEADERS[version](file)
            budget.take_values(shape, dtype.itemsize)
            with archive.open(member) as file:
                return np.asarray(np.lib.format.read_array(file, allow_pickle=False))

    return read

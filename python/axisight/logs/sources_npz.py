"""Read arrays of NumPy, alone (NPY) or in a zip archive (NPZ): each has a header that declares its size."""

from __future__ import annotations

import zipfile
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import IO, Any

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
# Wider arrays are matrices of something else.
_MOST_COLUMNS = 10_000


def load_npy(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every column of one array: by field if it is structured, else by number from "0".

    Raises LogError for an array without columns of samples.
    """
    with path.open("rb") as file:
        shape, dtype = _declared(file)

    @cache
    def whole() -> NDArray[Any]:
        return _read(lambda: path.open("rb"), budget)

    if dtype.hasobject:
        raise LogError("expected numbers, got objects")
    if dtype.names is not None and len(shape) == 1:
        return {name: _column(whole, name) for name in dtype.names}
    if len(shape) not in (1, 2):
        raise LogError(
            f"expected an array of shape (samples,), (samples, columns) or structured, got {shape}"
        )
    if len(shape) == 1:
        return {"0": whole}
    if shape[1] > min(shape[0], _MOST_COLUMNS):
        raise LogError(
            f"expected an array of shape (samples, columns), got {shape}; save its transpose"
        )
    return {str(k): _column(whole, (slice(None), k)) for k in range(shape[1])}


def _column(whole: Reader, key: Any) -> Reader:
    return lambda: np.asarray(whole()[key])


def load_npz(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every array, by name; raise LogError for two arrays of one name."""
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    names = [member.filename.removesuffix(".npy") for member in members]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise LogError(f"{short(twice[0])}: expected one array of that name, got several")
    return {
        name: _member(path, member, budget)
        if member.filename.endswith(".npy")
        else refusing("expected an array, got another member of the archive")
        for name, member in zip(names, members, strict=True)
    }


def _member(path: Path, member: zipfile.ZipInfo, budget: Budget) -> Reader:
    def read() -> NDArray[Any]:
        if member.compress_type not in _METHODS:
            raise LogError("expected an array stored or deflated, as NumPy does")
        with zipfile.ZipFile(path) as archive:
            return _read(lambda: archive.open(member), budget)

    return read


def _read(opened: Callable[[], IO[bytes]], budget: Budget) -> NDArray[Any]:
    """Return the array of a file after its declared size is counted."""
    with opened() as file:
        shape, dtype = _declared(file)
    budget.take_values(shape, dtype.itemsize)
    with opened() as file:
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))


def _declared(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return shape and type of the array in a file."""
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise LogError(f"expected version 1.0 or 2.0 of arrays, got {version}")
    shape, _, dtype = _HEADERS[version](file)
    return shape, dtype

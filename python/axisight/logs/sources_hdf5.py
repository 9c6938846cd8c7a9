"""HDF5 files, and MATLAB v7.3 files, which are HDF5 inside."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader

_DEEPEST = 32


def load_hdf5(path: Path, budget: Budget, *, matlab: bool = False) -> dict[str, Reader]:
    """Return a reader for every dataset, by its path with dots for slashes.

    With `matlab`, arrays are transposed back to MATLAB's order, singleton dimensions are dropped, and
    cells become object arrays. Raises whatever h5py raises on a damaged file.
    """
    with h5py.File(path, "r") as file:
        names = [name for name in _datasets(file) if not name.startswith("#")]
    return {name.replace("/", "."): _reader(path, name, budget, matlab) for name in names}


def _datasets(file: h5py.File) -> list[str]:
    """Return the sorted paths of all datasets that hard links lead to, each dataset once."""
    items = ((path, item) for path, _, item in walk(file))
    return sorted(path for path, item in items if isinstance(item, h5py.Dataset))


def walk(file: h5py.File) -> Iterator[tuple[str, Any, Any]]:
    """Yield (path, link, object) for every link below the root; the object is None unless the link is hard.

    Each object comes once. The library's own visit asks a group for its size and its links for their order,
    and may therefore never end on a damaged file; this function does not ask for either. Raises what h5py
    raises on a damaged file, and LogError if links of a group repeat.
    """
    seen: set[int] = set()
    groups = [("", file["/"])]
    while groups:
        path, group = groups.pop()
        for name in _links(group):
            whole = path + name.decode("utf-8", "replace")
            info = group.id.links.get_info(name)
            if info.type != h5py.h5l.TYPE_HARD:
                yield whole, group.get(name, getlink=True), None
                continue
            if info.u in seen:
                continue
            seen.add(info.u)
            item = group[name]
            yield whole, h5py.HardLink(), item
            if isinstance(item, h5py.Group):
                groups.append((f"{whole}/", item))


def _links(group: h5py.Group) -> list[bytes]:
    """Return the names of the links of a group; raise LogError if they repeat, as in an endless ring."""
    names: set[bytes] = set()

    def more(name: bytes) -> bool | None:
        again = name in names
        names.add(name)
        return again or None

    native = h5py.h5.ITER_NATIVE
    in_a_ring, _ = group.id.links.iterate(more, idx_type=h5py.h5.INDEX_NAME, order=native)
    if in_a_ring:
        raise LogError("expected each name once, got some again")
    return sorted(names)


def _reader(path: Path, name: str, budget: Budget, matlab: bool) -> Reader:
    def read() -> NDArray[Any]:
        with h5py.File(path, "r") as file:
            dataset = file[name]
            return _Cells(file, budget).of(dataset, 0) if matlab else _read(dataset, budget)

    return read


def _read(dataset: h5py.Dataset, budget: Budget) -> NDArray[Any]:
    """Return the values of a dataset within the budget; raise LogError if other files hold them."""
    if dataset.is_virtual or dataset.external:
        raise LogError("expected values in the file itself, got those of other files")
    if dataset.dtype.hasobject and h5py.check_ref_dtype(dataset.dtype) is not h5py.Reference:
        raise LogError("expected numbers, got values of variable length")
    # Reading any part of a chunk unpacks the whole chunk.
    shape = max(dataset.shape or (), dataset.chunks or (), key=prod)
    budget.take_values(shape, dataset.dtype.itemsize)
    return np.asarray(dataset[()])


class _Cells:
    """A reader of MATLAB cells, which are references to datasets; it reads each dataset once."""

    def __init__(self, file: h5py.File, budget: Budget) -> None:
        self._file = file
        self._budget = budget
        self._seen: dict[str, NDArray[Any]] = {}

    def of(self, dataset: h5py.Dataset, depth: int) -> NDArray[Any]:
        """Return the values of a dataset; cells become object arrays."""
        if depth > _DEEPEST:
            raise LogError(f"expected at most {_DEEPEST} cells inside each other")
        if dataset.name in self._seen:
            return self._seen[dataset.name]
        values = _read(dataset, self._budget)
        if "MATLAB_empty" in dataset.attrs:
            return np.empty(0)
        if h5py.check_ref_dtype(dataset.dtype) is h5py.Reference:
            cells = np.empty(values.shape, dtype=object)
            for index, reference in np.ndenumerate(values):
                target = self._file[reference] if reference else None
                if isinstance(target, h5py.Dataset):
                    cells[index] = self.of(target, depth + 1)
            values = cells
        self._seen[dataset.name] = values.T.squeeze()
        return self._seen[dataset.name]

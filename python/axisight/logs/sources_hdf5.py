"""HDF5 files, and MATLAB v7.3 files, which are HDF5 inside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray


def load_hdf5(path: Path, *, matlab: bool = False) -> dict[str, NDArray[Any]]:
    """Return every dataset by its path with dots for slashes.

    With `matlab`, arrays are transposed back to MATLAB's order, singleton dimensions dropped, and
    cells followed into object arrays. Raises whatever h5py raises on a damaged file.
    """
    arrays: dict[str, NDArray[Any]] = {}
    with h5py.File(path, "r") as file:

        def visit(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#"):
                arrays[name.replace("/", ".")] = _read(file, item, matlab=matlab)

        file.visititems(visit)
    return arrays


def _read(file: h5py.File, dataset: h5py.Dataset, *, matlab: bool) -> NDArray[Any]:
    values = np.asarray(dataset[()])
    if not matlab:
        return values
    if "MATLAB_empty" in dataset.attrs:
        return np.empty(0)
    if h5py.check_ref_dtype(dataset.dtype) is h5py.Reference:
        cells = np.empty(values.shape, dtype=object)
        for index, reference in np.ndenumerate(values):
            target = file[reference] if reference else None
            if isinstance(target, h5py.Dataset):
                cells[index] = _read(file, target, matlab=True)
        values = cells
    return values.T.squeeze()

"""Read MAT files: version 5, or 7.3, which is HDF5."""

from __future__ import annotations

from pathlib import Path

import h5py

from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader
from axisight.logs.sources_hdf5 import load_hdf5
from axisight.logs.sources_mat5 import load_mat5


def load_mat(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every variable by dotted name; singleton dimensions are dropped.

    Raises LogError, and whatever h5py raises, on a damaged file.
    """
    if h5py.is_hdf5(path):
        return load_hdf5(path, budget, matlab=True)
    return load_mat5(path, budget)

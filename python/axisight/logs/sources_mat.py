"""MATLAB files of either kind."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.logs.sources_hdf5 import load_hdf5


def load_mat(path: Path) -> dict[str, NDArray[Any]]:
    """Return every variable by dotted name; singleton dimensions are dropped.

    Fields of a struct follow its name after a dot; elements of a struct array by their number from
    0 (`run.0.q`). Raises whatever the readers raise on a damaged file.
    """
    if h5py.is_hdf5(path):
        return load_hdf5(path, matlab=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.io.matlab.MatReadWarning)
        content = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    arrays: dict[str, NDArray[Any]] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _flatten(name, value, arrays)
    return arrays


def _flatten(name: str, value: Any, arrays: dict[str, NDArray[Any]]) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None:
        for field in fields:
            _flatten(f"{name}.{field}", getattr(value, field), arrays)
        return
    array = np.asarray(value)
    if array.dtype == object and array.size and hasattr(array.flat[0], "_fieldnames"):
        for number, element in enumerate(array.flat):
            _flatten(f"{name}.{number}", element, arrays)
        return
    arrays[name] = array

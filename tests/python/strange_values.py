"""Calls of functions with values that they were not made for, one argument at a time.

The outcome must be an AxisightError, or a result without infinite numbers. A NaN is allowed only if a flag or
the documentation of the field explains it.
"""

import dataclasses
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from axisight.errors import AxisightError

STRANGE: list[Any] = [
    float("nan"),
    float("inf"),
    -float("inf"),
    -1,
    0,
    0.5,
    1e300,
    1e-300,
    2**70,
    1j,
    True,
    None,
    "",
    "text",
    b"bytes",
    object(),
    [],
    [float("nan")],
    [1.5],
    [0],
    [-3],
    [1, 1],
    [2**70],
    ["a"],
    [[1.0, 2.0], [3.0]],
    {},
    {"a": 1},
    np.zeros(0),
    np.zeros(7),
    np.zeros((2, 2)),
    np.full((2, 2), np.nan),
    np.full((2, 2, 2), np.inf),
    np.zeros((2, 0, 2)),
    np.ones((1, 1, 1, 1)),
    np.array(["a", "b"]),
    np.array([1, None]),
    np.datetime64("2020-01-01"),
    xr.Dataset(),
    xr.Dataset({"response": ("x", np.ones(3))}),
    (lambda x: x),
]

MAY_BE_NAN = {
    "variance",
    "noise_variance",
    "condition",
    "degrees_of_freedom",
    "distortion_variance",
}


def check(result: Any, may_be_nan: frozenset[str] = frozenset(), name: str = "result") -> None:
    """Fail on any infinite number, and on a NaN that nothing explains."""
    if isinstance(result, xr.Dataset):
        lost = result["flag"].values != 0 if "flag" in result else None
        for key, values in result.data_vars.items():
            array = values.values
            if array.dtype.kind in "fc":
                assert not np.isinf(array).any(), f"{name}.{key} is infinite"
                unexplained = np.isnan(array)
                if lost is not None and array.ndim and len(lost) == len(array):
                    unexplained = unexplained[~lost]
                explained = key in MAY_BE_NAN | may_be_nan
                assert explained or not unexplained.any(), f"{name}.{key} is NaN without a flag"
    elif isinstance(result, xr.DataArray):
        check(result.values, may_be_nan, f"{name}.{result.name}")
    elif isinstance(result, np.ndarray):
        if result.dtype.kind in "fc":
            assert not np.isinf(result).any(), f"{name} is infinite"
            assert name in may_be_nan or not np.isnan(result).any(), f"{name} is NaN"
    elif isinstance(result, float | complex):
        assert not np.isinf(result), f"{name} is infinite"
        assert name in may_be_nan or not np.isnan(result), f"{name} is NaN"
    elif isinstance(result, Mapping):
        for key, value in result.items():
            check(value, may_be_nan, f"{name}.{key}")
    elif isinstance(result, tuple | list):
        for value in result:
            check(value, may_be_nan, name)
    elif dataclasses.is_dataclass(result):
        for field in dataclasses.fields(result):
            check(getattr(result, field.name), may_be_nan, field.name)
        for key in ("rms", "peak", "crest_factor", "period", "frequency_hz"):
            if hasattr(result, key):
                check(getattr(result, key), may_be_nan, key)


def feed(
    function: Callable[..., Any],
    good: Mapping[str, Any],
    may_be_nan: frozenset[str] = frozenset(),
    leave_out: frozenset[str] = frozenset(),
) -> list[str]:
    """Call with every strange value in place of every argument; return the failures."""
    check(function(**good), may_be_nan | {"result"})
    wrong = []
    for argument in good:
        if argument in leave_out:
            continue
        for value in STRANGE:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", DeprecationWarning)
                    result = function(**{**good, argument: value})
                check(result, may_be_nan)
            except AxisightError:
                continue
            except Exception as error:
                wrong.append(f"{argument}={value!r:.60}: {type(error).__name__}: {error!s:.100}")
    return wrong

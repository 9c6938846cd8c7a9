"""Check arguments of any type: return the checked value, or raise InputError that names the field.

In every function here, ``field`` is the name of the argument in messages.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Lines = NDArray[np.int64]
T = TypeVar("T")

_MOST_THREADS = 1024
# Longest name and whole path that file systems accept, in bytes.
_LONGEST_NAME = 255
_LONGEST_PATH = 4000
# Longer text is not a typing error of a name.
_LONGEST_WORD = 100
_ALIKE = 0.7


def short(text: str, most: int = 80) -> str:
    """Return a text for a message, cut to ``most`` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


def counted(number: int, one: str, many: str = "") -> str:
    """Return a number with its noun: "1 round", "2 rounds", "3 axes" with ``many`` "axes"."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def shown(value: object) -> str:
    """Return a value as text for a message, cut to 80 characters."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of {value.dtype} with shape {value.shape}"
    if isinstance(value, str):  # cut before repr, because it may be the text of a whole file
        return short(repr(value[:100]))
    try:
        text = str(value) if isinstance(value, (int, float, np.number)) else repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or nested without end
        text = f"a {type(value).__name__} too large to be shown"
    return short(text)


def nearest(value: object, known: Iterable[str]) -> str | None:
    """Return the known word that a text probably means; None if no word is near.

    Case, spaces and dashes do not count. The start of exactly one known word means that word.
    """
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST_WORD:
        return None
    words = {_plain(word): word for word in known if word.isprintable()}
    wanted = _plain(value)
    if near := get_close_matches(wanted, words, n=1, cutoff=_ALIKE):
        return words[near[0]]
    begun = [word for plain, word in words.items() if len(wanted) > 2 and plain.startswith(wanted)]
    return begun[0] if len(begun) == 1 else None


def _plain(word: str) -> str:
    return word.strip().lower().replace(" ", "_").replace("-", "_")


def did_you_mean(value: object, known: Iterable[str]) -> str:
    """Return ``. Did you mean 'word'?`` for the end of a message; "" if no known word is near."""
    near = nearest(value, known)
    return "" if near is None else f". Did you mean {near!r}?"


def _array(value: object, kinds: str) -> NDArray[Any] | None:
    """Return a value as an array if its dtype kind is in ``kinds`` (or it is empty), else None."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # lists of unequal lengths, strange objects
        return None
    return array if array.dtype.kind in kinds or not array.size else None


def real_array(value: object) -> NDArray[Any] | None:
    """Return a value as an array of real numbers of any shape, or None if it is none."""
    return _array(value, "biuf")


def complex_array(field: str, value: object) -> Complex:
    """Return complex numbers of any shape, finite or not; raise InputError for anything else."""
    array = _array(value, "biufc")
    if array is None:
        raise InputError(f"{field}: expected complex numbers, got {shown(value)}")
    return np.asarray(array, dtype=np.complex128)


def number(field: str, value: object, what: str = "a finite number") -> float:
    """Return a finite number; raise InputError, which expects ``what``, for anything else."""
    array = _array(value, "iuf")
    if array is None or array.ndim or not np.isfinite(array):
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return float(array)


def positive(field: str, value: object) -> float:
    """Return a positive finite number; raise InputError for anything else."""
    what = "a positive number"
    if not (found := number(field, value, what)) > 0:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def not_negative(field: str, value: object) -> float:
    """Return a finite number that is not negative; raise InputError for anything else."""
    what = "a number not below zero"
    if not (found := number(field, value, what)) >= 0:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def between(field: str, value: object, low: float, high: float) -> float:
    """Return a number between ``low`` and ``high``, both excluded; raise InputError for anything else."""
    what = f"a number between {low:g} and {high:g}"
    if not low < (found := number(field, value, what)) < high:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def whole(field: str, value: object, least: int = 1, most: int = 2**31 - 1) -> int:
    """Return a whole number from ``least`` to ``most``; raise InputError for anything else."""
    array = _array(value, "iuf")
    if (
        array is None
        or array.ndim
        or not np.isfinite(array)
        or int(array) != array
        or not least <= int(array) <= most
    ):
        range_ = f"from {least}" if most == 2**31 - 1 else f"{least} to {most}"
        raise InputError(f"{field}: expected a whole number {range_}, got {shown(value)}")
    return int(array)


def seed_of(field: str, seed: object) -> int:
    """Return a seed or run number, 0 to 2^64 - 1; raise InputError for anything else."""
    array = _array(seed, "iu")
    if array is None or array.ndim or not 0 <= int(array) < 1 << 64:
        raise InputError(f"{field}: expected a whole number, 0 to 2^64 - 1, got {shown(seed)}")
    return int(array)


def threads_of(value: object) -> int:
    """Return a number of threads, 0 to 1024, where 0 means every core; raise InputError for anything else."""
    return whole("threads", value, 0, _MOST_THREADS)


def switch(field: str, value: object) -> bool:
    """Return a bool; raise InputError for anything else, numbers included."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{field}: expected True or False, got {shown(value)}")
    return bool(value)


def one_of(field: str, value: object, known: Iterable[str]) -> str:
    """Return one of the known words; raise InputError, with the nearest word, for anything else."""
    names = list(known)
    if not isinstance(value, str) or value not in names:
        meant = did_you_mean(value, names)
        raise InputError(f"{field}: expected one of {', '.join(names)}, got {shown(value)}{meant}")
    return value


def words(field: str, value: object) -> str:
    """Return a text; raise InputError for anything else."""
    if not isinstance(value, str):
        raise InputError(f"{field}: expected text, got {shown(value)}")
    return value


def instance(field: str, value: object, *kinds: type[T]) -> T:
    """Return an object of one of these types; raise InputError for any other."""
    if not isinstance(value, kinds):
        expected = " or ".join(kind.__name__ for kind in kinds)
        raise InputError(f"{field}: expected {expected}, got {type(value).__name__}")
    return value


def path_of(field: str, value: object) -> Path:
    """Return a path; raise InputError for other types and for paths that no file can have."""
    if not isinstance(value, str | PathLike):
        raise InputError(f"{field}: expected a path, got {shown(value)}")
    return usable_path(value, InputError, field)


def usable_path(path: str | PathLike[str], kind: type[InputError], field: str = "") -> Path:
    """Return a path; raise an error of ``kind`` for one that no file can have.

    For such names the system raises ValueError or OSError instead of reporting a missing file.
    """
    path, where = Path(path), f"{field}: " if field else ""
    if "\0" in str(path):
        raise kind(f"{where}expected the path of a file, got {shown(str(path))}")
    if any(_bytes(part) > _LONGEST_NAME for part in path.parts) or _bytes(path) > _LONGEST_PATH:
        raise kind(f"{where}expected a shorter path of a file, got {shown(str(path))}")
    return path


def _bytes(path: str | Path) -> int:
    return len(str(path).encode("utf-8", "replace"))


def several(field: str, value: object) -> list[Any]:
    """Return the items of an iterable as a list; raise InputError for text and for anything else."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(f"{field}: expected a list, got {shown(value)}")
    return list(value)


def reals(field: str, value: object, what: str, ndim: int | tuple[int, ...]) -> Real:
    """Return finite real numbers as float64, copied only if needed.

    Raises InputError, which expects ``what``, for other values, for another number of dimensions than
    ``ndim``, and for an empty dimension.
    """
    array = _array(value, "biuf")
    _expect(field, value, array, what, ndim)
    return np.asarray(array, dtype=np.float64)


def complexes(field: str, value: object, what: str, ndim: int | tuple[int, ...]) -> Complex:
    """Return finite complex numbers; dimensions, copies and errors are as in `reals`."""
    array = _array(value, "biufc")
    _expect(field, value, array, what, ndim)
    return np.asarray(array, dtype=np.complex128)


def _expect(
    field: str, value: object, array: NDArray[Any] | None, what: str, ndim: int | tuple[int, ...]
) -> None:
    allowed = (ndim,) if isinstance(ndim, int) else ndim
    if array is None or array.ndim not in allowed or 0 in array.shape:
        got = shown(value) if array is None else f"shape {array.shape}"
        raise InputError(f"{field}: expected {what}, got {got}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        place = ", ".join(str(i) for i in bad[0])
        where = f" at [{place}] ({len(bad)} in all)" if array.ndim else ""
        raise InputError(f"{field}: expected {what}, finite, got {array[tuple(bad[0])]}{where}")


def lines_below(field: str, value: object, n_samples: int) -> Lines:
    """Return ascending lines from 1 to below the Nyquist line of ``n_samples``, possibly none.

    Raises InputError for other numbers, other orders and repetitions.
    """
    array = _array(value, "iuf")
    if (
        array is None
        or array.ndim != 1
        or not np.isfinite(array).all()
        or not np.array_equal(array, np.round(array))
    ):
        raise InputError(f"{field}: expected a list of whole numbers, got {shown(value)}")
    outside = array[(array < 1) | (array >= n_samples / 2)]
    if outside.size:
        raise InputError(
            f"{field}: expected lines from 1 to below {n_samples / 2:g} (Nyquist), got {outside[0]}"
        )
    lines = array.astype(np.int64)
    if np.any(np.diff(lines) <= 0):
        raise InputError(f"{field}: expected ascending lines without repetition")
    return lines


def series_pair(first: str, a: object, second: str, b: object) -> tuple[Real, Real]:
    """Return two series (n,) of finite real numbers; raise InputError unless their lengths are equal.

    ``first`` and ``second`` are the field names of ``a`` and ``b`` in messages.
    """
    found = []
    for field, value in ((first, a), (second, b)):
        array = np.asarray(value)
        if array.dtype.kind not in "biuf" or array.ndim != 1 or not array.size:
            raise InputError(
                f"{field}: expected real numbers of shape (n,), got {array.dtype} of {array.shape}"
            )
        if not np.isfinite(array).all():
            at = int(np.argmax(~np.isfinite(array)))
            raise InputError(
                f"{field}: expected finite numbers, got {array[at]} at sample {at + 1}"
            )
        found.append(array.astype(np.float64))
    if len(found[0]) != len(found[1]):
        raise InputError(
            f"{second}: expected {len(found[0])} samples as {first}, got {len(found[1])}"
        )
    return found[0], found[1]

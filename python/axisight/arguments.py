"""Checks of arguments: what is wrong is named, whatever its type; nothing is guessed."""

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
# Bytes of a name, and of a whole path, that file systems take.
_LONGEST_NAME = 255
_LONGEST_PATH = 4000
# Longer texts are no typing errors of a name.
_LONGEST_WORD = 100
_ALIKE = 0.7


def short(text: str, most: int = 80) -> str:
    """Return a text for a message, cut where it is longer than ``most`` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


def counted(number: int, one: str, many: str = "") -> str:
    """Return a number with its noun: "1 round", "2 rounds", "3 axes" with ``many`` "axes"."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def shown(value: object) -> str:
    """Return a value for a message, cut where it is long."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of {value.dtype} with shape {value.shape}"
    if isinstance(value, str):  # cut first: the text may be that of a whole file
        return short(repr(value[:100]))
    try:
        text = str(value) if isinstance(value, (int, float, np.number)) else repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or nested without end
        text = f"a {type(value).__name__} too large to be shown"
    return short(text)


def nearest(value: object, known: Iterable[str]) -> str | None:
    """Return the known word that a text was meant to be; None where no word is near.

    Case, spaces and dashes do not count. The start of exactly one known word stands for that word.
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
    """Return ``. Did you mean 'word'?`` for the end of a message; nothing where no known word is near."""
    near = nearest(value, known)
    return "" if near is None else f". Did you mean {near!r}?"


def _array(value: object, kinds: str) -> NDArray[Any] | None:
    """Return an array of one of these kinds of numbers, or None."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # lists of unequal lengths, strange objects
        return None
    return array if array.dtype.kind in kinds or not array.size else None


def real_array(value: object) -> NDArray[Any] | None:
    """Return an array of real numbers of any shape, or None."""
    return _array(value, "biuf")


def complex_array(field: str, value: object) -> Complex:
    """Return complex numbers of any shape, finite or not."""
    array = _array(value, "biufc")
    if array is None:
        raise InputError(f"{field}: expected complex numbers, got {shown(value)}")
    return np.asarray(array, dtype=np.complex128)


def number(field: str, value: object, what: str = "a finite number") -> float:
    """Return a finite number."""
    array = _array(value, "iuf")
    if array is None or array.ndim or not np.isfinite(array):
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return float(array)


def positive(field: str, value: object) -> float:
    """Return a positive finite number."""
    what = "a positive number"
    if not (found := number(field, value, what)) > 0:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def not_negative(field: str, value: object) -> float:
    """Return a finite number from zero on."""
    what = "a number not below zero"
    if not (found := number(field, value, what)) >= 0:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def between(field: str, value: object, low: float, high: float) -> float:
    """Return a number between ``low`` and ``high``, neither included."""
    what = f"a number between {low:g} and {high:g}"
    if not low < (found := number(field, value, what)) < high:
        raise InputError(f"{field}: expected {what}, got {shown(value)}")
    return found


def whole(field: str, value: object, least: int = 1, most: int = 2**31 - 1) -> int:
    """Return a whole number from ``least`` to ``most``."""
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
    """Return a seed or the number of a run."""
    array = _array(seed, "iu")
    if array is None or array.ndim or not 0 <= int(array) < 1 << 64:
        raise InputError(f"{field}: expected a whole number, 0 to 2^64 - 1, got {shown(seed)}")
    return int(array)


def threads_of(value: object) -> int:
    """Return a number of threads; 0 stands for every core."""
    return whole("threads", value, 0, _MOST_THREADS)


def switch(field: str, value: object) -> bool:
    """Return True or False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{field}: expected True or False, got {shown(value)}")
    return bool(value)


def one_of(field: str, value: object, known: Iterable[str]) -> str:
    """Return one of the known words."""
    names = list(known)
    if not isinstance(value, str) or value not in names:
        meant = did_you_mean(value, names)
        raise InputError(f"{field}: expected one of {', '.join(names)}, got {shown(value)}{meant}")
    return value


def words(field: str, value: object) -> str:
    """Return text."""
    if not isinstance(value, str):
        raise InputError(f"{field}: expected text, got {shown(value)}")
    return value


def instance(field: str, value: object, *kinds: type[T]) -> T:
    """Return an object of one of these types."""
    if not isinstance(value, kinds):
        expected = " or ".join(kind.__name__ for kind in kinds)
        raise InputError(f"{field}: expected {expected}, got {type(value).__name__}")
    return value


def path_of(field: str, value: object) -> Path:
    """Return a path."""
    if not isinstance(value, str | PathLike):
        raise InputError(f"{field}: expected a path, got {shown(value)}")
    return usable_path(value, InputError, field)


def usable_path(path: str | PathLike[str], kind: type[InputError], field: str = "") -> Path:
    """Return a path; raises an error of ``kind`` for one that no file can have.

    Asked about such names, the system raises instead of saying that there is no such file.
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
    """Return the items of a list, tuple or array."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(f"{field}: expected a list, got {shown(value)}")
    return list(value)


def reals(field: str, value: object, what: str, ndim: int | tuple[int, ...]) -> Real:
    """Return finite numbers (a copy only where needed); none of the axes is empty."""
    array = _array(value, "biuf")
    _expect(field, value, array, what, ndim)
    return np.asarray(array, dtype=np.float64)


def complexes(field: str, value: object, what: str, ndim: int | tuple[int, ...]) -> Complex:
    """Return finite complex numbers (a copy only where needed); none of the axes is empty."""
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
    """Return ascending lines from 1 to below the Nyquist line of ``n_samples``; may be none."""
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
    """Return two series of finite real numbers of one length, (n,) each, by their field names."""
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

"""MAT files of version 5, read by their tags: each is held against the bytes that are there before use.

A file is a row of elements, each a tag (type, size) and its bytes. Variables are elements of type
miMATRIX, or miCOMPRESSED with one inside: flags, dimensions and name, then numbers, or the matrices that
a cell or struct is made of. Nothing is trusted: types other than those that must stand somewhere, sizes
beyond what is around them, and counts that the bytes do not bear out raise LogError.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from pathlib import Path
from struct import unpack_from
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import short
from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader, given, refusing

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_INT8, _INT32, _UINT32 = (1,), (5,), (6,)
# Some writers put these where MATLAB has the types above.
_NAME, _DIMENSIONS = (1, 16), (5, 6)
_NUMBERS = {
    **{1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4"},
    **{7: "f4", 9: "f8", 12: "i8", 13: "u8"},
}
_TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _OBJECT, _CHAR = 1, 2, 3, 4
_NUMERIC = range(6, 16)
_OTHERS = {5: "a sparse matrix", 16: "a function handle", 17: "an object of a class"}
_OPAQUE = 17
_DEEPEST = 32
_MOST_DIMENSIONS = 32
# Enough of a compressed variable for flags, dimensions and name.
_HEAD = 4096
# What a cell or field costs in memory besides its numbers.
_MATRIX_COST = 512


@dataclass(frozen=True)
class _Part:
    """One element: its type, and where its bytes stand."""

    kind: int
    start: int
    stop: int
    next: int


@dataclass(frozen=True)
class _Matrix:
    """A matrix whose flags, dimensions and name are sound; its content begins at ``body``."""

    data: bytes
    order: str
    kind: int
    flags: int
    dims: tuple[int, ...]
    name: str
    body: int
    stop: int

    @property
    def count(self) -> int:
        return prod(self.dims)


def load_mat5(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return a reader for every variable, by dotted name.

    Fields of a struct follow its name after a dot; elements of a struct array by their number from 0
    (`run.0.q`). Raises LogError for a file whose structure is damaged.
    """
    data = path.read_bytes()
    order = _order(data)
    readers: dict[str, Reader] = {}
    names: set[str] = set()
    for part in _parts(data, _HEADER, len(data), order):
        if part.kind not in (_MATRIX, _COMPRESSED):
            raise LogError(
                f"byte {part.start}: expected a variable, got an element of type {part.kind}"
            )
        head = _head(data, part, order)
        if not head.name:  # what MATLAB keeps for itself
            continue
        if head.name in names:
            raise LogError(f"{short(head.name)}: expected one variable of that name, got two")
        names.add(head.name)
        if head.kind in (_CELL, _STRUCT, _OBJECT):
            try:
                matrix = _whole(data, part, order, budget)
            except LogError as error:  # too large, or damaged: that of who asks for it
                readers[head.name] = refusing(str(error))
                continue
            readers |= dict(_leaves(head.name, matrix, budget, 0))
        else:
            readers[head.name] = _later(data, part, order, budget)
    return readers


def _later(data: bytes, part: _Part, order: str, budget: Budget) -> Reader:
    def read() -> NDArray[Any]:
        return _values(_whole(data, part, order, budget), budget, 0)

    return read


def _order(data: bytes) -> str:
    """Return the byte order that the header states."""
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128], "")
    version = unpack_from(f"{order}H", data, 124)[0] >> 8 if order else 0
    if version != 1:
        raise LogError(
            "expected a MAT file of version 5 or 7.3, got one that is truncated, corrupt or of another "
            "format [file_unreadable]"
        )
    return order


def _part(data: bytes, at: int, end: int, order: str) -> _Part:
    """Return the element whose tag stands at ``at``; it ends before ``end``."""
    if at + 8 > end:
        raise LogError(f"byte {at}: expected an element, got the end of what holds it (truncated)")
    kind, size = unpack_from(f"{order}II", data, at)
    if kind >> 16:  # up to four bytes stand inside the tag
        kind, size = kind & 0xFFFF, kind >> 16
        if size > 4:
            raise LogError(f"byte {at}: expected at most 4 bytes in a tag, got {size}")
        return _Part(kind, at + 4, at + 4 + size, at + 8)
    start, stop = at + 8, at + 8 + size
    if stop > end:
        raise LogError(
            f"byte {at}: expected at most {end - start} bytes, got an element of {size} (truncated, corrupt)"
        )
    # Compressed elements alone are not filled up to multiples of 8; the last of a file may not be either.
    after = stop if kind == _COMPRESSED else min(stop + -size % 8, end)
    return _Part(kind, start, stop, after)


def _parts(data: bytes, at: int, end: int, order: str) -> Iterator[_Part]:
    while at < end:
        part = _part(data, at, end, order)
        yield part
        at = part.next


def _expect(data: bytes, at: int, end: int, order: str, kinds: tuple[int, ...], what: str) -> _Part:
    part = _part(data, at, end, order)
    if part.kind not in kinds:
        said = " or ".join(map(str, kinds))
        raise LogError(f"byte {at}: {what}: expected an element of type {said}, got {part.kind}")
    return part


def _head(data: bytes, part: _Part, order: str) -> _Matrix:
    """Return the head of a variable, of a compressed one without inflating the rest."""
    if part.kind == _MATRIX:
        return _matrix(data, part.start, part.stop, order)
    head = _inflate(data, part, _HEAD)
    _declared(head, order)
    # What follows may be cut: only flags, dimensions and name are looked at.
    return _matrix(head, 8, len(head), order)


def _whole(data: bytes, part: _Part, order: str, budget: Budget) -> _Matrix:
    """Return a variable, inflated as far as it declares and no further."""
    if part.kind == _MATRIX:
        return _matrix(data, part.start, part.stop, order)
    size = _declared(_inflate(data, part, 8), order)
    budget.take(size)
    inflated = _inflate(data, part, size + 9)  # one more, for the checksum behind the last
    if len(inflated) != size + 8:
        raise LogError(
            f"byte {part.start}: expected {size} bytes compressed here, got {len(inflated) - 8}"
        )
    return _matrix(inflated, 8, size + 8, order)


def _inflate(data: bytes, part: _Part, most: int) -> bytes:
    """Return the first ``most`` bytes of a compressed element; less is all of it, whose checksum holds."""
    stream = zlib.decompressobj()
    try:
        found = stream.decompress(data[part.start : part.stop], most)
        if len(found) < most and not stream.eof:
            raise LogError(f"byte {part.start}: expected compressed bytes, got the first of them")
        if stream.unused_data:
            raise LogError(
                f"byte {part.start}: expected the end of compressed bytes, got more of them"
            )
        return found
    except zlib.error as error:
        raise LogError(f"byte {part.start}: expected compressed bytes, got {error}") from None


def _declared(inflated: bytes, order: str) -> int:
    """Return the size of the matrix that compressed bytes begin with."""
    if len(inflated) < 8:
        raise LogError("expected a compressed variable, got the end of it")
    kind, size = unpack_from(f"{order}II", inflated)
    if kind != _MATRIX:
        raise LogError(f"expected a compressed variable of type {_MATRIX}, got {kind}")
    return int(size)


def _matrix(data: bytes, at: int, end: int, order: str) -> _Matrix:
    """Return the matrix whose content stands from ``at`` to ``end``, its head checked."""
    flags = _expect(data, at, end, order, _UINT32, "flags")
    if flags.stop - flags.start != 8:
        raise LogError(f"byte {at}: flags: expected 8 bytes, got {flags.stop - flags.start}")
    word = unpack_from(f"{order}I", data, flags.start)[0]
    kind = word & 0xFF
    if kind not in (_CELL, _STRUCT, _OBJECT, _CHAR, *_NUMERIC, *_OTHERS):
        raise LogError(f"byte {flags.start}: expected a class of arrays, got {kind}")
    if kind == _OPAQUE:  # has a name and no dimensions
        name = _expect(data, flags.next, end, order, _NAME, "name")
        text = data[name.start : name.stop].decode("latin-1")
        return _Matrix(data, order, kind, word, (), text, name.next, end)
    sizes = _expect(data, flags.next, end, order, _DIMENSIONS, "dimensions")
    n, rest = divmod(sizes.stop - sizes.start, 4)
    if rest or not 2 <= n <= _MOST_DIMENSIONS:
        raise LogError(f"byte {sizes.start}: expected 2 to {_MOST_DIMENSIONS} dimensions, got {n}")
    dims = unpack_from(f"{order}{n}i", data, sizes.start)
    if min(dims) < 0:
        raise LogError(f"byte {sizes.start}: expected dimensions from 0 on, got {min(dims)}")
    name = _expect(data, sizes.next, end, order, _NAME, "name")
    text = data[name.start : name.stop].decode("latin-1")
    return _Matrix(data, order, kind, word, dims, text, name.next, end)


def _children(matrix: _Matrix, at: int, count: int, budget: Budget) -> list[_Matrix | None]:
    """Return the matrices inside a cell or struct, None for empty ones; they fill it exactly."""
    if count * 8 > matrix.stop - at:
        raise LogError(f"byte {at}: expected at most {(matrix.stop - at) // 8} cells, got {count}")
    budget.take(count * _MATRIX_COST)
    found: list[_Matrix | None] = []
    for _ in range(count):
        part = _expect(matrix.data, at, matrix.stop, matrix.order, (_MATRIX,), "cell or field")
        empty = part.start == part.stop
        found.append(None if empty else _matrix(matrix.data, part.start, part.stop, matrix.order))
        at = part.next
    _end(matrix, at)
    return found


def _end(matrix: _Matrix, at: int) -> None:
    if at != matrix.stop:
        raise LogError(
            f"byte {at}: expected the end of a variable, got {matrix.stop - at} bytes more"
        )


def _fields(matrix: _Matrix) -> tuple[list[str], int]:
    """Return the names of the fields of a struct, and where their values begin."""
    at = matrix.body
    if matrix.kind == _OBJECT:
        at = _expect(matrix.data, at, matrix.stop, matrix.order, _INT8, "class").next
    length = _expect(matrix.data, at, matrix.stop, matrix.order, _INT32, "length of names")
    if length.stop - length.start != 4:
        raise LogError(f"byte {at}: length of names: expected 4 bytes")
    size = unpack_from(f"{matrix.order}i", matrix.data, length.start)[0]
    names = _expect(matrix.data, length.next, matrix.stop, matrix.order, _INT8, "names of fields")
    text = matrix.data[names.start : names.stop]
    if size <= 0 or len(text) % size:
        raise LogError(
            f"byte {names.start}: expected names of {size} bytes, got {len(text)} in all"
        )
    each = [text[k : k + size].split(b"\0")[0] for k in range(0, len(text), size)]
    found = [name.decode("latin-1") for name in each]
    if len(set(found)) != len(found) or "" in found:
        raise LogError(f"byte {names.start}: expected names of fields, each once, got others")
    return found, names.next


def _leaves(
    label: str, matrix: _Matrix, budget: Budget, depth: int
) -> Iterator[tuple[str, Reader]]:
    """Yield what a variable consists of, structs taken apart, with its dotted name."""
    if depth > _DEEPEST:
        raise LogError(f"{short(label)}: expected at most {_DEEPEST} structs inside each other")
    if matrix.kind in (_STRUCT, _OBJECT):
        names, at = _fields(matrix)
        if not matrix.count or not names:
            yield label, given(np.empty(0))
            return
        inside = _children(matrix, at, matrix.count * len(names), budget)
        for number, element in _numbered(matrix):
            own = label if matrix.count == 1 else f"{label}.{number}"
            for k, name in enumerate(names):
                child = inside[element * len(names) + k]
                yield from _of_child(f"{own}.{name}", child, budget, depth)
        return
    if matrix.kind == _CELL:
        cells = _children(matrix, matrix.body, matrix.count, budget)
        if cells and cells[0] is not None and cells[0].kind in (_STRUCT, _OBJECT):
            for number, element in _numbered(matrix):
                own = label if matrix.count == 1 else f"{label}.{number}"
                yield from _of_child(own, cells[element], budget, depth)
            return
    yield label, lambda: _values(matrix, budget, depth)


def _of_child(
    label: str, child: _Matrix | None, budget: Budget, depth: int
) -> Iterator[tuple[str, Reader]]:
    if child is None:
        yield label, given(np.empty(0))
    else:
        yield from _leaves(label, child, budget, depth + 1)


def _numbered(matrix: _Matrix) -> list[tuple[int, int]]:
    """Return the numbers of elements row by row, with their places in the file, column by column."""
    places = np.arange(matrix.count).reshape(matrix.dims, order="F")
    return list(enumerate(places.ravel().tolist()))


def _values(matrix: _Matrix, budget: Budget, depth: int) -> NDArray[Any]:
    """Return the numbers, text or cells of a matrix without singleton dimensions."""
    if depth > _DEEPEST:
        raise LogError(f"expected at most {_DEEPEST} cells inside each other")
    if matrix.kind in _OTHERS:
        raise LogError(f"expected a full array of numbers, got {_OTHERS[matrix.kind]}")
    if matrix.kind in (_STRUCT, _OBJECT):
        raise LogError("expected numbers, got a struct among cells")
    if matrix.kind == _CELL:
        cells = np.empty(matrix.count, dtype=object)
        for k, child in enumerate(_children(matrix, matrix.body, matrix.count, budget)):
            values = np.empty(0) if child is None else _values(child, budget, depth + 1)
            cells[k] = values if values.ndim else values.item()
        return cells.reshape(matrix.dims, order="F").squeeze()
    if matrix.kind == _CHAR:
        return _text(matrix)
    budget.take_values(matrix.dims, 16 if matrix.flags & 0x0800 else 8)
    values, at = _numbers(matrix, matrix.body)
    if matrix.flags & 0x0800:
        imaginary, at = _numbers(matrix, at)
        values = values + 1j * imaginary
    _end(matrix, at)
    if matrix.flags & 0x0200:
        values = values.astype(bool)
    return values.reshape(matrix.dims, order="F").squeeze()


def _numbers(matrix: _Matrix, at: int) -> tuple[NDArray[Any], int]:
    """Return the numbers of one part, as many as the dimensions say, and where it ends."""
    part = _part(matrix.data, at, matrix.stop, matrix.order)
    if part.kind not in _NUMBERS:
        raise LogError(f"byte {at}: expected an element of numbers, got type {part.kind}")
    dtype = np.dtype(f"{matrix.order}{_NUMBERS[part.kind]}")
    size = part.stop - part.start
    if size != matrix.count * dtype.itemsize:
        raise LogError(
            f"byte {at}: expected {matrix.count} numbers of {dtype.itemsize} bytes, got {size} bytes"
        )
    return np.frombuffer(matrix.data, dtype, matrix.count, part.start), part.next


def _text(matrix: _Matrix) -> NDArray[Any]:
    """Return characters as one text, or one for each row."""
    if not matrix.count:
        return np.array("")
    part = _part(matrix.data, matrix.body, matrix.stop, matrix.order)
    codec = _TEXTS.get(part.kind)
    if codec is None:
        raise LogError(f"byte {matrix.body}: expected an element of text, got type {part.kind}")
    if codec in ("utf-16", "utf-32"):
        codec += {"<": "-le", ">": "-be"}[matrix.order]
    _end(matrix, part.next)
    text = matrix.data[part.start : part.stop].decode(codec, "replace")
    if len(text) != matrix.count:
        raise LogError(f"expected {matrix.count} characters, got {len(text)}")
    letters = np.array(list(text)).reshape(matrix.dims, order="F")
    rows = ["".join(row) for row in letters.reshape(-1, letters.shape[-1])]
    return np.array(rows).squeeze()

"""Read MAT files of version 5, checking every tag against the bytes in the file before use.

A file is a sequence of elements, each a tag (type, size) and its bytes. A variable is an element of type
miMATRIX, or of type miCOMPRESSED with a miMATRIX inside. It has flags, dimensions and a name, then its
numbers, or the matrices of a cell or struct. Nothing is trusted: unexpected types, sizes beyond the
enclosing element, and counts that disagree with the bytes raise LogError.
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
# Some writers use other types than MATLAB for names and dimensions.
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
# Bytes of a compressed variable that cover flags, dimensions and name.
_HEAD = 4096
# Bytes that a cell or field takes in memory besides its numbers.
_MATRIX_COST = 512


@dataclass(frozen=True)
class _Part:
    """One element: its type, the range of its bytes, and the start of the next element."""

    kind: int
    start: int
    stop: int
    next: int


@dataclass(frozen=True)
class _Matrix:
    """A matrix with checked flags, dimensions and name; its content begins at byte ``body``."""

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

    Fields of a struct follow its name after a dot; elements of a struct array are numbered from 0
    (`run.0.q`). Raises LogError for a file with a damaged structure.
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
        if not head.name:  # internal data of MATLAB
            continue
        if head.name in names:
            raise LogError(f"{short(head.name)}: expected one variable of that name, got two")
        names.add(head.name)
        if head.kind in (_CELL, _STRUCT, _OBJECT):
            try:
                matrix = _whole(data, part, order, budget)
            except LogError as error:  # too large or damaged, which matters only if a map needs it
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
    """Return the byte order that the header states; raise LogError for another format."""
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128], "")
    version = unpack_from(f"{order}H", data, 124)[0] >> 8 if order else 0
    if version != 1:
        raise LogError(
            "expected a MAT file of version 5 or 7.3, got one that is truncated, corrupt or of another "
            "format [file_unreadable]"
        )
    return order


def _part(data: bytes, at: int, end: int, order: str) -> _Part:
    """Return the element whose tag begins at ``at``; raise LogError unless it ends by ``end``."""
    if at + 8 > end:
        raise LogError(f"byte {at}: expected an element, got the end of what holds it (truncated)")
    kind, size = unpack_from(f"{order}II", data, at)
    if kind >> 16:  # small format: the tag itself holds up to four bytes
        kind, size = kind & 0xFFFF, kind >> 16
        if size > 4:
            raise LogError(f"byte {at}: expected at most 4 bytes in a tag, got {size}")
        return _Part(kind, at + 4, at + 4 + size, at + 8)
    start, stop = at + 8, at + 8 + size
    if stop > end:
        raise LogError(
            f"byte {at}: expected at most {end - start} bytes, got an element of {size} (truncated, corrupt)"
        )
    # Elements are padded to multiples of 8 bytes, except compressed ones and perhaps the last of a file.
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
    """Return the head of a variable; inflate no more than the head of a compressed one."""
    if part.kind == _MATRIX:
        return _matrix(data, part.start, part.stop, order)
    head = _inflate(data, part, _HEAD)
    _declared(head, order)
    # Here the content may be cut off: callers use only flags, dimensions and name.
    return _matrix(head, 8, len(head), order)


def _whole(data: bytes, part: _Part, order: str, budget: Budget) -> _Matrix:
    """Return a variable; inflate no more than its declared size."""
    if part.kind == _MATRIX:
        return _matrix(data, part.start, part.stop, order)
    size = _declared(_inflate(data, part, 8), order)
    budget.take(size)
    # One byte more than declared, so that zlib reaches the end and verifies the checksum.
    inflated = _inflate(data, part, size + 9)
    if len(inflated) != size + 8:
        raise LogError(
            f"byte {part.start}: expected {size} bytes compressed here, got {len(inflated) - 8}"
        )
    return _matrix(inflated, 8, size + 8, order)


def _inflate(data: bytes, part: _Part, most: int) -> bytes:
    """Return up to ``most`` bytes of a compressed element; fewer are the whole element, checksum verified."""
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
    """Return the declared size of the matrix at the start of inflated bytes."""
    if len(inflated) < 8:
        raise LogError("expected a compressed variable, got the end of it")
    kind, size = unpack_from(f"{order}II", inflated)
    if kind != _MATRIX:
        raise LogError(f"expected a compressed variable of type {_MATRIX}, got {kind}")
    return int(size)


def _matrix(data: bytes, at: int, end: int, order: str) -> _Matrix:
    """Return the matrix with its content from ``at`` to ``end``; raise LogError for a wrong head."""
    flags = _expect(data, at, end, order, _UINT32, "flags")
    if flags.stop - flags.start != 8:
        raise LogError(f"byte {at}: flags: expected 8 bytes, got {flags.stop - flags.start}")
    word = unpack_from(f"{order}I", data, flags.start)[0]
    kind = word & 0xFF
    if kind not in (_CELL, _STRUCT, _OBJECT, _CHAR, *_NUMERIC, *_OTHERS):
        raise LogError(f"byte {flags.start}: expected a class of arrays, got {kind}")
    if kind == _OPAQUE:  # such an object has a name but no dimensions
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
    """Return the matrices in a cell or struct, None for empty ones; raise LogError unless they fill it."""
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
    """Return the field names of a struct, and the byte at which the values begin."""
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
    """Yield dotted name and reader of every array in a variable; structs are taken apart."""
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
    """Return (number, place): elements are numbered row by row, the file stores them column by column."""
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
    """Return the numbers at byte ``at`` and the end of their element; raise LogError for a wrong count."""
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
    """Return a character matrix as one text per row, 0-dimensional for a single row."""
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

"""Read what the footer of a Parquet file declares about its columns, without pyarrow.

pyarrow reads the data itself. But if a histogram in the footer is damaged, asking pyarrow for the metadata of
a column ends the process (pyarrow 26: nothing catches an exception of its C++ part). The footer is one struct
of Thrift's compact protocol: integers with seven bits per byte, fields by number.
Source: the specifications of Apache Parquet (parquet.thrift) and Apache Thrift (compact protocol).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from axisight.errors import LogError

_MAGIC = b"PAR1"
# The structs and lists of Parquet itself nest ten deep.
_DEEPEST = 16
_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT, _UUID = range(
    1, 14
)
_FIXED = {_BYTE: 1, _DOUBLE: 8, _UUID: 16}
# Field numbers in parquet.thrift.
_ROW_GROUPS, _COLUMNS, _METADATA = 4, 1, 3
_PATH, _VALUES, _UNPACKED = 3, 5, 6


@dataclass(frozen=True)
class Chunk:
    """What a file declares about a column in one row group: dotted path, values, uncompressed bytes."""

    path: str
    values: int
    unpacked_bytes: int


def chunks(path: Path) -> Iterator[Chunk]:
    """Yield what a file declares about each column of each row group; raise LogError for a damaged footer."""
    try:
        footer = _Compact(_footer(path)).struct()
        for group in footer.get(_ROW_GROUPS, []):
            for column in group.get(_COLUMNS, []):
                told = column[_METADATA]
                name = ".".join(part.decode("utf-8") for part in told[_PATH])
                yield Chunk(name, int(told[_VALUES]), int(told[_UNPACKED]))
    except (IndexError, KeyError, TypeError, AttributeError, ValueError) as error:
        raise LogError(f"{path}: expected a sound Parquet footer, got damage ({error})") from None


def _footer(path: Path) -> bytes:
    with path.open("rb") as file:
        begin = max(file.seek(0, 2) - 8, 0)
        file.seek(begin)
        end = file.read(8)
        size = int.from_bytes(end[:4], "little")
        if end[4:] != _MAGIC or size > begin:
            raise ValueError("no footer")
        file.seek(begin - size)
        return file.read(size)


class _Compact:
    """A reader of one message in the compact protocol; raises IndexError if the message ends too early."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.depth = data, 0, 0

    def struct(self) -> dict[int, Any]:
        """Return the fields of a struct by number."""
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            step, kind = head >> 4, head & 15
            number = number + step if step else self._signed()
            # The kind of a boolean field is its value.
            fields[number] = kind == _TRUE if kind in (_TRUE, _FALSE) else self._value(kind)
        return fields

    def _value(self, kind: int) -> Any:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ValueError("nested too deep")
        value = self._read(kind)
        self.depth -= 1
        return value

    def _read(self, kind: int) -> Any:
        if kind in (_I16, _I32, _I64):
            return self._signed()
        if kind == _BINARY:
            return self._take(self._unsigned())
        if kind in (_LIST, _SET):
            head = self._byte()
            size = head >> 4 if head >> 4 < 15 else self._unsigned()
            return [self._entry(head & 15) for _ in range(size)]
        if kind == _MAP:
            size = self._unsigned()
            kinds = self._byte() if size else 0
            return [(self._entry(kinds >> 4), self._entry(kinds & 15)) for _ in range(size)]
        if kind == _STRUCT:
            return self.struct()
        if kind not in _FIXED:
            raise ValueError(f"kind {kind}")
        return self._take(_FIXED[kind])

    def _entry(self, kind: int) -> Any:
        return self._byte() if kind in (_TRUE, _FALSE) else self._value(kind)

    def _byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def _take(self, size: int) -> bytes:
        if self.at + size > len(self.data):
            raise IndexError("cut off")
        self.at += size
        return self.data[self.at - size : self.at]

    def _unsigned(self) -> int:
        out = shift = 0
        while True:
            byte = self._byte()
            out |= (byte & 127) << shift
            if byte < 128:
                return out
            shift += 7
            if shift > 63:
                raise ValueError("a number too long")

    def _signed(self) -> int:
        zigzag = self._unsigned()
        return (zigzag >> 1) ^ -(zigzag & 1)

"""Results on disk: one Zarr group per block of runs, written whole or not at all.

Layout of the folder of a study::

    study.toml             the study, for people
    study.zarr/            Zarr v3; provenance in the attributes of the root group
        blocks/00000032-32/    accumulators of runs 32 to 63, their SHA-256 in the attributes
        result/                the finished result, an xarray Dataset

The store writes a block to a folder next to it and moves it in by one rename, so a killed process
leaves either all of a block or nothing. Blocks that fail their checksum are computed again.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
import zarr
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from axisight.arguments import short, shown
from axisight.documents import parse_json, read_text
from axisight.errors import StoreError, StudyError
from axisight.montecarlo.design import Arrays, differences, digest, settings_of

FORMAT: Final = "axisight.montecarlo.store/1"


# One file per array instead of a tree of folders.
_FLAT: Final[dict[str, Any]] = {"name": "default", "configuration": {"separator": "."}}
# All types and codecs that this module writes; others come from foreign or changed files.
_INTEGERS = [f"{sign}int{n}" for sign in ("", "u") for n in (8, 16, 32, 64)]
_TYPES: Final = frozenset(["bool", *_INTEGERS, "float32", "float64", "complex64", "complex128"])
_CODECS: Final = ("bytes", "zstd")
# Limits of the declared size of blocks, in total and per byte on disk, against crafted files.
_MOST_BYTES: Final = 2**28
_MOST_PER_BYTE: Final = 1000


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Convert errors of the disk to a StoreError that names the path."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise StoreError(
            f"{path}: cannot be written: {reason}; finished blocks are kept, resume to go on"
        ) from error


def checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 over names, types, shapes and bytes."""
    sha = hashlib.sha256()
    for name in sorted(arrays):
        value = np.ascontiguousarray(arrays[name])
        sha.update(f"{name} {value.dtype.str} {value.shape}\n".encode())
        sha.update(value.tobytes())
    return sha.hexdigest()


class Store:
    """The blocks of one study on disk; open it with :func:`open_store`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.root = folder / "study.zarr"
        self.blocks = self.root / "blocks"

    def create(self, study_toml: str, provenance: Mapping[str, Any]) -> None:
        """Create the store in a new or empty folder."""
        with writing(self.folder):
            new = self.folder / ".tmp-root"
            shutil.rmtree(new, ignore_errors=True)
            root = zarr.create_group(store=str(new), zarr_format=3, attributes=dict(provenance))
            root.create_group("blocks")
            (self.folder / "study.toml").write_text(study_toml, "utf-8")
            new.rename(self.root)

    def provenance(self) -> dict[str, Any]:
        """Return the provenance of the store; raises StoreError, with advice, for a damaged one."""
        if not self.root.is_dir():
            raise StoreError(f"{self.root}: expected a store of a study, got nothing")
        try:
            return dict(_opened(self.root).attrs)
        # Damaged files make the readers of JSON and groups raise exceptions of any type.
        except Exception as error:
            raise self.damaged(short(str(error))) from None

    def begun_with(self) -> tuple[str, int]:
        """Return design and seed; raises StoreError if they are missing or the design was changed."""
        found = self.provenance()
        design, seed = found.get("design"), found.get("seed")
        if not isinstance(design, str) or not isinstance(seed, int):
            raise self.damaged("design and seed are not both there")
        if found.get("design_sha256") != digest(design):
            raise self.damaged("the design is not the one its SHA-256 is of")
        return design, seed

    def damaged(self, reason: str) -> StoreError:
        """Return the error for damaged metadata, without which the blocks have no meaning."""
        return StoreError(
            f"{self.root / 'zarr.json'}: expected what the study was begun with, got a damaged file ({reason}): "
            "put back a copy of it, or begin the study anew in another folder"
        )

    def path(self, first: int, count: int) -> Path:
        """Return the path of a block."""
        return self.blocks / f"{first:08d}-{count}"

    def stored(self) -> dict[int, int]:
        """Return the number of runs of each stored block by first run; blocks are not checked."""
        out: dict[int, int] = {}
        for path in self.blocks.iterdir():
            first, _, count = path.name.partition("-")
            if first.isdigit() and count.isdigit():
                out[int(first)] = max(int(count), out.get(int(first), 0))
        return out

    def write(self, first: int, count: int, arrays: Arrays) -> None:
        """Store a block, and delete the shorter ones that it replaces."""
        path = self.path(first, count)
        with writing(path):
            new = self.folder / f".tmp-{path.name}"
            shutil.rmtree(new, ignore_errors=True)
            attributes = {"first_run": first, "runs": count, "sha256": checksum(arrays)}
            group = zarr.create_group(store=str(new), zarr_format=3, attributes=attributes)
            for name, value in arrays.items():
                chunks = tuple(max(1, n) for n in value.shape)
                group.create_array(name, data=value, chunks=chunks, chunk_key_encoding=_FLAT)
            shutil.rmtree(path, ignore_errors=True)
            new.rename(path)
            for other in self.blocks.glob(f"{first:08d}-*"):
                if other != path:
                    shutil.rmtree(other)

    def read(self, first: int, count: int) -> Arrays | None:
        """Return a block, or None if it is damaged or not written by :meth:`write`."""
        # Damaged blocks raise exceptions of any type, from missing files to those of codecs.
        try:
            group = _opened(self.path(first, count))
            arrays = {name: np.asarray(array[...]) for name, array in group.arrays()}
            return arrays if group.attrs["sha256"] == checksum(arrays) else None
        except Exception:
            return None

    def write_result(self, result: xr.Dataset) -> None:
        """Store the finished result next to the blocks."""
        target, new = self.root / "result", self.folder / ".tmp-result"
        with writing(target):
            shutil.rmtree(new, ignore_errors=True)
            result.to_zarr(str(new), zarr_format=3, consolidated=False)
            shutil.rmtree(target, ignore_errors=True)
            new.rename(target)


def _opened(path: Path) -> zarr.Group:
    """Return an opened group if this module can have written its metadata; raises ValueError otherwise.

    The check comes before Zarr uses the metadata, because foreign metadata can name codecs that execute
    what they unpack, object types, and huge sizes.
    """
    found = _described(path, "group")
    if found.get("consolidated_metadata") is not None:
        raise ValueError(f"{path}: expected a description in every folder")
    declared, stored = 0, 0
    for below in path.iterdir():
        if below.is_dir() and path.parent.name == "blocks":
            declared += _declared(below)
            stored += sum(file.stat().st_size for file in below.rglob("*") if file.is_file())
    if declared > _MOST_BYTES + _MOST_PER_BYTE * stored:
        raise ValueError(f"{path}: expected accumulators, got {declared} bytes declared")
    return zarr.open_group(store=str(path), mode="r", zarr_format=3, use_consolidated=False)


def _described(path: Path, kind: str) -> dict[str, Any]:
    found = parse_json(read_text(path / "zarr.json"))
    if not isinstance(found, dict) or (found.get("zarr_format"), found.get("node_type")) != (
        3,
        kind,
    ):
        raise ValueError(f"{path}: expected the description of a Zarr 3 {kind}")
    return found


def _declared(path: Path) -> int:
    """Return the declared size of an array [bytes]; raises ValueError for foreign types and codecs."""
    found = _described(path, "array")
    shape, kind = found["shape"], found["data_type"]
    codecs = [(codec["name"], set(codec)) for codec in found["codecs"]]
    if kind not in _TYPES or codecs != [(name, {"name", "configuration"}) for name in _CODECS]:
        raise ValueError(
            f"{path}: expected numbers in {', '.join(_CODECS)}, got {short(repr(found))}"
        )
    whole = {"name": "regular", "configuration": {"chunk_shape": [max(1, n) for n in shape]}}
    if found["chunk_grid"] != whole or found.get("storage_transformers"):
        raise ValueError(f"{path}: expected an array in one piece")
    return int(prod(shape) * np.dtype(kind).itemsize)


def check_same(store: Store, design: str, seed: int) -> None:
    """Raise StudyError naming the fields in which a study differs from the stored one."""
    stored = store.provenance()
    if stored.get("format") != FORMAT:
        raise StudyError(
            f"{store.root}: format: expected {FORMAT}, got {shown(stored.get('format'))}"
        )
    try:
        was, seeded = parse_json(stored["design"]), stored["seed"]
    except (KeyError, TypeError, ValueError) as error:
        raise store.damaged(short(f"{type(error).__name__}: {error}")) from None
    found = differences(was, settings_of(design)) + differences(seeded, seed, "seed")
    if found:
        raise StudyError(f"{store.folder}: cannot resume: {'; '.join(found)}")


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the store of a study with a lock, so that no other process writes to it."""
    # The system releases the lock when the process ends in any way.
    lock = FileLock(folder / ".lock", blocking=False)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire()
        except Timeout:
            raise StoreError(f"{folder}: another process is writing this study") from None
    try:
        for left in folder.glob(".tmp-*"):
            shutil.rmtree(left, ignore_errors=True)
        yield Store(folder)
    finally:
        lock.release()

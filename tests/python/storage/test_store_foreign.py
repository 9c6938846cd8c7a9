"""A store that somebody else has written into: nothing it names is followed that the package does not write."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import zarr

from axisight.errors import StoreError, StudyError
from axisight.montecarlo.store import FORMAT, Store, check_same

ARRAYS = {
    "sums": np.arange(6.0).reshape(2, 3),
    "counts": np.arange(3, dtype=np.uint64),
    "spectra": np.ones(4, dtype=np.complex128),
    "failures": np.zeros((0, 2), dtype=np.int64),
}


@pytest.fixture
def store(tmp_path):
    made = Store(tmp_path)
    made.create("", {"format": FORMAT, "design": "{}", "seed": 1})
    made.write(0, 4, ARRAYS)
    return made


def described(path):
    return json.loads((path / "zarr.json").read_text())


def describe(path, **changes):
    (path / "zarr.json").write_text(json.dumps(described(path) | changes))


def test_what_was_written_is_read(store):
    found = store.read(0, 4)
    for name, values in ARRAYS.items():
        np.testing.assert_array_equal(found[name], values)
        assert found[name].dtype == values.dtype


class Bomb:
    """Leaves a file behind when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.mark.parametrize("kind", ["pickle", "numcodecs.pickle", "json2", "gzip", "blosc"])
def test_codecs_that_the_package_does_not_write(store, tmp_path, monkeypatch, kind):
    array = store.path(0, 4) / "sums"
    codecs = described(array)["codecs"]
    describe(array, codecs=[codecs[0], {"name": kind, "configuration": {}}])
    chunk = next(file for file in array.rglob("c.*") if file.is_file())
    chunk.write_bytes(pickle.dumps(Bomb(tmp_path / "was here")))
    asked = []
    monkeypatch.setattr(zarr, "open_group", lambda **options: asked.append(options))
    assert store.read(0, 4) is None
    assert not asked  # Zarr does not come to see the names of codecs
    assert not (tmp_path / "was here").exists()


@pytest.mark.parametrize(
    "changes",
    [
        {"data_type": "object"},
        {"data_type": "string"},
        {"data_type": {"name": "numpy.void", "configuration": {}}},
        {"shape": [10**6, 10**6]},
        {"shape": [-1, 3]},
        {"shape": "ab"},
        {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [10**9, 10**9]}}},
        {"codecs": []},
        {"codecs": None},
        {"storage_transformers": [{"name": "x"}]},
        {"zarr_format": 2},
        {"node_type": "group"},
    ],
)
def test_arrays_that_the_package_does_not_write(store, monkeypatch, changes):
    describe(store.path(0, 4) / "sums", **changes)
    asked = []
    monkeypatch.setattr(zarr, "open_group", lambda **options: asked.append(options))
    assert store.read(0, 4) is None
    assert not asked


def test_a_large_array_of_nothing_is_not_made(store):
    grid = {"name": "regular", "configuration": {"chunk_shape": [10**6, 10**6]}}
    describe(store.path(0, 4) / "sums", shape=[10**6, 10**6], chunk_grid=grid)
    assert store.read(0, 4) is None


def test_a_group_of_the_older_format_is_not_read(store):
    path = store.path(0, 4)
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / ".zattrs").write_text("{}")
    (path / "zarr.json").unlink()
    assert store.read(0, 4) is None


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 100_000, "9" * 5000, "[]", '{"zarr_format": 2, "node_type": "group"}']
)
def test_a_root_that_is_none(store, text):
    (store.root / "zarr.json").write_text(text)
    with pytest.raises(StoreError, match=r"zarr\.json: .*damaged file .*put back") as caught:
        store.provenance()
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    "attributes",
    [
        {"format": "x" * 10**5},
        {"format": FORMAT},
        {"format": FORMAT, "design": "[" * 10**5, "seed": 1},
        {"format": FORMAT, "design": 7, "seed": 1},
    ],
)
def test_provenance_that_is_none(store, attributes):
    describe(store.root, attributes=attributes)
    with pytest.raises((StudyError, StoreError), match=r"study\.zarr") as caught:
        check_same(store, "{}", 1)
    assert len(str(caught.value)) < 1000

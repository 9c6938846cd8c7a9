"""Datasets of an HDF5 file by its links: each once, whatever rings and names there are."""

import h5py
import numpy as np

from axisight.logs.gather import _numbers
from axisight.logs.sources_hdf5 import walk


def test_every_object_comes_once(tmp_path):
    path = tmp_path / "ring.h5"
    with h5py.File(path, "w") as file:
        file["a"] = [1.0]
        file["group/again"] = file["a"]
        file["group/itself"] = file["group"]
        file["group/root"] = file["/"]
        file["group/inner/b"] = [2.0]
        file["soft"] = h5py.SoftLink("/a")
        file["else"] = h5py.ExternalLink("other.h5", "/a")
    with h5py.File(path) as file:
        found = list(walk(file))
        items = [(name, item.name) for name, _, item in found if isinstance(item, h5py.Dataset)]
        kinds = {name: type(link) for name, link, _ in found}
    assert sorted(items) == [("a", "/a"), ("group/inner/b", "/group/inner/b")]
    assert (kinds["soft"], kinds["else"]) == (h5py.SoftLink, h5py.ExternalLink)


def test_as_the_library_visits_a_sound_file(tmp_path):
    """Groups of many links, compact and dense, in order of creation or not."""
    path = tmp_path / "sound.h5"
    for dense in (False, True):
        with h5py.File(path, "w", libver="latest" if dense else "earliest") as file:
            for i in range(40):
                group = file.create_group(f"g{i}", track_order=dense)
                for k in range(i):
                    group[f"é{k}"] = np.zeros(1)
            expected: list[str] = []
            file.visititems(
                lambda name, item, names=expected: (
                    names.append(name) if isinstance(item, h5py.Dataset) else None
                )
            )
            found = sorted(name for name, _, x in walk(file) if isinstance(x, h5py.Dataset))
        assert len(found) == 780
        assert found == sorted(expected)


def test_numbers_that_signal_are_no_numbers():
    """A damaged float may be a signal, of which NumPy warns where it is widened."""
    signal = np.array([0x7FA00000, 0x3F800000], dtype=np.uint32).view(np.float32)
    np.testing.assert_array_equal(_numbers(signal), [np.nan, 1.0])

"""MAT files of version 5 by their tags: damage is refused wherever it is, and what is sound is read as SciPy does."""

import struct
import zlib

import numpy as np
import pytest
import scipy.io

from axisight.errors import LogError
from axisight.logs.sources import load_arrays
from reading_children import read_in_child, wrong

MAP = """
sample_rate_hz = 100.0
[[axis]]
position = { name = "NAME", unit = "rad" }
torque = { name = "NAME", unit = "Nm" }
"""
Q = np.sin(0.1 * np.arange(120)).round(3)
KINDS = {
    "plain": ({"q": Q}, "q", False),
    "compressed": ({"q": Q}, "q", True),
    "struct": ({"s": {"q": Q, "text": "abc"}}, "s.q", False),
    "struct array": ({"s": np.array([(Q, 1.0)], dtype=[("q", "O"), ("n", "O")])}, "s.q", True),
    "cell": ({"q": np.array([Q, Q[:3]], dtype=object)}, "q", False),
    "char": ({"q": "some text"}, "q", False),
    "complex": ({"q": Q + 1j}, "q", False),
    "logical": ({"q": Q > 0}, "q", False),
}


def saved(path, content, packed):
    scipy.io.savemat(path, content, do_compression=packed)
    data = path.read_bytes()
    return data


@pytest.mark.parametrize("kind", KINDS)
def test_changed_bytes_are_refused_or_read_and_kill_nobody(tmp_path, kind):
    content, name, packed = KINDS[kind]
    data = saved(tmp_path / "good.mat", content, packed)
    rng = np.random.default_rng(11)
    text = MAP.replace("NAME", name)
    places = np.concatenate([np.arange(124, min(len(data), 300)), rng.integers(124, len(data), 60)])
    paths = []
    # Type codes 9 to 24 in the place of another were what killed the process.
    for number, place in enumerate(places):
        for value in (int(rng.integers(256)), int(rng.integers(9, 25))):
            spoiled = bytearray(data)
            spoiled[place] = value
            paths.append(tmp_path / f"{number}-{value}.mat")
            paths[-1].write_bytes(spoiled)
    outcomes = read_in_child(paths, text, limit=2 * 10**9)
    assert wrong(outcomes) == []
    refused = [said for said, _ in outcomes if said != "read"]
    assert refused
    assert all(".mat: " in said for said in refused)


CONTENT = {
    "scalar": 2.5,
    "row": np.arange(5.0),
    "matrix": np.arange(6, dtype=np.int16).reshape(2, 3),
    "cube": np.arange(24, dtype=np.float32).reshape(2, 3, 4),
    "complex": np.array([1 + 2j, 3 - 1j]),
    "flags": np.array([True, False]),
    "text": "hello",
    "rows": np.array(["ab", "cd"]),
    "empty": np.zeros((0, 3)),
    "cells": np.array([np.arange(3.0), "x", 4.0], dtype=object),
}


@pytest.mark.parametrize("packed", [False, True])
def test_variables_are_those_of_scipy(tmp_path, packed):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, CONTENT, do_compression=packed)
    wanted = scipy.io.loadmat(path, squeeze_me=True)
    found = load_arrays(path)
    assert set(found) == {name for name in wanted if not name.startswith("__")}
    for name, values in found.items():
        if name == "cells":
            for mine, own in zip(values, wanted[name], strict=True):
                np.testing.assert_array_equal(mine, own)
        elif values.size:
            np.testing.assert_array_equal(values, wanted[name])


def test_structs_and_their_arrays_have_dotted_names(tmp_path):
    inner = np.zeros((2, 2), dtype=[("q", "O")])
    for k in range(4):
        inner.flat[k] = (np.arange(3.0) + k,)
    scipy.io.savemat(tmp_path / "a.mat", {"s": {"a": {"b": 3.0}, "runs": inner}})
    found = load_arrays(tmp_path / "a.mat")
    assert set(found) == {"s.a.b", *(f"s.runs.{k}.q" for k in range(4))}
    for k in range(4):  # row by row
        np.testing.assert_array_equal(found[f"s.runs.{k}.q"], np.arange(3.0) + k)


def test_what_is_no_array_hinders_only_who_asks_for_it(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"q": Q, "m": scipy.sparse.eye(3).tocsc()})
    found = load_arrays(tmp_path / "a.mat")
    np.testing.assert_array_equal(found["q"], Q)
    with pytest.raises(LogError, match="expected a full array of numbers, got a sparse matrix"):
        found["m"]


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matrix(body, kind=6, dims=(1, 1), name=b"q", flags=6):
    sizes = struct.pack(f"<{len(dims)}i", *dims)
    head = element(flags, struct.pack("<II", kind, 0)) + element(5, sizes) + element(1, name)
    return element(14, head + body)


def file_of(path, *elements):
    path.write_bytes(b" " * 124 + b"\0\x01IM" + b"".join(elements))
    return path


NUMBER = element(9, struct.pack("<d", 1.0))


@pytest.mark.parametrize(
    ("elements", "words"),
    [
        ([matrix(NUMBER, flags=9)], "flags: expected an element of type 6, got 9"),
        ([matrix(element(14, b""))], "expected an element of numbers, got type 14"),
        ([matrix(NUMBER, dims=(1, 2))], "expected 2 numbers of 8 bytes, got 8 bytes"),
        ([matrix(NUMBER, dims=(-1, 1))], "expected dimensions from 0 on, got -1"),
        ([matrix(NUMBER, dims=(1,) * 40)], "expected 2 to 32 dimensions, got 40"),
        ([matrix(NUMBER + NUMBER)], "expected the end of a variable, got 16 bytes more"),
        ([matrix(NUMBER, kind=99)], "expected a class of arrays, got 99"),
        ([matrix(NUMBER), matrix(NUMBER)], "q: expected one variable of that name, got two"),
        ([matrix(NUMBER, kind=1, dims=(10**6, 10**6))], "expected at most 2 cells"),
        ([struct.pack("<II", 14, 10**9)], "got an element of 1000000000"),
        ([element(7, b"1234")], "expected a variable, got an element of type 7"),
    ],
)
def test_what_must_not_stand_somewhere_is_refused(tmp_path, elements, words):
    path = file_of(tmp_path / "a.mat", *elements)
    with pytest.raises(LogError, match=words):
        load_arrays(path)["q"]


def test_cells_inside_cells_come_to_an_end(tmp_path):
    body = NUMBER
    for _ in range(40):
        body = matrix(body, kind=1 if body is not NUMBER else 6, name=b"")
    inner = matrix(body, kind=1)
    with pytest.raises(LogError, match="expected at most 32 cells inside each other"):
        load_arrays(file_of(tmp_path / "a.mat", inner))["q"]


def test_a_compressed_variable_is_inflated_no_further_than_it_declares(tmp_path):
    zeros = matrix(element(9, bytes(8 * 10**7)), dims=(10**7, 1))
    packed = zlib.compress(zeros, 9)
    path = file_of(tmp_path / "a.mat", struct.pack("<II", 15, len(packed)) + packed)
    assert path.stat().st_size < 10**5
    with pytest.raises(LogError, match=r"max_bytes"):
        load_arrays(path)["q"]
    short = zlib.compress(zeros[:-8], 9)
    path = file_of(tmp_path / "b.mat", struct.pack("<II", 15, len(short)) + short)
    assert "q" in load_arrays(path)

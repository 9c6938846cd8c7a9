"""Small files cannot cost much: what they declare is held against a limit before it is read."""

import gzip
import io
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.errors import InputError, LogError
from axisight.logs import check_log, parse_column_map, read_log
from logs_data import native_columns, write
from reading_children import read_in_child

# Of the whole process, interpreter and libraries included (MB).
_MOST_MB = 500


def refused(path, *words, columns=None):
    """Read in a child that may take 500 MB at most; the message has the words."""
    [(said, used)] = read_in_child([path], columns, seconds=30)
    assert said.startswith("refused: "), said
    assert used < _MOST_MB
    for word in (path.name, *words):
        assert word in said
    return said


def declared_hdf5(path, rows):
    with h5py.File(path, "w") as file:
        for name in ("time_s", "position_1", "torque_cmd_1"):
            file.create_dataset(name, (rows,), "f8", chunks=(1024,))
    return path


def test_hdf5_data_sets_that_were_never_written(tmp_path):
    path = declared_hdf5(tmp_path / "a.h5", 130_000_000)
    assert path.stat().st_size < 20_000
    refused(path, "1040 MB by what the file declares", "max_bytes")


def test_one_chunk_of_hdf5_is_unpacked_whole(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("time_s", "position_1", "torque_cmd_1"):
            file.create_dataset(
                name, (10,), "f8", maxshape=(None,), chunks=(10**8,), compression="gzip"
            )
    refused(tmp_path / "a.h5", "800 MB by what")


def test_values_in_other_files_are_not_read(tmp_path):
    (tmp_path / "secret").write_bytes(bytes(8000))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("time_s", "position_1", "torque_cmd_1"):
            outside = [(str(tmp_path / "secret"), 0, 8000)]
            file.create_dataset(name, (1000,), "f8", external=outside)
    with pytest.raises(LogError, match="expected values in the file itself"):
        read_log(tmp_path / "a.h5")


def zip_bomb(path, rows):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (rows,)}
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("time_s", "position_1", "torque_cmd_1"):
            with archive.open(f"{name}.npy", "w") as file:
                file.write(head.getvalue())
                for _ in range(rows // 10**6):
                    file.write(bytes(8 * 10**6))
    return path


def test_npz_of_zeros(tmp_path):
    path = zip_bomb(tmp_path / "a.npz", 40_000_000)
    assert path.stat().st_size < 3_000_000
    refused(path, "320 MB by what")


def test_parquet_of_one_value(tmp_path):
    column = pa.array(np.zeros(40_000_000, np.float32))
    table = pa.table(dict.fromkeys(("time_s", "position_1", "torque_cmd_1"), column))
    pq.write_table(table, tmp_path / "a.parquet", compression="zstd")
    del table, column
    assert (tmp_path / "a.parquet").stat().st_size < 5_000_000
    refused(tmp_path / "a.parquet", "320 MB by what")


def test_one_long_text_in_every_row_of_parquet(tmp_path):
    text = pa.DictionaryArray.from_arrays(np.zeros(10_000, np.int32), pa.array(["1" * 10**6]))
    pq.write_table(pa.table({"time_s": text, "position_1": text}), tmp_path / "a.parquet")
    refused(tmp_path / "a.parquet", "time_s: expected numbers")


def test_csv_with_a_wide_header_and_short_rows(tmp_path):
    names = ",".join(["time_s", "position_1", *(f"x{k}" for k in range(9000))])
    (tmp_path / "a.csv").write_text(names + "\n" + "1\n" * 200_000)
    refused(tmp_path / "a.csv", "by what the file declares")
    (tmp_path / "b.csv").write_text(",".join(f"x{k}" for k in range(20_000)) + "\n1\n")
    refused(tmp_path / "b.csv", "expected at most 10000 columns, got 20000")


HEADER = b"time_s,position_1,torque_cmd_1\n"


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (b"0,0,0\n", "by what the file declares"),
        (b"0,", "expected lines of at most 1 MiB"),
        (b"a,", "expected lines of at most 1 MiB"),
        (b"\n", "by what the file declares"),
        (b'"', "expected lines of at most 1 MiB"),
    ],
    ids=["rows", "one_long_row", "texts_in_one_row", "empty_lines", "one_quoted_text"],
)
def test_packed_text_that_unpacks_to_much(tmp_path, row, words):
    with gzip.open(tmp_path / "a.csv.gz", "wb") as file:
        file.write(HEADER)
        for _ in range(100):
            file.write(row * (3_000_000 // len(row)))
    assert (tmp_path / "a.csv.gz").stat().st_size < 500_000
    refused(tmp_path / "a.csv.gz", words)


def test_packed_text_just_below_the_limit(tmp_path):
    """Numbers that become objects, as one row holds a text: 43 MB of text and values of 67."""
    with gzip.open(tmp_path / "a.csv.gz", "wb") as file:
        file.write(HEADER)
        file.write(b"0.1,0.1,0.1\n" * 1_200_000 + b"x,x,x\n")
    refused(tmp_path / "a.csv.gz", "expected numbers")


def test_a_long_line_is_refused_unpacked_too(tmp_path):
    (tmp_path / "a.csv").write_bytes(HEADER + b"0," * 1_500_000)
    refused(tmp_path / "a.csv", "expected lines of at most 1 MiB")


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "[" + "[]," * 500_000 + "[]]",
        "[" + '{"a":0},' * 300_000 + '{"a":0}]',
        "[" + ",".join(f'{{"a{k}":0}}' for k in range(200_000)) + "]",
        "{" + ",".join(f'"a{k}":0' for k in range(200_000)) + "}",
        '{"time_s": [' + "1" * 5000 + ', 1], "position_1": [1, 2]}',
        '{"time_s": ["' + "1" * 10**6 + '"' + ', ""' * 10**6 + "]}",
        '{"time_s": [' + "1e999," * 300_000 + "1]}",
    ],
    ids=[
        "deep",
        "empty_lists",
        "small_records",
        "other_key_in_every_record",
        "wide",
        "digits",
        "one_long_text",
        "infinite",
    ],
)
def test_json_that_becomes_much(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    refused(tmp_path / "a.json")


def test_an_array_that_declares_much(tmp_path):
    with (tmp_path / "a.npy").open("wb") as file:
        descr = [(name, "<f8") for name in ("time_s", "position_1", "torque_cmd_1")]
        head = {"descr": descr, "fortran_order": False, "shape": (40_000_000,)}
        np.lib.format.write_array_header_1_0(file, head)
    refused(tmp_path / "a.npy", "960 MB by what")


def mat73_cells(path, depth):
    """Cells that name the one before twice each: 2**depth by name, few in the file."""
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"] = np.arange(200.0)[:, None] / 100
        file["#refs#/c0"] = np.arange(200.0)[:, None]
        for k in range(1, depth + 1):
            cells = file.create_dataset(f"#refs#/c{k}", (2, 1), dtype=h5py.ref_dtype)
            cells[0, 0] = cells[1, 0] = file[f"#refs#/c{k - 1}"].ref
        top = file.create_dataset("q", (2, 1), dtype=h5py.ref_dtype)
        top[0, 0] = top[1, 0] = file[f"#refs#/c{depth}"].ref
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


CELLS = """
time = { name = "t" }
[[axis]]
position = { name = "q", index = 0, unit = "rad" }
torque = { name = "q", index = 1, unit = "Nm" }
"""


@pytest.mark.parametrize("depth", [28, 60])
def test_cells_that_name_the_one_before_twice(tmp_path, depth):
    said = refused(mat73_cells(tmp_path / "a.mat", depth), "q", columns=CELLS)
    assert ("32 cells inside each other" in said) == (depth > 32)


def test_cells_that_name_themselves(tmp_path):
    path = mat73_cells(tmp_path / "a.mat", 1)
    with h5py.File(path, "r+") as file:
        file["q"][0, 0] = file["q"].ref
    refused(path, "32 cells inside each other", columns=CELLS)


@pytest.mark.parametrize("number", [4, 1_000_000, 10**40])
def test_axes_beyond_those_that_are_there(tmp_path, number):
    columns = native_columns(n_axes=2)
    columns[f"position_{number}"] = columns["position_1"]
    path = write(tmp_path / "a.csv", columns)
    said = refused(path, "position_3: expected columns of axes 1 to")
    assert f"position_{number}"[:60] in said


def test_axes_of_a_pattern_beyond_those_that_are_there(tmp_path):
    own = """
    time = { name = "time_s" }
    [every_axis]
    position = { name = "position_{1}", unit = "rad" }
    torque = { name = "torque_cmd_{1}", unit = "Nm" }
    """
    columns = native_columns(n_axes=2) | {"position_1000000": np.zeros(1000)}
    path = write(tmp_path / "a.csv", columns)
    refused(path, "expected a column named 'position_3'", columns=own)
    with pytest.raises(LogError, match="axes"):
        parse_column_map(own.replace("time =", "axes = 1000000000\n time ="))


def test_rows_to_skip_beyond_the_file(tmp_path):
    path = write(tmp_path / "a.csv", native_columns())
    own = """
    csv = { skip_rows = 1_000_000_000_000_000 }
    time = { name = "time_s" }
    [[axis]]
    position = { name = "position_1", unit = "rad" }
    """
    refused(path, "file_unreadable", columns=own)


def test_a_grid_beyond_the_size_of_the_log(tmp_path):
    path = write(tmp_path / "a.csv", native_columns())
    own = """
    time = { name = "time_s", resample_hz = 1e8 }
    [[axis]]
    position = { name = "position_1", unit = "rad" }
    torque = { name = "torque_cmd_1", unit = "Nm" }
    """
    refused(path, "resample_hz: expected at most", "at 1e+08 Hz", columns=own)


def test_columns_that_nobody_maps_are_not_read(tmp_path):
    path = tmp_path / "a.h5"
    write(path, native_columns())
    with h5py.File(path, "r+") as file:
        file.create_dataset("images", (10**6, 1000), "f8", chunks=(1, 1000))
        file["names"] = ["a", "b"]
    assert read_log(path).n_samples == 1000
    assert {f.column for f in check_log(path).findings if "not used" in f.message} == {
        "images",
        "names",
    }


@pytest.mark.parametrize(
    "suffix", [".npz", ".h5", ".parquet", ".csv", ".mat", ".tsv", ".json", ".jsonl", ".npy"]
)
def test_the_limit_is_the_callers_to_set(tmp_path, suffix):
    path = write(tmp_path / f"a{suffix}", native_columns(n=1000, n_axes=1))
    # The text of JSON is in memory beside its values.
    text = path.stat().st_size if suffix.startswith(".json") else 0
    assert read_log(path, max_bytes=130_000 + text).n_samples == 1000
    with pytest.raises(LogError, match=r"expected at most 0\.02 MB .*max_bytes.*raises the limit"):
        read_log(path, max_bytes=20_000)
    assert not check_log(path, max_bytes=20_000).ok
    with pytest.raises(InputError, match="max_bytes: expected a whole number"):
        read_log(path, max_bytes=-1)


@pytest.mark.parametrize("n_axes", [1, 20])
def test_just_below_the_limit_memory_stays_below_500_mb(tmp_path, n_axes):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["pad"] = np.zeros(5_000_000, np.uint8)
        rows = 4_300_000 if n_axes == 1 else 420_000
        file.create_dataset("q", (rows,), "u1", chunks=(1024,))
    axis = """
    [[axis]]
    position = { name = "q", unit = "deg" }
    torque = { name = "q", unit = "Nm" }
    """
    [(said, used)] = read_in_child([path], "sample_rate_hz = 100.0" + n_axes * axis)
    assert said == "read"
    assert used < _MOST_MB


def test_a_log_as_large_as_it_looks_is_read(tmp_path):
    n = 500_000
    frame = pd.DataFrame({"time_s": np.arange(n) / 1000.0})
    rng = np.random.default_rng(3)
    for name in (
        "position_1",
        "torque_cmd_1",
        "velocity_1",
    ):  # counts, packed as far as they can be
        frame[name] = np.cumsum(rng.integers(-1, 2, n)) * 1e-3
    frame.to_parquet(tmp_path / "a.parquet", compression="zstd")
    assert (tmp_path / "a.parquet").stat().st_size < 8 * n
    assert read_log(tmp_path / "a.parquet").n_samples == n


def test_the_command_line_has_the_limit_too(tmp_path: Path) -> None:
    """What a small file may not take, a stated limit allows, and the other way round."""
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{0.01 * k},{k % 7},{k % 5}" for k in range(400))
    path.write_text(f"time_s,torque_cmd_1,position_1\n{rows}\n")
    for limit, refused in (("1000000", False), ("1000", True)):
        out = CliRunner().invoke(app, ["check", str(path), "--max-bytes", limit])
        assert ("--max-bytes" in out.output) == refused

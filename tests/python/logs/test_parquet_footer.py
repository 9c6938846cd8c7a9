"""What footers of Parquet files declare: as pyarrow reads them, and a refusal of whatever is damaged."""

from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from axisight.errors import LogError
from axisight.logs.parquet_footer import chunks
from damage import mutated

BAD = Path(__file__).resolve().parents[2] / "golden" / "bad" / "logs"


def written(path: Path, **options: object) -> Path:
    rng = np.random.default_rng(1)
    lists = [rng.standard_normal(k % 5).tolist() for k in range(500)]
    table = pa.table(
        {
            "time_s": np.arange(500.0),
            "a.b": pa.array([None if k % 3 else k for k in range(500)], pa.int64()),
            "word": pa.array(["one", "two"] * 250).dictionary_encode(),
            "lists": pa.array(lists),
            "nested": pa.array([{"x": {"y": k}, "z": [k]} for k in range(500)]),
            "true": pa.array([k % 2 == 0 for k in range(500)]),
            # More than fourteen: sizes of lists take a byte more.
            **{f"q{k}": rng.standard_normal(500) for k in range(20)},
        }
    )
    pq.write_table(table.replace_schema_metadata({"note": "x" * 300}), path, **options)
    return path


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"row_group_size": 64, "compression": "zstd"},
        {"write_page_index": True, "store_schema": False, "sorting_columns": None},
        {"write_statistics": False, "data_page_version": "2.0", "use_dictionary": False},
    ],
)
def test_it_is_what_pyarrow_reads(tmp_path: Path, options: dict[str, object]):
    path = written(tmp_path / "a.parquet", **options)
    metadata = pq.read_metadata(path)
    columns = [
        metadata.row_group(g).column(k)
        for g in range(metadata.num_row_groups)
        for k in range(metadata.num_columns)
    ]
    assert [(c.path, c.values, c.unpacked_bytes) for c in chunks(path)] == [
        (c.path_in_schema, c.num_values, c.total_uncompressed_size) for c in columns
    ]


def test_whatever_is_damaged_is_read_or_refused(tmp_path: Path):
    """Damage to the footer alone: of every kind that is not, in a struct of which nothing else is asked."""
    data = written(tmp_path / "a.parquet").read_bytes()
    size = int.from_bytes(data[-8:-4], "little")
    rng, path, came = np.random.default_rng(4), tmp_path / "b.parquet", Counter()
    for _ in range(1000):
        footer = mutated(data[-8 - size : -8], rng)
        path.write_bytes(data[: -8 - size] + footer + len(footer).to_bytes(4, "little") + b"PAR1")
        try:
            came["read" if list(chunks(path)) else "empty"] += 1
        except LogError as error:
            assert str(path) in str(error)
            came["refused"] += 1
    assert came["refused"] > 100
    assert came["read"] > 100


def test_what_is_not_parquet_is_refused(tmp_path: Path):
    deep = b"\x19" * 5000
    for data in (
        b"PAR1" * 3 + b"PARE",
        b"PAR1" + (10**6).to_bytes(4, "little") + b"PAR1",
        b"PAR1" + deep + len(deep).to_bytes(4, "little") + b"PAR1",
        b"PAR1",
        b"",
    ):
        path = tmp_path / "a.parquet"
        path.write_bytes(data)
        with pytest.raises(LogError, match="footer"):
            list(chunks(path))


def test_histograms_that_do_not_fit_end_no_process():
    """Asked for these columns, pyarrow 26 ends the process."""
    assert next(chunks(BAD / "levels.parquet")).path == "time_s"

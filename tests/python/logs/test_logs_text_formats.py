"""Tables in JSON, JSON lines, tab-separated and packed text, and arrays of NumPy, in the shapes people write them."""

import gzip
import json

import numpy as np
import pandas as pd
import pytest

from axisight.errors import LogError
from axisight.logs import check_log, parse_column_map, read_log
from axisight.logs.guessing import guess_columns
from axisight.logs.sources import load_arrays
from columns_data import maker_columns, robot
from logs_data import native_columns, write

COLUMNS = native_columns(600, 2)


def same(log):
    for k in (1, 2):
        np.testing.assert_allclose(log.position_rad[:, k - 1], COLUMNS[f"position_{k}"], atol=1e-9)
        np.testing.assert_allclose(log.torque_nm[:, k - 1], COLUMNS[f"torque_cmd_{k}"], atol=1e-9)


def written(path, content):
    path.write_text(json.dumps(content))
    return path


def lists():
    return {name: values.tolist() for name, values in COLUMNS.items()}


def test_json_of_columns(tmp_path):
    same(read_log(written(tmp_path / "a.json", lists())))


@pytest.mark.parametrize("orient", ["columns", "index", "records", "table"])
def test_json_as_pandas_writes_it(tmp_path, orient):
    path = tmp_path / "a.json"
    pd.DataFrame(COLUMNS).to_json(path, orient=orient, double_precision=15)
    if orient == "table":  # its records stand beside a description
        names = load_arrays(path)
        assert "data.position_1" in names
        return
    same(read_log(path))


MAP = """
time = { name = "run.t" }
[[axis]]
position = { name = "run.joints[0].q", unit = "rad" }
torque = { name = "run.tau[0]", unit = "Nm" }
[[axis]]
position = { name = "run.joints[1].q", unit = "rad" }
torque = { name = "run.tau[1]", unit = "Nm" }
"""


@pytest.mark.parametrize("lines", [False, True])
def test_records_with_records_and_lists_in_them(tmp_path, lines):
    rows = [
        {
            "run": {
                "t": COLUMNS["time_s"][k],
                "joints": [{"q": COLUMNS["position_1"][k]}, {"q": COLUMNS["position_2"][k]}],
                "tau": [COLUMNS["torque_cmd_1"][k], COLUMNS["torque_cmd_2"][k]],
                "comment": "moving",
            }
        }
        for k in range(600)
    ]
    path = tmp_path / ("a.jsonl" if lines else "a.json")
    if lines:
        path.write_text("\n".join(map(json.dumps, rows)) + "\n\n")
    else:
        path.write_text(json.dumps(rows))
    same(read_log(path, parse_column_map(MAP)))


def test_a_rate_beside_columns(tmp_path):
    content = lists() | {"meta": {"rate": 500.0, "robot": "x"}}
    text = 'sample_rate_hz = "meta.rate"\n[[axis]]\n'
    text += 'position = { name = "position_1", unit = "rad" }\n'
    text += 'torque = { name = "torque_cmd_1", unit = "Nm" }\n'
    path = written(tmp_path / "a.json", content)
    assert read_log(path, parse_column_map(text)).sample_rate_hz == 500.0


def spoiled(k, **changed):
    rows = [dict(zip(COLUMNS, row, strict=True)) for row in zip(*lists().values(), strict=True)]
    rows[k] = {name: value for name, value in (rows[k] | changed).items() if value != "gone"}
    return rows


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            spoiled(7, position_1="gone"),
            "position_1: expected it in every record, got none in 1 of",
        ),
        (spoiled(7, position_1="far"), "position_1: expected numbers, got 'far' at index 7"),
        (spoiled(7, position_1=None), "position_1.*NaN"),
        (spoiled(7, position_1=[1, 2]), r"position_1: expected numbers, got \[1, 2\] at index 7"),
        (spoiled(7, position_1=10**400), "position_1: expected numbers, got 1000.* at index 7"),
        (3, "expected records or columns, got 3"),
        ([], "expected records or columns, got an empty list"),
        ({}, "expected records or columns, got an empty object"),
        ({"a.b": [1, 2], "a": {"b": [1, 2]}}, "position_1"),
    ],
)
def test_json_that_is_no_log(tmp_path, content, words):
    path = written(tmp_path / "a.json", content)
    with pytest.raises(LogError, match=words):
        read_log(path)
    assert not check_log(path).ok


def test_a_key_that_stands_twice(tmp_path):
    (tmp_path / "a.json").write_text('{"position_1": [1, 2], "position_1": [3, 4]}')
    with pytest.raises(LogError, match="expected every key once, got 'position_1' several times"):
        read_log(tmp_path / "a.json")
    arrays = load_arrays(written(tmp_path / "b.json", {"a.b": [1, 2], "a": {"b": [1, 2]}}))
    with pytest.raises(LogError, match=r"expected one column of that name, got several"):
        arrays["a.b"]
    records = [{"a.b": 1, "a": {"b": 2}}, {"a.b": 3, "a": {"b": 4}}]
    (tmp_path / "c.json").write_text(json.dumps(records))
    with pytest.raises(LogError, match=r"expected one column of that name, got several"):
        load_arrays(tmp_path / "c.json")["a.b"]


def test_lists_that_are_not_all_as_long(tmp_path):
    arrays = load_arrays(written(tmp_path / "a.json", [{"q": [1, 2]}, {"q": [1]}]))
    with pytest.raises(
        LogError, match=r"expected lists that are all as long, got lengths \[1, 2\]"
    ):
        arrays["q"]


def test_a_line_of_json_that_is_cut(tmp_path):
    path = write(tmp_path / "a.jsonl", COLUMNS)
    path.write_text(path.read_text()[:-3])
    with pytest.raises(LogError, match="line 600: expected one JSON value"):
        read_log(path)


def test_tabs_unless_the_map_says_otherwise(tmp_path):
    path = tmp_path / "a.tsv.gz"
    with gzip.open(path, "wt") as file:
        file.write(pd.DataFrame(COLUMNS).to_csv(index=False, sep="\t"))
    same(read_log(path))
    text = """
    csv = { separator = ";" }
    time = { name = "time_s" }
    [[axis]]
    position = { name = "position_1", unit = "rad" }
    torque = { name = "torque_cmd_1", unit = "Nm" }
    """
    pd.DataFrame(COLUMNS).to_csv(tmp_path / "b.tsv", index=False, sep=";")
    assert read_log(tmp_path / "b.tsv", parse_column_map(text)).n_samples == 600


def test_packed_text_has_the_doubts_of_its_text(tmp_path):
    text = pd.DataFrame(COLUMNS).to_csv(index=False).rstrip("\n")
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode()))
    log = read_log(tmp_path / "a.csv.gz")
    assert log.name == "a"
    assert any("expected a line end" in note for note in log.notes)


@pytest.mark.parametrize("suffix", [".tsv", ".csv.gz", ".tsv.gz", ".json", ".jsonl", ".npy"])
def test_a_map_is_guessed(tmp_path, suffix):
    columns = maker_columns("kuka-rsi", 3)
    path = tmp_path / f"a{suffix}"
    if suffix == ".tsv.gz":
        pd.DataFrame(columns).to_csv(path, index=False, sep="\t")
    else:
        write(path, columns)
    found = guess_columns(path, robot(3))
    assert found.named == "kuka-rsi"
    columns["t"] = columns.pop("IPOC")
    columns = {name.replace("AIPos.A", "q"): values for name, values in columns.items()}
    if suffix == ".tsv.gz":
        pd.DataFrame(columns).to_csv(path, index=False, sep="\t")
    else:
        write(path, columns)
    (tmp_path / "columns.toml").write_text(guess_columns(path, robot(3)).text)
    log = read_log(path, parse_column_map((tmp_path / "columns.toml").read_text()), robot=robot(3))
    assert log.n_axes == 3


TWO = """
time = { name = "0", file = "t.npy" }
[[axis]]
position = { name = "0", unit = "rad" }
torque = { name = "2", unit = "Nm" }
[[axis]]
position = { name = "1", unit = "rad" }
torque = { name = "3", unit = "Nm" }
"""


def test_columns_of_an_array_have_numbers(tmp_path):
    names = ("position_1", "position_2", "torque_cmd_1", "torque_cmd_2")
    np.save(tmp_path / "a.npy", np.column_stack([COLUMNS[name] for name in names]))
    np.save(tmp_path / "t.npy", COLUMNS["time_s"])
    same(read_log(tmp_path / "a.npy", parse_column_map(TWO)))


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((2, 600)), r"\(samples, columns\), got \(2, 600\).*transpose"),
        (np.zeros((600, 2, 2)), r"\(samples, columns\) or structured, got \(600, 2, 2\)"),
        (np.float64(3), r"\(samples, columns\) or structured, got \(\)"),
        (np.array([{"a": 1}] * 600, dtype=object), "expected numbers, got objects"),
        (np.zeros(600, dtype=[(f"a{k}", "f8") for k in range(3)]), "position_1"),
    ],
)
def test_arrays_that_are_no_log(tmp_path, array, words):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(LogError, match=words):
        read_log(tmp_path / "a.npy")

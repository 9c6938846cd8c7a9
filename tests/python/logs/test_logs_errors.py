"""Every kind of bad log or map gives a LogError that names file, column, expected and got."""

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from axisight.errors import LogError
from axisight.logs import (
    check_log,
    check_same_rate,
    load_column_map,
    parse_column_map,
    read_log,
)
from logs_data import FORMAT_IDS, FORMATS, native_columns, write

AXIS = """
[[axis]]
position = { name = "position_1", unit = "rad" }
torque = { name = "torque_cmd_1", unit = "Nm" }
"""


def refuse(path, *words, columns=None, n_axes=None):
    with pytest.raises(LogError) as caught:
        read_log(path, columns, n_axes=n_axes)
    for word in (path.name, *words):
        assert word in str(caught.value)
    if n_axes is None:  # check_log does not raise, and finds the same
        report = check_log(path, columns)
        assert not report.ok
        assert words[0] in "".join(f"{f.column}: {f.message}" for f in report.findings)


@pytest.mark.parametrize(("name", "kind"), FORMATS, ids=FORMAT_IDS)
@pytest.mark.parametrize("share", [0.0, 0.5, 0.97])
def test_truncated_file(tmp_path, name, kind, share):
    path = write(tmp_path / name, native_columns(), kind)
    content = path.read_bytes()
    if path.suffix in {".csv", ".tsv"}:  # cut behind a separator: the last row then lacks values
        separator = b"," if path.suffix == ".csv" else b"\t"
        cut = content.rfind(separator, 0, int(share * len(content))) + 1
        expected = "finite" if share else "truncated, corrupt"
    else:
        cut, expected = int(share * len(content)), "truncated, corrupt"
    path.write_bytes(content[:cut])
    refuse(path, expected)


@pytest.mark.parametrize(
    "suffix",
    [
        ".parquet",
        ".mat",
        ".h5",
        ".npz",
        ".csv",
        ".csv.gz",
        ".tsv",
        ".tsv.gz",
        ".json",
        ".jsonl",
        ".npy",
    ],
)
def test_corrupt_file(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    refuse(path, "expected", "got")


@pytest.mark.parametrize("text", ["oops", "1.2.3", "2012-01-01"])
def test_text_in_a_number_column(tmp_path, text):
    path = tmp_path / "a.csv"
    rows = "".join(f"{k / 100},1,{text if k == 7 else 2}\n" for k in range(200))
    path.write_text("time_s,position_1,torque_cmd_1\n" + rows)
    refuse(path, "torque_cmd_1", "expected numbers", text, "index 7")


def test_missing_file_unknown_suffix_and_folder(tmp_path):
    refuse(tmp_path / "a.parquet", "expected a file, got nothing")
    (tmp_path / "b.csv").mkdir()
    refuse(tmp_path / "b.csv", "got a folder")
    (tmp_path / "a.xls").touch()
    refuse(tmp_path / "a.xls", "suffix", ".parquet", "'.xls'")


@pytest.mark.parametrize("column", ["time_s", "position_1", "torque_cmd_2", "velocity_ref_2"])
def test_missing_column(tmp_path, column):
    columns = native_columns(n_axes=3)
    del columns[column]
    refuse(write(tmp_path / "a.parquet", columns), column, "expected", "got")


def test_no_native_column_at_all(tmp_path):
    refuse(write(tmp_path / "a.npz", {"q": np.zeros(10)}), "position_1", "column map", "q")


def test_other_columns_are_listed_with_both_kinds_of_native_ones(tmp_path):
    names = [f"{what}_{joint}" for what in ("cmd", "meas") for joint in ("a", "b", "c", "d")]
    columns = dict(zip(["t", *names], np.ones((9, 600)), strict=True))
    with pytest.raises(LogError) as caught:
        read_log(write(tmp_path / "a.parquet", columns))
    message = str(caught.value)
    assert "columns time_s, position_1, torque_cmd_1 (or position_ref_1)" in message
    assert f"got {', '.join([*names, 't'])} (9 columns); `axisight columns guess" in message
    many = {f"c{k:02}": np.ones(600) for k in range(13)}
    with pytest.raises(LogError, match=r"c10, c11, \.\.\. \(13 columns\)"):
        read_log(write(tmp_path / "b.parquet", many))


def test_axis_missing_in_the_middle(tmp_path):
    columns = {k: v for k, v in native_columns(n_axes=3).items() if not k.endswith("_2")}
    refuse(write(tmp_path / "a.parquet", columns), "position_2")


@pytest.mark.parametrize("n_axes", [1, 3])
def test_wrong_number_of_axes(tmp_path, n_axes):
    path = write(tmp_path / "a.parquet", native_columns())
    refuse(path, f"axis: expected {n_axes} axes, got columns for 2", n_axes=n_axes)


@pytest.mark.parametrize(
    ("value", "counted"), [(np.nan, "2 NaN and 0 inf"), (np.inf, "0 NaN and 2 inf")]
)
def test_nan_and_inf_are_counted(tmp_path, value, counted):
    columns = native_columns()
    columns["torque_cmd_2"][[17, 400]] = value
    path = write(tmp_path / "a.parquet", columns)
    refuse(path, "torque_cmd_2", counted, "first at index 17")
    columns = native_columns()
    columns["time_s"][5] = value
    refuse(write(tmp_path / "b.parquet", columns), "time_s", "first at index 5")


def test_unequal_lengths(tmp_path):
    columns = native_columns()
    columns["torque_cmd_1"] = columns["torque_cmd_1"][:-1]
    path = write(tmp_path / "a.npz", columns)
    refuse(path, "torque_cmd_1", "expected 1000 samples as in time_s, got 999")


def test_time_that_does_not_increase(tmp_path):
    columns = native_columns()
    columns["time_s"][300] = columns["time_s"][299]
    refuse(write(tmp_path / "a.npz", columns), "time_s", "strictly increasing", "index 300")


def test_gap(tmp_path):
    columns = {k: np.delete(v, slice(100, 104)) for k, v in native_columns().items()}
    refuse(write(tmp_path / "a.npz", columns), "1 gaps (4 samples missing)", "after index 99")


def test_jitter_beyond_one_percent(tmp_path):
    columns = native_columns()
    columns["time_s"][500] += 0.03 / 500.0
    refuse(write(tmp_path / "a.npz", columns), "within 1% of a sample", "sample_rate_hz")


def test_slowly_drifting_rate(tmp_path):
    columns = native_columns()
    k = np.arange(1000)
    columns["time_s"] = (k + 0.006 * k**2 / 1000) / 500.0  # rate changes by 1.2 %, no step jumps
    refuse(write(tmp_path / "a.npz", columns), "uniform sampling")


def test_shorter_than_one_second(tmp_path):
    path = write(tmp_path / "a.npz", native_columns(n=499))
    refuse(path, "at least 1 s", "0.998 s")
    assert read_log(write(tmp_path / "b.npz", native_columns(n=500))).n_samples == 500


def test_unequal_rates_between_logs(tmp_path):
    first = read_log(write(tmp_path / "a.npz", native_columns()))
    second = read_log(write(tmp_path / "b.npz", native_columns(rate_hz=250.0)))
    check_same_rate([first, dataclasses.replace(first, name="c")])
    with pytest.raises(LogError, match=r"b\.npz: sample rate: expected 500 Hz as in a, got 250 Hz"):
        check_same_rate([first, second])


def test_declared_rate_against_stamps(tmp_path):
    path = write(tmp_path / "a.npz", native_columns())
    text = f'sample_rate_hz = 1000\ntime = {{ name = "time_s" }}\n{AXIS}'
    refuse(path, "sample_rate_hz = 1000 Hz", "got 500 Hz", columns=parse_column_map(text))


def test_addresses_that_do_not_fit(tmp_path):
    path = write(tmp_path / "a.npz", {"q": np.zeros((3, 1000)), "kt": np.ones(2)})
    base = 'sample_rate_hz = 500\n[[axis]]\ntorque = { name = "q", index = 0, unit = "Nm" }\n'
    for position, words in [
        ('{ name = "q", unit = "rad" }', ("q", "one value per sample", "(3, 1000)")),
        ('{ name = "q", index = "3,:", unit = "rad" }', ("q[3,:]", "inside shape (3, 1000)")),
        ('{ name = "q.w", unit = "rad" }', ("q.w", "expected a column named 'q.w', got q, kt")),
        ('{ name = "q", index = 0, unit = "rad", scale = "g" }', ("scalar named 'g'",)),
        ('{ name = "q", index = 0, unit = "rad", scale = "kt" }', ("one finite number",)),
        ('{ name = "q", index = 0, unit = "rad", file = "b.npz" }', ("b.npz",)),
    ]:
        refuse(path, *words, columns=parse_column_map(f"{base}position = {position}\n"))
    text = f'sample_rate_hz = "fs"\n{AXIS}'
    refuse(path, "sample_rate_hz", "scalar named 'fs'", columns=parse_column_map(text))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sample_rate_hz = 1\nrate = 2" + AXIS, ["rate: expected a known key"]),
        ("sample_rate_hz = 1" + AXIS + "torqe = 1", ["axis 1: torqe: expected a known key"]),
        ('schema = "axisight.columns/2"\nsample_rate_hz = 1' + AXIS, ["schema", "columns/1"]),
        (AXIS, ["sample_rate_hz", "[time]"]),
        ("sample_rate_hz = 0" + AXIS, ["sample_rate_hz", "greater than 0"]),
        ("sample_rate_hz = 1", ["axis"]),
        ("sample_rate_hz = 1" + AXIS.replace('"rad"', '"grad"'), ["axis 1: position.unit", "grad"]),
        ("sample_rate_hz = 1" + AXIS.replace('"rad"', '"counts"'), ["counts_per_rev"]),
        ("sample_rate_hz = 1" + AXIS.replace('"Nm"', '"V"'), ["scale", "'V'"]),
        (
            "sample_rate_hz = 1" + AXIS.replace('"rad"', '"mm"'),
            ["torque: expected a unit that goes with a position in mm, got Nm"],
        ),
        ("sample_rate_hz = 1" + AXIS.replace('"Nm"', '"Nm", index = "a"'), ["index", "'a'"]),
        ("sample_rate_hz = 1" + AXIS.replace('"Nm"', '"Nm", sign = 2'), ["sign", "2"]),
        (
            "sample_rate_hz = 1" + AXIS.replace('"Nm"', '"Nm", scale = 0'),
            ["scale: expected a number other than 0"],
        ),
        ("sample_rate_hz = ", ["expected TOML"]),
    ],
)
def test_bad_maps(tmp_path, text, words):
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(LogError) as caught:
        load_column_map(tmp_path / "map.toml")
    for word in ["map.toml", *words]:
        assert word in str(caught.value)


def test_missing_map(tmp_path):
    with pytest.raises(LogError, match=r"nowhere\.toml: column map cannot be read"):
        load_column_map(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_torques_that_nobody_filled_hide_no_targets(tmp_path: Path, nothing: float) -> None:
    """Some drivers publish an effort field that stays empty."""
    columns = native_columns()
    for axis in (1, 2):
        columns[f"position_ref_{axis}"] = columns[f"position_{axis}"] + 0.01
        columns[f"torque_cmd_{axis}"] = np.full_like(columns["time_s"], nothing)
        del columns[f"velocity_ref_{axis}"]
    path = tmp_path / "run.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    log = read_log(path)
    assert not log.has_torque
    assert log.position_ref_rad is not None
    assert any("count as not logged" in note for note in log.notes)
    report = check_log(path)
    assert report.ok
    assert any("count as not logged" in f.message for f in report.findings)


def test_one_torque_that_was_filled_keeps_all(tmp_path: Path) -> None:
    columns = native_columns()
    for axis in (1, 2):
        columns[f"position_ref_{axis}"] = columns[f"position_{axis}"] + 0.01
    columns["torque_cmd_2"] = np.zeros_like(columns["time_s"])
    path = tmp_path / "run.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    assert read_log(path).has_torque

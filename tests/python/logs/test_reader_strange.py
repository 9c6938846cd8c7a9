"""Documents, names and numbers at the edge of what there is give the package's errors, and at once."""

import json
import time
from pathlib import Path

import numpy as np
import pytest

from axisight.documents import parse_json, parse_toml
from axisight.errors import AxisightError, CaseError, InputError, LogError
from axisight.excitation.design import load_design
from axisight.logs import (
    ColumnMap,
    check_log,
    load_column_map,
    parse_column_map,
    read_case,
    read_log,
)
from axisight.montecarlo.study import read_study
from axisight.robot import load_robot
from axisight.robot_import.drives import read_drives
from logs_data import native_columns, write
from reading_children import read_in_child

DOCUMENTS = {
    "brackets": "a = " + "[" * 100_000,
    "tables": "a = " + "{a = " * 20_000,
    "digits": "a = " + "9" * 5000,
    "dots": "a." * 50_000 + "a = 1",
    "spaced dots": "a . " * 50_000 + "a = 1",
    "quoted dots": '"a".' * 50_000 + "a = 1",
    "dots in a table": "[" + "a." * 50_000 + "a]",
    "dots inside": "x = { " + "a." * 50_000 + "a = 1 }",
}
READERS = {
    "map": load_column_map,
    "case": lambda path: read_case(path.parent),
    "drives": read_drives,
    "study": read_study,
    "design": load_design,
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", DOCUMENTS)
def test_documents_that_never_end(tmp_path, kind, reader):
    path = tmp_path / "case.toml"
    path.write_text(DOCUMENTS[kind])
    before = time.perf_counter()
    with pytest.raises(AxisightError) as caught:
        READERS[reader](path)
    assert time.perf_counter() - before < 2.0
    assert "case.toml" in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_dots_in_texts_and_comments_are_no_keys():
    text = f'a = "{"x." * 20}x"  # ................................................ \nb.c.d = 1.5\n'
    assert parse_toml(text) == {"a": "x." * 20 + "x", "b": {"c": {"d": 1.5}}}


@pytest.mark.parametrize("text", ["[" * 100_000, "9" * 5000, '{"a":' * 100_000, "{"])
def test_json_that_never_ends(text):
    with pytest.raises(ValueError) as caught:
        parse_json(text)
    assert len(str(caught.value)) < 300


def test_json_of_a_folder_of_lerobot(tmp_path):
    (tmp_path / "set" / "meta").mkdir(parents=True)
    info = tmp_path / "set" / "meta" / "info.json"
    for text in (
        "[" * 100_000,
        '{"total_episodes": ' + "9" * 5000 + "}",
        '{"total_episodes": 1e999}',
    ):
        info.write_text(text)
        with pytest.raises(LogError, match=r"info\.json") as caught:
            read_log(tmp_path / "set")
        assert len(str(caught.value)) < 1000


WITHOUT_END = {
    "columns": "a.toml",
    "case": "case.toml",
    "robot": "a.toml",
    "study": "a.toml",
    "design": "a.toml",
    "drives": "a.toml",
    "verdict": "a.json",
    "sidecar": "a.json",
    "models": "a.urdf",
    "logs": "a.csv",
}


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a device without an end")
@pytest.mark.parametrize("reader", WITHOUT_END)
def test_documents_of_a_device_without_end(tmp_path, reader):
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / WITHOUT_END[reader]
    path.symlink_to("/dev/zero")
    if reader == "case":  # read from a folder of its own
        path, reader = tmp_path / "in", "folder"
    ((said, used),) = read_in_child([path], reader=reader, limit=3 * 10**9)
    assert said.startswith("refused"), said
    assert used < 500


NAMES = ["a\0b.csv", "n" * 300 + ".csv", "d/" * 3000 + "a.csv", "e" * 5000]


@pytest.mark.parametrize("name", NAMES, ids=["nul", "long", "deep", "longer"])
def test_names_that_no_file_can_have(tmp_path, name):
    write(tmp_path / "a.csv", native_columns(n_axes=1))
    (tmp_path / "robot.toml").touch()
    path = f"{tmp_path}/{name}"
    for call in (
        lambda: read_log(path),
        lambda: read_log(tmp_path / "a.csv", path),
        lambda: read_case(path),
        lambda: load_column_map(path),
        lambda: load_robot(path),
    ):
        with pytest.raises(InputError, match=r"path of a file") as caught:
            call()
        assert len(str(caught.value)) < 1000
    assert not check_log(path).ok
    signal = {"name": "position_1", "unit": "rad", "file": name}
    columns = {"time": {"name": "time_s"}, "axis": [{"position": signal}]}
    with pytest.raises(LogError, match="path of a file"):
        read_log(tmp_path / "a.csv", ColumnMap.model_validate(columns))
    for field in ("robot", "file"):
        fields = {"robot": "robot.toml", "file": "a.csv"} | {field: name}
        (tmp_path / "case.toml").write_text(
            f'schema = "axisight.case/1"\nname = "c"\nrobot = {json.dumps(fields["robot"])}\n'
            f'[[log]]\nfile = {json.dumps(fields["file"])}\nrole = "estimation"\n'
        )
        with pytest.raises(CaseError, match=f"{field}: expected .*path of a file") as caught:
            read_case(tmp_path)
        assert "case.toml" in str(caught.value)


@pytest.mark.parametrize("factor", [1e-320, 1e-300, 1e-12, 1e12, 1e300, 1.7e305])
@pytest.mark.parametrize("resample", [None, 100.0, "mean"])
@pytest.mark.filterwarnings("error")
def test_times_of_no_clock(tmp_path, factor, resample):
    columns = native_columns(n_axes=1)
    columns["time_s"] = columns["time_s"] * factor
    path = write(tmp_path / "a.npz", columns)
    time_ = {"name": "time_s", "resample_hz": resample}
    axis = {
        "position": {"name": "position_1", "unit": "rad"},
        "torque": {"name": "torque_cmd_1", "unit": "Nm"},
    }
    own = ColumnMap.model_validate({"time": time_, "axis": [axis]})
    with pytest.raises(LogError, match="time_s: expected"):
        read_log(path, own)
    assert not check_log(path, own).ok


@pytest.mark.parametrize("rate", [1e-320, 1e-300, 1e300, 1.7e308])
@pytest.mark.filterwarnings("error")
def test_rates_of_no_clock(tmp_path, rate):
    path = write(tmp_path / "a.npz", native_columns(n_axes=1) | {"fs": np.array(rate)})
    axis = """
    [[axis]]
    position = { name = "position_1", unit = "rad" }
    torque = { name = "torque_cmd_1", unit = "Nm" }
    """
    for given in (f"{rate!r}", '"fs"'):
        own = parse_column_map(f"sample_rate_hz = {given}\n{axis}")
        with pytest.raises(LogError, match="sample_rate_hz: expected"):
            read_log(path, own)
        assert not check_log(path, own).ok
    own = parse_column_map(f"time = {{ name = 'time_s', resample_hz = {rate!r} }}\n{axis}")
    with pytest.raises(LogError, match="resample_hz: expected"):
        read_log(path, own)


@pytest.mark.parametrize("period", ["inf", "-inf", "nan", "1e308", "1e-320", "9" * 400, "1e999"])
def test_periods_without_end(tmp_path, period):
    write(tmp_path / "a.csv", native_columns())
    (tmp_path / "robot.toml").touch()
    (tmp_path / "case.toml").write_text(
        'schema = "axisight.case/1"\nname = "c"\nrobot = "robot.toml"\n'
        f'[[log]]\nfile = "a.csv"\nrole = "estimation"\nperiod_s = {period}\n'
    )
    with pytest.raises(CaseError, match=r"log 1: period_s: ") as caught:
        read_case(tmp_path)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("scale", ["inf", "nan", "1e308", "9" * 400])
@pytest.mark.filterwarnings("error")
def test_scales_beyond_all_numbers(tmp_path, scale):
    columns = native_columns(n_axes=1)
    columns["position_1"] = columns["position_1"] * 1e10
    path = write(tmp_path / "a.npz", columns)
    text = f"""
    time = {{ name = "time_s" }}
    [[axis]]
    position = {{ name = "position_1", unit = "rad", scale = {scale} }}
    torque = {{ name = "torque_cmd_1", unit = "Nm" }}
    """
    with pytest.raises(LogError, match=r"finite|scale"):
        read_log(path, parse_column_map(text))


@pytest.mark.parametrize("index", ["9" * 30, "-" + "9" * 30, ",".join(["0"] * 70), "9" * 5000])
def test_indices_beyond_all_arrays(tmp_path, index):
    path = write(tmp_path / "a.npz", native_columns(n_axes=1))
    axis = {"position": {"name": "position_1", "unit": "rad", "index": index}}
    own = ColumnMap.model_validate({"time": {"name": "time_s"}, "axis": [axis]})
    with pytest.raises(LogError, match="position_1") as caught:
        read_log(path, own)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("separator", ["(a+)+$", "ab", "\n", ""])
def test_a_separator_is_one_character(separator):
    text = f"sample_rate_hz = 1\ncsv = {{ separator = {json.dumps(separator)} }}\n"
    axis = '[[axis]]\nposition = { name = "q", unit = "rad" }\n'
    with pytest.raises(LogError, match=r"csv\.separator"):
        parse_column_map(text + axis)

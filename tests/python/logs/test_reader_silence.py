"""Nothing is chosen, cut or dropped in silence: names that stand twice, ends that are missing, long echoes."""

import warnings
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from axisight.errors import InputError, LogError
from axisight.logs import ColumnMap, check_log, load_column_map, parse_column_map, read_log
from logs_data import native_columns, write

_LONG = "q" * 100_000


def test_an_npz_with_two_arrays_of_a_name(tmp_path):
    path = write(tmp_path / "a.npz", native_columns())
    with zipfile.ZipFile(path, "a") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive.writestr("position_1.npy", archive.read("position_2.npy"))
    with pytest.raises(LogError, match=r"a\.npz: position_1: expected one array of that name"):
        read_log(path)
    assert not check_log(path).ok


def test_a_csv_with_two_columns_of_a_name(tmp_path):
    path = write(tmp_path / "a.csv", native_columns())
    text = path.read_text()
    path.write_text(text.replace("velocity_ref_2", "position_1", 1))
    with pytest.raises(LogError, match=r"position_1: expected one column of that name, got 2"):
        read_log(path)
    # Of columns that nobody asks for there may be any number.
    other = text.replace("velocity_ref_2", "x", 1).replace("velocity_ref_1", "x", 1)
    path.write_text(other)
    assert read_log(path).n_axes == 2


def test_a_parquet_with_two_columns_of_a_name(tmp_path):
    columns = native_columns(n_axes=1)
    names = [*columns, "position_1"]
    arrays = [pa.array(values) for values in (*columns.values(), columns["torque_cmd_1"])]
    pq.write_table(pa.table(arrays, names=names), tmp_path / "a.parquet")
    with pytest.raises(LogError, match=r"position_1: expected one column of that name, got 2"):
        read_log(tmp_path / "a.parquet")


@pytest.mark.parametrize("digits", [1, 3])
def test_a_csv_that_ends_inside_its_last_number(tmp_path, digits):
    path = write(tmp_path / "a.csv", native_columns())
    assert not any("line end" in f.message for f in check_log(path).findings)
    assert not read_log(path).notes
    path.write_text(path.read_text()[: -1 - digits])
    [finding] = [f for f in check_log(path).findings if "line end" in f.message]
    assert finding.severity == "warning"
    assert "may be cut" in finding.message
    assert any("may be cut" in note for note in read_log(path).notes)


def test_a_csv_of_another_file_that_ends_inside_its_last_number(tmp_path):
    write(tmp_path / "a.csv", native_columns())
    cut = write(tmp_path / "b.csv", native_columns())
    cut.write_text(cut.read_text()[:-2])
    axis = {
        "position": {"name": "position_1", "unit": "rad"},
        "torque": {"name": "torque_cmd_1", "unit": "Nm", "file": "b.csv"},
    }
    log = read_log(
        tmp_path / "a.csv",
        ColumnMap.model_validate({"time": {"name": "time_s"}, "axis": [axis]}),
    )
    assert log.notes[-1].startswith("b.csv: expected a line end")


def message(call):
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


AXIS = """
[[axis]]
position = { name = "NAME", unit = "UNIT" }
torque = { name = "torque_cmd_1", unit = "Nm" }
"""


@pytest.mark.parametrize(
    "text",
    [
        "sample_rate_hz = 1" + AXIS.replace("UNIT", _LONG),
        "sample_rate_hz = 1" + AXIS + f"{_LONG} = 1",
        "sample_rate_hz = 1\n" + "".join(f"x{k} = 1\n" for k in range(20_000)) + AXIS,
        f"{_LONG}",
        f'"{_LONG}\x01" = 1',
        f"a = 1\n[{_LONG}]\n[{_LONG}]",
    ],
    ids=["value", "key", "many", "no value", "control", "twice"],
)
def test_maps_are_not_echoed_at_length(tmp_path, text):
    (tmp_path / "map.toml").write_text(text)
    said = message(lambda: load_column_map(tmp_path / "map.toml"))
    assert "map.toml" in said
    assert len(said) < 2000


def test_logs_are_not_echoed_at_length(tmp_path):
    columns = native_columns(n_axes=1)
    path = write(
        tmp_path / "a.npz", {"time_s": columns["time_s"], _LONG[:30_000]: columns["position_1"]}
    )
    assert len(message(lambda: read_log(path))) < 2000
    own = parse_column_map(
        AXIS.replace("NAME", _LONG[1:]).replace("UNIT", "rad") + "[time]\nname='t'"
    )
    said = message(lambda: read_log(path, own))
    assert len(said) < 2000
    path = write(tmp_path / "a.csv", columns)
    text = path.read_text().splitlines()
    text[5] = f"1,2,{_LONG},3"
    path.write_text("\n".join(text) + "\n")
    assert len(message(lambda: read_log(path))) < 2000
    report = check_log(path)
    assert all(len(f.message) < 2000 for f in report.findings)


def test_numbers_of_thousands_of_digits_are_refused_by_their_name(tmp_path):
    path = write(tmp_path / "a.csv", native_columns())
    text = path.read_text().replace("0.1", "9" * 5000, 1)
    path.write_text(text)
    assert len(message(lambda: read_log(path))) < 2000


def test_nothing_is_warned_on_the_way(tmp_path):
    path = write(tmp_path / "a.csv", native_columns())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(read_log(path).position_rad).all()

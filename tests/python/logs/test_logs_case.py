"""Case folders: what is read, and every way a case can be wrong."""

import numpy as np
import pytest

from axisight.errors import CaseError, LogError
from axisight.logs import read_case
from logs_data import native_columns, write

HEAD = 'schema = "axisight.case/1"\nname = "demo"\nrobot = "robot.toml"\n'
FIRST = '[[log]]\nfile = "logs/a.parquet"\nrole = "estimation"\n'
SECOND = '[[log]]\nfile = "logs/b.parquet"\nrole = "validation"\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "logs").mkdir()
    (tmp_path / "robot.toml").touch()
    write(tmp_path / "logs/a.parquet", native_columns())
    write(tmp_path / "logs/b.parquet", native_columns(n=1500))
    return tmp_path


def put(folder, text):
    (folder / "case.toml").write_text(text)
    return folder


def refuse(folder, text, *words, error=CaseError):
    with pytest.raises(error) as caught:
        read_case(put(folder, text))
    for word in words:
        assert word in str(caught.value)


def test_case_is_read(folder):
    extra = 'excitation = "multisine"\nperiod_s = 1.0\n'
    case = read_case(put(folder, HEAD + FIRST + extra + SECOND))
    assert (case.name, case.folder, case.robot_path) == ("demo", folder, folder / "robot.toml")
    assert case.roles == ("estimation", "validation")
    assert [log.name for log in case.estimation] == ["a"]
    assert [log.name for log in case.validation] == ["b"]
    assert (case.logs[0].excitation, case.logs[0].period_s) == ("multisine", 1.0)
    assert (case.logs[1].excitation, case.logs[1].period_s) == (None, None)


def test_case_with_foreign_logs(folder):
    np.savez(folder / "c.npz", q=np.arange(600.0), i=np.ones(600))
    (folder / "map.toml").write_text(
        'sample_rate_hz = 500\n[[axis]]\nposition = { name = "q", unit = "deg" }\n'
        'torque = { name = "i", unit = "Nm" }\n'
    )
    put(folder, HEAD + '[[log]]\nfile = "c.npz"\nrole = "estimation"\n')
    log = read_case(folder, folder / "map.toml").estimation[0]
    assert log.position_rad[180, 0] == pytest.approx(np.pi)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", ["expected TOML"]),
        (HEAD.replace("case/1", "case/9") + FIRST, ["schema", "axisight.case/1", "case/9"]),
        (HEAD + 'colour = "red"\n' + FIRST, ["colour: expected a known key"]),
        (HEAD + FIRST + "perod_s = 1\n", ["log 1: perod_s: expected a known key"]),
        (HEAD + FIRST.replace("estimation", "training"), ["log 1: role", "'training'"]),
        (HEAD + SECOND, ["log", "'estimation'", "none among 1 log"]),
        (HEAD, ["log", "'estimation'", "none among 0 logs"]),
        (HEAD.replace("robot.toml", "r.toml") + FIRST, ["robot: expected an existing", "r.toml"]),
        (HEAD + FIRST.replace("a.par", "z.par"), ["log 1: file", "logs/z.parquet"]),
        (HEAD + FIRST + SECOND.replace("b.par", "a.par"), ["log 2: file", "a.parquet", "again"]),
        (HEAD + FIRST + "period_s = 0.0011\n", ["log 1: period_s", "whole number"]),
        (HEAD + FIRST + "period_s = 5.0\n", ["log 1: period_s", "at most", "2 s", "5 s"]),
        (HEAD + FIRST + "period_s = -1\n", ["log 1: period_s", "greater than 0"]),
        (FIRST, ["name: expected this key, got none"]),
    ],
)
def test_bad_cases(folder, text, words):
    refuse(folder, text, "case.toml", *words)


def test_missing_case_file(tmp_path):
    with pytest.raises(CaseError, match=r"case\.toml: cannot be read"):
        read_case(tmp_path)


def test_logs_that_do_not_go_together(folder):
    write(folder / "logs/b.parquet", native_columns(n_axes=3))
    refuse(folder, HEAD + FIRST + SECOND, "log 2: file", "expected 2 axes", "got 3")
    write(folder / "logs/b.parquet", native_columns(rate_hz=250.0))
    refuse(folder, HEAD + FIRST + SECOND, "b.parquet", "sample rate", error=LogError)


def test_practice_cases(shared):
    folders = sorted((shared / "cases").glob("case_*"))
    if not folders:
        pytest.skip("practice cases not found beside the real data")
    for folder in folders:
        case = read_case(folder)
        assert (len(case.estimation), len(case.validation)) == (6, 3)
        assert {log.n_axes for log in case.logs} == {3}
        assert all(log.velocity_ref_rad_s is not None for log in case.logs)

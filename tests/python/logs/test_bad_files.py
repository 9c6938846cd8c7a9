"""Small damaged files of every reader (`tests/golden/make_bad.py`): each is refused, and by name."""

import re
import shutil
from pathlib import Path

import pytest

from axisight.errors import CaseError, InputError, LogError, RobotError, StoreError, StudyError
from every_reader import READERS
from reading_children import read_in_child

BAD = Path(__file__).resolve().parents[2] / "golden" / "bad"
TOML = {
    "cut": "expected TOML.*end of document",
    "digits": "5000 digits",
    "dotted": "fewer than 32 parts",
    "nested": "nested too deep",
}
IN_TOML = {name: said.replace("expected TOML", "in TOML") for name, said in TOML.items()}
JSON = {
    "cut": "JSON",
    "digits": r"5000 digits|out of range",
    "list": "object",
    "nested": "nested|rec",
}
UNREADABLE, TOO_LARGE = "file_unreadable", "MB to be needed"
ENTITY = "<!DOCTYPE"

# Reader, its error, and of each file what is said besides its name.
SAID: dict[str, tuple[type[Exception], dict[str, str]]] = {
    "logs": (
        LogError,
        dict.fromkeys(("cut.h5", "cut.npz", "cut.parquet", "cut73.mat", "empty.csv"), UNREADABLE)
        | dict.fromkeys(("huge.h5", "huge.mat", "huge.npz", "huge.parquet", "lines.csv"), TOO_LARGE)
        | {
            "bytes.csv": "utf-8",
            "checksum.npz": "position_1: .*CRC",
            "cut.mat": "byte 512: .*truncated",
            "footer.parquet": "footer",
            "heap.h5": "heap signature",
            "levels.parquet": "histogram",
            "longer.csv": "as many values in every row as names",
            "nested.npz": UNREADABLE,
            "pickle.npz": "Object arrays",
            "tag.mat": "byte 136: flags: expected an element of type 6",
            "twice.csv": "position_1: expected one column of that name, got 2",
            "wide.csv": "at most 10000 columns, got 10001",
            "words.csv": "time_s: expected numbers or ISO 8601 stamps.*got 'noon'",
        },
    ),
    "recordings": (
        LogError,
        dict.fromkeys(("cut.bag", "cut_mcap", "cut_rosbag2", "nested_rosbag2"), UNREADABLE)
        | {
            "lerobot_digits": r"info\.json: .*out of range",
            "lerobot_nested": r"info\.json: .*recursion limit",
            "lerobot_list": r"info\.json: .*valid dictionary|object",
            "lerobot_cut": UNREADABLE,
        },
    ),
    "columns": (LogError, TOML | {"unknown": "axis 1: position: "}),
    "case": (CaseError, TOML | {"unknown": "schema: "}),
    "robot": (
        RobotError,
        {
            "cut": "line 1: not valid TOML: unclosed array",
            "digits": "line 1: ",
            "dotted": "line 1: not valid TOML: recursion limit",
            "nested": "line 1: not valid TOML: cannot recurse further",
            "infinite": r"line 11: `joint\[1\]\.link\.mass`: .*got inf",
        },
    ),
    "study": (StudyError, IN_TOML | {"unknown": "runz: unknown key"}),
    "design": (InputError, IN_TOML | {"unknown": "peroid: "}),
    "drives": (RobotError, TOML | {"zero": r"joint\.shoulder\.gear_ratio: "}),
    "verdict": (InputError, JSON),
    "sidecar": (InputError, JSON),
    "store": (
        StoreError,
        {"cut": "put back", "digits": "Exceeds the limit", "nested": "nested too deep"},
    ),
    "models": (
        RobotError,
        {
            "cut.urdf": "line 25, within <joint 'shoulder'>: expected XML",
            "cut.xml": "line 12, within <body 'lower'>: expected XML",
            "digits.urdf": "line 7, <mass>: value: expected a number",
            "entity.urdf": ENTITY,
            "entities.urdf": ENTITY,
            "negative.urdf": "line 7, <mass>: value: .*-4 kg",
            "nested.urdf": "at most 200 elements",
            "outside.xml": "line 3, <include>: file: .*inside the folder",
            "short.csv": "line 2, joint 'one': ixx: ",
            "words.csv": "line 3, joint 'two': theta_rad: .*'left'",
        },
    ),
    "references": (
        InputError,
        {
            "cut.mat": "truncated",
            "cut.parquet": "footer",
            "nested.csv": "nested too deep",
            "shape.csv": "dimension",
            "longer.csv": "as many values in every row as names",
        },
    ),
}


EVERY = [(reader, name) for reader, (_, files) in SAID.items() for name in files]


def named(path):
    """What a file is called in the table: whole where its ending chooses a reader."""
    return path.stem if path.suffix in (".toml", ".json") else path.name


def test_every_file_is_in_the_table():
    found = {(p.parent.name, named(p)) for p in BAD.glob("*/*") if ".design" not in p.name}
    assert found == set(EVERY)
    assert max(p.stat().st_size for p in BAD.rglob("*") if p.is_file()) < 20_000


@pytest.mark.parametrize(("reader", "name"), EVERY, ids=[f"{r}-{n}" for r, n in EVERY])
def test_it_is_refused_by_name(tmp_path, reader, name):
    if name.endswith(".xml"):
        pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    kind, files = SAID[reader]
    (source,) = (p for p in (BAD / reader).iterdir() if named(p) == name)
    copy = tmp_path / reader / source.name
    shutil.copytree(source.parent, copy.parent)
    with pytest.raises(kind) as caught:
        READERS[reader](copy)
    said = str(caught.value)
    assert re.search(files[name], said, re.DOTALL), said
    assert (f"case_{name}" if reader == "case" else source.name) in said
    assert len(said) < 1000


def test_no_log_costs_memory_or_ends_the_process():
    logs = sorted((BAD / "logs").iterdir())
    outcomes = read_in_child(logs, seconds=10, limit=3 * 10**9)
    assert [said for said, _ in outcomes if not said.startswith("refused: ")] == []
    assert max(used for _, used in outcomes) < 500

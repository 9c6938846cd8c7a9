"""Make ``bad/``: of every reader small damaged files, each with one fault, by hand or cut off.

Run from the root of the repository: ``python tests/golden/make_bad.py``. Numbers are made up. What is said
of each stands in ``tests/python/test_bad_files.py``.
"""

import io
import json
import shutil
import struct
import sys
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io

ROOT = Path(__file__).resolve().parents[2]
BAD = ROOT / "tests" / "golden" / "bad"
sys.path.insert(0, str(ROOT / "tests" / "python"))

from axisight.excitation import multisine, references, write_references  # noqa: E402
from bag_data import written_states  # noqa: E402
from columns_data import robot_toml, write_lerobot  # noqa: E402
from import_data import DH, MJCF, URDF  # noqa: E402
from logs_data import native_columns, write  # noqa: E402

NESTED, DIGITS = "[" * 5_000, "9" * 5_000


def folder(name: str) -> Path:
    """Return a folder for the files of a reader."""
    path = BAD / name
    path.mkdir(parents=True, exist_ok=True)
    return path


def cut(path: Path, share: float = 0.5) -> None:
    """Take away the end of a file."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])


def logs() -> None:
    """Write logs."""
    out, columns = folder("logs"), native_columns(40, 1, 100.0)
    for name, kind in (
        ("cut.parquet", None),
        ("cut.mat", None),
        ("cut73.mat", "mat73"),
        ("cut.h5", None),
        ("cut.npz", None),
    ):
        cut(write(out / name, columns, kind))
    for name in ("footer.parquet", "levels.parquet", "tag.mat", "checksum.npz"):
        data = bytearray(write(out / name, columns).read_bytes())
        if name == "footer.parquet":
            data[-8:-4] = struct.pack("<I", 2**31)  # the length of the description
        elif name == "levels.parquet":
            # A column that may have gaps is called one that has none: its histograms are too long.
            place = data.index(b"%\x02\x18\x06time_s")
            data[place + 1] = 0
        elif name == "tag.mat":
            data[128 + 8] = 250  # the type of the first tag inside a matrix
        else:
            data[len(data) // 3] ^= 1  # values that their checksum is not of
        (out / name).write_bytes(bytes(data))
    tables(out, columns)
    declared(out, columns)


def tables(out: Path, columns: dict[str, np.ndarray]) -> None:
    """Write tables of text."""
    text = write(out / "twice.csv", columns).read_text()
    (out / "twice.csv").write_text(text.replace("velocity_ref_1", "position_1", 1))
    (out / "words.csv").write_text(text.replace("\n0.0,", "\nnoon,", 1))
    # Decimal commas between commas: every row is longer than the header.
    (out / "longer.csv").write_text(text.replace(".", ","))
    (out / "bytes.csv").write_bytes(b"time_s,position_1\n\xff\xfe\x00\n")
    (out / "empty.csv").write_bytes(b"")
    (out / "wide.csv").write_text("," * 10_000 + "\n")
    # A few thousand names, and as many lines of nothing: a thousand times as much when read.
    (out / "lines.csv").write_text("," * 9_000 + "\n" * 9_000)


def declared(out: Path, columns: dict[str, np.ndarray]) -> None:
    """Write files that declare far more than they hold."""
    n = 6_000_000
    step = pa.chunked_array([pa.array(np.zeros(n // 20))] * 20)
    table = pa.table(dict.fromkeys(columns, step))
    pq.write_table(
        table, out / "huge.parquet", compression="zstd", row_group_size=n, max_rows_per_page=n
    )
    with h5py.File(out / "huge.h5", "w") as file:
        for name in columns:
            file.create_dataset(name, (10**9,), "f8", chunks=(10**5,), compression="gzip")
    for name, head in (
        ("huge.npz", "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }"),
        ("nested.npz", "{'descr': " + "(" * 3_000 + "}"),
        ("pickle.npz", "{'descr': '|O', 'fortran_order': False, 'shape': (3,), }"),
    ):
        raw = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode()
        with zipfile.ZipFile(out / name, "w", zipfile.ZIP_DEFLATED) as file:
            for column in columns:
                file.writestr(f"{column}.npy", raw)
    data = io.BytesIO()
    scipy.io.savemat(data, dict(columns))
    raw = bytearray(data.getvalue())
    at = raw.index(struct.pack("<ii", 1, 40))  # the size of the first matrix
    raw[at : at + 8] = struct.pack("<ii", 2**30, 2**30)
    (out / "huge.mat").write_bytes(bytes(raw))


def recordings() -> None:
    """Write recordings of ROS, and episodes."""
    out, time_s = folder("recordings"), np.arange(12) / 100.0
    fields = [np.sin(time_s)[:, None]] * 3
    for kind in ("bag", "mcap", "rosbag2"):
        path = out / ("cut.bag" if kind == "bag" else f"cut_{kind}")
        if path.is_dir():
            shutil.rmtree(path)
        path.unlink(missing_ok=True) if not path.is_dir() else None
        written_states(path, kind, time_s, ["a"], fields)
        if kind == "bag":
            cut(path)
            continue
        for file in path.iterdir():
            if file.suffix != ".yaml":
                cut(file)
    nested = out / "nested_rosbag2"
    shutil.rmtree(nested, ignore_errors=True)
    written_states(nested, "mcap", time_s, ["a"], fields)
    (nested / "metadata.yaml").write_text("rosbag2_bagfile_information: " + NESTED)
    for name, text in (
        ("nested", '{"fps": ' + NESTED),
        ("digits", '{"fps": ' + DIGITS + "}"),
        ("cut", None),
        ("list", "[]"),
    ):
        episodes = out / f"lerobot_{name}"
        shutil.rmtree(episodes, ignore_errors=True)
        write_lerobot(episodes, 1, 1)
        if text is not None:
            (episodes / "meta" / "info.json").write_text(text)
        for file in episodes.rglob("*.parquet"):
            cut(file, 0.2)


def documents() -> None:
    """Write what people write: maps, cases, studies, designs, robots, and results in JSON."""
    dotted = ".".join("a" * 200) + " = 1\n"
    for reader, starts in (
        ("columns", {"unknown": "[[axis]]\nposition = 7\n"}),
        ("case", {"unknown": 'schema = "axisight.case/9"\n'}),
        ("robot", {"infinite": robot_toml(1).replace("mass = 2.0", "mass = inf")}),
        ("study", {"unknown": 'robot = "irb6600_like"\nrunz = 3\n'}),
        ("design", {"unknown": 'robot = "irb6600_like"\nperoid = 3\n'}),
        ("drives", {"zero": "[joint.shoulder]\ngear_ratio = 0\n"}),
    ):
        texts = {
            "nested": f"a = {NESTED}",
            "digits": f"a = {DIGITS}\n",
            "dotted": dotted,
            "cut": "a = [1,",
        }
        for name, text in (texts | starts).items():
            (folder(reader) / f"{name}.toml").write_text(text)
    for reader in ("verdict", "sidecar"):
        for name, text in (
            ("nested", NESTED),
            ("digits", f'{{"schema": {DIGITS}}}'),
            ("cut", '{"schema": "axisight.'),
            ("list", "[]"),
        ):
            (folder(reader) / f"{name}.json").write_text(text)
    for name, text in (("nested", NESTED), ("digits", DIGITS), ("cut", '{"zarr_format": 3')):
        (folder(f"store/{name}/study.zarr") / "zarr.json").write_text(text)


def models() -> None:
    """Write model files."""
    out = folder("models")
    entity = '<?xml version="1.0"?>\n<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>\n'
    more = '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY x "&a;&a;&a;">]>\n'
    for name, text in (
        ("cut.urdf", URDF[:700]),
        ("entity.urdf", entity + '<robot name="&x;"><link name="base"/></robot>\n'),
        ("entities.urdf", more + '<robot name="&x;"><link name="base"/></robot>\n'),
        ("nested.urdf", "<robot>" + "<a>" * 1000),
        ("negative.urdf", URDF.replace('mass value="4"', 'mass value="-4"')),
        ("digits.urdf", URDF.replace('mass value="4"', f'mass value="{DIGITS}"')),
        ("cut.xml", MJCF[:600]),
        ("outside.xml", MJCF.replace("<worldbody>", '<include file="../../x.xml"/><worldbody>')),
        ("short.csv", DH[:150]),
        ("words.csv", DH.replace("two,standard,-0.2", "two,standard,left")),
    ):
        (out / name).write_text(text)


def designs() -> None:
    """Write references with their design."""
    out = folder("references")
    good = references(multisine(0.1, 0.002, band_hz=(20.0, 60.0)), 1)
    for name in ("cut.mat", "cut.parquet", "nested.csv", "shape.csv", "longer.csv"):
        write_references(good, out / name)
    cut(out / "cut.mat")
    cut(out / "cut.parquet")
    (out / "nested.design.json").write_text(NESTED)
    design = json.loads((out / "shape.design.json").read_text())
    (out / "shape.design.json").write_text(json.dumps(design | {"shape": [10**30, 1, 1]}))
    text = (out / "longer.csv").read_text()
    (out / "longer.csv").write_text(text.replace("\n1,", "\n1,7,", 1))


if __name__ == "__main__":
    shutil.rmtree(BAD, ignore_errors=True)
    for make in (logs, recordings, documents, models, designs):
        make()
    large = [p for p in BAD.rglob("*") if p.is_file() and p.stat().st_size > 20_000]
    if large:
        sys.exit(f"too large: {large}")

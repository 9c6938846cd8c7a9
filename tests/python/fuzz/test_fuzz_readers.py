"""Damage of any kind, seeded: no reader is killed, hangs, swells, or raises what is not the package's."""

import gzip
import json

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from axisight.errors import InputError
from axisight.logs import check_log, named_map_text, parse_column_map, read_case, read_log
from bag_data import written_states
from columns_data import robot, write_lerobot
from damage import TIMES, batch, mutated, sound
from logs_data import FORMAT_IDS, FORMATS, native_columns, write
from reading_children import read_in_child


@pytest.mark.parametrize(("name", "kind"), FORMATS, ids=FORMAT_IDS)
def test_damaged_logs(tmp_path, name, kind):
    rng = np.random.default_rng([8, FORMATS.index((name, kind))])
    path = write(tmp_path / name, native_columns(120, 1, 100.0), kind)
    sound(read_in_child(batch(tmp_path, path, rng), seconds=10, limit=3 * 10**9))


def test_damaged_text_that_is_packed(tmp_path):
    """The text is damaged, and the packing sound."""
    rng = np.random.default_rng(14)
    text = write(tmp_path / "a.csv", native_columns(120, 1, 100.0)).read_bytes()
    paths = [tmp_path / f"{number}.csv.gz" for number in range(TIMES)]
    for path in paths:
        path.write_bytes(gzip.compress(mutated(text, rng)))
    sound(read_in_child(paths, seconds=10, limit=3 * 10**9))


@pytest.mark.parametrize("kind", ["csv", "json", "jsonl"])
def test_damaged_dates(tmp_path, kind):
    """Most of the damage is in the dates."""
    columns = native_columns(120, 1, 100.0)
    when = pd.Timestamp("2024-10-27T00:59:59Z") + pd.to_timedelta(columns["time_s"], unit="s")
    columns = {"time_s": [t.isoformat() for t in when]} | {
        name: np.round(columns[name], 1) for name in ("position_1", "torque_cmd_1")
    }
    path = write(tmp_path / f"a.{kind}", columns)
    assert read_log(path).n_samples == 120
    rng = np.random.default_rng([15, len(kind)])
    sound(read_in_child(batch(tmp_path, path, rng), seconds=10, limit=3 * 10**9))


NESTED = """
time = { name = "t" }
[[axis]]
position = { name = "joints[0].q", unit = "rad" }
torque = { name = "tau[0]", unit = "Nm" }
"""


@pytest.mark.parametrize("kind", ["json", "jsonl"])
def test_damaged_records_in_records(tmp_path, kind):
    rows = [{"t": k / 100, "joints": [{"q": k / 7}], "tau": [k, 1]} for k in range(120)]
    text = [json.dumps(row) for row in rows]
    path = tmp_path / f"a.{kind}"
    path.write_text(f"[{','.join(text)}]" if kind == "json" else "\n".join(text))
    assert read_log(path, parse_column_map(NESTED)).n_samples == 120
    rng = np.random.default_rng([16, len(kind)])
    sound(read_in_child(batch(tmp_path, path, rng), NESTED, seconds=10, limit=3 * 10**9))


def packed_mat(path):
    columns = native_columns(120, 1, 100.0)
    names = [(name, "O") for name in columns]
    cells = np.array([columns["time_s"], "text"], dtype=object)
    struct = np.array([tuple(columns.values())], dtype=names)
    scipy.io.savemat(path, {"run": struct, "cells": cells}, do_compression=path.stem == "packed")
    return path


def packed_hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in native_columns(120, 1, 100.0).items():
            file.create_dataset(
                f"run/{name}", data=values, chunks=(60,), compression="gzip", shuffle=True
            )
    return path


def packed_npz(path):
    np.savez_compressed(path, **{f"run.{k}": v for k, v in native_columns(120, 1, 100.0).items()})
    return path


RUN = """
time = { name = "run.time_s" }
[[axis]]
position = { name = "run.position_1", unit = "rad" }
torque = { name = "run.torque_cmd_1", unit = "Nm" }
"""
PACKED = {
    "struct.mat": packed_mat,
    "packed.mat": packed_mat,
    "a.h5": packed_hdf5,
    "a.npz": packed_npz,
}


@pytest.mark.parametrize("name", PACKED)
def test_damaged_logs_with_structure(tmp_path, name):
    path = PACKED[name](tmp_path / name)
    assert read_log(path, parse_column_map(RUN)).n_samples == 120
    rng = np.random.default_rng([9, len(name)])
    sound(read_in_child(batch(tmp_path, path, rng), RUN, seconds=10, limit=3 * 10**9))


STATES = """
time = { name = "joint_states.time_s", resample_hz = "mean" }
[[axis]]
position = { name = "joint_states.position.a", unit = "rad" }
torque = { name = "joint_states.effort.a", unit = "Nm" }
"""


@pytest.mark.parametrize("kind", ["bag", "mcap", "rosbag2"])
def test_damaged_recordings(tmp_path, kind):
    time_s = np.arange(120) / 100.0
    fields = [np.sin(time_s)[:, None]] * 3
    good = tmp_path / ("good.bag" if kind == "bag" else "good")
    path = written_states(good, kind, time_s, ["a"], fields)
    rng = np.random.default_rng(10)
    if kind == "bag":
        paths = batch(tmp_path, path, rng)
    else:  # a folder with a description and a file: either is damaged
        paths, files = [], sorted(p for p in good.iterdir() if p.is_file())
        for number in range(TIMES):
            paths.append(tmp_path / f"{number}")
            paths[-1].mkdir()
            spoiled = files[number % len(files)]
            for file in files:
                data = file.read_bytes()
                data = mutated(data, rng) if file == spoiled else data
                (paths[-1] / file.name).write_bytes(data)
    sound(read_in_child(paths, STATES, seconds=10, limit=3 * 10**9))


@pytest.mark.parametrize("kind", ["json", "protobuf", "cdr"])
def test_damaged_recordings_of_others(tmp_path, kind):
    """The file, and of JSON and CDR a message in a sound file, of CDR its definition too."""
    data = pytest.importorskip("mcap_data", reason="needs axisight[mcap]")
    rng, path = np.random.default_rng(12), tmp_path / "good.mcap"
    times = np.arange(120) / 100.0
    if kind == "protobuf":
        flat = data.protobuf_types()["Flat"]
        rows = [(t, flat(name=["a"], position=[np.sin(t)], effort=[1.0])) for t in times]
        paths = batch(tmp_path, data.written_protobuf(path, "/joint_states", rows), rng)
    elif kind == "cdr":
        fields = [np.sin(times)[:, None]] * 3
        states = written_states(tmp_path / "run", "mcap file", times, ["a"], fields)
        paths = batch(tmp_path, data.not_of_ros(path, states), rng)
        text = data.JOINT_STATE_IDL
        message = bytes(8) + b"\x05\x00\x00\x00abcd\x00" + bytes(64)
        for number in range(TIMES // 4):
            spoiled = mutated(text.encode(), rng).decode("latin-1")
            definition = data.Definition(encoding="ros2idl", text=spoiled)
            other = tmp_path / f"definition{number}.mcap"
            paths.append(data.not_of_ros(other, states, definition=definition))
            other = tmp_path / f"message{number}.mcap"
            paths.append(data.not_of_ros(other, states, spoiled={5: mutated(message, rng)}))
    else:
        rows = [(t, {"name": ["a"], "position": [np.sin(t)], "effort": [1.0]}) for t in times]
        paths = batch(tmp_path, data.written_json(path, {"/joint_states": rows}), rng)
        for number in range(TIMES // 4):
            text = mutated(json.dumps(rows[5][1]).encode(), rng)
            spoiled = [*rows[:5], (times[5], text), *rows[6:]]
            paths.append(
                data.written_json(tmp_path / f"text{number}.mcap", {"/joint_states": spoiled})
            )
    sound(read_in_child(paths, STATES, seconds=10, limit=3 * 10**9))


def refused_only(call, times=TIMES):
    """Call with numbers of damages; errors of the package are right, all others are raised."""
    refused = 0
    for number in range(times):
        try:
            call(number)
        except InputError:
            refused += 1
    assert refused


def test_damaged_maps_and_cases(tmp_path):
    path = write(tmp_path / "a.csv", native_columns(120, 1, 100.0))
    (tmp_path / "robot.toml").touch()
    rng = np.random.default_rng(12)
    zeros = RUN.replace("run.", "").replace('"rad" }', '"rad", offset = 1.5 }')
    ranges = zeros.replace("offset = 1.5", "raw_range = [0, 2], unit_range = [1, 3]")
    maps = [zeros, named_map_text("ur-rtde"), named_map_text("franka"), ranges]

    def one_map(number):
        text = mutated(maps[number % 4].encode(), rng).decode("utf-8", "replace")
        check_log(path, parse_column_map(text))

    refused_only(one_map)
    case = (
        'schema = "axisight.case/1"\nname = "c"\nrobot = "robot.toml"\n'
        '[[log]]\nfile = "a.csv"\nrole = "estimation"\nperiod_s = 1.0\n'
    )

    def one_case(number):
        (tmp_path / "case.toml").write_bytes(mutated(case.encode(), rng))
        read_case(tmp_path)

    refused_only(one_case)


def test_damaged_folders_of_lerobot(tmp_path):
    folder = write_lerobot(tmp_path / "set", 2)
    files = [p for p in sorted(folder.rglob("*")) if p.suffix in (".json", ".parquet")]
    good = {file: file.read_bytes() for file in files}
    rng = np.random.default_rng(13)

    def one(number):
        spoiled = files[number % len(files)]
        spoiled.write_bytes(mutated(good[spoiled], rng))
        try:
            read_log(tmp_path / "set#1", robot=robot(6))
        finally:
            spoiled.write_bytes(good[spoiled])

    refused_only(one)

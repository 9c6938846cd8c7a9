"""Small invented logs and writers of every format, for the log tests."""

import json
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import scipy.io

RATE_HZ = 500.0


def native_columns(n: int = 1000, n_axes: int = 2, rate_hz: float = RATE_HZ) -> dict:
    """Return native columns of a smooth run; velocity_ref is the exact derivative of the position."""
    t = np.arange(n) / rate_hz
    columns = {"time_s": t}
    for axis in range(1, n_axes + 1):
        w = 2 * np.pi * (0.5 + axis)
        columns[f"position_{axis}"] = np.sin(w * t) + 0.1 * axis
        columns[f"velocity_ref_{axis}"] = w * np.cos(w * t)
        columns[f"torque_cmd_{axis}"] = axis * np.cos(3.1 * w * t) + 0.3
    return columns


def write_mat73(path: Path, columns: dict) -> None:
    """Write in MATLAB v7.3's format: HDF5 behind a 512-byte header, row vectors transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            stored = np.atleast_2d(values).T if np.ndim(values) < 2 else np.asarray(values).T
            file[name.replace(".", "/")] = stored
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write(path: Path, columns: dict, kind: str | None = None) -> Path:
    """Write the columns in the format of the suffix, or of `kind` ("mat73")."""
    kind = kind or path.suffix
    if kind == "mat73":
        write_mat73(path, columns)
    elif kind == ".parquet":
        pd.DataFrame(columns).to_parquet(path)
    elif kind in {".csv", ".gz"}:
        pd.DataFrame(columns).to_csv(path, index=False)
    elif kind == ".tsv":
        pd.DataFrame(columns).to_csv(path, index=False, sep="\t")
    elif kind in {".json", ".jsonl"}:
        rows = [json.dumps(row) for row in pd.DataFrame(columns).to_dict(orient="records")]
        path.write_text("\n".join(rows) if kind == ".jsonl" else f"[{','.join(rows)}]")
    elif kind == ".npy":
        np.save(path, pd.DataFrame(columns).to_records(index=False))
    elif kind == ".mat":
        scipy.io.savemat(path, columns)
    elif kind in {".h5", ".hdf5"}:
        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values
    elif kind == ".npz":
        np.savez(path, **columns)
    return path


FORMATS = [
    ("run.parquet", None),
    ("run.csv", None),
    ("run.mat", None),
    ("run.mat", "mat73"),
    ("run.h5", None),
    ("run.hdf5", None),
    ("run.npz", None),
    ("run.csv.gz", None),
    ("run.tsv", None),
    ("run.json", None),
    ("run.jsonl", None),
    ("run.npy", None),
]
FORMAT_IDS = ["parquet", "csv", "mat5", "mat73", "h5", "hdf5", "npz"]
FORMAT_IDS += ["csv.gz", "tsv", "json", "jsonl", "npy"]

"""Plausible mistakes in the files of a case: each a function with the name of the expected finding."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from spoiled_cases import (
    Case,
    Mistake,
    mistake,
)


def write_case(case: Case, folder: Path) -> Path:
    """Write the case as a folder and return the folder."""
    toml = ['schema = "axisight.case/1"', 'name = "case"', 'robot = "robot.toml"']
    (folder / "logs").mkdir(parents=True)
    for log in case.logs:
        frame = {"time_s": log.time_s}
        for i in range(log.n_axes):
            if log.velocity_ref_rad_s is not None:
                frame[f"velocity_ref_{i + 1}"] = log.velocity_ref_rad_s[:, i]
            frame[f"torque_cmd_{i + 1}"] = log.torque_nm[:, i]
            frame[f"position_{i + 1}"] = log.position_rad[:, i]
        pd.DataFrame(frame).to_parquet(folder / "logs" / f"{log.name}.parquet", index=False)
        role = "estimation" if log in case.estimation else "validation"
        toml += ["[[log]]", f'file = "logs/{log.name}.parquet"', f'role = "{role}"']
    (folder / "case.toml").write_text("\n".join(toml))
    (folder / "robot.toml").write_text(case.robot.toml)
    return folder


def edit(folder: Path, change: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    path = next(iter(sorted((folder / "logs").iterdir())))
    change(pd.read_parquet(path)).to_parquet(path, index=False)


@mistake("rows_missing", kind="file")
def rows_dropped_gap_left(folder: Path) -> None:
    edit(folder, lambda f: f.drop(index=range(3000, 3050)))


@mistake("time_jitter", kind="file")
def uneven_time_stamps(folder: Path) -> None:
    noise = lambda f: np.random.default_rng(1).uniform(-0.2, 0.2, len(f)) * 5e-4  # noqa: E731
    edit(folder, lambda f: f.assign(time_s=f.time_s + noise(f)))


@mistake("time_not_increasing", kind="file")
def time_that_runs_back(folder: Path) -> None:
    edit(folder, lambda f: f.assign(time_s=np.where(f.index == 99, 0.0, f.time_s)))


@mistake("not_finite", kind="file")
def not_a_number_in_a_file(folder: Path) -> None:
    edit(folder, lambda f: f.assign(position_1=np.where(f.index == 99, np.nan, f.position_1)))


@mistake("file_unreadable", kind="file")
def truncated_file(folder: Path) -> None:
    path = next(iter(sorted((folder / "logs").iterdir())))
    path.write_bytes(path.read_bytes()[:5000])


@mistake("log_too_short", kind="file")
def empty_log(folder: Path) -> None:
    edit(folder, lambda f: f.iloc[:0])


@mistake("reference_missing", kind="file")
def reference_column_missing(folder: Path) -> None:
    edit(folder, lambda f: f.drop(columns="velocity_ref_2"))


@mistake("rates_differ", kind="file")
def unequal_rates_of_files(folder: Path) -> None:
    edit(folder, lambda f: f.assign(time_s=2 * f.time_s))


@mistake("rates_differ", kind="file")
def one_file_in_milliseconds(folder: Path) -> None:
    edit(folder, lambda f: f.assign(time_s=1000 * f.time_s))


@mistake("torque_in_mnm", kind="file")
def files_in_millinewtonmetres(folder: Path) -> None:
    for path in (folder / "logs").iterdir():
        frame = pd.read_parquet(path)
        for i in (1, 2, 3):
            frame[f"torque_cmd_{i}"] *= 1000
        frame.to_parquet(path, index=False)


assert dataclasses.is_dataclass(Mistake)

"""A public arm: its logs and robot in our format, and the three commands that judge them.

Each script beside this file reads one public data set into a `PublicArm` and calls `main`. Nothing of the data sets is
part of this project.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recording:
    """One log of an arm.

    ``position`` [rad] and ``velocity`` [rad/s] of the joints, and ``torque`` in the unit of the arm, (n, n_axes) each.
    ``time`` (n,) [s]: the stamps, None for rows without stamps.
    """

    name: str
    position: Array
    torque: Array
    velocity: Array | None = None
    time: Array | None = None


@dataclass(frozen=True)
class PublicArm:
    """A model file, its first and last link, and the logs of its arm.

    ``rate_hz``: the sample rate, or that of the grid for uneven stamps [Hz]. ``scale``: Nm on the joint by unit of
    torque, one number for each axis. The last of ``recordings`` is held out.
    """

    model: Path
    rate_hz: float
    recordings: Sequence[Recording]
    tip: str = ""
    base: str = ""
    scale: Sequence[float] = ()


def write(arm: PublicArm, folder: Path) -> list[Path]:
    """Write the column map (``columns.toml``) and a CSV for each log; return the paths of the logs."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "columns.toml").write_text(_column_map(arm))
    paths = []
    for recording in arm.recordings:
        names, parts = [], []
        if recording.time is not None:
            names, parts = ["time"], [recording.time[:, None] - recording.time[0]]
        for stem, values in (
            ("q", recording.position),
            ("dq", recording.velocity),
            ("tau", recording.torque),
        ):
            if values is not None:
                names += [f"{stem}_{k + 1}" for k in range(values.shape[1])]
                parts.append(values)
        path = folder / f"{recording.name}.csv"
        np.savetxt(
            path, np.hstack(parts), delimiter=",", header=",".join(names), comments="", fmt="%.10g"
        )
        paths.append(path)
    return paths


def _column_map(arm: PublicArm) -> str:
    first = arm.recordings[0]
    lines = ['schema = "axisight.columns/1"', 'side = "joint"']
    if first.time is None:
        lines.append(f"sample_rate_hz = {arm.rate_hz}")
    else:
        lines.append(f'time = {{ name = "time", resample_hz = {arm.rate_hz} }}')
    for axis in range(first.position.shape[1]):
        scale = arm.scale[axis] if len(arm.scale) else 1.0
        lines += [
            "[[axis]]",
            f'position = {{ name = "q_{axis + 1}", unit = "rad" }}',
            f'torque = {{ name = "tau_{axis + 1}", unit = "Nm", scale = {scale} }}',
        ]
        if first.velocity is not None:
            lines.append(f'velocity = {{ name = "dq_{axis + 1}", unit = "rad/s" }}')
    return "\n".join(lines) + "\n"


def main(read: Callable[..., PublicArm], description: str, folders: Sequence[str] = ()) -> None:
    """Read an arm out of the checkouts on the command line, write it, and run what is asked for.

    ``folders``: names of further checkouts that ``read`` takes after the first.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("checkout", *folders):
        parser.add_argument(name, type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder for logs and results")
    commands = ("check", "diagnose", "identify")
    parser.add_argument("--only", nargs="+", choices=commands, default=commands)
    given = parser.parse_args()
    arm = read(*(getattr(given, name) for name in ("checkout", *folders)))
    logs = write(arm, given.out)
    robot = given.out / "robot.toml"
    ends = [
        w
        for option in ("base", "tip")
        if (link := getattr(arm, option))
        for w in (f"--{option}", link)
    ]
    _run(["robot", "import", arm.model, *ends, "--out", robot, "--force"])
    columns = ["--columns", given.out / "columns.toml"]
    if "check" in given.only:
        for log in logs:
            _run(["check", log, *columns, "--robot", robot])
    if "diagnose" in given.only:
        verdict = ["--json", given.out / "verdict.json", "--force"]
        _run(["diagnose", robot, *logs, *columns, *verdict])
    if "identify" in given.only:
        held_out = ["--held-out", logs[-1]] if len(logs) > 1 else []
        written = ["--consistent", "--out", given.out / "identified.toml", "--force"]
        fitted = logs[:-1] or logs
        _run(["identify", "rigid-body", robot, *fitted, *held_out, *columns, *written])


def _run(arguments: Sequence[object]) -> None:
    """Run a command of the program, and print it with its output, exit status and time."""
    words = [str(a) for a in arguments]
    print(f"\n$ axisight {' '.join(words)}", flush=True)
    began = time.monotonic()
    status = subprocess.run([sys.executable, "-m", "axisight", *words], check=False).returncode
    print(f"exit status {status}, {time.monotonic() - began:.0f} s", flush=True)

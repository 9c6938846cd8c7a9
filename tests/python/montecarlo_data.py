"""Small studies and helpers for the tests of Monte Carlo studies."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr

from axisight import load_robot
from axisight import montecarlo as mc

ROBOT = "irb6600_like"
RIPPLE = mc.EffectEntry(
    name="torque_ripple",
    axis=1,
    parameters={"order_1": 3.0, "sine_1_nm": 0.06, "order_u": 18.0, "sine_u": 0.04},
)


def small_study(**changes) -> mc.Study:
    """Return a study with half-second periods at 2 kHz, 19 lines, blocks of 8 runs: about 5 ms per run."""
    fields = {
        "robot": ROBOT,
        "runs": 40,
        "seed": 7,
        "block_runs": 8,
        "excitation": mc.Excitation(
            multisine=mc.Multisine(period_s=0.5, band_hz=(4, 40), peak_rad_s=8),
            square=mc.Square(amplitude_rad_s=9.6, period_s=0.5),
        ),
        "effect": [RIPPLE],
    }
    return mc.Study(**{**fields, **changes})


def robot_file(folder: Path, old: str, new: str) -> str:
    """Return the path of the preset robot's file with a piece of its text replaced."""
    text = load_robot(ROBOT).toml
    assert old in text
    path = folder / "robot.toml"
    path.write_text(text.replace(old, new))
    return str(path)


def same_bits(a: xr.Dataset, b: xr.Dataset) -> None:
    """Assert that every variable has the same bytes in both."""
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        assert a[name].dtype == b[name].dtype, name
        assert a[name].values.tobytes() == b[name].values.tobytes(), name


def blocks(out: Path) -> list[Path]:
    """Return the finished blocks of a store."""
    return sorted((out / "study.zarr" / "blocks").glob("*-*"))


def start(*command: str, **options) -> subprocess.Popen:
    """Return a Python process in its own process group."""
    return subprocess.Popen(
        [sys.executable, *command],
        start_new_session=True,
        env={**os.environ, "PYTHONWARNINGS": "default"},
        **options,
    )


def kill(process: subprocess.Popen) -> None:
    """Send SIGKILL, because every other signal lets a process tidy up."""
    if process.poll() is None:
        process.send_signal(signal.SIGKILL)
    process.wait(timeout=10)


def until(condition, seconds: float = 30.0) -> None:
    """Wait for a condition, or fail after ``seconds``."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "timed out"
        time.sleep(0.01)


def relative(got, want) -> float:
    """Return the largest difference over the largest value."""
    return float(np.max(np.abs(got - want)) / np.max(np.abs(want)))


@contextmanager
def dask_cluster(
    folder: Path,
) -> Iterator[tuple[str, subprocess.Popen[bytes], list[subprocess.Popen[bytes]]]]:
    """Yield a scheduler's loopback address, its process, and two worker processes without nannies."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    contact = folder / "scheduler.json"
    host = ["--host", "127.0.0.1", "--no-dashboard"]
    scheduler = start(
        "-m", "distributed.cli.dask_scheduler", *host, "--port", "0",
        "--scheduler-file", str(contact), **quiet,
    )  # fmt: skip
    processes = [scheduler]
    try:
        until(lambda: contact.exists() and contact.read_text().endswith("}"))
        address = json.loads(contact.read_text())["address"]
        workers = [
            start(
                "-m", "distributed.cli.dask_worker", address, *host, "--no-nanny",
                "--nthreads", "1", "--local-directory", str(folder / f"worker{i}"), **quiet,
            )
            for i in range(2)
        ]  # fmt: skip
        processes += workers
        yield address, scheduler, workers
    finally:
        for process in reversed(processes):
            kill(process)

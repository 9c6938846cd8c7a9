"""The crash trial, ``make crash``: studies killed, damaged and starved end in the same bits or in a clear refusal.

    python tests/python/crash_trial.py [KILLS] [SEED]

Kills of the process that computes at random moments; every file of a finished store damaged in turn; a
file system that is full (Linux, as root); workers of a Dask cluster killed. Prints what came out and ends
with status 1 if anything was lost.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import xarray as xr

from axisight import montecarlo as mc
from axisight.errors import AxisightError
from montecarlo_data import dask_cluster, kill, same_bits, small_study, start

RUNS = {"runs": 400, "block_runs": 8}
# Of which every file is damaged: some dozen.
FEW = {"runs": 24, "block_runs": 8}
_COMPUTE = (
    "import sys; sys.path.insert(0, sys.argv[2]); from pathlib import Path; from axisight import montecarlo;"
    "from montecarlo_data import small_study; out = Path(sys.argv[1]);"
    f"montecarlo.run(small_study(**{RUNS}), out=out, resume=(out / 'study.zarr').exists())"
)


def finished(out: Path, size: dict[str, int]) -> xr.Dataset:
    """Return the study as it is when whatever is left of it in ``out`` has been gone on with."""
    return mc.run(small_study(**size), out=out, resume=(out / "study.zarr").exists())


def compared(out: Path, whole: xr.Dataset, size: dict[str, int] = RUNS) -> str:
    """Return ``same``, ``refused: ...``, or what was lost."""
    try:
        same_bits(finished(out, size), whole)
    except AxisightError as error:
        return f"refused: {type(error).__name__}"
    except AssertionError:
        return "LOST: other bits"
    except Exception as error:  # anything else is a failure of the trial's subject
        return f"LOST: {type(error).__name__}: {error}"
    return "same"


def killed(folder: Path, whole: xr.Dataset, kills: int, rng: np.random.Generator) -> Counter[str]:
    """Kill a computing process ``kills`` times, at any moment of its life; compare what remains each time."""
    begun = time.monotonic()
    out = folder / "whole"
    process = start("-c", _COMPUTE, str(out), str(Path(__file__).parent))
    process.wait(timeout=120)
    life_s = time.monotonic() - begun
    found: Counter[str] = Counter()
    for number in range(kills):
        out = folder / f"killed{number}"
        process = start("-c", _COMPUTE, str(out), str(Path(__file__).parent))
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=float(rng.uniform(0.2, 1.0)) * life_s)
        kill(process)
        found[compared(out, whole)] += 1
        shutil.rmtree(out, ignore_errors=True)
    return found


def damaged(folder: Path, rng: np.random.Generator) -> Counter[str]:
    """Damage every file of a finished store in turn: a byte changed, the end cut off, all taken away."""
    good = folder / "good"
    whole = finished(good, FEW)
    found: Counter[str] = Counter()
    for path in sorted(p for p in good.rglob("*") if p.is_file()):
        for spoil in (_changed, _cut, Path.unlink):
            out = folder / "spoiled"
            shutil.copytree(good, out)
            spoil(out / path.relative_to(good), *([rng] if spoil is _changed else []))
            found[compared(out, whole, FEW)] += 1
            shutil.rmtree(out)
    return found


def _changed(path: Path, rng: np.random.Generator) -> None:
    data = bytearray(path.read_bytes()) or bytearray(1)
    data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
    path.write_bytes(bytes(data))


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def starved(folder: Path, whole: xr.Dataset, times: int) -> Counter[str]:
    """Compute on a file system that is full at one size after another, then go on where there is room."""
    found: Counter[str] = Counter()
    for number in range(times):
        small, out = folder / f"small{number}", folder / f"room{number}"
        small.mkdir()
        size = f"size={40 * 2**number}k"
        subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", str(small)], check=True)
        try:
            said = compared(small / "out", whole)
            if (small / "out").exists():
                shutil.copytree(small / "out", out)
        finally:
            subprocess.run(["umount", str(small)], check=True)
        after = compared(out, whole)
        found[said if "LOST" in said else f"{said}, then {after}"] += 1
    return found


def orphaned(folder: Path, whole: xr.Dataset, times: int, rng: np.random.Generator) -> Counter[str]:
    """Kill one of two workers of a cluster in the middle of a study."""
    found: Counter[str] = Counter()
    for number in range(times):
        where = folder / f"cluster{number}"
        where.mkdir()
        at = int(rng.integers(2, 40))
        with dask_cluster(where) as (address, _, workers):
            done: list[int] = []

            def sabotage(state: mc.Progress, done=done, at=at, workers=workers) -> None:
                done.append(state.done)
                if len(done) == at:
                    kill(workers[0])

            far = mc.run(
                small_study(**RUNS), out=where / "out", backend="dask", scheduler=address,
                progress=sabotage,
            )  # fmt: skip
        try:
            same_bits(far, whole)
            found["same"] += 1
        except AssertionError:
            found["LOST: other bits"] += 1
    return found


def main(kills: int, seed: int) -> int:
    """Run all trials; 1 where anything was lost."""
    rng = np.random.default_rng(seed)
    lost = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = mc.run(small_study(**RUNS))
        trials: list[tuple[str, Callable[[], Counter[str]]]] = [
            (f"{kills} kills", lambda: killed(folder, whole, kills, rng)),
            ("every file damaged", lambda: damaged(folder, rng)),
        ]
        if hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("mount"):
            trials.append(("full disks", lambda: starved(folder, whole, 10)))
        if find_spec("distributed") is not None:
            trials.append(("dead workers", lambda: orphaned(folder, whole, 10, rng)))
        for what, trial in trials:
            found = trial()
            lost += sum(n for said, n in found.items() if "LOST" in said)
            said = ", ".join(f"{n} {outcome}" for outcome, n in found.most_common())
            print(f"{what}: {said}", flush=True)
    return 1 if lost else 0


if __name__ == "__main__":
    numbers = [int(x) for x in sys.argv[1:3]]
    sys.exit(main(*(numbers + [100, 0][len(numbers) :])))

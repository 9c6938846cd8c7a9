"""The crash trial, ``make crash``: killed, damaged and starved work gives the same bits or a clear refusal.

    python tests/python/crash_trial.py [KILLS] [SEED] [SUBJECT]

The trial does four things to a Monte Carlo study and to a fleet:

- it kills the computing process with its children, at random moments;
- it damages every file of a finished run in turn;
- it fills up the file system (Linux, as root);
- it kills workers of a Dask cluster.

It prints the outcomes and ends with status 1 if anything was lost.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from axisight.errors import AxisightError
from crash_subjects import Subject, subjects
from montecarlo_data import dask_cluster, kill

TIMES = 10
"""Number of trials with full disks and with dead workers."""


def compared(subject: Subject, out: Path, whole: object) -> str:
    """Return ``same``, ``refused: ...``, or what was lost."""
    try:
        subject.compare(subject.finish(out), whole)
    except AxisightError as error:
        return f"refused: {type(error).__name__}"
    except AssertionError:
        return "LOST: other bits"
    except Exception as error:  # any other exception is a failure of the subject
        return f"LOST: {type(error).__name__}: {error}"
    return "same"


def killed(
    subject: Subject, folder: Path, whole: object, kills: int, rng: np.random.Generator
) -> Counter[str]:
    """Return outcomes of ``kills`` kills of a computing process at random moments, compared after each."""
    begun = time.monotonic()
    subject.process(folder / "whole").wait(timeout=300)
    life_s = time.monotonic() - begun
    found: Counter[str] = Counter()
    for number in range(kills):
        out = folder / f"killed{number}"
        process = subject.process(out)
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=float(rng.uniform(0.2, 1.0)) * life_s)
        # Children too, so that nothing is left to finish the work.
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=10)
        found[compared(subject, out, whole)] += 1
        shutil.rmtree(out, ignore_errors=True)
    return found


def damaged(subject: Subject, folder: Path, rng: np.random.Generator) -> Counter[str]:
    """Return outcomes of damage to each file of a finished folder: a changed byte, a cut end, no content."""
    good = folder / "good"
    whole = subject.finish(good)
    found: Counter[str] = Counter()
    for path in sorted(p for p in good.rglob("*") if p.is_file()):
        for spoil in (_changed, _cut, Path.unlink):
            out = folder / "spoiled"
            shutil.copytree(good, out)
            spoil(out / path.relative_to(good), *([rng] if spoil is _changed else []))
            found[compared(subject, out, whole)] += 1
            shutil.rmtree(out)
    return found


def _changed(path: Path, rng: np.random.Generator) -> None:
    data = bytearray(path.read_bytes()) or bytearray(1)
    data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
    path.write_bytes(bytes(data))


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def starved(subject: Subject, folder: Path, whole: object) -> Counter[str]:
    """Return outcomes of work on file systems that fill up at different sizes, resumed with more space."""
    found: Counter[str] = Counter()
    for number in range(TIMES):
        small, out = folder / f"small{number}", folder / f"room{number}"
        small.mkdir()
        size = f"size={8 * 2**number}k"
        subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", str(small)], check=True)
        try:
            said = compared(subject, small / "out", whole)
            if (small / "out").exists():
                shutil.copytree(small / "out", out)
        finally:
            subprocess.run(["umount", str(small)], check=True)
        after = compared(subject, out, whole)
        found[said if "LOST" in said else f"{said}, then {after}"] += 1
    return found


def orphaned(
    subject: Subject, folder: Path, whole: object, rng: np.random.Generator
) -> Counter[str]:
    """Return outcomes of killing one of two cluster workers in the middle of the work."""
    found: Counter[str] = Counter()
    for number in range(TIMES):
        where = folder / f"cluster{number}"
        where.mkdir()
        with dask_cluster(where) as (address, _, workers):
            told: list[int] = []
            at = int(rng.integers(2, subject.steps))

            def sabotage(done: int, told=told, at=at, workers=workers) -> None:
                told.append(done)
                if len(told) == at:
                    kill(workers[0])

            far = subject.on_cluster(where / "out", address, sabotage)
        try:
            subject.compare(far, whole)
            found["same"] += 1
        except AssertionError:
            found["LOST: other bits"] += 1
    return found


def tried(subject: Subject, folder: Path, kills: int, seed: int) -> int:
    """Run all trials on a subject; return the number of losses."""
    rng = np.random.default_rng(seed)
    whole = subject.finish(folder / "once")
    trials = {
        f"{kills} kills": lambda: killed(subject, folder, whole, kills, rng),
        "every file damaged": lambda: damaged(subject.few(), folder, rng),
    }
    if hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("mount"):
        trials["full disks"] = lambda: starved(subject, folder, whole)
    if find_spec("distributed") is not None:
        trials["dead workers"] = lambda: orphaned(subject, folder, whole, rng)
    lost = 0
    for what, trial in trials.items():
        found = trial()
        lost += sum(n for said, n in found.items() if "LOST" in said)
        said = ", ".join(f"{n} {outcome}" for outcome, n in found.most_common())
        print(f"{subject.name}, {what}: {said}", flush=True)
    return lost


def main(kills: int = 100, seed: int = 0, only: str | None = None) -> int:
    """Run the trial on every subject, or on ``only`` one; return 1 if anything was lost."""
    lost = 0
    with tempfile.TemporaryDirectory() as name:
        for subject in subjects(Path(name)):
            if only in (None, subject.name):
                folder = Path(name, f"{subject.name}-trials")
                folder.mkdir()
                lost += tried(subject, folder, kills, seed)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:3]), *sys.argv[3:4]))

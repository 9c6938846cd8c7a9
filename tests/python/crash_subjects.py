"""Subjects of the crash trial: a Monte Carlo study and a fleet. Both resume where they were stopped."""

from __future__ import annotations

import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

from axisight import Effect, Settings
from axisight import montecarlo as mc
from axisight.fleet import diagnose_fleet
from fleet_data import write_case
from montecarlo_data import same_bits, small_study, start

# Callback with the number of steps done so far.
Told = Callable[[int], None]


class Subject(ABC):
    """Long work that leaves files in a folder ``out``."""

    name: str
    steps: int
    """How often the work calls ``told``."""

    @abstractmethod
    def process(self, out: Path) -> subprocess.Popen[bytes]:
        """Start or resume the work in its own process."""

    @abstractmethod
    def finish(self, out: Path) -> object:
        """Resume the work to its end and return the result."""

    @abstractmethod
    def on_cluster(self, out: Path, scheduler: str, told: Told) -> object:
        """Return the result as computed by the workers of a scheduler."""

    @abstractmethod
    def compare(self, found: object, whole: object) -> None:
        """Raise AssertionError if any bit differs."""

    def few(self) -> Subject:
        """Return a subject with fewer files, for the trial that damages each of them."""
        return self


_RUN_STUDY = (
    "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path;"
    "from crash_subjects import Studies; Studies(int(sys.argv[3])).finish(Path(sys.argv[2]))"
)


class Studies(Subject):
    """A Monte Carlo study in blocks of eight runs."""

    def __init__(self, runs: int = 400) -> None:
        self.name, self.runs, self.steps = "study", runs, runs // 8
        self.study = small_study(runs=runs, block_runs=8)

    def process(self, out: Path) -> subprocess.Popen[bytes]:
        """Start or resume the study."""
        return start("-c", _RUN_STUDY, str(Path(__file__).parent), str(out), str(self.runs))

    def finish(self, out: Path) -> object:
        """Return the study."""
        return mc.run(self.study, out=out, resume=(out / "study.zarr").exists())

    def on_cluster(self, out: Path, scheduler: str, told: Told) -> object:
        """Return the study."""
        return mc.run(
            self.study,
            out=out,
            backend="dask",
            scheduler=scheduler,
            progress=lambda state: told(state.done),
        )

    def compare(self, found: object, whole: object) -> None:
        """Compare every variable."""
        same_bits(found, whole)

    def few(self) -> Subject:
        """Return a study of three blocks."""
        return Studies(24)


class Fleets(Subject):
    """Cases of small axes; the benchmark of withheld effects runs the same code."""

    name = "fleet"

    def __init__(self, folder: Path, cases: int = 4) -> None:
        self.folder, self.steps = folder, cases
        for day in range(cases):
            friction = {"coulomb_nm": 0.2 + 0.1 * day, "smoothing_rad_s": 0.05}
            effects = [Effect("coulomb_friction", 1, friction)] if day else []
            write_case(folder / "welder" / f"day_{day}", effects, day)

    def process(self, out: Path) -> subprocess.Popen[bytes]:
        """Start or resume the fleet by its command."""
        call = "import sys; from axisight.cli import main; sys.argv[0] = 'axisight'; main()"
        where = ["--fleet", str(self.folder), "--out", str(out), "--workers", "2", "-q"]
        return start("-c", call, "diagnose", *where, stderr=subprocess.DEVNULL)

    def finish(self, out: Path) -> object:
        """Return the verdicts."""
        return diagnose_fleet(self.folder, out, Settings(), workers=2)

    def on_cluster(self, out: Path, scheduler: str, told: Told) -> object:
        """Return the verdicts."""
        return diagnose_fleet(
            self.folder,
            out,
            Settings(),
            scheduler=scheduler,
            progress=lambda _label, done, _total: told(done),
        )

    def compare(self, found: object, whole: object) -> None:
        """Compare every verdict."""
        assert found == whole


def subjects(folder: Path) -> list[Subject]:
    """Return all subjects; ``folder`` holds the files that they need."""
    if sys.platform == "win32":
        raise SystemExit("the crash trial kills as POSIX does")
    return [Studies(), Fleets(folder / "fleet")]

"""Reading of files in child processes, which shows crashes, hangs and memory growth."""

import json
import os
import subprocess
import sys
from pathlib import Path

# Reads every path on its standard input. Each gives one line: the exception, and the peak memory so far (MB).
_CHILD = """
import json, resource, signal, sys, warnings
from pathlib import Path
warnings.simplefilter("ignore")
from axisight.errors import AxisightError
from axisight.logs import parse_column_map, read_log
import h5py, pandas, pyarrow.parquet

limit, seconds = int(sys.argv[1]), int(sys.argv[2])
read_path = None
if len(sys.argv) > 3:
    sys.path.insert(0, sys.argv[3])
    from every_reader import READERS
    read_path = READERS[sys.argv[4]]
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
signal.signal(signal.SIGALRM, signal.SIG_DFL)
for line in sys.stdin:
    path, columns = json.loads(line)
    signal.alarm(seconds)
    try:
        if read_path is not None:
            read_path(Path(path))
        else:
            read_log(path, None if columns is None else parse_column_map(columns))
        said = "read"
    except AxisightError as error:
        said = f"refused: {error}"
    except BaseException as error:
        said = f"{type(error).__name__}: {str(error)[:300]}"
    signal.alarm(0)
    # Not `ru_maxrss`, which begins at the size of the process that this one was forked from.
    with open("/proc/self/status") as status:
        used = next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1000
    print(json.dumps([said, used]), flush=True)
"""


def read_in_child(
    paths: list[Path],
    columns: str | None = None,
    *,
    reader: str | None = None,
    limit: int = 4 * 10**9,
    seconds: int = 20,
) -> list[tuple[str, float]]:
    """Return the outcome of each file, and the child's peak memory until then (MB).

    Files are read as logs, or by a ``reader`` of `every_reader`. Outcomes: "read", "refused: ..." for an
    error of the package, the name of another exception, or "killed: ..." with the signal: 11 for a memory
    violation, 14 after `seconds`.
    """
    found: list[tuple[str, float]] = []
    while len(found) < len(paths):
        lines = "".join(f"{json.dumps([str(p), columns])}\n" for p in paths[len(found) :])
        chosen = [] if reader is None else [str(Path(__file__).parent), reader]
        child = subprocess.run(
            [sys.executable, "-c", _CHILD, str(limit), str(seconds), *chosen],
            check=False,
            input=lines,
            capture_output=True,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            timeout=600,
        )
        found += [tuple(json.loads(line)) for line in child.stdout.splitlines()]
        if len(found) < len(paths):
            assert child.returncode, child.stderr
            found.append((f"killed: {child.returncode} {child.stderr[-300:]}", 0.0))
    return found


def wrong(outcomes: list[tuple[str, float]]) -> list[str]:
    """Return the outcomes that are neither a log nor an error of the package."""
    return [said for said, _ in outcomes if said != "read" and not said.startswith("refused: ")]

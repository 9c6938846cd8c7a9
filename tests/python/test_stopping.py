"""Ctrl-C and SIGTERM: no traceback at whatever moment, the exit status of shells, no process left."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from axisight.cli.demo import write_demo_case

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")

# A shell that started the tests in the background ignores interrupts, and so would the command.
LISTEN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
RUN = LISTEN + "from axisight.cli import main; print('begun', flush=True); main()"
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("made") / "case")


def started(*arguments: str | Path) -> subprocess.Popen[str]:
    """Return a command of which the entry point is imported, in a session of its own."""
    done = subprocess.Popen(
        [sys.executable, "-c", RUN, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert done.stdout is not None
    assert done.stdout.readline() == "begun\n"
    return done


def ended(command: subprocess.Popen[str]) -> str:
    """Return what a command says until it ends; it is not waited for without end."""
    try:
        out, error = command.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        os.killpg(command.pid, signal.SIGKILL)
        raise
    return out + error


def running(group: int) -> list[int]:
    """Return the processes of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(text[3]) == group and text[0] != "Z":
            found.append(int(stat.parent.name))
    return found


@pytest.mark.parametrize("delay_s", [0.05, 0.2, 0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_command_stops_without_a_traceback_at_any_time(case, delay_s, number, status):
    command = started("diagnose", case)
    time.sleep(delay_s)
    command.send_signal(number)
    said = ended(command)
    assert "Traceback" not in said
    assert command.returncode == status, said


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)]
)
@pytest.mark.parametrize("delay_s", [2.0, 12.0])
def test_the_workers_of_a_fleet_end_with_it(case, tmp_path, number, status, delay_s):
    for name in ("a", "b", "c"):
        shutil.copytree(case, tmp_path / "fleet" / name)
    command = started("blind", "run", tmp_path / "fleet", "--out", tmp_path / "v", "--workers", "2")
    time.sleep(delay_s)
    if number == signal.SIGINT:
        # As a terminal does it: to all of them.
        os.killpg(command.pid, number)
    else:
        command.send_signal(number)
    begin = time.monotonic()
    said = ended(command)
    assert "Traceback" not in said
    assert command.returncode == status, said
    while running(command.pid) and time.monotonic() < begin + PATIENCE_S:
        time.sleep(0.1)
    assert running(command.pid) == []


def test_the_entry_point_is_there_before_any_library():
    code = "import sys, axisight.cli; print({'typer', 'rich', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"

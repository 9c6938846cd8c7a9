"""Write the entries of a method for the public test of diagnosis (docs/public_test.md).

Run: python benches/diagnosis_entries.py METHOD CASES OUT [--limit N]

OUT is a folder for one JSON file per case, or a file of lines: NAME.jsonl. METHOD is `axisight`, `aic` (the single best
effect by AIC) or `sysid` (everything at once by mujoco.sysid). Reads only the folder of cases; cases that have an entry
are left out, so that a stopped run goes on. A case on which a method fails has no entry, and counts as wrong.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from axisight import Settings, diagnose
from axisight.blind.entries import ENTRY_SCHEMA, entries_in, entry_line
from axisight.blind.sealed import SEAL
from axisight.logs import Case, read_case
from axisight.storage import write_whole

MODULES = {"aic": "entries_by_aic", "sysid": "entries_by_sysid"}


def by_axisight(case: Case) -> dict[str, Any]:
    """Return the verdict of a diagnosis, which is an entry as it is."""
    return diagnose(case, settings=Settings(threads=1)).to_verdict()


def method(name: str) -> Callable[[Case], dict[str, Any]]:
    """Return the function of a method from a case to its entry; only its libraries are loaded."""
    if name == "axisight":
        return by_axisight
    return import_module(MODULES[name]).entry  # type: ignore[no-any-return]


def written(name: str, cases: Path, out: Path, limit: int | None) -> int:
    """Write the missing entries, at most ``limit``; return how many were written."""
    solve, count = method(name), 0
    done = entries_in(out) if out.is_file() or any(out.glob("*.json")) else {}
    for seal in sorted(cases.glob(f"*/{SEAL}")):
        case = seal.parent.name
        if case in done or count == limit:
            continue
        started = time.process_time()
        try:
            said = solve(read_case(seal.parent, untrusted=True))
        except Exception as error:  # a method may fail in any way, and the other cases go on
            print(f"{case}: failed: {type(error).__name__}: {error}", flush=True)
            continue
        # Time of the processor: on a shared machine the wall clock says little.
        seconds = round(time.process_time() - started, 2)
        said.setdefault("schema", ENTRY_SCHEMA)
        said["seconds"] = seconds
        if "provenance" in said:
            said["provenance"]["seconds"] = seconds
        keep(case, said, out)
        count += 1
        causes = ", ".join(f"{c['effect']}@{c['axis']}" for c in said.get("causes", ())) or "-"
        print(f"{case}: {said['verdict']}: {causes} ({seconds:g} s)", flush=True)
    return count


def keep(case: str, said: dict[str, Any], out: Path) -> None:
    """Write an entry into its folder, or add its line to a file."""
    if out.suffix == ".jsonl":
        before = out.read_text(encoding="utf-8") if out.exists() else ""
        write_whole(out, before + entry_line(case, said))
    else:
        write_whole(out / f"{case}.json", json.dumps(said, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("method", choices=["axisight", *MODULES])
    parser.add_argument("cases", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--limit", type=int, help="Most entries to write in this run.")
    given = parser.parse_args()
    count = written(given.method, given.cases, given.out, given.limit)
    print(f"{count} entries written to {given.out}")


if __name__ == "__main__":
    main()

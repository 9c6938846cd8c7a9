"""Diagnoses of a fleet: on this machine or on a Dask cluster, resumable, with identical results."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from axisight.cluster import on_cluster
from axisight.cluster.workers import each_done
from axisight.documents import parse_json, read_text
from axisight.errors import AxisightError
from axisight.fleet.cases import FleetCase, fingerprint, fleet_cases
from axisight.gap import Settings, diagnose
from axisight.gap.facts.schema import VERDICT_SCHEMA
from axisight.storage import write_whole

Progress = Callable[[str, int, int], None]

_LABEL = "diagnosing cases"


def diagnose_fleet(
    folder: Path,
    verdicts: Path,
    settings: Settings,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    patience_s: float = 60.0,
    progress: Progress = lambda _label, _done, _total: None,
) -> dict[str, dict[str, Any]]:
    """Diagnose every case below ``folder``; return the verdicts by name, in the order of the cases.

    A verdict goes to ``verdicts`` / name + ``.json`` as soon as it is done. Later calls reuse it while the
    case, the settings and the version of this package are the same; they replace a damaged one. A case that
    fails has ``error``, the reason, in place of a verdict.

    ``workers``: processes on this machine. ``scheduler``: address of a Dask scheduler whose workers get the
    files and diagnose instead. Every diagnosis uses one thread, so the verdict does not depend on where it
    ran.

    Raises InputError for a folder without cases, and BackendError if a scheduler or all of its workers are
    gone for ``patience_s`` seconds. Finished verdicts stay.
    """
    one = replace(settings, threads=1)
    also = json.dumps([version("axisight"), asdict(one)], sort_keys=True, default=str)
    cases = fleet_cases(folder)
    found: dict[str, dict[str, Any]] = {}
    todo = []
    prints = {case.name: fingerprint(case.files(), also) for case in cases}
    for case in cases:
        known = _known(_path(verdicts, case), prints[case.name])
        if known is None:
            todo.append(case)
        else:
            found[case.name] = known
    progress(_LABEL, len(found), len(cases))
    if todo:
        made = (
            _here(todo, one, workers)
            if scheduler is None
            else on_cluster(
                todo, lambda c: (verdict_of, c.name, c.files(), one), scheduler, patience_s
            )
        )
        for case, text in made:
            found[case.name] = verdict = json.loads(text)
            verdict["fingerprint"] = prints[case.name]
            verdict["sha256"] = _checksum(verdict)
            write_whole(_path(verdicts, case), json.dumps(verdict, indent=2) + "\n")
            progress(_LABEL, len(found), len(cases))
    return {case.name: found[case.name] for case in cases}


def verdict_of(name: str, files: dict[str, bytes], settings: Settings) -> str:
    """Return the verdict (JSON) of a case from its files; its ``error`` says why a diagnosis failed."""
    with tempfile.TemporaryDirectory() as folder:
        for relative, data in files.items():
            path = Path(folder, relative)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        try:
            found = diagnose(Path(folder), settings=settings)
        except AxisightError as error:
            reason = str(error).replace(f"{folder}/", "")
            return json.dumps({"schema": VERDICT_SCHEMA, "name": name, "error": reason})
        out = found.to_verdict()
    # The run time is not part of the result.
    out["provenance"].pop("seconds", None)
    return json.dumps(out, allow_nan=False)


def _path(verdicts: Path, case: FleetCase) -> Path:
    return verdicts / f"{case.name}.json"


def _known(path: Path, wanted: str) -> dict[str, Any] | None:
    """Return the verdict in a file if it is undamaged and has the wanted fingerprint, else None."""
    try:
        found = parse_json(read_text(path))
    except (OSError, ValueError):
        return None
    same = (
        isinstance(found, dict)
        and found.get("fingerprint") == wanted
        and found.get("sha256") == _checksum(found)
    )
    return found if same else None


def _checksum(verdict: dict[str, Any]) -> str:
    """Return the SHA-256 of a verdict without its checksum field."""
    said = {name: value for name, value in verdict.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _here(
    cases: Sequence[FleetCase], settings: Settings, workers: int
) -> Iterator[tuple[FleetCase, str]]:
    """Yield every case with its verdict as it finishes, from processes of this machine."""
    work = partial(_of_path, settings=settings)
    for place, verdict in each_done(work, cases, workers):
        yield cases[place], verdict


def _of_path(case: FleetCase, settings: Settings) -> str:
    return verdict_of(case.name, case.files(), settings)

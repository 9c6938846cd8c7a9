"""Diagnose a folder of cases from elsewhere and score the verdicts against their truths.

Run: python benches/outside.py CASES --truth labels.json --verdicts FOLDER [--json out.json]
         [--only NAME ...] [--again] [--score-only]

CASES holds case folders; labels.json says what each machine has that its simulator lacks:

    {"NAME": {"effects": "backlash", "severity": [[...]],
              "truth": [{"effect": "backlash", "axis": 1, "params": {"half_width_rad": 3e-4}}]}}

``effects`` is "none" where nothing is withheld and "outside the library" where no effect of Axisight's
library is right. ``severity`` (rms change of torque over noise: validation logs, axes) may stand
beside the effect, too. Parameters count where they have the names of `axisight effects`.

Every case is diagnosed by one process of the command `axisight diagnose`, without its truth. Verdicts
that are there already stay, so that a run may be broken off. `axisight blind score` counts by the rules
of docs/blind.md. benches/outside/ makes such cases with five engines.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from axisight import InputError, effect_info

AXISIGHT = (sys.executable, "-m", "axisight")
NOTHING, STRANGE = "none", "outside the library"


class TruthError(ValueError):
    """A truth is missing or does not say what it should."""


def diagnose(case: Path, verdict: Path, limit_s: float) -> None:
    """Diagnose a case and write its verdict; a case that is refused gets a file that says why."""
    part = verdict.with_suffix(".part")
    command = [*AXISIGHT, "diagnose", str(case), "--json", str(part), "--force", "--quiet"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=limit_s, check=False)
        error = None if run.returncode == 0 else run.stderr.strip()
    except subprocess.TimeoutExpired:
        error = f"not done after {limit_s:g} s"
    if error is not None:
        part.write_text(json.dumps({"name": case.name, "error": error}, indent=1))
    part.replace(verdict)


def diagnose_all(cases: list[Path], verdicts: Path, again: bool, limit_s: float) -> None:
    """Diagnose all cases that have no verdict yet; with ``again`` also those that failed."""
    verdicts.mkdir(parents=True, exist_ok=True)
    for number, case in enumerate(cases, 1):
        verdict = verdicts / f"{case.name}.json"
        if verdict.exists() and not (again and "error" in json.loads(verdict.read_text())):
            continue
        began = time.monotonic()
        diagnose(case, verdict, limit_s)
        seconds = time.monotonic() - began
        print(f"{number}/{len(cases)} {case.name}: {said(verdict)}, {seconds:.0f} s", flush=True)


def said(verdict: Path) -> str:
    """Return a verdict in a few words."""
    found = json.loads(verdict.read_text())
    if "error" in found:
        return f"failed: {found['error'].splitlines()[-1][:120]}"
    causes = (f"{label(c)} (p = {c['probability']:.2f})" for c in found["causes"])
    return ": ".join(filter(None, (found["verdict"], ", ".join(causes))))


def label(effect: dict) -> str:
    """Return effect@axis, or the effect alone if it is one of the whole arm."""
    return effect["effect"] if effect["axis"] is None else f"{effect['effect']}@{effect['axis']}"


def compared(effect: dict) -> dict[str, float]:
    """Return the parameters that the library knows by the same name, amplitudes first.

    The first one is the size that is held against detection limits. Where the file states none, the
    size counts as zero, so that no limit is said to be broken.
    """
    try:
        known = effect_info(effect["effect"]).parameters
    except InputError:  # not in the library
        known = []
    params = effect.get("params", {})
    ordered = sorted(known, key=lambda parameter: parameter.role != "amplitude")
    found = {p.name: params[p.name] for p in ordered if p.name in params}
    return found or {"not_compared": 0.0}


def truth_of(name: str, entry: dict) -> dict:
    """Return the truth of a case as `axisight blind score` reads it.

    Raises TruthError if an entry says neither effects nor that there are none.
    """
    if entry["effects"] == NOTHING:
        effects = []
    else:
        effects = entry.get("truth") or []
        if not effects and entry["effects"] == STRANGE:
            effects = [{"effect": "outside_the_library", "axis": None}]
        if not effects:
            raise TruthError(f"{name}: truth: expected a list of effects, got none")
    stated = [entry.get("severity"), *(effect.get("severity") for effect in effects)]
    severities = [logs for logs in stated if logs]
    # The largest of all logs and statements, by axis.
    rows = [row for logs in severities for row in logs]
    return {
        "schema": "axisight.truth/1",
        "engine": entry.get("engine", "elsewhere"),
        "arm": entry.get("arm", "elsewhere"),
        "motions": "elsewhere",
        "seed": 0,
        "number": 0,
        "effects": [
            {"effect": e["effect"], "axis": e["axis"], "parameters": compared(e)} for e in effects
        ],
        "severity": [max(column) for column in zip(*rows, strict=True)] if rows else [0.0],
    }


def score(truths: dict[str, dict], verdicts: Path) -> dict:
    """Print the figures of `axisight blind score` and return them."""
    with TemporaryDirectory() as folder:
        cases, sealed = Path(folder) / "cases", Path(folder) / "truths"
        sealed.mkdir(parents=True)
        for name, truth in truths.items():
            text = json.dumps(truth)
            (sealed / f"{name}.json").write_text(text)
            (cases / name).mkdir(parents=True)
            digest = hashlib.sha256(text.encode()).hexdigest()
            (cases / name / "truth.sha256").write_text(f"{digest}\n")
        out = Path(folder) / "score.json"
        command = [*AXISIGHT, "blind", "score", str(cases), "--truth", str(sealed)]
        subprocess.run([*command, "--verdicts", str(verdicts), "--json", str(out)], check=True)
        return json.loads(out.read_text())


def row(name: str, truth: dict, verdict: Path) -> dict:
    """Return a case with its truth, severity and verdict."""
    found = json.loads(verdict.read_text())
    return {
        "case": name,
        "engine": truth["engine"],
        "arm": truth["arm"],
        "withheld": [label(effect) for effect in truth["effects"]],
        "severity": max(truth["severity"]),
        "said": said(verdict),
        "verdict": found.get("verdict"),
        "named": [label(cause) for cause in found.get("causes", [])],
        "seconds": found.get("provenance", {}).get("seconds"),
    }


def table(rows: list[dict]) -> str:
    """Return all cases as a table in Markdown."""
    lines = ["| case | arm | withheld | severity | said |", "|---|---|---|---|---|"]
    for r in rows:
        withheld = ", ".join(r["withheld"]) or "nothing"
        lines.append(
            f"| {r['case']} | {r['arm']} | {withheld} | {r['severity']:.3g} | {r['said']} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Diagnose what is left to do and print the score."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", type=Path)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--verdicts", type=Path, required=True)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--only", nargs="+", help="names of the cases to take")
    parser.add_argument("--again", action="store_true", help="diagnose failed cases again")
    parser.add_argument("--score-only", action="store_true", help="score the verdicts that exist")
    parser.add_argument("--limit-s", type=float, default=1800.0, help="time of one diagnosis")
    given = parser.parse_args()
    cases = sorted(path.parent for path in given.cases.glob("*/case.toml"))
    cases = [case for case in cases if not given.only or case.name in given.only]
    labels = json.loads(given.truth.read_text())
    unknown = [case.name for case in cases if case.name not in labels]
    if unknown or not cases:
        raise TruthError(f"{given.truth}: expected the truth of every case, none of {unknown}")
    if not given.score_only:
        diagnose_all(cases, given.verdicts, given.again, given.limit_s)
    done = [case.name for case in cases if (given.verdicts / f"{case.name}.json").exists()]
    truths = {name: truth_of(name, labels[name]) for name in done}
    figures = score(truths, given.verdicts)
    rows = [row(name, truths[name], given.verdicts / f"{name}.json") for name in done]
    print(table(rows))
    silent = sum(1 for r in rows if r["withheld"] and r["severity"] == 0.0)
    if silent:
        print(f"{silent} cases state no severity: they count under any severity only.")
    if given.json:
        given.json.write_text(json.dumps({"score": figures, "cases": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()

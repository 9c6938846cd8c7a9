"""Twenty public robots: model and recording -> verdict -> patched model -> does the gap fall in MuJoCo?

    python benches/twenty_robots.py CHECKOUTS --work FOLDER [--only NAME ...] [--whole-tree] [--json OUT]

CHECKOUTS holds the repositories of benches/twenty_robots.toml as OWNER/NAME. For each robot the script drops the
shapes of the model, so that no mesh is needed, and runs the commands of a user: `axisight robot import`, then
`axisight diagnose ... --write-model`. Where there is a public recording it is the machine. Otherwise MuJoCo runs a
machine with one withheld effect (twenty_machines.py), drawn by the seed of the table among those that the format of
the model can hold, and drawn again while the effect changes the torque by less than a tenth. Both models then run in
MuJoCo along a motion that the diagnosis used for its figures only. `docs/make_twenty_robots.py` makes a page of the
result.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
import tomllib
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from twenty_machines import (
    PER_SAMPLE,
    RUNS,
    STEP_S,
    Arm,
    Machine,
    gap,
    noisy,
    run,
    sized,
    without_shapes,
)

from axisight import load_robot

sys.path.insert(0, str(Path(__file__).parent / "arms"))

TABLE = Path(__file__).with_suffix(".toml")
_SAMPLE_S = STEP_S * PER_SAMPLE
# Whether the two arms, legs and hands are diagnosed whole; --whole-tree turns it on.
WHOLE_TREES = False
# What each format has a place for (docs/write_back.md); the draw takes nothing else.
_URDF = (
    "coulomb_friction",
    "viscous_friction",
    "link_mass",
    "link_com",
    "payload",
    "joint_zero_offset",
)
_MJCF = (
    "rotor_inertia",
    "cable_stiffness",
    "torque_constant",
    "torque_offset",
    "torque_ripple",
    "stribeck_friction",
)
HELD = {"urdf": _URDF, "xml": _URDF + _MJCF}
# Smallest gap of a machine that is worth a diagnosis, and how often an effect is drawn.
_VISIBLE, _DRAWS, _BAND_HZ = 0.1, 30, 20.0


@dataclass(frozen=True)
class Entry:
    """A row of the table.

    ``path`` starts from the checkout; ``recording`` and ``script`` name a real machine. ``mended``: a text of the
    file that no reader takes, and what it should be.
    """

    name: str
    kind: str
    repository: str
    licence: str
    path: str
    base: str = ""
    tip: str = ""
    recording: str = ""
    script: str = ""
    refused: bool = False
    mended: tuple[str, str] = ("", "")

    @property
    def format(self) -> str:
        """urdf or xml."""
        return Path(self.path).suffix[1:]

    def ends(self, *, whole_tree: bool = False) -> list[str]:
        """Return the options that choose the chain."""
        words = ["--base", self.base] if self.base else []
        if whole_tree:
            return [*words, "--whole-tree"]
        return [*words, "--tip", self.tip] if self.tip else words


def entries(path: Path = TABLE) -> tuple[int, list[Entry]]:
    """Return the seed and the rows of a table."""
    table = tomllib.loads(path.read_text())
    return int(table["seed"]), [Entry(**row) for row in table["robot"]]


def command(words: list[object], folder: Path) -> tuple[int, str, str]:
    """Run a command of the program in a folder; return its status, what it printed, and the command."""
    line = [str(w) for w in words]
    done = subprocess.run(
        [sys.executable, "-m", "axisight", *line],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
    )
    said = (done.stdout + done.stderr).strip()
    return done.returncode, said, "axisight " + " ".join(line)


def drawn(entry: Entry, seed: list[int], nominal: Arm) -> tuple[Machine, list[Any]]:
    """Return the machine of an entry and its runs: the first draw whose effect is visible."""
    random = np.random.default_rng(seed)
    path_and_joints = (nominal.path, nominal.joints)
    known = run(nominal, nominal, RUNS - 1)
    for _ in range(_DRAWS):
        effect = HELD[entry.format][random.integers(len(HELD[entry.format]))]
        machine = sized(effect, int(random.integers(len(nominal.joints))), nominal, known)
        arm = Arm(*path_and_joints)
        machine.change(arm)
        held_out = run(arm, nominal, RUNS - 1, machine)
        if gap(known[1], held_out[1], _SAMPLE_S, _BAND_HZ) > _VISIBLE:
            return machine, [*(run(arm, nominal, r, machine) for r in range(RUNS - 1)), held_out]
    raise ValueError(f"{entry.name}: expected a visible effect within {_DRAWS} draws, got none")


def write_log(path: Path, position: Any, torque: Any) -> None:
    """Write a log with native columns."""
    n = position.shape[1]
    names = [
        "time_s",
        *(f"position_{k + 1}" for k in range(n)),
        *(f"torque_cmd_{k + 1}" for k in range(n)),
    ]
    time_s = _SAMPLE_S * np.arange(len(position))[:, None]
    table = np.hstack([time_s, position, torque])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.9g")


def right(machine: Machine, named: list[str], joints: int) -> bool:
    """Return whether the withheld effect is the first cause; a load is a heavier last link."""
    accepted = {machine.label}
    if machine.effect == "payload" or machine.label == f"link_mass@{joints}":
        accepted |= {"payload", f"link_mass@{joints}"}
    return bool(named) and named[0] in accepted


def _verdict(found: dict[str, Any]) -> dict[str, Any]:
    causes = found["causes"]
    named = [c["effect"] if c["axis"] is None else f"{c['effect']}@{c['axis']}" for c in causes]
    return {
        "verdict": found["verdict"],
        "named": named,
        "probability": [round(c["probability"], 3) for c in causes],
        "headline": found.get("headline", ""),
        "seconds": found["provenance"].get("seconds"),
    }


def simulated(entry: Entry, number: int, seed: int, folder: Path, row: dict[str, Any]) -> list[str]:
    """Write the logs of a machine of MuJoCo; return their names."""
    robot = load_robot(folder / "robot.toml")
    nominal = Arm(folder / row["model"], robot.joint_names)
    machine, runs = drawn(entry, [seed, number], nominal)
    logs = []
    for r, (position, torque) in enumerate(runs):
        logs.append(f"run{r + 1}.csv")
        write_log(folder / logs[-1], *noisy(position, torque, [seed, number, r]))
    np.savez(folder / "held_out.npz", torque=runs[-1][1])
    row |= {"withheld": machine.label, "size": machine.size, "joints": robot.joint_names}
    row["machine"] = {"effect": machine.effect, "axis": machine.axis}
    return logs


def replayed(folder: Path, row: dict[str, Any]) -> list[float]:
    """Return the gap of the model and of the patched one, run along the held-out references [1]."""
    nominal = Arm(folder / row["model"], row["joints"])
    measured = np.load(folder / "held_out.npz")["torque"]
    gaps = []
    for name in (row["model"], row["patched"]):
        torque = run(Arm(folder / name, row["joints"]), nominal, RUNS - 1)[1]
        gaps.append(gap(torque, measured, _SAMPLE_S, row["cutoff_hz"]))
    return gaps


def recorded(entry: Entry, checkouts: Path, folder: Path, row: dict[str, Any]) -> list[str]:
    """Write the public recording of an entry by its script of benches/arms; return the names of the logs."""
    module = __import__(Path(entry.script).stem)
    roots = [checkouts / entry.recording]
    if entry.recording != entry.repository:
        roots.append(checkouts / entry.repository)
    arm = module.read(*roots)
    public = __import__("public_arm")
    row["rate_hz"], row["joints"] = arm.rate_hz, load_robot(folder / "robot.toml").joint_names
    return [path.name for path in public.write(arm, folder)]


def by_inverse_dynamics(folder: Path, log: str, row: dict[str, Any]) -> list[float]:
    """Return the gap of both models on a recorded log by `mj_inverse` [1], below the cutoff of the verdict."""
    from axisight.logs import lowpass, read_log  # noqa: PLC0415 - only for recordings

    robot = load_robot(folder / "robot.toml")
    read = read_log(folder / log, columns=folder / "columns.toml", robot=robot)
    dt, cutoff_hz = read.sample_time_s, row["cutoff_hz"]
    q = lowpass(read.position_rad, dt, cutoff_hz)
    v = np.gradient(q, dt, axis=0)
    a = np.gradient(v, dt, axis=0)
    gaps = []
    for name in (row["model"], row["patched"]):
        arm = Arm(folder / name, row["joints"])
        model = copy(arm.model)
        data, asked = mujoco.MjData(model), np.empty_like(q)
        for k in range(len(q)):
            data.qpos[arm.order], data.qvel[arm.order], data.qacc[arm.order] = q[k], v[k], a[k]
            beside = arm.rub(model, data.qvel)
            mujoco.mj_inverse(model, data)
            asked[k] = (data.qfrc_inverse - beside)[arm.order]
        gaps.append(gap(asked, read.torque_nm, dt, cutoff_hz))
    return gaps


def outcome(
    entry: Entry, number: int, seed: int, checkouts: Path, work: Path, whole: bool
) -> dict[str, Any]:
    """Return what became of an entry: its commands, verdict, and gaps; ``error`` where a step failed."""
    folder = work / entry.name.replace(" ", "_").replace(",", "")
    folder.mkdir(parents=True, exist_ok=True)
    model = f"model.{entry.format}"
    row: dict[str, Any] = {"name": entry.name, "kind": entry.kind, "model": model, "commands": []}
    without_shapes(checkouts / entry.repository / entry.path, folder / model)
    (folder / f"patched.{entry.format}").unlink(missing_ok=True)
    text = (folder / model).read_text()
    (folder / model).write_text(text.replace(*entry.mended) if entry.mended[0] else text)
    ends = entry.ends(whole_tree=whole)
    status, said, line = command(
        ["robot", "import", model, *ends, "-o", "robot.toml", "--force"], folder
    )
    row["commands"].append(line)
    if status or entry.refused:
        return row | ({"refusal": said} if status else {"error": "was not refused"})
    real = bool(entry.script)
    logs = (
        recorded(entry, checkouts, folder, row)
        if real
        else simulated(entry, number, seed, folder, row)
    )
    row["patched"] = f"patched.{entry.format}"
    options = ["--columns", "columns.toml"] if real else []
    words = [model, *logs[:-1], "--validation", logs[-1], *ends, *options]
    written = ["--json", "verdict.json", "--write-model", row["patched"], "--force"]
    status, said, line = command(["diagnose", *words, *written], folder)
    row["commands"].append(line)
    if status:
        return row | {"error": said}
    found = json.loads((folder / "verdict.json").read_text())
    row |= _verdict(found)
    row["cutoff_hz"] = float(found["provenance"]["cutoff_hz"])
    row["gap"] = {k: found["gap"][k] for k in ("before", "after", "floor")}
    if not real:
        row["right"] = right(
            Machine(**row["machine"], size=row["size"]), row["named"], len(row["joints"])
        )
    row["unwritten"] = [s for s in said.splitlines() if s.startswith("not in")]
    if (folder / row["patched"]).exists():
        row["mujoco"] = (
            by_inverse_dynamics(folder, logs[-1], row) if real else replayed(folder, row)
        )
    return row


def main() -> None:
    """Run the table and print a line for every robot."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("checkouts", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", nargs="+")
    parser.add_argument("--json", type=Path, help="rows of other robots that it has stay")
    parser.add_argument("--whole-tree", action="store_true", default=WHOLE_TREES)
    given = parser.parse_args()
    seed, table = entries()
    kept = json.loads(given.json.read_text()) if given.json and given.json.exists() else []
    rows = {row["name"]: row for row in kept}
    for number, entry in enumerate(table):
        if given.only and entry.name not in given.only:
            continue
        began = time.monotonic()
        try:
            whole = given.whole_tree and bool(entry.tip)
            row = outcome(entry, number, seed, given.checkouts.resolve(), given.work, whole)
        except Exception as error:
            row = {
                "name": entry.name,
                "kind": entry.kind,
                "error": f"{type(error).__name__}: {error}",
            }
        rows[entry.name] = row
        print(f"{entry.name}: {time.monotonic() - began:.0f} s, {summary(row)}", flush=True)
        if given.json:
            ordered = [rows[e.name] for e in table if e.name in rows]
            given.json.write_text(json.dumps(ordered, indent=1) + "\n")


def summary(row: dict[str, Any]) -> str:
    """Return what became of an entry in a line."""
    if "error" in row:
        return "error: " + " ".join(row["error"].split())[-300:]
    if "refusal" in row:
        return "refused: " + " ".join(row["refusal"].split())[:200]
    before, after = row.get("mujoco", (float("nan"),) * 2)
    verdict = f"{row['verdict']} {', '.join(row['named'])}"
    return f"{row.get('withheld', 'real')} -> {verdict}; MuJoCo {before:.1%} -> {after:.1%}"


if __name__ == "__main__":
    main()

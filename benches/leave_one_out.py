"""One effect at a time withheld from the complete simulator of a real machine: is it named?

Run: python benches/leave_one_out.py DATA [--machine emps kr300 tx40] [--json out.json]
         [--score FOLDER] [--public FOLDER LOG LOG ...]

DATA holds emps/, kuka_kr300/ and staubli_tx40/ (see real_arms.py). Each machine is identified from
its estimation logs; then it is diagnosed without friction, complete, and without one effect of
one axis, each in turn. Prints a table in Markdown. With --score, truths and verdicts go to a folder
as those of the benchmark do, and `axisight blind score FOLDER/cases --truth FOLDER/truths --verdicts
FOLDER/verdicts` counts them by its rules. --public takes a public arm instead: the folder that a script of benches/arms
wrote, and the names of its logs, of which the last is held out.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from real_arms import MACHINES, Machine, public

from axisight import Diagnosis, Robot, Settings, diagnose
from axisight.blind.sealed import SEAL, TRUTH_SCHEMA, seal_of
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.signals.motion import motion
from axisight.gap.simulator.rigid_torque import predicted_torque

# Below this share of the torque's standard deviation on its axis an effect is not worth finding.
SMALLEST_SHARE = 0.05
PAYLOAD_SHARE = 0.8
# Standard deviations of a 95 % interval.
NORMAL = 1.96


@dataclass(frozen=True)
class Case:
    """A simulator that lacks one thing: its label, parameter and true value."""

    label: str
    robot: Robot
    parameter: str
    value: float
    share: float


@dataclass(frozen=True)
class Row:
    """What came out of one diagnosis. ``first``: the withheld effect is the first cause named.

    ``value_holds``: its value is within 10 % of the identification's, or that in its interval;
    ``agrees``: that, or it is within what the identification itself leaves open (95 %).
    """

    machine: str
    withheld: str
    share: float
    verdict: str
    named: str
    first: bool
    value: str
    value_holds: bool | None
    agrees: bool | None
    before: float
    after: float
    floor: float
    seconds: float


def cases(machine: Machine) -> Iterator[Case]:
    """Yield the simulator without each of its effects, where the effect is worth finding."""
    full = machine.complete
    for effect in full.effects:
        rest = [e for e in full.effects if e.label != effect.label]
        name = {"coulomb_friction": "coulomb_nm", "torque_offset": "offset_nm"}[effect.name]
        value = (effect.parameters or {})[name]
        yield _case(machine, effect.label, full.with_effects(rest), name, value)
    for axis, joint in enumerate(full.axis_names, 1):
        key = f"{joint}.viscous_friction"
        bare = full.with_parameters({key: 0.0})
        value = full.parameters()[key]
        yield _case(machine, f"viscous_friction@{axis}", bare, "viscous_nm_s_rad", value)
    if full.n_axes > 1:
        key = f"{full.joint_names[-1]}.mass"
        mass = full.parameters()[key]
        # What the tool weighs beyond a fifth of the last link, at its centre of mass.
        light = full.with_parameters({key: (1 - PAYLOAD_SHARE) * mass})
        yield _case(machine, "payload", light, "mass_kg", PAYLOAD_SHARE * mass)


def _case(machine: Machine, label: str, robot: Robot, parameter: str, value: float) -> Case:
    axis = int(label.partition("@")[2] or 0) - 1
    missing, size = [], []
    for log in machine.estimation:
        at = motion(log, 20.0)
        with_it, without = (predicted_torque(r, AS_GIVEN, at) for r in (machine.complete, robot))
        missing.append(np.mean((with_it - without) ** 2, axis=0))
        size.append(np.var(log.torque_nm, axis=0))
    share = np.sqrt(np.mean(missing, axis=0) / np.mean(size, axis=0))
    return Case(label, robot, parameter, value, float(share[axis] if axis >= 0 else share.max()))


def row(machine: Machine, case: Case, found: Diagnosis, seconds: float) -> Row:
    """Return what the diagnosis of a case says."""
    labels = [c.effect if c.axis is None else f"{c.effect}@{c.axis}" for c in found.causes]
    mine = [c for c, label in zip(found.causes, labels, strict=True) if label == case.label]
    value, holds, agrees = "", None, None
    if mine:
        v = mine[0].parameters[case.parameter]
        error = machine.standard_errors.get(case.label)
        known = "" if error is None else f" ± {NORMAL * error:.2g}"
        value = f"{v.value:.4g} [{v.low:.3g}, {v.high:.3g}] for {case.value:.4g}{known}"
        off = abs(v.value - case.value)
        holds = off <= 0.1 * abs(case.value) or v.low <= case.value <= v.high
        agrees = holds or off <= NORMAL * (error or 0.0)
    return Row(
        machine.name,
        case.label,
        case.share,
        found.verdict,
        ", ".join(labels),
        bool(labels) and labels[0] == case.label,
        value,
        holds,
        agrees,
        found.gap.before,
        found.gap.after,
        found.gap.floor,
        seconds,
    )


def add_to_score(folder: Path, machine: Machine, case: Case, found: Diagnosis) -> None:
    """Write a sealed truth and its verdict as the benchmark has them.

    Severity: the torque that is withheld over what sensor noise leaves in the error, both relative
    to the torque.
    """
    effect, _, axis = case.label.partition("@")
    place = int(axis) if axis else None
    floor = float(found.gap.floor_per_axis[place - 1]) if place else found.gap.floor
    nothing = case.label == "nothing"
    truth = {
        "schema": TRUTH_SCHEMA,
        "engine": "measured",
        "arm": machine.name,
        "motions": "rigid",
        "seed": 0,
        "number": 0,
        "effects": []
        if nothing
        else [{"effect": effect, "axis": place, "parameters": {case.parameter: case.value}}],
        "severity": [0.0 if nothing else case.share / max(floor, 1e-300)],
    }
    name = f"{machine.name}_{case.label}".replace("@", "_").lower()
    text = json.dumps(truth, indent=1)
    files = {
        folder / "cases" / name / SEAL: seal_of(text) + "\n",
        folder / "truths" / f"{name}.json": text,
    }
    for path, content in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    verdicts = folder / "verdicts"
    verdicts.mkdir(exist_ok=True)
    found.save_verdict(verdicts / f"{name}.json")


def least_squares_gap(machine: Machine, robot: Robot, cutoff_hz: float) -> float:
    """Return the held-out gap of viscous and Coulomb friction and an offset fitted to the residual."""

    def parts(log):
        at = motion(log, cutoff_hz)
        return at, at[3] - predicted_torque(robot, AS_GIVEN, at)

    def columns(velocity):
        return np.stack([velocity, np.sign(velocity), np.ones(len(velocity))], axis=1)

    fitted = [parts(log) for log in machine.estimation]
    held = [parts(log) for log in machine.validation]
    squares = []
    for axis in range(robot.n_axes):
        x = np.concatenate([columns(at[1][:, axis]) for at, _ in fitted])
        y = np.concatenate([left[:, axis] for _, left in fitted])
        theta = np.linalg.lstsq(x, y, rcond=None)[0]
        for log, (at, left) in zip(machine.validation, held, strict=True):
            error = left[:, axis] - columns(at[1][:, axis]) @ theta
            squares.append(float(np.mean(error**2) / np.var(log.torque_nm[:, axis])))
    return float(np.sqrt(np.mean(squares)))


def diagnosed(machine: Machine, case: Case) -> tuple[Row, Diagnosis]:
    """Diagnose a case."""
    began = time.monotonic()
    settings = Settings(bootstrap=100)
    found = diagnose(
        robot=case.robot,
        estimation=machine.estimation,
        validation=machine.validation,
        settings=settings,
    )
    return row(machine, case, found, time.monotonic() - began), found


def report(rows: list[Row]) -> str:
    """Return the table."""
    lines = [
        "| machine | withheld | share of torque | verdict | first | named | value | gap | seconds |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        gap = f"{100 * r.before:.3g} to {100 * r.after:.3g} %"
        first = "yes" if r.first else "no"
        lines.append(
            f"| {r.machine} | {r.withheld} | {100 * r.share:.0f} % | {r.verdict} | {first} "
            f"| {r.named or '-'} | {r.value or '-'} | {gap} | {r.seconds:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run all cases and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--machine", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument("--only", nargs="+", help="labels of the cases to run")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--score", type=Path, help="folder for truths and verdicts")
    parser.add_argument("--public", nargs="+", metavar=("FOLDER", "LOG"))
    arguments = parser.parse_args()
    rows: list[Row] = []
    if arguments.public:
        folder, *logs = arguments.public
        machines = [public(Path(folder), logs)]
    else:
        machines = [MACHINES[name](arguments.data) for name in arguments.machine]
    for machine in machines:
        bare = machine.without_friction()
        todo = [
            Case("all friction", bare, "", 0.0, 1.0),
            Case("nothing", machine.complete, "", 0.0, 0),
        ]
        todo += list(cases(machine))
        for case in todo:
            if arguments.only and case.label not in arguments.only:
                continue
            if case.share < SMALLEST_SHARE and case.label != "nothing":
                print(
                    f"{machine.name}: {case.label} is {100 * case.share:.1f} % of the torque: left out"
                )
                continue
            result, found = diagnosed(machine, case)
            rows.append(result)
            if arguments.score and case.label != "all friction":
                add_to_score(arguments.score, machine, case, found)
            print(report([result]).splitlines()[-1], flush=True)
            if case.label == "all friction":
                reference = least_squares_gap(machine, bare, float(found.provenance["cutoff_hz"]))
                print(f"{machine.name}: least squares leaves {100 * reference:.3g} %")
    print(report(rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(r) for r in rows], indent=1))


if __name__ == "__main__":
    main()

"""The remainder of real machines, modelled: the gap on held-out logs, and whether the causes stay.

Run: python benches/remainder_real.py DATA [--machine emps kr300 tx40]

DATA: see real_arms.py. Each complete simulator is diagnosed with its remainder modelled. So is the simulator without
friction, whose causes are then compared with those of a second diagnosis, of the logs less the torque of the remainder.
Prints a table in Markdown. The last column but one is a bound: the gap with a remainder that was fitted to the held-out
log as well.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from real_arms import MACHINES, Machine

from axisight import Diagnosis, Log, Robot, Settings, diagnose
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.modelled.records import records_of
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.remainder import fit_remainder


def diagnosed(
    machine: Machine, robot: Robot, estimation: list[Log], *, remainder: bool
) -> Diagnosis:
    """Diagnose a simulator of a machine."""
    return diagnose(
        robot=robot,
        estimation=estimation,
        validation=machine.validation,
        settings=Settings(bootstrap=100),
        remainder=remainder,
    )


def less_remainder(machine: Machine, robot: Robot, found: Diagnosis) -> list[Log]:
    """Return the estimation logs without the torque of the remainder."""
    assert found.remainder is not None and found.remainder.modelled is not None
    view = InverseView(robot, machine.estimation, Settings(), machine.validation)
    causes = tuple(cause.as_effect() for cause in found.causes)
    records = records_of(view, machine.estimation, Variant({}, causes))
    model = found.remainder.modelled.model
    return [
        replace(log, torque_nm=log.torque_nm - model.torque(record.motion))
        for log, record in zip(machine.estimation, records, strict=True)
    ]


def kept(before: Diagnosis, after: Diagnosis) -> tuple[int, int]:
    """Return how many values of causes stay within their intervals, and how many there are."""
    values = {cause.label: cause.parameters for cause in after.causes}
    inside = [
        cause.label in values and p.low <= values[cause.label][name].value <= p.high
        for cause in before.causes
        for name, p in cause.parameters.items()
    ]
    return sum(inside), len(inside)


def bound(machine: Machine, robot: Robot) -> float:
    """Return the gap on the held-out log with a remainder that has read this log, too [1]."""
    view = InverseView(robot, machine.estimation, Settings(), machine.validation)
    records = records_of(view, [*machine.estimation, *machine.validation], AS_GIVEN)
    model = fit_remainder(records)
    shares = []
    for log, record in zip(machine.validation, records[len(machine.estimation) :], strict=True):
        left = record.residual_nm - record.filtered(model.torque(record.motion))
        shares.append(np.mean(left**2, axis=0) / np.var(log.torque_nm, axis=0))
    return float(np.sqrt(np.mean(shares)))


def rows(machine: Machine) -> Iterator[str]:
    """Yield a row of the table for the complete simulator and for the one without friction."""
    for name, robot in (
        ("complete", machine.complete),
        ("without friction", machine.without_friction()),
    ):
        found = diagnosed(machine, robot, machine.estimation, remainder=True)
        assert found.remainder is not None and found.remainder.modelled is not None
        m = found.remainder.modelled
        stays = "no causes"
        if found.causes:
            off = less_remainder(machine, robot, found)
            stays = "{} of {}".format(*kept(found, diagnosed(machine, robot, off, remainder=False)))
        gaps = (m.gap_before, m.gap_after, m.moving_before, m.moving_after)
        shown = " | ".join(f"{100 * gap:.3g} %" for gap in gaps)
        # With causes the re-fitted simulator would count as well.
        least = "-" if found.causes else f"{100 * bound(machine, robot):.3g} %"
        terms = "; ".join(f"{t.axis}: {t.acts}, {t.variable} {t.of_axis}" for t in m.model.terms)
        yield f"| {machine.name} | {name} | {shown} | {least} | {stays} | {terms or '-'} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--machine", nargs="+", choices=MACHINES, default=list(MACHINES))
    given = parser.parse_args()
    print(
        "| machine | simulator | gap | with remainder | in motion | with remainder | bound | values kept | terms |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for name in given.machine:
        for row in rows(MACHINES[name](given.data)):
            print(row, flush=True)


if __name__ == "__main__":
    main()

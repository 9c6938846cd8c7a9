"""Compare runs of one motion over days: one call."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.arguments import between
from axisight.errors import InputError
from axisight.logs import Log
from axisight.repeats.alignment import align
from axisight.repeats.columns import columns_of, unexplained
from axisight.repeats.family import judged
from axisight.repeats.findings import findings_of
from axisight.repeats.motions import run_motions
from axisight.repeats.parameter_changes import parameter_table, with_power
from axisight.repeats.result import DayComparison
from axisight.repeats.run_parameters import run_parameters
from axisight.repeats.torque_scatter import place_table, torque_table
from axisight.robot import Robot
from axisight.statistics.one_way import OneWay

# Largest torque that a model may leave, as a share of the torque, for its values to be believed. Without a robot
# the values of an arm never are, because other axes and gravity act on the torque too.
_EXPLAINED = 0.2


def compare_days(
    logs: Sequence[Log],
    days: Sequence[str],
    *,
    robot: Robot | None = None,
    reference: str | None = None,
    cutoff_hz: float = 10.0,
    reversal_s: float | None = None,
    torque_held: bool = True,
    level: float = 0.05,
) -> DayComparison:
    """Return what differs between days of runs of one motion by more than runs of one day differ.

    Parameters
    ----------
    logs : runs of one motion, in their order in time. A run is a log; give a day two runs or more.
    days : the day of each run, by any name.
    robot : its mechanics give a common level to all runs, and tell a load from friction. Without it every
        axis has an offset, friction, an inertia and a slope over its position.
    reference : the day that changes refer to; default that of the first run.
    cutoff_hz, reversal_s, torque_held : as of :func:`axisight.rigid_body.identify_logs`.
    level : probability of any false finding among all tests (Holm 1979).

    Returns
    -------
    :class:`DayComparison`. The tests are F tests with the scatter of runs of one day as the error, so they
    allow for everything that varies from run to run. Runs of a single day give the floor, and no test.
    Raises InputError for several days of one run each, for different motions, and as :func:`align`.

    """
    level = between("level", level, 0.0, 0.5)
    names, day = _numbered(logs, days)
    at = names.index(reference) if reference in names else 0
    if reference is not None and reference not in names:
        raise InputError(f"reference: expected one of {', '.join(names)}, got {reference!r}")
    aligned = align(logs, cutoff_hz=cutoff_hz)
    motions = run_motions(
        aligned.logs, cutoff_hz=cutoff_hz, reversal_s=reversal_s, torque_held=torque_held
    )
    columns = columns_of(motions, robot, aligned.logs[0].axis_kinds)
    found = run_parameters(columns, motions.weight)
    runs = OneWay(found.values, day)
    torque = torque_table(aligned, motions, day, level)
    table = parameter_table(
        found, runs, names, at, level, motions.weight, torque["torque_nm"].values
    )
    left = unexplained(columns, motions.weight, torque["torque_nm"].values)
    alone = robot is None and len(motions.moving) > 1
    believed = (left[table["axis"].values - 1] <= _EXPLAINED) & (not alone)
    table = table.assign(believed=("parameter", believed))
    torque = torque.assign(unexplained=("axis", left))
    table, torque = judged(table, torque, level)
    tests = int(np.isfinite(table["p_value"]).sum() + np.isfinite(torque["p_value"]).sum())
    table = with_power(table, runs.counts, level / max(tests, 1))
    return DayComparison(
        runs=tuple(log.name for log in aligned.logs),
        days=tuple(names),
        day_of_run=day,
        reference=names[at],
        level=level,
        parameters=table.assign_coords(run=[log.name for log in aligned.logs]),
        torque=torque,
        places=place_table(aligned, motions, day),
        findings=findings_of(aligned, table, columns.dropped, names, day, level),
        aligned=aligned,
    )


def _numbered(logs: Sequence[Log], days: Sequence[str]) -> tuple[list[str], np.ndarray]:
    """Return the names of the days in their order, and the number of the day of each run, from 0."""
    if len(days) != len(logs):
        raise InputError(f"days: expected one for each of {len(logs)} logs, got {len(days)}")
    names = list(dict.fromkeys(str(one) for one in days))
    if 1 < len(names) == len(logs):
        raise InputError(
            "days: expected two runs or more of one day, got one of each: without repeats no difference "
            "between days can be told from chance. Record several runs a day"
        )
    return names, np.array([names.index(str(one)) for one in days], dtype=np.intp)

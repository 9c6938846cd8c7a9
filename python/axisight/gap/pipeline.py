"""The pipeline: a simulator and measured logs in, a diagnosis out."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from axisight.effects import Effect
from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.settings import Settings
from axisight.gap.fit.time_limit import TimeLimit
from axisight.gap.intake.given import Given, check_options, given_inputs
from axisight.gap.intake.prepared_logs import behind_gate
from axisight.gap.measure.by_axis import believed_by_axis
from axisight.gap.screening.search_round import Progress
from axisight.gap.search.balanced_values import with_balanced_values
from axisight.gap.search.reported_torque import with_constants_told
from axisight.gap.search.search import refitted, search
from axisight.gap.search.stated_effects import with_scatter_taken
from axisight.gap.separate.asked import asked_of
from axisight.gap.separate.limits import ExperimentLimits
from axisight.gap.simulator.tolerances import loaded
from axisight.gap.uncertainty.beside_verdict import Wanted
from axisight.gap.verdict.assembled import assembled
from axisight.gap.verdict.validated import validated
from axisight.logs import AnyMap, Case, Log
from axisight.robot import Robot

LogLike = Log | Path | str | Any
"""A log: its path, a `Log`, a pandas DataFrame, an xarray Dataset, or a mapping of names to arrays."""
LogsLike = LogLike | Iterable[LogLike]
"""One log or several."""


def _silent(_label: str, _done: int, _total: int) -> None:
    """Report nothing."""


def diagnose(
    case: Case | Robot | LogsLike | None = None,
    logs: LogsLike | None = None,
    *,
    robot: Robot | Path | str | None = None,
    estimation: LogsLike = (),
    validation: LogsLike = (),
    columns: AnyMap | Path | str | None = None,
    name: str | None = None,
    settings: Settings | None = None,
    progress: Progress = _silent,
    separate: bool = False,
    to_show: Effect | str | None = None,
    within: ExperimentLimits | None = None,
    signals: bool = False,
    posterior: bool = False,
    simulated: LogsLike = (),
    remainder: bool = False,
) -> Diagnosis:
    """Say where a simulator disagrees with measured logs, which effect causes it, and how far it shrinks.

    Call it as ``diagnose(case)``, or as ``diagnose(robot, logs, validation=...)``.

    Parameters
    ----------
    case : a case or the folder of one (``axisight.case/1``); or the robot of ``logs``: a `Robot`, a
        preset, or the path of a robot file, URDF or MJCF.
    logs : estimation logs, one or a list. Each is a path, a `Log`, a pandas DataFrame or an xarray
        Dataset; `axisight.logs.log_of_table` says how their columns are named. Without
        ``validation`` the last log is held out, and ``Diagnosis.checks`` says so.
    robot : the robot by name instead of first; beside a case, in place of the case's own.
    estimation : ``logs`` by another name; the roles are then explicit, and nothing is held out unasked.
    validation : logs that only the final figures see, given as ``logs`` are; beside a case they are
        added to the case's own.
    columns : column map of logs that are paths or tables, as in `axisight.read_log`.
    name : what to call the case.
    settings : tolerances of the simulator's parameters, thresholds, seed.
    progress : called with (what, done, total).
    separate : also design the next experiment, ``Diagnosis.experiment``: the motion that tells open causes
        apart, or a record of several motions if the verdict is unknown or explained in part.
    to_show : design the experiment that shows this effect, of this size, if the machine has it; or
        ``"limits"``, a record that lowers all detection limits.
    within : limits of speed, acceleration, travel, room and torque for an experiment; by default what the
        logs show.
    signals : keep measured and simulated torques of all logs, ``Diagnosis.signals``.
    posterior : also keep the joint distribution of all parameters, ``Diagnosis.posterior``, and simulate
        50 samples of it along the validation logs. The verdict stays as it is.
    simulated : logs of your own simulator under the same references, or along the same motion: one for
        each estimation log, then one for each validation log. ``Diagnosis.simulator`` says how far the
        model reproduces it. The gap is then that of your simulator, by inverse dynamics if motions
        are alike.
    remainder : also model what the causes leave, ``Diagnosis.remainder.modelled``. The verdict stays; the
        headline adds the gap with the modelled remainder.

    Returns
    -------
    The diagnosis. It compares in closed loop if the robot has a controller and every log its velocity
    references. It does so too if no log has references and the gears are elastic: the references are
    then those for which the controller commands the logged torque. Otherwise it compares by inverse
    dynamics. The same input, settings and version give the same result, unless the time limit ends the
    search: ``Diagnosis.trace.stopped`` says so.

    Raises
    ------
    CaseError, LogError, RobotError, InputError for bad input; RefusedInputError, which is the first two
    of them, with the name of every fault, where logs or robot cannot be what they claim.

    """
    check_options(settings)
    given = given_inputs(case, logs, robot, estimation, validation, simulated, columns)
    asked = Asking(separate, to_show, within)
    wanted = Wanted(signals, posterior, remainder)
    found = _diagnosed(given, name or given.name, settings or Settings(), progress, asked, wanted)
    return replace(found, checks=(*given.says, *found.checks))


@dataclass(frozen=True)
class Asking:
    """What is asked for beside the diagnosis; as in `diagnose`."""

    separate: bool
    to_show: Effect | str | None
    within: ExperimentLimits | None


def _diagnosed(
    given: Given,
    name: str,
    chosen: Settings,
    progress: Progress,
    asking: Asking,
    wanted: Wanted,
) -> Diagnosis:
    """Return the diagnosis of a simulator and logs with roles."""
    started, limit = time.monotonic(), TimeLimit(chosen.time_limit_s)
    fit_logs, held_logs = given.estimation, given.validation
    machine, chosen = loaded(given.source, chosen, fit_logs[0].sample_time_s)
    asked = asked_of(machine, asking.separate, asking.to_show, asking.within)
    progress("looking at the logs", 0, 1)
    inputs = behind_gate(machine, fit_logs, held_logs, chosen.despite, given.simulated)
    progress("looking at the logs", 1, 1)
    inputs, view = inputs.compared(chosen)
    if asked is not None:
        asked.check_limits(view)
    baseline = refitted(view.fitter, progress)
    later = inputs.compared_later(view, baseline, chosen)
    if later is not inputs:
        inputs, view = later, later.view(chosen)
        baseline = refitted(view.fitter, progress)
    found = search(
        view.fitter, view.candidates, view.floor.expected, chosen, progress, limit, baseline
    )
    taken, scatter = with_scatter_taken(inputs.robot, found, chosen)
    if scatter and found.stopped is None:
        restated = inputs.with_effects_of(taken, scatter)
        seen_by = restated.view(chosen)
        again = search(
            seen_by.fitter, seen_by.candidates, seen_by.floor.expected, chosen, progress, limit
        )
        if again.stopped is None:
            inputs, view, found = restated, seen_by, again
        else:
            # What the first search found stays; it is not told as complete.
            found.stopped = replace(
                again.stopped, causes=tuple(f.effect.label for f in found.model.free)
            )
    machine, held_logs, commanded = inputs.robot, inputs.validation, inputs.commanded
    found = with_constants_told(found, view.fitter, view.shown)
    found = with_balanced_values(believed_by_axis(found, view.fitter, chosen), view.fitter)
    progress("measuring the gap", 0, 1)
    unknown = [one.axis for one in inputs.nominal]
    seen = validated(view, held_logs, found, unknown, chosen)
    out = assembled(name, machine, view, held_logs, seen, chosen, inputs.noted)
    progress("measuring the gap", 1, 1)
    if asked is not None:
        progress("designing an experiment", 0, 1)
        # What constants leave open no experiment decides.
        keep = bool(unknown) and out.verdict == "undecidable"
        out = asked.added(out, view, seen.found, keep=keep)
        progress("designing an experiment", 1, 1)
    out = wanted.added(out, view, held_logs, seen, chosen, progress, logged=commanded is None)
    checks = (*out.checks, *inputs.says(view.mode, view.compared))
    found_faults = (*inputs.constants(out.refit), *out.findings)
    out = replace(out, simulator=inputs.simulator, checks=checks, findings=found_faults)
    logged = "recovered" if inputs.recovered else "logged"
    out.provenance["references"] = logged if view.mode == "closed_loop" else None
    out.provenance["seconds"] = round(time.monotonic() - started, 1)
    return out

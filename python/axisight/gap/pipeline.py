"""The pipeline: a simulator and measured logs in, a diagnosis out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from axisight.effects import Effect
from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.settings import Settings
from axisight.gap.intake.prepared_logs import behind_gate, named_inputs
from axisight.gap.measure.by_axis import believed_by_axis
from axisight.gap.measure.torque_traces import signals_of
from axisight.gap.screening.search_round import Progress
from axisight.gap.search.balanced_values import with_balanced_values
from axisight.gap.search.reported_torque import with_constants_told
from axisight.gap.search.search import search
from axisight.gap.search.stated_effects import with_scatter_taken
from axisight.gap.separate.asked import asked_of
from axisight.gap.separate.waves import ExperimentLimits
from axisight.gap.simulator.tolerances import loaded
from axisight.gap.verdict.assembled import assembled
from axisight.gap.verdict.validated import validated
from axisight.logs import Case, Log
from axisight.robot import Robot


def _silent(_label: str, _done: int, _total: int) -> None:
    """Report nothing."""


def diagnose(
    case: Case | Path | str | None = None,
    *,
    robot: Robot | Path | str | None = None,
    estimation: Sequence[Log] = (),
    validation: Sequence[Log] = (),
    name: str | None = None,
    settings: Settings | None = None,
    progress: Progress = _silent,
    separate: bool = False,
    to_show: Effect | None = None,
    within: ExperimentLimits | None = None,
    signals: bool = False,
    simulated: Sequence[Log] = (),
) -> Diagnosis:
    """Say where a simulator disagrees with measured logs, which effect causes it, and how far it shrinks.

    Parameters
    ----------
    case : a case, or the folder of one (``axisight.case/1``); or give
    robot, estimation, validation : the simulator (or its file or preset), logs to
        fit and choose on, and logs that only the final figures see.
    name : what to call the case.
    settings : tolerances of the simulator's parameters, thresholds, seed.
    progress : called with (what, done, total).
    separate : also design the experiment that tells the causes apart which stay open,
        ``Diagnosis.experiment`` (closed loop only).
    to_show : design the one that shows this effect instead, of this size, if the machine has it.
    within : limits of speed, travel and torque for either; by default what the logs show.
    signals : keep measured and simulated torques of all logs, ``Diagnosis.signals``.
    simulated : logs of one's own simulator under the same references, or along the same motion, one for
        each estimation log and then each validation log: how far the model reproduces it,
        ``Diagnosis.simulator``; the gap is then that of this simulator, by inverse dynamics if motions
        are alike.

    Returns
    -------
    The diagnosis. Closed loop when the robot has a controller and every log its
    velocity references, or none has and the gears are elastic (the references are then those for
    which the controller commands the logged torque); inverse dynamics otherwise. The same input, settings
    and version give the same result.

    Raises
    ------
    CaseError, LogError, RobotError, InputError for bad input; RefusedInputError, which is the first two
    of them, with the name of every fault, where logs or robot cannot be what they claim.

    """
    started = time.monotonic()
    chosen = settings or Settings()
    found_name, source, fit_logs, held_logs = named_inputs(case, robot, estimation, validation)
    machine, chosen = loaded(source, chosen, fit_logs[0].sample_time_s)
    asked = asked_of(machine, separate, to_show, within)
    progress("looking at the logs", 0, 1)
    inputs = behind_gate(machine, fit_logs, held_logs, chosen.despite, simulated)
    progress("looking at the logs", 1, 1)
    inputs, view = inputs.compared(chosen)
    if asked is not None:
        asked.check_limits(view)
    found = search(view.fitter, view.candidates, view.floor.expected, chosen, progress)
    taken, scatter = with_scatter_taken(inputs.robot, found, chosen)
    if scatter:
        inputs = inputs.with_effects_of(taken, scatter)
        view = inputs.view(chosen)
        found = search(view.fitter, view.candidates, view.floor.expected, chosen, progress)
    machine, held_logs, commanded = inputs.robot, inputs.validation, inputs.commanded
    found = with_constants_told(found, view.fitter, view.shown)
    found = with_balanced_values(believed_by_axis(found, view.fitter, chosen), view.fitter)
    progress("measuring the gap", 0, 1)
    unknown = [one.axis for one in inputs.nominal]
    seen = validated(view, held_logs, found, unknown, chosen)
    out = assembled(name or found_name, machine, view, held_logs, seen, chosen, inputs.noted)
    progress("measuring the gap", 1, 1)
    if asked is not None:
        progress("designing an experiment", 0, 1)
        # What constants leave open no experiment decides.
        keep = bool(unknown) and out.verdict == "undecidable"
        out = asked.added(out, view, seen.found, keep=keep)
        progress("designing an experiment", 1, 1)
    if signals:
        after = seen.reach.simulator
        out = replace(out, signals=signals_of(view, held_logs, after, logged=commanded is None))
    checks = (*out.checks, *inputs.says(view.mode, view.compared))
    found_faults = (*inputs.constants(out.refit), *out.findings)
    out = replace(out, simulator=inputs.simulator, checks=checks, findings=found_faults)
    logged = "recovered" if inputs.recovered else "logged"
    out.provenance["references"] = logged if view.mode == "closed_loop" else None
    out.provenance["seconds"] = round(time.monotonic() - started, 1)
    return out

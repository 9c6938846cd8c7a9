"""The pipeline: a simulator and measured logs in, a diagnosis out."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.errors import CaseError, InputError
from axisight.gap import own_simulator
from axisight.gap.begun import from_rest
from axisight.gap.beyond import beyond_torque
from axisight.gap.by_axis import OwnAxes, believed_by_axis, without_axis
from axisight.gap.carried import carried_over, open_check
from axisight.gap.chatter import chance_check, with_chance
from axisight.gap.coarse import with_coarse_encoders
from axisight.gap.compared import Compared
from axisight.gap.currents import Nominal, in_torques
from axisight.gap.detection import detection_limits
from axisight.gap.edge import parameters_at_edge
from axisight.gap.encoder_steps import encoder_steps
from axisight.gap.evidence import Evidence
from axisight.gap.faults import Finding
from axisight.gap.gate import pass_gate, pass_gate_by_targets
from axisight.gap.headline import headline
from axisight.gap.howfar import Stage, Stages, gap_figures, gap_reduction, overlays, stage
from axisight.gap.intervals import with_own_scatter
from axisight.gap.misfit import with_balanced_values
from axisight.gap.modes import view_of
from axisight.gap.motion_errors import motion_errors, velocity_from
from axisight.gap.open_constants import open_with_constants
from axisight.gap.own_effects import constant_name, nominal_and_size, nominal_values
from axisight.gap.poses import SAYS as FROM_OWN_POSES
from axisight.gap.poses import at_their_poses
from axisight.gap.recovered import SAYS, with_references
from axisight.gap.remainder import refit_worse, remainder_of, reversals_smeared
from axisight.gap.result import (
    Cause,
    Diagnosis,
    Interval,
    MotionErrors,
    Overlay,
    Reproduction,
)
from axisight.gap.search import search
from axisight.gap.separate.asked import asked_of
from axisight.gap.separate.waves import ExperimentLimits
from axisight.gap.settings import Settings
from axisight.gap.signals import signals_of
from axisight.gap.slipping import with_bristles_followed
from axisight.gap.speed_loop import as_speed_loop
from axisight.gap.state import Search
from axisight.gap.stated_scatter import with_scatter_taken
from axisight.gap.straight import bent_for
from axisight.gap.targets import Commanded, with_commands
from axisight.gap.told import with_constants_told
from axisight.gap.tolerances import loaded
from axisight.gap.torques import AS_GIVEN, Variant
from axisight.gap.trials import Progress
from axisight.gap.unfelt import with_controllers_shown
from axisight.gap.verdict import Conclusion, conclude
from axisight.gap.view import View
from axisight.gap.where import (
    ErrorLog,
    band_map,
    findings,
    led_by_weight,
    regime_maps,
    stands_out,
)
from axisight.logs import Case, Log, read_case
from axisight.robot import Robot

Array = NDArray[np.float64]


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
    found_name, source, fit_logs, held_logs = _inputs(case, robot, estimation, validation)
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
    error_logs = _error_logs(view, found)
    told = partial(conclude, settings=chosen, stands_out=stands_out(error_logs), shown=view.shown)
    unknown = [one.axis for one in inputs.nominal]

    def said(one: Search) -> Conclusion:
        return open_with_constants(told(one), unknown)

    seen = _seen(view, held_logs, found, said, chosen)
    out = _assemble(
        name or found_name, machine, view, held_logs, seen, error_logs, chosen, inputs.noted
    )
    out = replace(out, gap=replace(out.gap, motion=_motion(view, held_logs, seen, inputs.noted)))
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
    constants = [n.finding(out.refit[constant_name(machine, n.axis)]) for n in inputs.nominal]
    found_faults = (*constants, *out.findings)
    out = replace(out, simulator=inputs.simulator, checks=checks, findings=found_faults)
    logged = "recovered" if inputs.recovered else "logged"
    out.provenance["references"] = logged if view.mode == "closed_loop" else None
    out.provenance["seconds"] = round(time.monotonic() - started, 1)
    return out


def _motion(
    view: View, logs: Sequence[Log], seen: _Seen, noted: Sequence[Finding]
) -> MotionErrors | None:
    """Return the errors of position and velocity on the validation logs, where positions are compared."""
    refitted, after = Variant(seen.found.baseline.robot_values), seen.reach.simulator
    return motion_errors(view, logs, refitted, after, velocity_from(logs, noted))


@dataclass(frozen=True)
class _Inputs:
    """A simulator and logs that passed the gate, as they are compared.

    ``commanded``: logs without torque with what the controller commands along them, where they have none;
    ``nominal``: the torque constants by which currents were read whose constant nobody knows;
    ``recovered``: whether the references are those that the controller must have had; ``simulator``: how
    far the robot reproduces the user's own simulator, where its logs were given; ``beside``: these logs, from
    where the others are taken.
    """

    robot: Robot
    estimation: list[Log]
    validation: list[Log]
    noted: tuple[Finding, ...]
    commanded: Commanded | None
    recovered: bool
    nominal: tuple[Nominal, ...] = ()
    simulator: Reproduction | None = None
    beside: tuple[Log, ...] = ()

    def view(self, settings: Settings) -> View:
        """Return how simulator and logs are compared."""
        return view_of(self.robot, self.estimation, self.validation, settings, self.commanded)

    def compared(self, settings: Settings) -> tuple[_Inputs, View]:
        """Return how simulator and logs are compared: against the user's own simulator, where it has logs."""
        view = self.view(settings)
        if not self.beside:
            return self, view
        inputs = self.against(view, self.beside, settings)
        return inputs, inputs.view(settings)

    def against(self, view: View, simulated: Sequence[Log], settings: Settings) -> _Inputs:
        """Return the same against the user's own simulator, by its logs."""
        logs, n = [*self.estimation, *self.validation], len(self.estimation)
        commanded = self.commanded
        if commanded is None:
            beside = own_simulator.paired(logs, simulated)
        else:
            as_logged = own_simulator.paired(commanded.as_logged(), simulated)
            beside = commanded.of(as_logged)
        off = own_simulator.difference(view, beside, settings)
        found = own_simulator.reproduction(view, logs, beside, off, settings)
        if found.taken_off:
            logs = off.taken_from(logs)
        if commanded is not None:
            # What the controller commands follows from the positions that are left.
            commanded = commanded.along(logs)
            logs = list(commanded.logs)
        return replace(
            self,
            estimation=logs[:n],
            validation=logs[n:],
            noted=(*self.noted, *own_simulator.noted(found)),
            commanded=commanded,
            simulator=found,
        )

    def with_effects_of(self, robot: Robot, why: Sequence[Finding]) -> _Inputs:
        """Return the same with a simulator that states its effects otherwise."""
        commanded = None if self.commanded is None else replace(self.commanded, robot=robot)
        return replace(self, robot=robot, commanded=commanded, noted=(*self.noted, *why))

    def says(self, mode: str, compared: Compared) -> tuple[str, ...]:
        """Return what is to be known of the logs."""
        own_poses = any(log.start_rad is not None and log.run_up is None for log in self.estimation)
        said = [
            "" if self.simulator is None else own_simulator.said(self.simulator, compared),
            FROM_OWN_POSES if own_poses and mode == "closed_loop" else "",
            SAYS if self.recovered else "",
        ]
        return tuple(filter(None, said))


def behind_gate(
    robot: Robot,
    estimation: Sequence[Log],
    validation: Sequence[Log],
    despite: Collection[str],
    simulated: Sequence[Log] = (),
) -> _Inputs:
    """Return simulator and logs behind the gate, with commands and references where none were logged.

    ``despite`` as in `Settings`, ``simulated`` and what is raised as in `diagnose`.
    """
    robot, slowed = with_bristles_followed(robot)
    read = in_torques(robot, estimation, validation)
    if read.nominal and simulated:
        raise InputError(
            'simulated: expected logs of torques beside logs of a simulator, got currents of scale = "unknown"'
        )
    begun = from_rest(robot, read.estimation, read.validation, simulated, despite)
    logs, n = [*begun.estimation, *begun.validation], len(estimation)
    robot = as_speed_loop(robot, logs)
    found, beside = (*slowed, *begun.findings), begun.simulated
    commanded = with_commands(robot, logs)
    if commanded is not None:
        logged = commanded.as_logged()
        noted = pass_gate_by_targets(commanded.robot, logged[:n], logged[n:], despite)
        robot, logs = commanded.robot, list(commanded.logs)
        found, beside = (*found, *commanded.findings()), commanded.taken(beside)
    else:
        logs = at_their_poses(robot, logs)
        noted = pass_gate(robot, logs[:n], logs[n:], despite)
    recovered = with_references(robot, logs)
    logs = logs if recovered is None else recovered
    noted = (*found, *noted)
    return _Inputs(
        robot,
        logs[:n],
        logs[n:],
        noted,
        commanded,
        recovered is not None,
        read.nominal,
        beside=tuple(beside),
    )


def _inputs(
    case: Case | Path | str | None,
    robot: Robot | Path | str | None,
    estimation: Sequence[Log],
    validation: Sequence[Log],
) -> tuple[str, Robot | Path | str, list[Log], list[Log]]:
    source: Robot | Path | str | None
    if case is not None:
        read = case if isinstance(case, Case) else read_case(Path(case), currents=True)
        name, source = read.name, robot if robot is not None else read.robot_path
        fit_logs, held_logs = list(read.estimation), list(read.validation)
    elif robot is not None:
        name, source = "logs", robot
        fit_logs, held_logs = list(estimation), list(validation)
    else:
        raise InputError(
            "diagnose: expected a case, or a robot with estimation and validation logs"
        )
    if not fit_logs or not held_logs:
        raise CaseError(
            f"{name}: expected at least one estimation and one validation log, "
            f"got {len(fit_logs)} and {len(held_logs)}"
        )
    return name, source, fit_logs, held_logs


def _error_logs(view: View, found: Search) -> list[ErrorLog]:
    """Return the torque error of the re-fitted simulator on the estimation logs, and noise alone."""
    with ThreadPoolExecutor(view.settings.threads) as pool:
        noise = pool.submit(view.noises, view.logs, 0)
        refit = view.torques(Variant(found.baseline.robot_values), view.logs)
        noises = noise.result()
    errors = view.errors(refit, view.logs)
    return [ErrorLog(*each) for each in zip(view.logs, errors, noises, strict=True)]


@dataclass(frozen=True)
class Reach:
    """The gap on the validation logs before, re-fitted and with the causes one after another.

    ``judged``: the same with the floor of a machine that chatters; ``change``: what all of it changes
    of the simulator's torque there; ``simulator``: the one with all causes.
    """

    stages: Stages
    judged: Stages
    reductions: list[Interval]
    overlays: tuple[Overlay, ...]
    left: tuple[ErrorLog, ...]
    change: Stage
    simulator: Variant


def _reach(
    view: View,
    logs: Sequence[Log],
    found: Search,
    causes: Sequence[Effect],
    settings: Settings,
) -> Reach:
    """Measure the gap on validation logs; all ``causes`` are in ``after``."""
    values = found.model.robot_values
    variants = [Variant(values, tuple(causes[: i + 1])) for i in range(len(causes))]
    refit = Variant(found.baseline.robot_values)
    measured = [view.measured(log) for log in logs]
    # Few logs are one simulation in lock-step: the simulators run beside one another.
    simulators = (AS_GIVEN, refit, *variants)
    with ThreadPoolExecutor(settings.threads) as pool:
        noises = pool.submit(view.noises, logs, len(view.logs))
        left_open = view.left_open(logs)
        before, *steps = pool.map(lambda v: view.torques(v, logs), simulators)
        noise = noises.result()

    def measure(errors: Sequence[Array]) -> Stage:
        return stage(logs, errors, settings.block_s, measured)

    given = measure(view.errors(before, logs))
    refitted, *stages = [measure(view.errors(torques, logs)) for torques in steps]
    floor = measure(noise)
    after = stages[-1] if stages else refitted
    # The first cause is credited from the simulator as given: that is what the user had.
    earlier = [given, *stages]
    reductions = [
        gap_reduction(a, b, given, floor, draws=settings.bootstrap, seed=settings.seed)
        for a, b in zip(earlier, stages, strict=False)
    ]
    remaining = zip(logs, view.errors(steps[-1], logs), noise, strict=True)
    reached = Stages(
        given,
        refitted,
        after,
        floor,
        None if left_open is None else measure(left_open),
        view.compared,
    )
    return Reach(
        reached,
        with_chance(view, found, logs, reached, simulators[-1], measure),
        reductions,
        overlays(logs, before, steps[-1]),
        tuple(ErrorLog(*each) for each in remaining),
        measure([b - a for a, b in zip(before, steps[-1], strict=True)]),
        simulators[-1],
    )


@dataclass(frozen=True)
class _Seen:
    """What the estimation logs say, and what it does on the validation logs."""

    found: Search
    conclusion: Conclusion
    reach: Reach
    own: OwnAxes | None


def _seen(
    view: View,
    held_logs: Sequence[Log],
    found: Search,
    said: Callable[[Search], Conclusion],
    settings: Settings,
) -> _Seen:
    """Measure on the validation logs what the search found.

    Where axes are judged alone, one whose causes do not carry over takes nothing from the others:
    it loses its own.
    """
    lost: list[str] = []
    while True:
        conclusion = said(found)
        causes = with_own_scatter(conclusion.causes, view.fitter.tolerated)
        conclusion = replace(conclusion, causes=causes)
        reach = _reach(view, held_logs, found, conclusion.effects, settings)
        own = _axes_alone(view, conclusion, reach)
        axis = None if own is None else own.not_carried()
        if own is None or axis is None or len(own.axes) < 2:
            return _Seen(found, conclusion.with_checks(lost), reach, own)
        lost.append(
            f"What explains axis {axis + 1} on the estimation logs does not carry over to the validation "
            f"logs: it is not among the causes."
        )
        found = with_balanced_values(without_axis(found, view.fitter, axis), view.fitter)


def _assemble(
    name: str,
    robot: Robot,
    view: View,
    held_logs: Sequence[Log],
    seen: _Seen,
    error_logs: Sequence[ErrorLog],
    settings: Settings,
    noted: tuple[Finding, ...],
) -> Diagnosis:
    found, conclusion, reach, own = seen.found, seen.conclusion, seen.reach, seen.own
    bands = band_map(error_logs, settings.block_s)
    regimes = regime_maps(error_logs, settings.bandwidth_hz, settings.block_s)
    gap = gap_figures(reach.stages, one_unit=len(set(robot.axis_is_prismatic)) == 1)
    judged = gap_figures(reach.judged)
    names = [log.name for log in held_logs]
    nominal, tolerances = nominal_values(robot), view.fitter.tolerances
    share = bent_for(view.fitter, found)
    left = remainder_of(reach.judged, judged, reach.left, settings)
    removed = view.removed_there(found, held_logs) if conclusion.causes else None
    steps = encoder_steps(view.robot, view.logs)
    conclusion = carried_over(
        conclusion, reach.judged, judged, names, settings, own, share, removed, steps > 0
    )
    measured = [view.measured(log) for log in held_logs]
    conclusion, of_steps = with_coarse_encoders(
        conclusion,
        steps,
        view,
        held_logs,
        reach.judged,
        lambda errors: stage(held_logs, errors, settings.block_s, measured),
    )
    conclusion, unfelt = with_controllers_shown(conclusion, view)
    causes = _causes(conclusion, [*reach.reductions, *of_steps, *unfelt])
    maps = (bands, regimes, settings.significance)
    places = findings(*maps) if conclusion.verdict != "none" else ()
    excess = np.array([axis.excess for axis in conclusion.axes])
    if conclusion.verdict == "unknown" and excess.max() > settings.largest_scatter:
        places = led_by_weight(places, *maps, excess)
    # Where nothing was named, `after` is the simulator re-fitted alone.
    fitted = found.model if reach.reductions else found.baseline
    refit = {k: _relative(robot, fitted, k) for k in fitted.robot_values}
    return Diagnosis(
        name=name,
        mode=view.mode,
        verdict=conclusion.verdict,
        headline=headline(
            conclusion, gap, causes, places, robot.effects, refit=refit, joints=robot.axis_names
        ),
        gap=gap,
        where=places,
        causes=causes,
        alternatives=conclusion.alternatives,
        equivalent=conclusion.equivalent,
        next_experiment=conclusion.next_experiment,
        ranking=conclusion.ranking,
        band_map=bands,
        regime_maps=regimes,
        overlays=reach.overlays,
        refit=refit,
        checks=(
            *conclusion.checks,
            *chance_check(reach.stages, reach.judged),
            *open_check(reach.stages),
            *view.remarks(),
        ),
        axes=conclusion.axes,
        p_none=conclusion.p_none,
        p_unknown=conclusion.p_unknown,
        remainder=left,
        detection_limits=detection_limits(found, view),
        findings=(
            *noted,
            *refit_worse(reach.stages, names),
            *beyond_torque(gap, held_logs),
            *reversals_smeared(left, places, view.cutoff_hz),
            *parameters_at_edge(fitted, nominal, tolerances),
        ),
        settings=settings.as_dict(robot),
        provenance=_provenance(robot, view, names, settings),
    )


def _causes(conclusion: Conclusion, reductions: Sequence[Interval]) -> tuple[Cause, ...]:
    return tuple(
        Cause(
            c.effect,
            c.axis,
            c.probability,
            c.parameters,
            c.units,
            r,
            c.family,
            c.family_probability,
            c.axes,
            conclusion.rivals_of(c.label),
        )
        for c, r in zip(conclusion.causes, reductions, strict=False)
    )


def _provenance(
    robot: Robot, view: View, held: Sequence[str], settings: Settings
) -> dict[str, object]:
    return {
        "axisight_version": version("axisight"),
        "seed": settings.seed,
        "robot": robot.name,
        "robot_effects": [effect.label for effect in robot.effects if effect.acts],
        "axis_names": list(robot.axis_names),
        "axis_kinds": ["prismatic" if p else "revolute" for p in robot.axis_is_prismatic],
        "estimation_logs": [log.name for log in view.logs],
        "validation_logs": list(held),
        "position_noise_std_rad": view.floor.position_std_rad.tolist(),
        "cutoff_hz": view.cutoff_hz,
    }


def _axes_alone(view: View, conclusion: Conclusion, reach: Reach) -> OwnAxes | None:
    """Return how causes fare on their axes, where errors of axes add up."""
    arm = any(c.axis is None for c in conclusion.causes)
    if not view.fitter.adds_up or not conclusion.causes or arm:
        return None
    axes = sorted({c.axis - 1 for c in conclusion.causes if c.axis is not None})
    return OwnAxes(axes, reach.stages.given, reach.stages.after, reach.change)


def _relative(robot: Robot, model: Evidence, name: str) -> Interval:
    """Return the relative change of a re-fitted parameter with its 95 % interval."""
    nominal, size = nominal_and_size(robot, name)
    change = (model.robot_values[name] - nominal) / size
    spread = 1.96 * model.std.get((None, name), 0.0) / size
    return Interval(change, change - spread, change + spread)

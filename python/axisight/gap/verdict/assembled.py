"""Puts the diagnosis together from the search and the measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version

import numpy as np
import xarray as xr

from axisight.effects import Effect
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.result import (
    Cause,
    DetectionLimit,
    Diagnosis,
    Interval,
    MotionErrors,
    Where,
)
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.tolerance_edges import parameters_at_edge
from axisight.gap.measure.chatter import chance_check
from axisight.gap.measure.detection_limits import detection_limits
from axisight.gap.measure.gap_beyond_torque import beyond_torque
from axisight.gap.measure.gap_figures import gap_figures, stage
from axisight.gap.measure.gear_deflections import GearErrors, gear_check, gear_errors
from axisight.gap.measure.motion_errors import motion_errors, velocity_from
from axisight.gap.measure.reach import Reach
from axisight.gap.measure.where import (
    band_map,
    findings,
    led_by_weight,
    of_axes,
    regime_maps,
)
from axisight.gap.ranking.twins import open_twins
from axisight.gap.search.account import trace_of
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.simulator.brought_inertia import brought_inertias
from axisight.gap.simulator.own_parameters import nominal_and_size, nominal_values
from axisight.gap.verdict.agreed_probabilities import in_agreement
from axisight.gap.verdict.axis_verdicts import open_groups, verdict_told, with_axes_agreed
from axisight.gap.verdict.bent_simulator import bent_for
from axisight.gap.verdict.carry_over import carried_over, open_check
from axisight.gap.verdict.coarse_encoders import with_coarse_encoders
from axisight.gap.verdict.conclusion import Conclusion, advice_unknown
from axisight.gap.verdict.controller_causes import with_controllers_shown
from axisight.gap.verdict.headline import Facts, headline
from axisight.gap.verdict.remainder import refit_worse, remainder_of, reversals_smeared
from axisight.gap.verdict.validated import Validated
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.robot import Robot
from axisight.statistics.intervals import NORMAL_DEVIATIONS


def assembled(
    name: str,
    robot: Robot,
    view: View,
    held_logs: Sequence[Log],
    seen: Validated,
    settings: Settings,
    noted: tuple[Finding, ...],
) -> Diagnosis:
    """Return the diagnosis: the verdict as it holds on the validation logs, with all figures.

    ``noted``: findings of the logs before anything was fitted.
    """
    found, reach = seen.found, seen.reach
    bands = band_map(seen.errors, settings.block_s)
    regimes = regime_maps(seen.errors, settings.bandwidth_hz, settings.block_s)
    gap = gap_figures(reach.stages, one_unit=len(set(robot.axis_is_prismatic)) == 1)
    gap = replace(gap, motion=_motion(view, held_logs, seen, noted))
    names = [log.name for log in held_logs]
    nominal, tolerances = nominal_values(robot), view.fitter.tolerances
    gears = _gear_errors(view, held_logs, seen)
    conclusion, reductions = _concluded(view, held_logs, seen, settings, gears)
    conclusion = with_axes_agreed(
        conclusion, reach.judged, gap, settings, own_residual=found.adds_up
    )
    quiet = [a.axis for a in conclusion.axes if a.verdict in ("none", "not_judged")]
    # A re-fit without a cause may bend the simulator until the rest follows nothing.
    before = () if reach.reductions else reach.given
    left = remainder_of(
        reach.judged, gap_figures(reach.judged), reach.left, settings, quiet, before
    )
    places = _places(conclusion, (bands, regimes, settings.significance), settings)
    conclusion = in_agreement(conclusion.ranked_on(places[0].axis) if places else conclusion)
    causes = _causes(conclusion, reductions)
    # Without causes, `after` is the re-fitted simulator.
    fitted = found.model if reach.reductions else found.baseline
    refit = {k: _relative(robot, fitted, k) for k in fitted.robot_values}
    return Diagnosis(
        name=name,
        mode=view.mode,
        verdict=verdict_told(conclusion),
        headline=headline(
            Facts(
                verdict=conclusion.verdict,
                gap=gap,
                axes=conclusion.axes,
                causes=causes,
                open=open_groups(conclusion, robot.n_axes),
                twins=open_twins(conclusion.causes, robot.n_axes),
                withdrawn=conclusion.withdrawn,
                where=places,
                remainder=left,
                own=tuple(robot.effects),
                refit=refit,
                joints=robot.axis_names,
                mode=view.mode,
                apart=_apart(reach),
                stopped=found.stopped,
            )
        ),
        gap=gap,
        where=places,
        causes=causes,
        alternatives=conclusion.alternatives,
        equivalent=conclusion.equivalent,
        next_experiment=_next_experiment(conclusion),
        ranking=conclusion.ranking,
        band_map=bands,
        regime_maps=regimes,
        overlays=reach.overlays,
        refit=refit,
        checks=(
            *conclusion.checks,
            *chance_check(reach.stages, reach.judged),
            *open_check(reach.stages),
            *gear_check(gears, settings),
            *view.remarks(),
        ),
        axes=conclusion.axes,
        p_none=conclusion.p_none,
        p_unknown=conclusion.p_unknown,
        remainder=left,
        detection_limits=_limits(detection_limits(found, view), conclusion),
        findings=(
            *noted,
            *refit_worse(reach.stages, names),
            *beyond_torque(gap, held_logs, view.silent),
            *reversals_smeared(left, places, view.cutoff_hz),
            *parameters_at_edge(
                fitted, nominal, tolerances, brought_inertias(robot, _named(conclusion))
            ),
        ),
        settings=settings.as_dict(robot),
        trace=replace(
            trace_of(found),
            named=(*(x for c in conclusion.causes for x in c.ledger), *conclusion.ledger),
            work=view.fitter.work.done,
            work_by_stage=dict(view.fitter.work.by_stage),
        ),
        provenance=_provenance(robot, view, names, settings),
    )


def _named(conclusion: Conclusion) -> list[Effect]:
    """Return the causes that are named, with their values."""
    return [
        Effect(
            c.effect,
            None if c.axes else c.axis,
            {k: p.value for k, p in c.parameters.items()},
            c.axes,
        )
        for c in conclusion.causes
    ]


def _apart(reach: Reach) -> float | None:
    """Return the difference of two runs of a machine that chatters [1]; None of others."""
    return None if reach.judged is reach.stages else float(np.sqrt(reach.judged.floor.mean()))


def _next_experiment(conclusion: Conclusion) -> str | None:
    in_part = verdict_told(conclusion) == "explained_in_part"
    return conclusion.next_experiment or (advice_unknown() if in_part else None)


def _limits(limits: Sequence[DetectionLimit], conclusion: Conclusion) -> tuple[DetectionLimit, ...]:
    """Return the limits on judged axes without an unknown gap: what is unknown may hide any effect."""
    unknown = {a.axis for a in conclusion.axes if a.verdict == "unknown"}
    hidden = unknown | {a.axis for a in conclusion.axes if a.verdict == "not_judged"}
    return tuple(x for x in limits if not (unknown if x.axis is None else x.axis in hidden))


def _concluded(
    view: View,
    held_logs: Sequence[Log],
    seen: Validated,
    settings: Settings,
    gears: GearErrors | None,
) -> tuple[Conclusion, list[Interval]]:
    """Return the conclusion after validation, and by how much each cause reduces the gap there."""
    found, reach = seen.found, seen.reach
    names = [log.name for log in held_logs]
    share = bent_for(view.fitter, found)
    removed = view.removed_there(found, held_logs) if seen.conclusion.causes else None
    steps = encoder_steps(view.robot, view.logs)
    conclusion = carried_over(
        seen.conclusion,
        reach.judged,
        gap_figures(reach.judged),
        names,
        settings,
        seen.own,
        share,
        removed,
        steps > 0,
        differentiated=view.mode == "inverse_dynamics",
        refuted=found.noise,
        gears=gears,
    )
    measured = [view.measured(log) for log in held_logs]
    conclusion, of_steps = with_coarse_encoders(
        conclusion,
        steps,
        view,
        held_logs,
        reach.judged,
        lambda errors: stage(held_logs, errors, settings.block_s, measured, view.silent),
    )
    conclusion, unfelt = with_controllers_shown(conclusion, view)
    return conclusion, [*reach.reductions, *of_steps, *unfelt]


def _gear_errors(view: View, held_logs: Sequence[Log], seen: Validated) -> GearErrors | None:
    """Return the errors of gears on the validation logs, if gears take part in the comparison."""
    if view.fitter.gears is None:
        return None
    refitted = Variant(seen.found.baseline.robot_values)
    error = view.settings.model_error
    return gear_errors(view.robot, held_logs, error, refitted, seen.reach.simulator)


def _places(
    conclusion: Conclusion,
    maps: tuple[xr.Dataset, dict[str, xr.Dataset], float],
    settings: Settings,
) -> tuple[Where, ...]:
    """Return where the gap lies: before the causes, or of *unknown* the part that no effect explains.

    Only axes with such a gap are named, at least one; none for the verdict *none*.
    """
    if conclusion.verdict == "none":
        return ()
    bands, regimes, significance = maps
    unknown = conclusion.verdict == "unknown"
    told = [
        a
        for a in conclusion.axes
        if a.verdict == "unknown" or not (unknown or a.verdict in ("none", "not_judged"))
    ]
    axes = [a.axis for a in told]
    seen = of_axes(bands, axes)
    of = f"of the squared gap {'that no effect explains' if unknown else 'before the causes'}"
    places = findings(seen, regimes, significance, of)
    excess = np.array([a.excess if a.axis in axes else -np.inf for a in conclusion.axes])
    if unknown and (not places or excess.max() > settings.largest_scatter):
        places = led_by_weight(places, seen, regimes, significance, excess, of)
    return places


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


def _relative(robot: Robot, model: FittedModel, name: str) -> Interval:
    """Return the relative change of a re-fitted parameter with its 95 % interval."""
    nominal, size = nominal_and_size(robot, name)
    change = (model.robot_values[name] - nominal) / size
    spread = NORMAL_DEVIATIONS * model.std.get((None, name), 0.0) / size
    return Interval(change, change - spread, change + spread)


def _motion(
    view: View, logs: Sequence[Log], seen: Validated, noted: Sequence[Finding]
) -> MotionErrors | None:
    """Return the errors of position and velocity on the validation logs, where positions are compared."""
    refitted, after = Variant(seen.found.baseline.robot_values), seen.reach.simulator
    return motion_errors(view, logs, refitted, after, velocity_from(logs, noted))

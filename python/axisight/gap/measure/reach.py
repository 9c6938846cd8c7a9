"""Measures the gap on the validation logs as given, re-fitted, and with the causes added one after another."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.gap.facts.result import Interval, Overlay
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.measure.chatter import with_chance
from axisight.gap.measure.gap_figures import Stage, Stages, gap_reduction, overlays, stage
from axisight.gap.measure.where import ErrorLog
from axisight.gap.search.state import SearchState
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]


def refitted_errors(view: View, found: SearchState) -> list[ErrorLog]:
    """Return the torque error of the re-fitted simulator on the estimation logs, with noise alone."""
    with ThreadPoolExecutor(view.settings.threads) as pool:
        noise = pool.submit(view.noises, view.logs, 0)
        refit = view.torques(Variant(found.baseline.robot_values), view.logs)
        noises = noise.result()
    errors = view.errors(refit, view.logs)
    noises = [found.noise * each for each in noises]
    return [ErrorLog(*each) for each in zip(view.logs, errors, noises, strict=True)]


@dataclass(frozen=True)
class Reach:
    """The gap on the validation logs as given, re-fitted and with the causes added one after another.

    - ``judged``: the stages, with the floor of a chattering machine if it is one.
    - ``reductions``: share of the explainable gap that each cause removes.
    - ``left``: torque errors with all causes; ``given``: those as given.
    - ``change``: torque change from the simulator as given to all causes.
    - ``simulator``: the simulator with all causes.
    """

    stages: Stages
    judged: Stages
    reductions: list[Interval]
    overlays: tuple[Overlay, ...]
    left: tuple[ErrorLog, ...]
    given: tuple[ErrorLog, ...]
    change: Stage
    simulator: Variant


def reach_of(
    view: View,
    logs: Sequence[Log],
    found: SearchState,
    causes: Sequence[Effect],
    settings: Settings,
) -> Reach:
    """Return the gap on validation logs with the ``causes`` added in their order; ``after`` has all of them."""
    values = found.model.robot_values
    variants = [Variant(values, tuple(causes[: i + 1])) for i in range(len(causes))]
    refit = Variant(found.baseline.robot_values)
    measured = [view.measured(log) for log in logs]
    # Few logs make one lock-step simulation, so the simulators run in parallel.
    simulators = (AS_GIVEN, refit, *variants)
    with ThreadPoolExecutor(settings.threads) as pool:
        noises = pool.submit(view.noises, logs, len(view.logs))
        left_open = view.left_open(logs)
        before, *steps = pool.map(lambda v: view.torques(v, logs), simulators)
        noise = [found.noise * each for each in noises.result()]

    def measure(errors: Sequence[Array]) -> Stage:
        return stage(logs, errors, settings.block_s, measured, view.silent)

    as_given = view.errors(before, logs)
    given = measure(as_given)
    refitted, *stages = [measure(view.errors(torques, logs)) for torques in steps]
    floor = measure(noise)
    after = stages[-1] if stages else refitted
    # The first cause is credited from the simulator as given, which is what the user had.
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
        overlays(view, logs, (before, steps[-1]), (given, after)),
        tuple(ErrorLog(*each) for each in remaining),
        tuple(ErrorLog(*each) for each in zip(logs, as_given, noise, strict=True)),
        measure([b - a for a, b in zip(before, steps[-1], strict=True)]),
        simulators[-1],
    )

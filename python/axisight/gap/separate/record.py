"""A record for logs that no hypothesis explains, or that show too little: repeats, slow triangles, a known load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.fitting.divergence import must_hold
from axisight.fitting.loads import payload_of
from axisight.gap.facts.experiment import Plan, RecordExperiment
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.separate.design import planned
from axisight.gap.separate.route import Route, Runs
from axisight.gap.separate.waves import Motion
from axisight.logs import Load

Array = NDArray[np.float64]

# Runs of the rich motion: two are the least that differ, a third shows which one is the odd one out.
_RUNS = 3
# Sizes at which slow and loaded motions are tried, as shares of the designed ones.
_LEVELS = (1.0, 0.6, 0.3, 0.1)
# Torque that a load adds, as a share of the largest torque of the motion: far above the model error.
_SHOWS = 0.2
# Masses of a load, as shares of the mass of all links, the largest first.
_MASSES = (0.5, 0.2, 0.1, 0.05, 0.02)


def record(route: Route, model: FittedModel) -> RecordExperiment:
    """Return the record of a machine like ``model``.

    The rich motion is the one along which the simulator's own parameters are known best (largest determinant of their
    information matrix), of those within the limits.
    """
    rich = _richest(route, model)
    slow = _first_possible(route, model, _levels(route.slow_motion()))
    load, loaded = _with_load(route, model, rich)
    return RecordExperiment(
        _plan(route, rich, _RUNS), _plan(route, slow, 1), _plan(route, loaded, 1), load
    )


def _plan(route: Route, motion: Motion, repeats: int) -> Plan:
    return planned(route, motion, repeats)


def _richest(route: Route, model: FittedModel) -> Motion:
    tried = route.rich_motions()
    runs = route.runs(model, tried)
    possible = np.flatnonzero(runs.possible).tolist()
    if not possible:
        return _smallest(tried)
    worth = [_information(route, model, runs, k) for k in possible]
    return tried[possible[int(np.argmax(worth))]]


def _information(route: Route, model: FittedModel, runs: Runs, which: int) -> float:
    """Return the log-determinant of the information matrix of a run and of the tolerances."""
    start = replace(model, columns={})
    fitter = route.fitter(runs, [which], alone=True)
    found = must_hold(
        fitter.fit(model.free, start, robot_values=model.robot_values, max_iterations=0)
    )
    matrix = found.matrix.sum(axis=0) + found.prior_matrix
    # Relative to the tolerances, whatever the units.
    size = np.sqrt(np.maximum(np.diag(found.prior_matrix), 1e-12 * np.diag(matrix)))
    sign, worth = np.linalg.slogdet(matrix / np.outer(size, size))
    return float(worth) if sign > 0 else -np.inf


def _levels(motion: Motion) -> list[Motion]:
    return [replace(motion, reference=level * motion.reference) for level in _LEVELS]


def _first_possible(route: Route, model: FittedModel, tried: Sequence[Motion]) -> Motion:
    """Return the first motion within the limits, else the smallest."""
    possible = np.flatnonzero(route.runs(model, tried).possible)
    return tried[int(possible[0])] if len(possible) else _smallest(tried)


def _smallest(tried: Sequence[Motion]) -> Motion:
    return min(tried, key=lambda m: float(np.abs(m.reference).max()))


def _with_load(route: Route, model: FittedModel, rich: Motion) -> tuple[Load | None, Motion]:
    """Return a load that shows along the rich motion within the limits, and the motion to run with it.

    Its centre is that of the last link: a load on a joint's axis would not turn the joint.
    The largest of several masses that the motors can carry along the motion, or along a smaller one. A robot with
    branches has no one tip for a load.
    """
    robot = route.view.robot
    if not robot.is_chain:
        return None, rich
    links = [j.link for j in robot.joints if j.link is not None]
    whole = sum(link.mass_kg for link in links)
    x, y, z = (float(c) for c in links[-1].com_m)
    for motion in _levels(rich):
        bare = route.runs(model, [motion])
        size = np.abs(bare.torques[0]).max(axis=0)
        for share in _MASSES:
            load = Load(float(f"{share * whole:.1g}"), (x, y, z))
            effect = payload_of(load)
            others = [e for e in model.effects if e.label != effect.label]
            carrying = replace(model, effects=(*others, effect))
            runs = route.runs(carrying, [motion])
            if not runs.possible[0]:
                continue
            more = np.abs(runs.torques[0] - bare.torques[0]).max(axis=0)
            if np.any(more >= _SHOWS * size):
                return load, motion
    return None, rich

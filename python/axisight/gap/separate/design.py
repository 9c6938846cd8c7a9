"""Choose the motion on which two rivals differ most, whichever of them is true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.excitation import References
from axisight.gap.closed_loop import ClosedLoopView
from axisight.gap.model import Evidence
from axisight.gap.search import Search
from axisight.gap.separate.experiment import Experiment
from axisight.gap.separate.rivals import Rivals, rivals_of
from axisight.gap.separate.waves import Motion, motions, seen_range, standard
from axisight.gap.view import View
from axisight.simulation import simulate_batch

Array = NDArray[np.float64]

# Torque beyond what was seen by this share is too much.
_MARGIN = 1.05


@dataclass(frozen=True, eq=False)
class _Run:
    """A rival's machine on every motion: motor angles and torques, each (n, n_axes)."""

    records: list[tuple[Array, Array]]
    possible: NDArray[np.bool_]


def separating_experiment_of(view: View, found: Search) -> Experiment | None:
    """Return the experiment that separates the rivals of a search; None where nothing is open.

    By inverse dynamics there is no loop to simulate, and no experiment.
    """
    rivals = rivals_of(found)
    if rivals is None or not isinstance(view, ClosedLoopView):
        return None
    return separating(view, rivals)


def separating(view: ClosedLoopView, rivals: Rivals) -> Experiment | None:
    """Return the motion on which two rivals differ most; None where none can be run.

    Each rival in turn is the machine: its simulated run along a motion is fitted by the other, in one
    linear step, held by what the logs say of its parameters. What is left is what tells them apart
    (with weights of noise and model error, in units of which a log-likelihood ratio is half of it).
    The motion counts for the worse of the two.
    """
    seen = seen_range(view.logs)
    widest = 0.8 * min(view.settings.bandwidth_hz, 0.5 / view.robot.sample_time_s)
    time, seed = view.robot.sample_time_s, view.settings.seed
    axes = rivals.axes or tuple(view.robot.axis_numbers())
    tried = [standard(seen, time, seed), *motions(seen, axes, time, widest, seed)]
    left = np.full((2, len(tried)), np.inf)
    for k, (machine, other) in enumerate((rivals.models, rivals.models[::-1])):
        run = _runs(view, machine, tried, seen.torque)
        left[k, ~run.possible] = 0.0
        here = np.flatnonzero(run.possible)
        if len(here):
            left[k, here] = _left(view, other, [run.records[i] for i in here])
    worth = left.min(axis=0)
    best = int(np.argmax(worth[1:])) + 1
    if not worth[best] > 0:
        return None
    chosen = tried[best]
    design = {"motion": chosen.words, "rivals": list(rivals.labels), "seed": seed}
    return Experiment(
        rivals.labels,
        chosen.words,
        chosen.axes,
        References(time, chosen.reference[None], design=design),
        float(worth[best]),
        float(worth[0]),
    )


def _runs(view: ClosedLoopView, machine: Evidence, tried: Sequence[Motion], most: Array) -> _Run:
    robot = view.robot.with_parameters(machine.robot_values)
    out = simulate_batch(
        robot,
        np.stack([m.reference for m in tried]),
        effects=list(machine.effects),
        method="rk4",
        threads=view.settings.threads,
    )
    angle, torque = out["position_rad"].values, out["torque_cmd_nm"].values
    sound = np.isfinite(torque).all(axis=(1, 2)) & np.isfinite(angle).all(axis=(1, 2))
    gentle = (
        np.abs(np.where(np.isfinite(torque), torque, np.inf)).max(axis=1) <= _MARGIN * most
    ).all(axis=1)
    records = [
        (np.ascontiguousarray(q), np.ascontiguousarray(u))
        for q, u in zip(angle, torque, strict=True)
    ]
    return _Run(records, sound & gentle)


def _left(view: ClosedLoopView, model: Evidence, records: list[tuple[Array, Array]]) -> Array:
    """Return what a model leaves of each run (n_runs,), as a mean square on the axis where it is most."""
    fitter = view.fitter.along(records)
    # Sensitivities of other logs are of no use here.
    start = replace(model, columns={})
    found = fitter.fit(model.free, start, robot_values=model.robot_values, max_iterations=0)
    known = model.matrix.sum(axis=0) + model.prior_matrix
    order = [model.parameters.index(p) for p in found.parameters]
    known = known[np.ix_(order, order)] + 1e-12 * np.diag(np.diag(known)[order])
    n_axes = view.robot.n_axes
    out = np.zeros(len(records))
    for i in range(len(records)):
        here = found.log == i
        matrix, gradient = found.matrix[here], found.gradient[here]
        step = -np.linalg.lstsq(matrix.sum(axis=0) + known, gradient.sum(axis=0), rcond=1e-12)[0]
        loss = found.loss[here] + 2 * gradient @ step + np.einsum("bij,i,j->b", matrix, step, step)
        samples = np.bincount(found.axis[here], found.samples[here], n_axes)
        out[i] = float((np.bincount(found.axis[here], loss, n_axes) / samples).max())
    return np.maximum(out, 0.0)

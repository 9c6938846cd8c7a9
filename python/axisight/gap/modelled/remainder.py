"""Fits the remainder of a diagnosis on its estimation logs and judges it on its validation logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_figures import Stage, stage
from axisight.gap.modelled.nearest_law import with_nearest_laws
from axisight.gap.modelled.records import records_of
from axisight.gap.search.search import refitted
from axisight.gap.signals.standstill import standing
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.remainder import ModelledRemainder, Record, Remainder, fit_remainder

Array = NDArray[np.float64]

_NO_TORQUE = "The remainder is not modelled: no torque was logged."
_BY_INVERSE = (
    "The remainder is modelled by inverse dynamics: in closed loop the controller turns a missing torque into "
    "another error."
)


def _quiet(_label: str, _done: int, _total: int) -> None:
    """Report nothing."""


def with_modelled_remainder(
    out: Diagnosis, view: View, held: Sequence[Log], after: Variant, settings: Settings
) -> Diagnosis:
    """Return the diagnosis with its remainder modelled; the verdict stays.

    ``held``: the validation logs; ``after``: the simulator with the causes.
    """
    if out.remainder is None or view.by_targets:
        return replace(out, checks=(*out.checks, _NO_TORQUE))
    seen = view
    checks = out.checks
    if not isinstance(seen, InverseView):
        seen = InverseView(view.robot, view.logs, settings, held, view.silent)
        checks = (*checks, _BY_INVERSE)
    fitted, base = _best_of(seen, after, tuple(cause.as_effect() for cause in out.causes))
    if fitted.terms:
        fitted = with_nearest_laws(fitted, seen, refitted(seen.fitter, _quiet))
    # By another comparison than that of the verdict, the figure before is that of the causes that were named:
    # effects that did not carry over in closed loop may say anything by inverse dynamics.
    modelled = judged(fitted, seen, held, after if seen is view else base, base)
    return replace(
        out,
        headline=f"{out.headline} {_told(modelled, by_inverse=seen is not view)}",
        remainder=replace(out.remainder, modelled=modelled),
        checks=checks,
    )


def _best_of(
    view: InverseView, after: Variant, named: tuple[Effect, ...]
) -> tuple[Remainder, Variant]:
    """Return the remainder of the simulator with re-fitted or with stated own parameters, and that simulator.

    A re-fit may bend own parameters until the rest follows no variable. The simulator counts that leaves less on
    held-out data. ``named``: the causes of the verdict; ``after`` may have further effects, which did not carry over.
    """
    bases = [Variant({}, named)]
    if after.robot_values:
        bases.append(Variant(after.robot_values, named))
    std = np.sqrt(np.mean([np.var(log.torque_nm, axis=0) for log in view.logs], axis=0))
    fits = [
        (fit_remainder(records_of(view, view.logs, base, view.certainty)), base) for base in bases
    ]
    judged = [i for i in range(len(std)) if i not in view.silent]
    return min(fits, key=lambda fit: float(np.sum((fit[0].held_out_nm / std)[judged] ** 2)))


def judged(
    fitted: Remainder,
    view: InverseView,
    held: Sequence[Log],
    after: Variant,
    base: Variant | None = None,
) -> ModelledRemainder:
    """Return a remainder with the gap on validation logs without and with it, as `Gap` has it.

    ``after``: the simulator with the causes; ``base``: that to which the remainder belongs, by default the same.
    """
    own = after if base is None else base
    plain = records_of(view, held, after)
    records = plain if own is after else records_of(view, held, own)
    measured = [view.measured(log) for log in held]
    moves = [still < 0.5 for still in standing([view.filtering(log) for log in held])]

    def gaps(of: Sequence[Record], torques: Sequence[Array]) -> tuple[Stage, Stage]:
        left = [_error(r, t) for r, t in zip(of, torques, strict=True)]
        moving = [
            e * m / np.sqrt(np.maximum(m.mean(axis=0), 1e-9))
            for e, m in zip(left, moves, strict=True)
        ]
        whole, part = (
            stage(held, errors, view.settings.block_s, measured, view.silent)
            for errors in (left, moving)
        )
        return whole, part

    none = [np.zeros_like(r.residual_nm) for r in plain]
    before = gaps(plain, none)
    with_it = gaps(records, [r.filtered(fitted.torque(r.motion)) for r in records])
    (whole, moving), (whole_after, moving_after) = before, with_it
    return ModelledRemainder(
        model=fitted,
        gap_before=_root(whole.mean()),
        gap_after=_root(whole_after.mean()),
        before_per_axis=_per_axis(whole),
        after_per_axis=_per_axis(whole_after),
        moving_before=_root(moving.mean()),
        moving_after=_root(moving_after.mean()),
        own_parameters="re-fitted" if own.robot_values else "stated",
    )


def _error(record: Record, torque_nm: Array) -> Array:
    weight = np.ones(1) if record.weight is None else record.weight
    return np.asarray(weight * (record.residual_nm - torque_nm))


def _root(square: float) -> float:
    return float(np.sqrt(square))


def _per_axis(of: Stage) -> Array:
    return np.asarray(np.sqrt(np.mean(of.per_log(), axis=0)))


def _told(modelled: ModelledRemainder, *, by_inverse: bool) -> str:
    if not modelled.model.terms:
        return "The remainder follows no variable that a model could carry to other motions."
    how = ", by inverse dynamics" if by_inverse else ""
    return (
        f"Remainder modelled: from {percent(modelled.gap_before)} to {percent(modelled.gap_after)} on the "
        f"validation logs{how}."
    )

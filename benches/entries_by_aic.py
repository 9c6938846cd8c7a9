"""The single best effect by AIC: the first baseline of the public test of diagnosis.

Every effect of the library is fitted alone, on every axis where it can act, together with the simulator's own
parameters. The entry names the effect of least AIC = n ln(loss / n) + 2 k (Akaike 1974), or none if no effect has a
smaller AIC than the re-fitted simulator. ``n`` is the number of samples, ``k`` the number of parameters of the effect.
The fits are those of the diagnosis; its decisions are not used.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from axisight.fitting.divergence import Diverged
from axisight.gap import Settings
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.intake.prepared_logs import behind_gate
from axisight.gap.screening.screening import Screening, ScreeningModel
from axisight.gap.search.search import refitted
from axisight.gap.simulator.tolerances import with_tolerances
from axisight.logs import Case
from axisight.robot import load_robot

# Effects that are fitted after one linear step for each: those that promise most.
FITTED = 15
# AIC above the least up to which an effect is listed as an alternative (Burnham, Anderson 2002).
CLOSE = 2.0


def entry(case: Case) -> dict[str, Any]:
    """Return the entry of a case, without its schema and time."""
    robot = load_robot(case.robot_path)
    settings = with_tolerances(Settings(threads=1), robot, case.robot_path)
    inputs = behind_gate(robot, case.estimation, case.validation, ())
    _, view = inputs.compared(settings)
    alone = refitted(view.fitter, lambda *_: None)
    every = range(1, robot.n_axes + 1)
    screening = Screening(ScreeningModel(view.fitter, alone))
    groups = screening.groups(view.candidates(alone, axes=every))
    starts = [start for group in groups for start in screening.starts(group)]
    starts.sort(key=operator.attrgetter("gain"), reverse=True)
    found = [
        view.fitter.fit([start.option], alone, robot_values=start.robot_values, lazy=True)
        for start in starts[:FITTED]
        if math.isfinite(start.gain)
    ]
    models = sorted((m for m in found if not isinstance(m, Diverged)), key=aic)
    if not models or aic(models[0]) >= aic(alone):
        return {"verdict": "none"}
    close = [m for m in models[1:] if aic(m) < aic(models[0]) + CLOSE]
    return {
        "verdict": "undecidable" if close else "explained",
        "causes": [_cause(models[0], models)],
        "alternatives": [_named(m, models) for m in close],
    }


def aic(model: FittedModel) -> float:
    """Return the AIC of a fit, up to a constant of the data."""
    n = float(model.samples.sum())
    return n * math.log(model.total / n) + 2 * sum(len(one.free) for one in model.free)


def _named(model: FittedModel, among: list[FittedModel]) -> dict[str, Any]:
    (effect,) = model.effects
    least = aic(among[0])
    weight = math.exp((least - aic(model)) / 2) / sum(math.exp((least - aic(m)) / 2) for m in among)
    return {"effect": effect.name, "axis": effect.axis, "probability": weight}


def _cause(model: FittedModel, among: list[FittedModel]) -> dict[str, Any]:
    (effect,) = model.effects
    values = {}
    for name in model.free[0].free:
        value, std = (effect.parameters or {})[name], model.std.get((0, name))
        half = None if std is None or not math.isfinite(std) else 1.96 * std
        ends = [None, None] if half is None else [value - half, value + half]
        values[name] = {"value": value, "ci95": ends}
    return {**_named(model, among), "parameters": values}

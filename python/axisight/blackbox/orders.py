"""Choosing the orders of an ARX model: AIC, BIC, FPE and the loss on validation data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np
import xarray as xr

from axisight.blackbox._data import Integers, gathered, whole
from axisight.blackbox.arx import prediction_covariance, solved, triangularized
from axisight.errors import InputError
from axisight.records.experiment import Experiment

NAMES = ("na", "nb", "nk", "n_parameters")
NUMBERS = ("loss", "aic", "bic", "fpe", "validation_loss")
CRITERIA = NUMBERS[1:]


def arx_orders(
    experiments: Experiment | Sequence[Experiment],
    *,
    na: Iterable[int],
    nb: Iterable[int],
    nk: Iterable[int] = (1,),
    validation: Experiment | Sequence[Experiment] | None = None,
) -> xr.Dataset:
    """Return a table of criteria for every combination of ARX orders, all on the same samples.

    experiments
        Data to fit, as in `axisight.blackbox.arx`.
    na, nb, nk
        Candidates, the same for every pair of channels.
    validation
        Fresh data for ``validation_loss``; without it that column is NaN.

    Variables over ``candidate``, with d parameters, N equations, L the covariance of the
    one-step prediction errors (not corrected for d):

    - ``na``, ``nb``, ``nk``, ``n_parameters``
    - ``loss``: det L, ``validation_loss``: the same on validation data
    - ``aic``: ln det L + 2 d / N, ``bic``: ln det L + d ln N / N, ``fpe``:
    det L (1 + d/N) / (1 - d/N), with d / p for p outputs (Ljung, 1999, chapter 16)
    - ``status``: ``estimated``, or ``rank_deficient`` (the rest is NaN)

    ``attrs["best_aic"]`` and so on give the position of the smallest value, -1 if there is none.
    With much data AIC and FPE tend to a high order, and BIC to the true one if it is a candidate.

    Raises InputError for misuse and experiments too short for the largest order.
    """
    data = gathered(experiments, "experiments")
    fresh = None if validation is None else gathered(validation, "validation")
    p, m = data[0].output.shape[1], data[0].input.shape[1]
    if fresh is not None and (fresh[0].output.shape[1], fresh[0].input.shape[1]) != (p, m):
        raise InputError("validation: expected the channels of experiments")
    lists = [
        sorted({whole(name, v, least) for v in values})
        for name, values, least in (("na", na, 0), ("nb", nb, 1), ("nk", nk, 0))
    ]
    if not all(lists):
        raise InputError("na, nb, nk: expected at least one candidate each, got none")
    shapes = ((p, p), (p, m), (p, m))
    largest = [np.full(s, v[-1], np.int64) for s, v in zip(shapes, lists, strict=True)]
    reach = max(lists[0][-1], lists[1][-1] + lists[2][-1] - 1)
    # One triangle with all lags serves every candidate.
    first = np.full((p, m), lists[2][0], np.int64)
    span = (largest[0], largest[1] + (lists[2][-1] - lists[2][0]), first)
    triangle = triangularized(data, *span, reach)
    test = None if fresh is None else triangularized(fresh, *span, reach)
    columns: dict[str, list[float]] = {name: [] for name in (*NAMES, *NUMBERS)}
    status = []
    for orders in product(*lists):
        row = dict(zip(NAMES, (*orders, p * (p * orders[0] + m * orders[1])), strict=True))
        try:
            model = solved(triangle, *_full(orders, p, m), data[0].sample_time_s)
        except InputError:
            status.append("rank_deficient")
        else:
            status.append("estimated")
            loss = float(np.linalg.det(prediction_covariance(model, triangle)))
            row |= _judged(loss, len(model.values), p, triangle.n_rows)
            if test is not None:
                row["validation_loss"] = float(np.linalg.det(prediction_covariance(model, test)))
        for name, column in columns.items():
            column.append(row.get(name, np.nan))
    return _table(columns, status, triangle.n_rows)


def _full(orders: tuple[int, ...], p: int, m: int) -> tuple[Integers, Integers, Integers]:
    na, nb, nk = orders
    return (
        np.full((p, p), na, np.int64),
        np.full((p, m), nb, np.int64),
        np.full((p, m), nk, np.int64),
    )


def _judged(loss: float, d: int, p: int, n: int) -> dict[str, float]:
    with np.errstate(divide="ignore"):
        level = float(np.log(max(loss, 0.0)))
    share = d / (p * n)
    return {
        "loss": loss,
        "aic": level + 2 * d / n,
        "bic": level + d * float(np.log(n)) / n,
        "fpe": loss * (1 + share) / (1 - share),
    }


def _table(columns: dict[str, list[float]], status: list[str], n_rows: int) -> xr.Dataset:
    variables = {
        name: ("candidate", np.asarray(column, np.int64 if name in NAMES else np.float64))
        for name, column in columns.items()
    }
    best = {}
    for name in CRITERIA:
        values = variables[name][1]
        known = not np.isnan(values).all()
        best[f"best_{name}"] = int(np.nanargmin(values)) if known else -1
    return xr.Dataset(
        {**variables, "status": ("candidate", np.asarray(status))},
        attrs={"n_rows": n_rows, **best},
    )

"""The result of a fit of an axis: values, uncertainty and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import one_of
from axisight.blackbox import fit_percent
from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.graybox.axis_findings import (
    covariance_findings,
    curvature_findings,
    fit_findings,
    noise_weights,
    weight_findings,
)
from axisight.graybox.axis_model import OUTPUT_UNIT, AxisData, AxisModel
from axisight.graybox.axis_search import (
    CONVERGED,
    LEAST_BLOCKS,
    Point,
    Task,
    error_variance,
    free_run,
)
from axisight.graybox.normal_matrix import inverse_normal
from axisight.statistics.intervals import student_interval

Array = NDArray[np.float64]

# Beyond this condition, one parameter combination is known a thousand times worse than the best.
POOR_CONDITION = 1e6

_SEARCH_ADVICE = dict(_core.status_advice())
STATUS_ADVICE = _SEARCH_ADVICE | {
    "stalled": f"{_SEARCH_ADVICE['stalled']}: the model is not smooth here; try more substeps, a "
    "friction smoothing, or another start",
    "noise_rounds": "parameters and noise filter did not agree within FitSettings.ar_rounds: allow "
    "more rounds or fix the order (ar_order). The values are those of the last round",
}


@summarized
@dataclass(frozen=True)
class NoiseModel:
    """The noise model that whitens the prediction errors.

    ``gains`` are the innovations gains K of (3.33) per sample: those of the deflections, then those of
    the speeds. ``whitening`` are a_1..a_p of ``A(q)``, for the noise ``e / A(q)``.
    """

    kind: str
    gains: tuple[float, ...] = ()
    whitening: tuple[float, ...] = ()


@summarized
@dataclass(frozen=True)
class AxisFit:
    """Result of `fit_axis`.

    ``parameters`` holds all values, including fixed ones. The arrays run over ``free``, the names of
    the fitted parameters, in the units of the parameters.

    - ``covariance`` holds for white errors. ``sandwich`` comes from the scatter of blocks of data,
      and stays valid if errors are correlated or the model is incomplete.
    - ``trusted`` names the covariance of `standard_error`, `interval` and `summary`. It is
      ``"sandwich"`` if the residuals contradict white errors of one variance and ``blocks`` are
      enough, else ``"white"``.
    - ``sandwich_freedom``: degrees of freedom of the sandwich, that is, blocks minus all estimated
      numbers, including gains and starts.
    - ``status``: ``loss_converged``, ``step_converged``, ``exact`` (residuals are rounding errors),
      ``max_iterations``, ``stalled``, or ``noise_rounds`` (parameters and noise filter did not agree).
    - ``warnings`` say in words what to check.
    - ``residuals``: prediction errors by record, model minus measurement, whitened by the noise model
      and not weighted. ``error_std`` is the standard deviation of the weighted ones.
    - ``weights`` of the records, given or estimated.
    - ``starts``: states (`AxisModel.state_names`) at the first sample of every record.
    """

    model: AxisModel
    parameters: Mapping[str, float]
    free: tuple[str, ...]
    values: Array
    std: Array
    covariance: Array
    sandwich: Array
    correlation: Array
    condition: float
    status: str
    warnings: tuple[str, ...]
    at_bound: tuple[str, ...]
    loss: float
    initial_loss: float
    iterations: int
    evaluations: int
    error_std: float
    residuals: tuple[Array, ...]
    fit_percent: tuple[float, ...]
    starts: Array
    noise: NoiseModel
    trusted: Literal["white", "sandwich"] = "white"
    blocks: int = 0
    sandwich_freedom: int = 0
    weights: tuple[float, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether the search converged."""
        return self.status in CONVERGED

    def _repr_html_(self) -> str:
        """Return the values with standard errors, for notebooks."""
        unit = {p.name: p.unit for p in self.model.parameters}
        units = [unit[name] for name in self.free]
        fits = ", ".join(f"{fit:.2f} %" for fit in self.fit_percent)
        return html.page(
            f"fit of an axis: {self.status} after {self.iterations} iterations, fit {fits}",
            html.values(self.free, self.values, self.standard_error, units),
            html.lines(self.warnings),
        )

    @property
    def standard_error(self) -> Array:
        """Standard errors of the free parameters, from the ``trusted`` covariance."""
        return np.asarray(np.sqrt(np.diag(self._covariance(self.trusted))))

    def _covariance(self, kind: str) -> Array:
        return self.covariance if kind == "white" else self.sandwich

    def noise_weights(self) -> tuple[float, ...]:
        """Return one over the variance of each record's residuals, scaled to one for the first record.

        Use them as weights of `AxisData` if sensor noise differs between records.
        """
        return noise_weights(self.residuals)

    def interval(
        self,
        name: str,
        level: float = 0.95,
        kind: Literal["trusted", "white", "sandwich"] = "trusted",
    ) -> tuple[float, float]:
        """Return the confidence interval of a free parameter.

        ``name`` is that of the parameter, ``level`` the probability. ``kind`` ``"white"`` assumes white
        prediction errors of one variance, ``"sandwich"`` does not, and ``"trusted"`` is the one that
        ``trusted`` names. Intervals from the sandwich use Student quantiles, because a sandwich of few
        blocks is itself uncertain. Raises InputError for another kind.
        """
        one_of("name", name, self.free)
        if kind not in ("trusted", "white", "sandwich"):
            raise InputError(f"kind: expected trusted, white or sandwich, got {kind!r}")
        chosen = self.trusted if kind == "trusted" else kind
        freedom = np.inf if chosen == "white" else self.sandwich_freedom
        i = self.free.index(name)
        variance = self._covariance(chosen)[i, i]
        low, high = student_interval(self.values[i], np.sqrt(variance), freedom, level)
        return float(low), float(high)

    def simulate(self, data: AxisData) -> Array:
        """Return the output (n,) of a record, simulated from its torque without feedback of errors."""
        return self._run(data, predicts=False)

    def predict(self, data: AxisData) -> Array:
        """Return the one-step prediction (n,) with the noise model's gains; simulated without gains."""
        return self._run(data, predicts=bool(self.noise.gains))

    def _run(self, data: AxisData, *, predicts: bool) -> Array:
        start = np.zeros(2 * self.model.n_masses)
        start[0] = data.start_angle_rad()
        theta = [*self.model.vector(self.parameters, self.noise.gains), *start.tolist()]
        return _core.axis_simulate(
            self.model.core(), data.core(self.model), theta, predicts=predicts
        )[0]

    def fit_to(self, data: AxisData, *, predicted: bool = False) -> float:
        """Return the model fit (3.54) [%] to a record that starts at rest, for cross-validation."""
        run = self.predict if predicted else self.simulate
        return float(fit_percent(data.measured(self.model), run(data))[0])

    def to_xarray(self) -> xr.Dataset:
        """Return values and uncertainty as a Dataset over ``parameter``."""
        unit = {p.name: p.unit for p in self.model.parameters}
        pair = ("parameter", "other")
        return xr.Dataset(
            {
                "value": ("parameter", self.values),
                "std": ("parameter", self.std),
                "std_sandwich": ("parameter", np.sqrt(np.diag(self.sandwich))),
                "covariance": (pair, self.covariance),
                "correlation": (pair, self.correlation),
                "unit": ("parameter", [unit[n] for n in self.free]),
            },
            coords={"parameter": list(self.free), "other": list(self.free)},
            attrs={
                "status": self.status,
                "loss": self.loss,
                "condition": self.condition,
                "noise_model": self.noise.kind,
                "trusted": self.trusted,
                "error_std": self.error_std,
                "error_unit": OUTPUT_UNIT[self.model.output],
            },
        )

    def summary(self) -> str:
        """Return a table of values and standard errors, status and warnings."""
        unit = {p.name: p.unit for p in self.model.parameters}
        rows = [
            f"{n:>8} {v:12.5g} ± {s:8.2g} {unit[n]}"
            for n, v, s in zip(self.free, self.values, self.standard_error, strict=True)
        ]
        fits = ", ".join(f"{f:.2f} %" for f in self.fit_percent)
        return "\n".join([*rows, f"fit {fits}", f"status {self.status}", *self.warnings])


def conclude(task: Task, point: Point, noise: NoiseModel, warnings: tuple[str, ...]) -> AxisFit:
    """Return the result of a search that ended at ``point``."""
    model = task.model
    names = task.free_names
    errors, lengths = point.errors, [len(d) for d in task.data]
    variance = error_variance(task, point)
    inverse, condition = inverse_normal(point.matrix)
    n = len(names)
    # Parameters that the data do not show stay unknown, even without any error.
    covariance = np.where(np.isfinite(inverse), variance, 1.0) * inverse
    blocks, estimated = point.block_gradients.shape
    freedom = blocks - estimated
    sandwich = _sandwich(inverse, point.block_gradients, freedom)
    std = np.sqrt(np.diag(covariance)[:n])
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance[:n, :n] / np.outer(std, std)
    places = model.places()
    parameters = {p.name: float(point.theta[places[p.name]]) for p in model.parameters}
    values = np.array([parameters[name] for name in names])
    bounded = tuple(k for k in names if parameters[k] in task.bounds[k])
    roots = np.sqrt([d.weight for d in task.data])
    parts = np.split(errors, np.cumsum(lengths)[:-1])
    first = len(model.vector({}))
    starts = np.array(point.theta[first:]).reshape(len(lengths), 2 * model.n_masses)
    texts = [*warnings, *_warnings(point.status, bounded, condition, names, inverse)]
    residuals = tuple(p / r for p, r in zip(parts, roots, strict=True))
    simulated = not (point.gains or point.whitening)
    fits = []
    for i, (d, part, root) in enumerate(zip(task.data, parts, roots, strict=True)):
        measured = d.measured(model)
        run = measured + part / root if simulated else free_run(task, point, i)
        fits.append(float(fit_percent(measured, run)[0]))
    texts += fit_findings(task, parameters, fits)
    trusted: Literal["white", "sandwich"] = "white"
    if point.status != "exact" and min(fits) < ROUNDING:
        unequal = weight_findings(task, residuals)
        words, coloured = covariance_findings(
            task, names, covariance[:n, :n], sandwich[:n, :n], (blocks, freedom), residuals
        )
        texts += [*unequal, *words]
        if not bounded and point.status not in STATUS_ADVICE:
            texts += curvature_findings(task, point, covariance, variance)
        if coloured or (unequal and np.isfinite(sandwich).all()):
            trusted = "sandwich"
    return AxisFit(
        model=model,
        parameters=parameters,
        free=names,
        values=values,
        std=std,
        covariance=covariance[:n, :n],
        sandwich=sandwich[:n, :n],
        correlation=correlation,
        condition=condition,
        status=point.status,
        warnings=tuple(texts),
        at_bound=bounded,
        loss=point.loss,
        initial_loss=point.initial_loss,
        iterations=point.iterations,
        evaluations=point.evaluations,
        error_std=float(np.sqrt(variance)),
        residuals=residuals,
        fit_percent=tuple(fits),
        starts=starts,
        noise=noise,
        trusted=trusted,
        blocks=blocks,
        sandwich_freedom=freedom,
        weights=tuple(d.weight for d in task.data),
    )


# Fit (3.54) [%] above which residuals are rounding errors of the search, not noise.
ROUNDING = 100 - 1e-7


def _sandwich(inverse: Array, gradients: Array, freedom: int) -> Array:
    """Return the covariance from the scatter of block gradients, NaN for too few blocks."""
    blocks, n = gradients.shape
    if blocks < LEAST_BLOCKS * n:
        return np.full_like(inverse, np.nan)
    with np.errstate(invalid="ignore"):
        out = inverse @ (gradients.T @ gradients) @ inverse * (blocks / freedom)
    return np.asarray(out, dtype=np.float64)


def _warnings(
    status: str, bounded: tuple[str, ...], condition: float, names: tuple[str, ...], inverse: Array
) -> list[str]:
    out = [STATUS_ADVICE[status]] if status in STATUS_ADVICE else []
    if bounded:
        out.append(
            f"on a bound: {', '.join(bounded)}. Intervals there are not valid; look at the model "
            "or the bound"
        )
    blind = [n for n, v in zip(names, np.diag(inverse), strict=False) if not np.isfinite(v)]
    if blind:
        out.append(
            f"the data do not determine {', '.join(blind)} apart from each other: fix some of "
            "them or add records that excite them"
        )
    elif condition > POOR_CONDITION:
        out.append(
            f"condition number {condition:.1e}: the data hardly separate some parameters; look "
            "at the correlation and fix one of a pair near 1"
        )
    return out

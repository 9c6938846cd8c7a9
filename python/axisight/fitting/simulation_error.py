"""Fitting robot and effect parameters to logs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import did_you_mean
from axisight.display import html
from axisight.display.summary import summarized
from axisight.effects import Effect, core_effects, effect_info
from axisight.errors import InputError
from axisight.fitting.divergence import Diverged
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import Integrator

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Parameter:
    """One number to fit.

    Without ``effect``, ``name`` is a robot parameter (``axis1.stiffness``; see `robot_parameters`).
    Otherwise ``effect`` is the position of an effect in the list of effects, and ``name`` one of its
    parameters. ``scale`` is the natural size of a change, ``prior`` a mean and a standard deviation,
    all in the unit of the parameter. ``frozen`` keeps it at ``initial``. ``nuisance`` marks a
    parameter whose sensitivity is computed once and refreshed at the end.
    """

    name: str
    initial: float
    lower: float
    upper: float
    scale: float
    effect: int | None = None
    prior: tuple[float, float] | None = None
    frozen: bool = False
    nuisance: bool = False


@summarized
@dataclass(frozen=True)
class Weighting:
    """Weight of residuals over frequency, one table per axis, and decimation.

    ``frequency_hz`` (n_freq,) [Hz] and ``weight`` (n_axes, n_freq) are linear in between and constant
    outside. Frequencies above the Nyquist frequency after decimation have weight zero. A residual of
    standard deviation s weighted by 1/s counts one.
    """

    frequency_hz: Array
    weight: Array
    decimation: int = 1

    @classmethod
    def flat(cls, n_axes: int) -> Weighting:
        """Return a weighting of one at all frequencies."""
        return cls(np.zeros(1), np.ones((n_axes, 1)))

    def of(self, series: Array, sample_time_s: float) -> Array:
        """Return signals (n, n_axes) weighted and decimated, (n // decimation, n_axes).

        Like the core, it continues the signals by reflection and filters with zero phase.
        """
        kept = len(series) // self.decimation
        whole = series[: kept * self.decimation]
        spectrum = np.fft.rfft(np.concatenate([whole, whole[::-1]]), axis=0)[: kept + 1]
        frequency = np.arange(kept + 1) / (2 * len(whole) * sample_time_s)
        weight = [np.interp(frequency, self.frequency_hz, w) for w in self.weight]
        spectrum *= np.stack(weight, axis=1) / np.sqrt(self.decimation)
        if self.decimation > 1:
            # Decimation folds two frequencies onto the new Nyquist frequency.
            spectrum[-1] = 0.0
        return np.asarray(np.fft.irfft(spectrum, 2 * kept, axis=0)[:kept])

    def core(self) -> list[tuple[list[float], list[float], int]]:
        """Return the tables in the form of the compiled core."""
        f = self.frequency_hz.tolist()
        return [(f, w.tolist(), self.decimation) for w in self.weight]


@dataclass(frozen=True)
class FitOptions:
    """Settings of a fit.

    The fit stops after ``max_iterations`` accepted steps, when the loss falls by less than
    ``loss_tolerance`` of itself, or when no parameter moves by ``step_tolerance`` of its scale.
    ``loss_scale`` of a robust ``loss`` is in units of the whitened residual. ``nuisance_refreshes`` is
    how often sensitivities of nuisance parameters are computed again, and ``block_s`` [s] the length
    of the data blocks of the sandwich covariance. ``method``, ``substeps`` and ``tolerance`` are those
    of `axisight.simulate`.
    """

    max_iterations: int = 50
    loss_tolerance: float = 1e-10
    step_tolerance: float = 1e-8
    loss: Literal["squared", "huber", "soft_l1"] = "squared"
    loss_scale: float = 1.0
    nuisance_refreshes: int = 2
    block_s: float = 1.0
    method: Literal["rk4", "dopri5"] = "rk4"
    substeps: int = 1
    tolerance: float = 1e-7

    @property
    def integrator(self) -> Integrator:
        """``method``, ``substeps`` and ``tolerance`` as an `Integrator`; raises its InputError."""
        return Integrator(self.method, self.tolerance, self.substeps)


@summarized
@dataclass(frozen=True)
class Fitted:
    """Result of a fit.

    ``status`` is ``loss_converged``, ``step_converged``, ``exact`` (no residual is left),
    ``max_iterations`` or ``stalled``. ``warnings`` say what to check: status, parameters on a bound,
    poor conditioning. ``values``, ``std`` and the matrices run over ``names``, the free parameters,
    in their units. ``std`` comes from the sandwich covariance of data blocks and priors, which stays
    valid if the model is incomplete.
    """

    names: tuple[str, ...]
    values: Array
    std: Array
    covariance: Array
    correlation: Array
    status: str
    loss: float
    initial_loss: float
    iterations: int
    evaluations: int
    condition: float
    at_bound: tuple[str, ...]
    warnings: tuple[str, ...]
    core: _core.FitResult = field(repr=False)

    def _repr_html_(self) -> str:
        """Return the values with standard errors, for notebooks."""
        return html.page(
            f"fit: {self.status} after {self.iterations} iterations",
            html.values(self.names, self.values, self.std),
            html.lines(self.warnings),
        )

    def to_xarray(self) -> xr.Dataset:
        """Return values and uncertainty as a Dataset over ``parameter``."""
        return xr.Dataset(
            {
                "value": ("parameter", self.values),
                "std": ("parameter", self.std),
                "correlation": (("parameter", "other"), self.correlation),
            },
            coords={"parameter": list(self.names), "other": list(self.names)},
            attrs={"status": self.status, "loss": self.loss, "condition": self.condition},
        )


@dataclass(frozen=True)
class Spec:
    """A parameter in the form of the compiled core."""

    robot: str | None
    effect: tuple[int, int] | None
    initial: float
    lower: float
    upper: float
    scale: float
    prior: tuple[float, float] | None
    frozen: bool
    nuisance: bool
    amplitude: int | None


PRIOR_REACH = 4.0
"""Bounds of a parameter with a tolerance, in standard deviations of its prior."""


def robot_parameters(robot: Robot) -> dict[str, float]:
    """Return the names and values of all physical parameters of a robot."""
    return robot.parameters()


def robot_parameter(
    robot: Robot, name: str, *, relative_tolerance: float | None = None, nuisance: bool = False
) -> Parameter:
    """Return a robot parameter at its nominal value, free or within a tolerance.

    ``relative_tolerance``, relative to the value, becomes the standard deviation of a prior, with
    bounds at four standard deviations. ``nuisance`` is that of `Parameter`. Raises InputError for an
    unknown name.
    """
    known = robot_parameters(robot)
    if name not in known:
        raise InputError(
            f"parameter {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}"
        )
    nominal = known[name]
    size = abs(nominal) if nominal else 1.0
    signed = name.rsplit(".", 1)[1].startswith("com_")
    if relative_tolerance is None:
        lower = -10 * size if signed else 1e-6 * size
        return Parameter(name, nominal, lower, max(100 * size, lower), size, nuisance=nuisance)
    spread = relative_tolerance * size
    reach = PRIOR_REACH * spread
    lower = nominal - reach if signed else max(nominal - reach, 1e-6 * size)
    return Parameter(
        name,
        nominal,
        lower,
        nominal + reach,
        spread,
        prior=(nominal, spread),
        nuisance=nuisance,
    )


def effect_parameter(effects: Sequence[Effect], index: int, name: str) -> Parameter:
    """Return the parameter ``name`` of ``effects[index]``, at its present value and with its bounds.

    Raises InputError for an unknown name.
    """
    info = {p.name: p for p in effect_info(effects[index].name).parameters}
    if name not in info:
        raise InputError(
            f"effect {effects[index].name!r}: parameter {name!r}: expected {', '.join(info)}"
            f"{did_you_mean(name, info)}"
        )
    p = info[name]
    initial = (effects[index].parameters or {}).get(name, p.neutral)
    return Parameter(name, initial, p.lower, p.upper, p.typical, effect=index)


def core_spec(parameter: Parameter, effects: Sequence[Effect]) -> Spec:
    """Return a parameter in the form of the compiled core."""
    place = None
    if parameter.effect is not None:
        names = [p.name for p in effect_info(effects[parameter.effect].name).parameters]
        place = (parameter.effect, names.index(parameter.name))
    return Spec(
        robot=parameter.name if parameter.effect is None else None,
        effect=place,
        initial=parameter.initial,
        lower=parameter.lower,
        upper=parameter.upper,
        scale=parameter.scale,
        prior=parameter.prior,
        frozen=parameter.frozen,
        nuisance=parameter.nuisance,
        amplitude=None
        if parameter.effect is None
        else _amplitude(effects[parameter.effect], parameter.name),
    )


def _amplitude(effect: Effect, name: str) -> int | None:
    """Return the position of the effect's only amplitude if ``name`` is a shape, else None."""
    table = effect_info(effect.name).parameters
    sizes = [i for i, p in enumerate(table) if p.role == "amplitude"]
    shape = any(p.name == name and p.role == "shape" for p in table)
    # Only an amplitude that is neutral at zero is a factor of the effect.
    return sizes[0] if shape and len(sizes) == 1 and table[sizes[0]].neutral == 0 else None


def fit(
    robot: Robot,
    logs: Sequence[Log],
    parameters: Sequence[Parameter],
    *,
    effects: Iterable[Effect] = (),
    weighting: Weighting | None = None,
    options: FitOptions | None = None,
) -> Fitted:
    """Fit parameters to several logs together, and return values with standard errors.

    If the robot has a velocity controller and all logs have velocity references, the fit compares
    simulated and logged torque commands [Nm]. Otherwise the logged torque drives the simulation, and
    the fit compares motor positions [rad]. ``weighting`` and ``options`` have defaults.
    Effect parameters refer to positions in ``effects``. The robot's own effects act too; an effect in
    ``effects`` replaces the robot's own one with the same name and axis.
    Raises InputError for misuse, and for a start that cannot be simulated; non-convergence is a status.
    """
    chosen = options or FitOptions()
    added = robot.placed(effects)
    closed = is_closed_loop(robot, logs)
    ready = _core.SimulatedLogs(
        robot.core,
        records(logs, closed=closed),
        (weighting or Weighting.flat(robot.n_axes)).core(),
        input="reference" if closed else "torque",
        output="torque" if closed else "position",
        block_s=chosen.block_s,
        integrator=chosen.integrator,
    )
    result = ready.fit(core_effects(added), [core_spec(p, added) for p in parameters], chosen)
    if isinstance(result, Diverged):
        raise InputError(
            f"parameters: expected initial values that can be simulated, got some where {result}; "
            "start nearer to the machine, or integrate in smaller steps"
        )
    return fitted(result, parameters, added)


def is_closed_loop(robot: Robot, logs: Sequence[Log]) -> bool:
    """Return whether the robot has a velocity controller and all logs have velocity references."""
    return robot.told_speeds and all(log.velocity_ref_rad_s is not None for log in logs)


def records(
    logs: Sequence[Log], *, closed: bool
) -> list[tuple[Array, Array, None, Array | None, int]]:
    """Return (input, target, None, start, lead) of each log, in closed loop or driven by torque."""
    out = []
    for log in logs:
        reference = log.velocity_ref_rad_s
        if closed and reference is None:
            raise InputError(
                f"log {log.name!r}: expected velocity references for a closed-loop fit"
            )
        torque = log.led("torque_nm")
        pair = (
            (log.led("velocity_ref_rad_s"), torque) if closed else (torque, log.led("position_rad"))
        )
        first, second = (np.ascontiguousarray(x, dtype=np.float64) for x in pair)
        out.append((first, second, None, log.start_rad, log.lead))
    return out


def fitted(
    result: _core.FitResult, parameters: Sequence[Parameter], effects: Sequence[Effect]
) -> Fitted:
    """Wrap a core result with names and warnings."""
    names = tuple(_full_name(p, effects) for p in parameters)
    free = result.free
    covariance = result.sandwich
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(std, std)
    at_bound = tuple(names[i] for i in result.at_bound)
    return Fitted(
        names=tuple(names[i] for i in free),
        values=result.theta[free],
        std=std,
        covariance=covariance,
        correlation=correlation,
        status=result.status,
        loss=result.loss,
        initial_loss=result.initial_loss,
        iterations=result.iterations,
        evaluations=result.evaluations,
        condition=result.condition,
        at_bound=at_bound,
        warnings=tuple(_warnings(result, at_bound)),
        core=result,
    )


def _full_name(parameter: Parameter, effects: Sequence[Effect]) -> str:
    if parameter.effect is None:
        return parameter.name
    return f"{effects[parameter.effect].label}.{parameter.name}"


# Advice for a search that did not converge, by status.
STATUS_ADVICE = dict(_core.status_advice())

# Beyond this condition, one parameter combination is known a thousand times worse than the best.
_POOR_CONDITION = 1e6


def _warnings(result: _core.FitResult, at_bound: Sequence[str]) -> list[str]:
    out = []
    if result.status in STATUS_ADVICE:
        remedy = ": tighten the integrator" if result.status == "stalled" else ""
        out.append(STATUS_ADVICE[result.status] + remedy)
    if at_bound:
        out.append(f"on a bound: {', '.join(at_bound)}")
    if result.condition > _POOR_CONDITION:
        out.append(
            f"condition number {result.condition:.1e}: the data hardly separates some parameters"
        )
    return out

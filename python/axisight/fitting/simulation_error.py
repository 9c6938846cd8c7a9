"""Fitting robot and effect parameters to logs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.display import html
from axisight.display.summary import summarized
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting.divergence import Diverged
from axisight.fitting.loads import with_loads
from axisight.fitting.parameters import Parameter, core_spec, with_search
from axisight.fitting.sensed import accelerations, core_readings, joint_angles
from axisight.fitting.weighting import Weighting
from axisight.logs import Log
from axisight.robot import Robot
from axisight.robot.stated_remainder import refuse_remainder
from axisight.simulation import Integrator

Array = NDArray[np.float64]


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


def fit(
    robot: Robot,
    logs: Sequence[Log],
    parameters: Sequence[Parameter],
    *,
    effects: Iterable[Effect] = (),
    weighting: Weighting | None = None,
    joint_weighting: Weighting | None = None,
    acceleration_weighting: Weighting | None = None,
    options: FitOptions | None = None,
) -> Fitted:
    """Fit parameters to several logs together, and return values with standard errors.

    If the robot has a velocity controller and all logs have velocity references, the fit compares
    simulated and logged torque commands [Nm]. Otherwise the logged torque drives the simulation, and
    the fit compares motor positions [rad]. ``weighting`` and ``options`` have defaults.

    With a ``joint_weighting`` (weights in 1/rad), the fit also compares the angles of the driven joints with
    ``joint_position_rad`` of the logs. The zero of a joint encoder does not matter: its mean error over a log
    is removed. Axes without an encoder (NaN) and logs without any are not compared.

    With an ``acceleration_weighting`` (weights in s^2/m, a row for each reading of `Robot.accelerometers`), the
    fit also compares ``acceleration_m_s2`` of the logs. The mean error of each reading over a log is removed, so
    that its bias does not matter. Readings that a log lacks are not compared.

    A log may state its load (``load``). It replaces the robot's own effect ``payload`` in that log only.

    Effect parameters refer to positions in ``effects``. The robot's own effects act too; an effect in
    ``effects`` replaces the robot's own one with the same name and axis.
    Raises InputError for misuse, and for a start that cannot be simulated; non-convergence is a status.
    """
    chosen = options or FitOptions()
    added = robot.placed(effects)
    ready, every = simulated_logs(
        robot,
        logs,
        added,
        weighting=weighting,
        joint_weighting=joint_weighting,
        acceleration_weighting=acceleration_weighting,
        options=chosen,
    )
    specs = [core_spec(with_search(p), added) for p in parameters]
    result = ready.fit(core_effects(every), specs, chosen)
    if isinstance(result, Diverged):
        raise InputError(
            f"parameters: expected initial values that can be simulated, got some where {result}; "
            "start nearer to the machine, or integrate in smaller steps"
        )
    return fitted(result, parameters, added)


def simulated_logs(
    robot: Robot,
    logs: Sequence[Log],
    effects: Sequence[Effect],
    *,
    weighting: Weighting | None = None,
    joint_weighting: Weighting | None = None,
    acceleration_weighting: Weighting | None = None,
    options: FitOptions,
) -> tuple[_core.SimulatedLogs, list[Effect]]:
    """Return the logs ready for fits, and ``effects`` with a payload if logs state their load.

    Arguments are those of `fit`, with ``effects`` placed. Raises InputError as `fit`.
    """
    refuse_remainder(robot.remainder, "a fit to logs")
    closed = is_closed_loop(robot, logs)
    every, own = with_loads(robot, effects, [log.load for log in logs])
    sensed = []
    if joint_weighting is not None:
        sensed.append(joint_angles(logs, joint_weighting))
    if acceleration_weighting is not None:
        sensed.append(accelerations(robot, logs, acceleration_weighting))
    ready = _core.SimulatedLogs(
        robot.core,
        records(logs, closed=closed),
        (weighting or Weighting.flat(robot.n_axes)).core(),
        input="reference" if closed else "torque",
        output="torque" if closed else "position",
        sensed=[output for one in sensed for output in one.core()],
        readings=core_readings(sensed, logs),
        own=own,
        block_s=options.block_s,
        integrator=options.integrator,
    )
    return ready, every


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
    dropped = _dropped_blocks(result)
    if dropped:
        out.append(
            f"{100 * dropped:.2g} % of the data blocks took no part in the search, because a natural change of "
            "a parameter changes them a thousand times more than noise: they are chaotic (contact, stiction), "
            "or the weights or the scale of a parameter are too large"
        )
    if result.condition > _POOR_CONDITION:
        out.append(
            f"condition number {result.condition:.1e}: the data hardly separates some parameters"
        )
    return out


def _dropped_blocks(result: _core.FitResult) -> float:
    """Return the share of blocks that the fit counts in the loss but not in the derivatives."""
    if not result.free or not result.blocks:
        return 0.0
    empty = ~np.any(result.block_matrix, axis=(1, 2)) & (result.block_loss > 0)
    if not empty.any():
        return 0.0
    moved = result.jacobian
    cut = [
        bool(lost and moved[:, start : start + n].any())
        for lost, (_, _, start, n) in zip(empty, result.blocks, strict=True)
    ]
    return float(np.mean(cut))

"""Check of motor velocity, acceleration and torque against limits, in a simulated run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.arguments import Real, instance, one_of, several, whole
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.excitation.checks import numbers, per_item
from axisight.excitation.references import References
from axisight.excitation.rigid_motion import rigid_torque
from axisight.robot import Robot
from axisight.simulation import Model, simulate_batch

Quantity = Literal["reference_velocity", "velocity", "acceleration", "torque"]
Method = Literal["closed_loop", "inverse_dynamics"]
UNITS: dict[Quantity, str] = {
    "reference_velocity": "rad/s",
    "velocity": "rad/s",
    "acceleration": "rad/s^2",
    "torque": "Nm",
}


@summarized
@dataclass(frozen=True)
class Limits:
    """Limits of the motors: one number for all axes, one per axis, or None for no limit.

    All limits are absolute values on the motor side: velocity [rad/s], acceleration [rad/s^2] and
    torque [Nm]. ``velocity_rad_s`` applies to the reference and to the motor.
    """

    velocity_rad_s: ArrayLike | None = None
    acceleration_rad_s2: ArrayLike | None = None
    torque_nm: ArrayLike | None = None


@summarized
@dataclass(frozen=True)
class Excess:
    """One limit that one axis exceeds in one experiment.

    ``experiment`` and ``axis`` count from 1. ``largest``, at ``at_s`` [s], is the largest absolute
    value. ``first_s`` [s] is when the axis first exceeds the limit, and ``n_samples`` the number of
    samples above it, over the start and all periods. Values are in the unit of the quantity.
    """

    quantity: Quantity
    experiment: int
    axis: int
    limit: float
    largest: float
    at_s: float
    first_s: float
    n_samples: int

    def __str__(self) -> str:
        """Return the excess as one line of text."""
        unit = UNITS[self.quantity]
        return (
            f"experiment {self.experiment}, axis {self.axis}: {self.quantity} "
            f"{self.largest:.4g} {unit} at {self.at_s:.4g} s passes {self.limit:.4g} {unit} "
            f"(first at {self.first_s:.4g} s, {self.n_samples} samples)"
        )


@summarized
@dataclass(frozen=True, eq=False)
class LimitReport:
    """Result of a check of limits.

    ``excesses`` are ordered by size relative to the limit, worst first. ``largest`` are the largest
    absolute values (quantity, experiment, axis). ``failed`` maps experiments (from 1) whose
    simulation did not complete to its status. ``compared`` are the quantities that had a limit.
    ``method`` is "closed_loop" or, for robots without a known controller, "inverse_dynamics".
    """

    excesses: tuple[Excess, ...]
    largest: xr.DataArray
    failed: dict[int, str]
    compared: tuple[Quantity, ...]
    method: Method

    @property
    def ok(self) -> bool:
        """Whether every experiment ran to its end within all given limits."""
        return not self.excesses and not self.failed

    def __str__(self) -> str:
        """Return one line per excess or failure; without any, a line with what was compared."""
        lines = [f"experiment {e}: simulation {status}" for e, status in self.failed.items()]
        lines += [str(excess) for excess in self.excesses]
        if not self.compared:
            lines.append("no limits given: nothing was compared")
        elif not lines:
            lines.append(
                "within all limits"
                if len(self.compared) == len(UNITS)
                else f"within the limits given: {', '.join(self.compared)}"
            )
        if self.method == "inverse_dynamics":
            lines.append(
                "no controller is known: torque is that of the rigid robot along the reference, "
                "without start, elasticity and feedback"
            )
        return "\n".join(lines)


def check_limits(
    reference: References,
    robot: Robot,
    limits: Limits,
    *,
    periods: int = 2,
    model: Model = "nonlinear",
    effects: Iterable[Effect] = (),
    start_rad: Sequence[float] | None = None,
) -> LimitReport:
    """Simulate every experiment in closed loop from rest, and return where it exceeds the limits.

    Parameters
    ----------
    reference : motor-side velocity references [rad/s] at the robot's sample time.
    robot : the model. Without a known controller (kind ``"none"``) there is no loop to simulate.
        The check then assumes that the motors follow the periodic reference exactly, and computes
        the torque of the rigid robot by :func:`axisight.Robot.inverse_dynamics` with motor inertia
        and viscous friction. It ignores ``model`` and refuses effects.
    limits : the limits to check.
    periods : number of periods to simulate; the first includes the start from rest.
    model, effects, start_rad : as in :func:`axisight.simulate`.

    Velocity and acceleration are means over a sample, from true motor positions; torque is the
    command. Raises InputError for other sample times, axes or units, for limits that are
    not positive, and for effects without a known controller.

    """
    instance("reference", reference, References)
    instance("robot", robot, Robot)
    one_of("model", model, get_args(Model))
    added = [instance("effects", effect, Effect) for effect in several("effects", effects)]
    if start_rad is not None:
        start_rad = numbers("start_rad", start_rad, robot.n_axes).tolist()
    if reference.unit != "rad/s" or reference.n_inputs != robot.n_axes:
        raise InputError(
            f"reference: expected {robot.n_axes} velocities [rad/s], got {reference.n_inputs} "
            f"inputs [{reference.unit}]"
        )
    if abs(reference.sample_time_s / robot.sample_time_s - 1) > 1e-9:
        raise InputError(
            f"reference: expected the sample time of the robot, {robot.sample_time_s} s, "
            f"got {reference.sample_time_s} s"
        )
    bounds = _bounds(instance("limits", limits, Limits), robot.n_axes)
    given = reference.repeated(whole("periods", periods))
    step = robot.sample_time_s
    failed: dict[int, str] = {}
    method: Method = "closed_loop"
    if robot.controller_kind == "none":
        method = "inverse_dynamics"
        if added:
            raise InputError(
                f"effects: expected none for a robot without controller, got {len(added)}"
            )
        signals = _followed(given, robot, start_rad)
    else:
        run = simulate_batch(robot, given, effects=added, start_rad=start_rad, model=model)
        rest = robot.equilibrium(start_rad, added)["motor_angle_rad"].values
        signals = _simulated(run, given, rest, step)
        status = run["status"].values
        failed = {e + 1: str(s) for e, s in enumerate(status) if s != "completed"}
    excesses = [
        excess
        for quantity, bound in bounds.items()
        for excess in _excesses(quantity, signals[quantity], bound, step)
    ]
    excesses.sort(key=lambda e: -e.largest / e.limit)
    return LimitReport(
        excesses=tuple(excesses),
        largest=xr.DataArray(
            np.stack([np.nanmax(np.abs(x), axis=1) for x in signals.values()]),
            dims=("quantity", "experiment", "axis"),
            coords={
                "quantity": list(signals),
                "experiment": np.arange(1, len(given) + 1),
                "axis": robot.axis_numbers(),
            },
        ),
        failed=failed,
        compared=tuple(bounds),
        method=method,
    )


def _simulated(run: xr.Dataset, given: Real, rest: Real, step: float) -> dict[Quantity, Real]:
    position = run["motor_position_rad"].values
    before = np.broadcast_to(rest, (len(position), 1, len(rest)))
    velocity = np.diff(position, axis=1, prepend=before) / step
    return {
        "reference_velocity": given,
        "velocity": velocity,
        "acceleration": np.diff(velocity, axis=1, prepend=0.0) / step,
        "torque": run["torque_cmd_nm"].values,
    }


def _followed(given: Real, robot: Robot, start_rad: Sequence[float] | None) -> dict[Quantity, Real]:
    """Return the signals of motors that follow the periodic reference."""
    acceleration = (given - np.roll(given, 1, axis=1)) / robot.sample_time_s
    return {
        "reference_velocity": given,
        "velocity": given,
        "acceleration": acceleration,
        "torque": rigid_torque(robot, given, acceleration, start_rad),
    }


def _bounds(limits: Limits, n_axes: int) -> dict[Quantity, Real]:
    given: dict[Quantity, tuple[str, ArrayLike | None]] = {
        "reference_velocity": ("velocity_rad_s", limits.velocity_rad_s),
        "velocity": ("velocity_rad_s", limits.velocity_rad_s),
        "acceleration": ("acceleration_rad_s2", limits.acceleration_rad_s2),
        "torque": ("torque_nm", limits.torque_nm),
    }
    out: dict[Quantity, Real] = {}
    for quantity, (name, value) in given.items():
        if value is not None:
            out[quantity] = per_item(f"limits.{name}", value, n_axes)
            if np.any(out[quantity] <= 0):
                raise InputError(f"limits.{name}: expected positive numbers, got {value}")
    return out


def _excesses(quantity: Quantity, signal: Real, bound: Real, step: float) -> list[Excess]:
    # A failed run ends in NaN, which exceeds no limit; the report lists the run as failed.
    size = np.abs(signal)
    above = size > bound
    out = []
    for e, a in np.argwhere(above.any(axis=1)):
        at = int(np.nanargmax(size[e, :, a]))
        out.append(
            Excess(
                quantity=quantity,
                experiment=int(e) + 1,
                axis=int(a) + 1,
                limit=float(bound[a]),
                largest=float(size[e, at, a]),
                at_s=at * step,
                first_s=int(np.argmax(above[e, :, a])) * step,
                n_samples=int(above[e, :, a].sum()),
            )
        )
    return out

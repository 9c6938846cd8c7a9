"""Records of a comparison for a remainder: motion, load, residual, and the torques of the causes' parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info, effect_table
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.signals.motion import Motion, motion
from axisight.gap.simulator.own_parameters import with_values
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.logs import Log
from axisight.remainder import Motion as Course
from axisight.remainder import Record
from axisight.robot import Robot

Array = NDArray[np.float64]

# Step of the derivative by a parameter of a cause, as a share of its value.
_STEP = 1e-3


def records_of(
    view: InverseView,
    logs: Sequence[Log],
    after: Variant,
    certain: Sequence[Array | None] | None = None,
) -> list[Record]:
    """Return a record for each log: what the simulator ``after`` leaves of the measured torque.

    Protected are the parameters of the causes. ``certain``: weights with which the causes were fitted, by log.
    """
    changes = _changes(view.robot, after)
    out = []
    weights = [None] * len(logs) if certain is None else certain
    for log, torque, sure in zip(logs, view.torques(after, logs), weights, strict=True):
        at = view.filtering(log)
        residual = view.measured(log) - torque
        judged = np.ones(log.n_axes)
        judged[list(view.silent)] = 0.0
        protected = [_derivative(view, log, at, change) for change in changes]
        out.append(
            Record(
                motion=course_of(view, log, gear_load(view, log, after)),
                residual_nm=judged * residual,
                weight=view.counted(log) * np.ones(log.n_axes),
                protected=np.stack(protected, axis=2) if protected else None,
                certainty=sure,
                lowpass=_lowpass(view, log),
            )
        )
    return out


def gear_load(view: InverseView, log: Log, after: Variant) -> Array:
    """Return the load on the gears (n, n_axes) [Nm] along a log: torques of bodies alone, motor side."""
    return predicted_torque(*_without_drives(view.robot, after), view.filtering(log))


def course_of(view: InverseView, log: Log, load_nm: Array) -> Course:
    """Return the motion of a log as terms of a remainder see it, with the load on its gears (n, n_axes) [Nm]."""
    cutoff_hz = view.filtering.cutoff_hz
    position, velocity, acceleration, _ = motion(log, cutoff_hz, view.filtering.measured)
    return Course(
        name=log.name,
        time_s=log.time_s,
        position_rad=position,
        velocity_rad_s=velocity,
        acceleration_rad_s2=acceleration,
        load_nm=load_nm,
        temperature_c=log.temperature_c,
    )


def _lowpass(view: InverseView, log: Log) -> Callable[[Array], Array]:
    return lambda x: view.filtering.compared(x, log.sample_time_s)


def _without_drives(robot: Robot, after: Variant) -> tuple[Robot, Variant]:
    """Return the simulator whose torque is the load of the gears: bodies alone, with causes that change bodies."""
    changed = with_values(robot, after.robot_values)
    on_motors = {
        info.stands_for[0]
        for info in effect_table().values()
        if info.stands_for and info.acts == "motor"
    }
    own = {n: 0.0 for n in changed.parameters() if n.rsplit(".", 1)[1] in on_motors}
    bodies = [e for e in changed.effects if _moves_bodies(e)]
    bare = changed.with_parameters(own).with_effects(bodies)
    return bare, Variant({}, tuple(e for e in after.effects if _moves_bodies(e)))


def _moves_bodies(effect: Effect) -> bool:
    return effect_info(effect.name).acts in ("arm", "base")


# Two simulators that differ in one parameter, and by how much.
_Change = tuple[tuple[Robot, Variant], tuple[Robot, Variant], float]


def _changes(robot: Robot, after: Variant) -> list[_Change]:
    """Return a change of each parameter of the causes."""
    plain = (robot, after)
    out: list[_Change] = []
    for effect in after.effects:
        table = {p.name: p for p in effect_info(effect.name).parameters}
        for name, value in (effect.parameters or {}).items():
            step = _STEP * value
            # Away from a bound at which the value may stand.
            step = step if table[name].lower <= value + step <= table[name].upper else -step
            if step:
                changed = effect.with_values({name: value + step})
                others = tuple(e for e in after.effects if e.label != effect.label)
                out.append(((robot, replace(after, effects=(*others, changed))), plain, step))
    return out


def _derivative(view: InverseView, log: Log, at: Motion, change: _Change) -> Array:
    changed, plain, step = change
    difference = predicted_torque(*changed, at) - predicted_torque(*plain, at)
    return np.asarray(view.filtering.compared(difference / step, log.sample_time_s))

"""Notes on everything in an MJCF that a serial chain with drives cannot have."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from axisight.effects.dcmotor import effects_of
from axisight.robot_import.mjcf.actuators import Actuators, numbers
from axisight.robot_import.mjcf.gravity import compensation
from axisight.robot_import.mjcf.motors import Law
from axisight.robot_import.mjcf.sensors import notes_of_sensors, reading_delay_s

Named = Callable[[str, int], str]

# Transmissions that do not act on a single joint, by MuJoCo's numbers.
_TRANSMISSIONS = {2: "a slider-crank", 3: "a tendon", 4: "a site", 5: "a body"}


def notes_of(model: Any, name: Named) -> list[str]:
    """Return a note for everything in a compiled model that is left out; ``name`` gives names of elements."""
    actuators = Actuators(model)
    out = [
        f"actuator {name('actuator', i)!r}{note}"
        for i in range(actuators.n)
        for note in _of_actuator(actuators, i)
    ]
    for j, own in actuators.known().items():
        if len(own) > 1:
            out.append(
                f"joint {name('joint', j)!r} has {len(own)} motors, {_listed(name, 'actuator', own)}: their gears, "
                f"gains, limits, delays and lags left out, its torque is taken as one"
            )
    out += _of_joints(actuators, name) + _of_bodies(model, name)
    out += notes_of_sensors(model, name)
    counts = {
        "equality constraints": ("equality", model.neq),
        "tendons": ("tendon", model.ntendon),
        "plugins": ("plugin", model.nplugin),
        "flexes": ("flex", model.nflex),
    }
    out += [
        f"{count} {what} left out: {_listed(name, kind, range(count))}"
        for what, (kind, count) in counts.items()
        if count
    ]
    if model.nmocap:
        out.append(f"{model.nmocap} mocap bodies left out")
    if model.opt.density > 0 or model.opt.viscosity > 0:
        out.append("drag of the medium left out")
    return out


def _of_actuator(actuators: Actuators, i: int) -> list[str]:
    """Return what is left out of one actuator, as text to follow its name."""
    model = actuators.model
    if (
        (motor := actuators.motors[i]) is not None
        and motor.is_passive
        and actuators.acts_on[i] >= 0
    ):
        return [f": {what} left out" for what in motor.beyond()]
    if actuators.joint[i] < 0:
        kind = _TRANSMISSIONS.get(int(model.actuator_trntype[i]), "several axes")
        return [f" acts on {kind}, not on one joint: left out"]
    is_servo = int(actuators.joint[i]) in actuators.servos()
    out = _of_law(actuators, i, is_servo=is_servo)
    command = actuators.command_limit[i]
    if command != np.inf and (np.isnan(command) or not actuators.is_motor(i)):
        out.append(
            ": limits of its command left out: expected those of a torque, the same both ways"
        )
    force = actuators.force_limit[i]
    if force != np.inf and (why := _limits_out(actuators, i, force)):
        out.append(f": limits of its force left out{why}")
    if np.any(numbers(model, "actuator_dampingpoly", np.zeros((actuators.n, 2)))[i, 1:]):
        out.append(": cubic damping left out")
    if model.actuator_actearly[i]:
        out.append(": actearly left out: its activation acts a step later")
    return out


def _of_law(actuators: Actuators, i: int, *, is_servo: bool) -> list[str]:
    """Return what is left out of the law of an actuator, or what users must know about it."""
    if is_servo and actuators.sums_up(i):
        out = [
            " is told speeds, which it sums up to its target: position_ref of logs is its activation (act), "
            "at the simulator's step"
        ]
        limited = bool(actuators.model.actuator_actlimited[i])
        out += [": limits of its target left out"] * limited
        return out + [": its delay left out: its activation has it"] * bool(actuators.delay[i] > 0)
    if actuators.is_speed_servo(i) and actuators.drives_alone(i):
        out = [
            f" is told speeds: its law, {actuators.gain[i]:g} Nm s/rad times the error of speed, is left out"
        ]
        return out + [": its delay left out"] * bool(actuators.delay[i] > 0)
    motor = actuators.motors[i]
    out = [] if motor is None else [f": {what} left out" for what in motor.beyond()]
    if is_servo:
        return out + _unused(actuators.laws[i])
    if motor is not None and motor.is_told_voltage:
        per_volt = motor.constant_nm_a / motor.resistance_ohm
        out.append(f" is told voltages: {per_volt:g} Nm/V left out, log its force as torque")
    return out if actuators.is_motor(i) else [*out, _no_motor(actuators, i)]


def _unused(law: Law | None) -> list[str]:
    """Return notes on the inputs of a servo beside its target."""
    return [] if law is None else [f": its {what} is taken as zero" for what in law.unused()]


def _no_motor(actuators: Actuators, i: int) -> str:
    """Return why an actuator is neither a motor nor a servo."""
    law, filtered_s = actuators.laws[i], actuators.filtered_servo_s(i)
    if law is not None:
        beyond = ", ".join(law.beyond()) or "inputs"
        return (
            f": its law is left out, no controller of a robot file has its {beyond}: to be said in the drive "
            f"data"
        )
    if filtered_s > 0:
        return (
            f" filters its targets over {filtered_s:g} s: its law is left out, no controller of a robot file "
            f"does"
        )
    return (
        " is no plain motor: its gain and bias are the controller's, to be said in the drive data"
    )


def _limits_out(actuators: Actuators, i: int, limit: float) -> str:
    """Return why a force limit of an actuator or its joint is left out; "" if it is kept."""
    if np.isnan(limit):
        return ": expected the same both ways"
    if not actuators.drives_alone(i):
        return ": expected those of the only motor or servo of a joint"
    if actuators.is_motor(i) and actuators.lag[i] > 0:
        return ": they act behind its lag"
    if actuators.is_motor(i) and actuators.offset[i] != 0:
        return ": they act behind its constant torque"
    return ""


def _limits_of_joint(actuators: Actuators, j: int) -> str:
    """Return why the force limit of a joint is left out; "" if it is kept."""
    own = np.flatnonzero(actuators.joint == j).tolist()
    if not own:
        return ": no actuator acts on it"
    if np.isnan(actuators.joint_limit[j]) or (len(own) == 1 and actuators.drives_alone(own[0])):
        return _limits_out(actuators, own[0], actuators.joint_limit[j])
    return ""


def _of_joints(actuators: Actuators, name: Named) -> list[str]:
    """Return notes on what is left out of joints."""
    out, model = [], actuators.model
    none = np.zeros((model.njnt, 1))
    springs = numbers(model, "jnt_stiffnesspoly", none)
    yields = numbers(model, "jnt_springyield", none[:, 0])
    dampers = numbers(model, "dof_dampingpoly", np.zeros((model.nv, 2)))
    for j in range(model.njnt):
        what = {
            "stiffness beyond the linear": np.any(springs[j]),
            "cubic damping": dampers[model.jnt_dofadr[j], 1] != 0,
            "yielding of its spring": yields[j] > 0,
            "actuatorgravcomp": model.jnt_actgravcomp[j] and compensation(model) is None,
        }
        # Ratios do not matter for what no effect can state.
        what |= dict.fromkeys(effects_of(actuators.devices(j), 1, 1.0)[1], True)
        late = j in actuators.servos() and reading_delay_s(model, j) > 0
        what["delay of its position sensor, which its servo does not read,"] = late
        if model.jnt_actfrclimited[j] and (why := _limits_of_joint(actuators, j)):
            out.append(
                f"joint {name('joint', j)!r}: limits of the force of its actuators left out{why}"
            )
        out += [
            f"joint {name('joint', j)!r}: {one} left out" for one, there in what.items() if there
        ]
    return out


def _of_bodies(model: Any, name: Named) -> list[str]:
    """Return notes on what is left out of bodies."""
    alike = compensation(model)
    if alike is not None:
        return alike.notes()
    held = np.flatnonzero(model.body_gravcomp).tolist()
    return [
        f"gravcomp of {_listed(name, 'body', held)} left out: gravity acts on all of their masses, what "
        f"compensates it is to be said in the controller"
    ]


def _listed(name: Named, kind: str, which: Iterable[int]) -> str:
    """Return the quoted names of elements, joined by commas."""
    return ", ".join(repr(name(kind, i)) for i in which)

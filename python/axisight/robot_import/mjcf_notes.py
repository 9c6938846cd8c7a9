"""What an MJCF has beyond a serial chain with drives: said, not dropped."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from axisight.robot_import.mjcf_actuators import Actuators, numbers

Named = Callable[[str, int], str]

# Kinds of transmissions that are none of one joint, by MuJoCo's numbers.
_TRANSMISSIONS = {2: "a slider-crank", 3: "a tendon", 4: "a site", 5: "a body"}


def notes_of(model: Any, name: Named) -> list[str]:
    """Return what of a compiled model is left out; ``name`` says its elements by kind and number."""
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
    out += _of_joints(model, name) + _of_bodies(model, name)
    counts = {
        "equality constraints": model.neq,
        "tendons": model.ntendon,
        "mocap bodies": model.nmocap,
        "plugins": model.nplugin,
        "flexes": model.nflex,
    }
    out += [f"{count} {what} left out" for what, count in counts.items() if count]
    if model.opt.density > 0 or model.opt.viscosity > 0:
        out.append("drag of the medium left out")
    return out


def _of_actuator(actuators: Actuators, i: int) -> list[str]:
    """Return what of one actuator is left out, to stand behind its name."""
    model = actuators.model
    if actuators.joint[i] < 0:
        kind = _TRANSMISSIONS.get(int(model.actuator_trntype[i]), "several axes")
        return [f" acts on {kind}, not on one joint: left out"]
    out = []
    is_servo = int(actuators.joint[i]) in actuators.servos()
    if not (actuators.is_motor(i) or is_servo):
        out.append(
            " is no plain motor: its gain and bias are the controller's, to be said in the drive data"
        )
    if actuators.limited[i] and (is_servo or not actuators.limited_both_ways[i]):
        out.append(
            ": limits of its command left out: expected those of a torque, the same both ways"
        )
    if model.actuator_forcelimited[i]:
        out.append(": limits of its force left out")
    if np.any(numbers(model, "actuator_dampingpoly", np.zeros((actuators.n, 1)))[i]):
        out.append(": damping beyond the linear left out")
    return out


def _of_joints(model: Any, name: Named) -> list[str]:
    """Return what of joints is left out."""
    out = []
    none = np.zeros((model.njnt, 1))
    springs = numbers(model, "jnt_stiffnesspoly", none)
    yields = numbers(model, "jnt_springyield", none[:, 0])
    dampers = numbers(model, "dof_dampingpoly", np.zeros((model.nv, 1)))
    for j in range(model.njnt):
        what = {
            "limits of the force of its actuators": model.jnt_actfrclimited[j],
            "stiffness beyond the linear": np.any(springs[j]),
            "damping beyond the linear": np.any(dampers[model.jnt_dofadr[j]]),
            "yielding of its spring": yields[j] > 0,
        }
        out += [
            f"joint {name('joint', j)!r}: {one} left out" for one, there in what.items() if there
        ]
    return out


def _of_bodies(model: Any, name: Named) -> list[str]:
    """Return what of bodies is left out."""
    held = np.flatnonzero(model.body_gravcomp).tolist()
    if not held:
        return []
    return [
        f"gravcomp of {_listed(name, 'body', held)} left out: gravity acts on all of their masses, what "
        f"compensates it is to be said in the controller"
    ]


def _listed(name: Named, kind: str, which: Iterable[int]) -> str:
    """Return names, each with the signs of a name."""
    return ", ".join(repr(name(kind, i)) for i in which)

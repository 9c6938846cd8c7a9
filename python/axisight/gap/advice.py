"""Which experiment separates effects that one data set cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

_FRICTION = {
    "coulomb_friction",
    "asymmetric_friction",
    "stribeck_friction",
    "viscous_friction",
    "quadratic_drag",
    "load_dependent_friction",
}
_SPRING = {
    "backlash",
    "nonlinear_stiffness",
    "joint_stiffness",
    "joint_damping",
    "transmission_error",
}
_TIMING = {"input_delay", "actuator_bandwidth"}
_LOAD = {
    "payload",
    "torque_constant",
    "gravity_compensation",
    "torque_offset",
    "motor_inertia",
    "cable_stiffness",
}
_PERIODIC = {"torque_ripple", "resolver_ripple", "transmission_error"}

_ADVICE = (
    (
        _SPRING,
        "Repeat the multisine at three amplitudes and with a changed preload (another pose).",
    ),
    (_TIMING, "Excite a wider band, to several times the present bandwidth of the controller."),
    (_FRICTION, "Move at several constant speeds in both directions, with and without a load."),
    (_PERIODIC, "Move slowly at two constant speeds; add a joint-side sensor if there is one."),
    (_LOAD, "Hold and move in several poses with and without a known payload."),
)


def separating_experiment(labels: Sequence[str]) -> str:
    """Return the experiment that would separate candidates named ``effect@axis``."""
    effects = {label.split("@")[0] for label in labels}
    axes = {label.split("@")[1] for label in labels if "@" in label}
    if len(axes) > 1 and len(effects) == 1:
        return "Move one axis at a time, the others held."
    for group, advice in _ADVICE:
        if effects <= group:
            return advice
    return (
        "Record one axis at a time: slow motion in both directions at several speeds and poses, "
        "then a multisine at three amplitudes."
    )

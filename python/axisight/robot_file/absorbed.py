"""Which effects of a robot an identified quantity has taken up: on top of it they count twice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from axisight.effects import Effect

ABSORBED: Mapping[str, tuple[str, ...]] = {
    "links": ("payload", "gravity_compensation"),
    "motor_inertia": ("motor_inertia",),
    "viscous_friction": ("viscous_friction", "quadratic_drag"),
    "dry_friction": (
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "presliding_friction",
        "load_dependent_friction",
    ),
    "torque_offset": ("torque_offset",),
    "stiffness": ("joint_stiffness", "nonlinear_stiffness"),
    "damping": ("joint_damping",),
    "backlash": ("backlash",),
    "torque": ("torque_constant",),
}
"""What was identified: effects whose torque, in the data, is in it, wholly or in part.

A balancer pulls as the mass of a link does; drag and load-dependent friction go into the friction
that stands nearest. ``"torque"``: all that is found from commanded torques is in units of these.
"""


def absorbed_effects(
    effects: Iterable[Effect],
    quantities: Iterable[str],
    *,
    axis: int | None,
    found: Iterable[Effect] = (),
) -> list[Effect]:
    """Return those of the ``effects`` that identified ``quantities`` have taken up.

    ``quantities`` are keys of :data:`ABSORBED`, identified for ``axis`` (from 1), None for the whole
    arm: its links take up effects of every axis. Effects in ``found`` stand for themselves, and those
    that are neutral stay.
    """
    names = {name for quantity in quantities for name in ABSORBED[quantity]}
    labels = {effect.label for effect in found}
    return [
        effect
        for effect in effects
        if effect.name in names
        and axis in (None, effect.axis)
        and effect.label not in labels
        and effect.acts
    ]


def absorbed_note(effects: Iterable[Effect]) -> list[str]:
    """Return the note that says which effects were removed, none if there are none."""
    what = ", ".join(effect.label for effect in effects)
    return [f"removed, what was identified stands in their place: {what}"] if what else []

"""Which effects of a robot an identified quantity has taken up: on top of it they count twice."""

from __future__ import annotations

from collections.abc import Iterable

from axisight.effects import Effect, effect_info


def absorbed_effects(
    effects: Iterable[Effect],
    quantities: Iterable[str],
    *,
    axis: int | None,
    found: Iterable[Effect] = (),
) -> list[Effect]:
    """Return those of the ``effects`` that identified ``quantities`` have taken up.

    ``quantities`` are those of `EffectInfo.absorbed_by`, identified for ``axis`` (from 1), None for
    the whole arm: its links take up effects of every axis. Effects in ``found`` stand for
    themselves, and those that are neutral stay. All that is found from commanded torques is in
    units of these: the quantity ``torque``.
    """
    wanted = set(quantities)
    labels = {effect.label for effect in found}
    return [
        effect
        for effect in effects
        if wanted.intersection(effect_info(effect.name).absorbed_by)
        and axis in (None, effect.axis)
        and effect.label not in labels
        and effect.acts
    ]


def absorbed_note(effects: Iterable[Effect]) -> list[str]:
    """Return the note that says which effects were removed, none if there are none."""
    what = ", ".join(effect.label for effect in effects)
    return [f"removed, what was identified stands in their place: {what}"] if what else []

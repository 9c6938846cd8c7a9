"""Find the effects that an identified quantity contains already; in the file they would count twice."""

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
    """Return those of the ``effects`` that identified ``quantities`` contain already.

    ``quantities`` are words of `EffectInfo.absorbed_by`. They were identified for ``axis`` (from 1), or with
    None for the whole arm, whose links absorb effects of every axis. Effects in ``found`` were identified
    themselves and stay, and so do neutral effects. The quantity ``torque`` is for results in units of the
    commanded torque.
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
    """Return a note on the effects that were removed, as a list of one; [] without effects."""
    what = ", ".join(effect.label for effect in effects)
    return [f"removed, what was identified stands in their place: {what}"] if what else []

"""A robot with the values of one sample of a posterior."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.posterior.result import Posterior
from axisight.robot import Robot


def sampled_robot(posterior: Posterior, robot: Robot, sample: xr.Dataset) -> Robot:
    """Return the simulator with the parameters and causes of one sample.

    ``robot``: the simulator that was diagnosed. ``sample``: one draw of `Posterior.samples`, such as
    ``samples.isel(draw=0)``. A cause replaces an effect of the same label. Raises InputError for more than one draw.
    """
    if sample.sizes.get("draw", 1) != 1:
        raise InputError(f"sample: expected one draw, got {sample.sizes['draw']}; use isel(draw=0)")
    one = sample.isel(draw=0) if "draw" in sample.dims else sample
    values = {name: float(one[name]) for name in posterior.names}
    plain, effects = split_values(posterior, values, int(one["hypothesis"]))
    stated = {e.label: e for e in robot.effects} | {e.label: e for e in effects}
    return robot.with_parameters(plain).with_effects(list(stated.values()))


def split_values(
    posterior: Posterior, values: Mapping[str, float], hypothesis: int
) -> tuple[dict[str, float], list[Effect]]:
    """Return the values of robot parameters by name, and the effects that hold all other values."""
    one = posterior.hypotheses[hypothesis]
    plain: dict[str, float] = {}
    held = {effect.label: effect for effect in one.effects}
    for p in map(posterior.parameter, one.names):
        if p.effect is None:
            plain[p.name] = values[p.name]
        else:
            empty = Effect(p.effect, None if p.axes else p.axis, {}, p.axes)
            effect = held.get(empty.label, empty)
            held[effect.label] = effect.with_values({p.quantity: values[p.name]})
    return plain, list(held.values())

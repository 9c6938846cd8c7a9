"""Tolerances of the simulator's own parameters, by quantity, or by name from an identification."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.fitting import robot_parameters
from axisight.gap.facts.settings import Settings
from axisight.robot import Robot, load_robot
from axisight.robot.fixed_base import refuse_floating
from axisight.robot_file import load_identified
from axisight.robot_file.sidecar import sidecar_path

# Relative difference up to which a value counts as unchanged; robot files state so many digits.
_SAME = 1e-6


def tolerance_of(tolerances: Mapping[str, float], name: str) -> float | None:
    """Return the relative tolerance [1] of a parameter, by its name, else by its quantity; None if it is exact."""
    return tolerances.get(name, tolerances.get(name.rsplit(".", 1)[1]))


def spring_changes(effect: Effect) -> tuple[float, ...]:
    """Return the relative changes of stiffness [1] that an effect makes as another spring; empty for other effects."""
    info = effect_info(effect.name)
    values = dict(zip((p.name for p in info.parameters), effect.values(), strict=True))
    sums = () if info.spring is None else info.spring.sums
    return tuple(sum(values[name] for name in names) for names in sums)


def with_tolerances(
    settings: Settings,
    robot: Robot,
    robot_file: Path | str,
    given: Mapping[str, float] = MappingProxyType({}),
) -> Settings:
    """Return settings with all tolerances of a robot.

    Later sources replace earlier ones: defaults, the robot file, an identification beside it, and ``given``.
    """
    known = identified_tolerances(robot_file, settings.model_error)
    # A given tolerance of a quantity holds for all parameters of that quantity.
    known = {n: t for n, t in known.items() if n.rsplit(".", 1)[1] not in given}
    return replace(settings, tolerances={**settings.tolerances_of(robot), **known, **given})


def loaded(
    source: Robot | Path | str, settings: Settings, sample_time_s: float
) -> tuple[Robot, Settings]:
    """Return the simulator, and settings with the tolerances in and beside its file.

    ``sample_time_s``: for a model file that states none. Raises RobotError for a floating base.
    """
    if isinstance(source, Robot):
        refuse_floating(source, "the diagnosis")
        return source, settings
    machine = load_robot(source, sample_time_s=sample_time_s)
    refuse_floating(machine, "the diagnosis")
    if settings.tolerances is not None:
        return machine, settings
    return machine, with_tolerances(settings, machine, source)


def identified_tolerances(robot_file: Path | str, model_error: float) -> dict[str, float]:
    """Return relative tolerances by name from the identification beside a robot file; empty without one.

    Standard errors contain noise but no formula error. So ``model_error``, the relative error of a perfect
    simulator, is added in squares. A value that was changed in the robot file after the identification is left
    out, and so are presets. Raises InputError for an identification that cannot be read.
    """
    path = sidecar_path(robot_file)
    if not path.is_file():
        return {}
    found = load_identified(path, check=False)
    if found.robot is None:
        return {}
    stated = robot_parameters(found.robot)
    out = {}
    for name, value, deviation in zip(
        found.names, found.values, found.standard_errors, strict=True
    ):
        same = math.isclose(stated.get(name, np.nan), value, rel_tol=_SAME)
        if same and value != 0 and np.isfinite(deviation):
            out[name] = float(np.hypot(deviation / abs(value), model_error))
    return out

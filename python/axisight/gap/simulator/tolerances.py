"""How far the simulator's own parameters may be off: by quantity, or by name from an identification."""

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
from axisight.robot_file import load_identified
from axisight.robot_file.sidecar import sidecar_path

# Robot files state values to as many digits.
_SAME = 1e-6


def tolerance_of(tolerances: Mapping[str, float], name: str) -> float | None:
    """Return the relative tolerance [1] of a parameter, its own before that of its quantity.

    None: it is taken as exact.
    """
    return tolerances.get(name, tolerances.get(name.rsplit(".", 1)[1]))


def spring_changes(effect: Effect) -> tuple[float, ...]:
    """Return by what shares of its stiffness [1] a law makes a gear another spring; none of others."""
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

    The defaults, then what its file states, what an identification beside the file says of single
    parameters, and what is ``given``, each before the one before.
    """
    known = identified_tolerances(robot_file, settings.model_error)
    # One given for a quantity is meant for all parameters of it.
    known = {n: t for n, t in known.items() if n.rsplit(".", 1)[1] not in given}
    return replace(settings, tolerances={**settings.tolerances_of(robot), **known, **given})


def loaded(
    source: Robot | Path | str, settings: Settings, sample_time_s: float
) -> tuple[Robot, Settings]:
    """Return the simulator and settings with the tolerances that stand in and beside its file.

    ``sample_time_s``: of a model file that states none.
    """
    if isinstance(source, Robot):
        return source, settings
    machine = load_robot(source, sample_time_s=sample_time_s)
    if settings.tolerances is not None:
        return machine, settings
    return machine, with_tolerances(settings, machine, source)


def identified_tolerances(robot_file: Path | str, model_error: float) -> dict[str, float]:
    """Return relative tolerances by name from the identification beside a robot file.

    Standard errors know of noise and not of the errors of formulas: ``model_error``, the relative
    error of a perfect simulator, is added in squares. They belong to the values that were
    identified: one that was changed in the file since is left out. Empty where there is no
    identification, or for a preset. Raises InputError for one that cannot be read.
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

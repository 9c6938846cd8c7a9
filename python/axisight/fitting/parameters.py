"""Parameters of a fit: robot parameters and effect parameters with bounds and priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from axisight.arguments import did_you_mean
from axisight.display.summary import summarized
from axisight.effects import Effect, effect_info
from axisight.errors import InputError
from axisight.robot import Robot


@summarized
@dataclass(frozen=True)
class Parameter:
    """One number to fit.

    Without ``effect``, ``name`` is a robot parameter (``axis1.stiffness``; see `robot_parameters`).
    Otherwise ``effect`` is the position of an effect in the list of effects, and ``name`` one of its
    parameters. ``scale`` is the natural size of a change, ``prior`` a mean and a standard deviation,
    all in the unit of the parameter. ``frozen`` keeps it at ``initial``. ``nuisance`` marks a
    parameter whose sensitivity is computed once and refreshed at the end.

    ``logarithmic`` says whether the logarithm is searched, which needs ``lower`` above zero. It finds
    stiffnesses, dampings and inertias from starts that are wrong by a factor of two. ``None`` leaves the
    choice to the fit: `axisight.fit` searches the logarithm of every robot parameter that has a ``lower``
    above zero and no prior.
    """

    name: str
    initial: float
    lower: float
    upper: float
    scale: float
    effect: int | None = None
    prior: tuple[float, float] | None = None
    frozen: bool = False
    nuisance: bool = False
    logarithmic: bool | None = None


@dataclass(frozen=True)
class Spec:
    """A parameter in the form of the compiled core."""

    robot: str | None
    effect: tuple[int, int] | None
    initial: float
    lower: float
    upper: float
    scale: float
    prior: tuple[float, float] | None
    frozen: bool
    nuisance: bool
    amplitude: int | None
    logarithmic: bool


PRIOR_REACH = 4.0
"""Bounds of a parameter with a tolerance, in standard deviations of its prior."""


def robot_parameters(robot: Robot) -> dict[str, float]:
    """Return the names and values of all physical parameters of a robot."""
    return robot.parameters()


def robot_parameter(
    robot: Robot, name: str, *, relative_tolerance: float | None = None, nuisance: bool = False
) -> Parameter:
    """Return a robot parameter at its nominal value, free or within a tolerance.

    ``relative_tolerance``, relative to the value, becomes the standard deviation of a prior, with
    bounds at four standard deviations. ``nuisance`` is that of `Parameter`. Raises InputError for an
    unknown name.
    """
    known = robot_parameters(robot)
    if name not in known:
        raise InputError(
            f"parameter {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}"
        )
    nominal = known[name]
    size = abs(nominal) if nominal else 1.0
    signed = name.rsplit(".", 1)[1].startswith("com_")
    if relative_tolerance is None:
        lower = -10 * size if signed else 1e-6 * size
        return Parameter(name, nominal, lower, max(100 * size, lower), size, nuisance=nuisance)
    spread = relative_tolerance * size
    reach = PRIOR_REACH * spread
    lower = nominal - reach if signed else max(nominal - reach, 1e-6 * size)
    return Parameter(
        name,
        nominal,
        lower,
        nominal + reach,
        spread,
        prior=(nominal, spread),
        nuisance=nuisance,
    )


def effect_parameter(effects: Sequence[Effect], index: int, name: str) -> Parameter:
    """Return the parameter ``name`` of ``effects[index]``, at its present value and with its bounds.

    Raises InputError for an unknown name.
    """
    info = {p.name: p for p in effect_info(effects[index].name).parameters}
    if name not in info:
        raise InputError(
            f"effect {effects[index].name!r}: parameter {name!r}: expected {', '.join(info)}"
            f"{did_you_mean(name, info)}"
        )
    p = info[name]
    initial = (effects[index].parameters or {}).get(name, p.neutral)
    return Parameter(name, initial, p.lower, p.upper, p.typical, effect=index)


def core_spec(parameter: Parameter, effects: Sequence[Effect]) -> Spec:
    """Return a parameter in the form of the compiled core."""
    place = None
    if parameter.effect is not None:
        names = [p.name for p in effect_info(effects[parameter.effect].name).parameters]
        place = (parameter.effect, names.index(parameter.name))
    return Spec(
        robot=parameter.name if parameter.effect is None else None,
        effect=place,
        initial=parameter.initial,
        lower=parameter.lower,
        upper=parameter.upper,
        scale=parameter.scale,
        prior=parameter.prior,
        frozen=parameter.frozen,
        nuisance=parameter.nuisance,
        logarithmic=bool(parameter.logarithmic),
        amplitude=None
        if parameter.effect is None
        else _amplitude(effects[parameter.effect], parameter.name),
    )


def with_search(parameter: Parameter) -> Parameter:
    """Return the parameter with its choice of ``logarithmic`` made."""
    if parameter.logarithmic is not None:
        return parameter
    free = parameter.effect is None and parameter.prior is None
    return replace(parameter, logarithmic=free and parameter.lower > 0)


def _amplitude(effect: Effect, name: str) -> int | None:
    """Return the position of the effect's only amplitude if ``name`` is a shape, else None."""
    table = effect_info(effect.name).parameters
    sizes = [i for i, p in enumerate(table) if p.role == "amplitude"]
    shape = any(p.name == name and p.role == "shape" for p in table)
    # Only an amplitude that is neutral at zero is a factor of the effect.
    return sizes[0] if shape and len(sizes) == 1 and table[sizes[0]].neutral == 0 else None

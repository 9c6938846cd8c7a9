"""Shared parts of commands that simulate a robot: load it, add effects, and print which effects act."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from axisight.arguments import nearest
from axisight.cli.common import numbers, say
from axisight.cli.model_options import AS_IT_IS, ModelOptions
from axisight.cli.panels import SIMULATOR
from axisight.effects import Effect, effect_info, effect_table
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot.axis_names import axis_number
from axisight.robot_file import refuse_effects_beside
from axisight.robot_import import is_model_file

GivenEffects = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        metavar="EFFECT",
        rich_help_panel=SIMULATOR,
        help="Add an effect to the simulator (repeatable), e.g. 'coulomb_friction@2 coulomb_nm=0.4'. "
        "AXIS is a number or a joint name, two as @5,6; leave it out for the whole arm. "
        "It replaces an effect of the same name and axis.",
    ),
]


def load_simulator(
    source: Path | str,
    given: Sequence[GivenEffect] = (),
    *,
    options: ModelOptions = AS_IT_IS,
    sample_time_s: float | None = None,
) -> Robot:
    """Return the robot of a source with the ``given`` effects, and print which of its own effects act.

    ``options`` are those of `ModelOptions.load`; ``sample_time_s`` [s] is as in `axisight.load_robot`.
    Raises InputError as `say_effects`, and for a given effect that the robot cannot have.
    """
    robot = options.load(source, sample_time_s=sample_time_s)
    if is_model_file(source):
        say_import(robot)
    effects = effects_on(robot, given)
    say_effects(robot, source, effects)
    return with_given(robot, effects)


def say_import(robot: Robot) -> None:
    """Print the notes on a robot from a model file, which are the head comments of its text."""
    for line in robot.toml.splitlines():
        if not line.startswith("# "):
            break
        say(line.removeprefix("# "))


def with_given(robot: Robot, given: Sequence[Effect]) -> Robot:
    """Return the robot with ``given`` effects in place of its own of the same name and axis.

    Raises InputError for an effect that the robot cannot have.
    """
    if not given:
        return robot
    replaced = {effect.label for effect in given}
    own = [effect for effect in robot.effects if effect.label not in replaced]
    try:
        return robot.with_effects([*own, *given])
    except InputError as error:
        raise InputError(f"--effect: {error}") from None


def say_effects(robot: Robot, source: Path | str, given: Iterable[Effect] = ()) -> None:
    """Print the robot's own effects that act, except those that ``given`` effects replace, and its remainder.

    Raises InputError as `refuse_effects_beside`.
    """
    refuse_effects_beside(source, robot)
    replaced = {effect.label for effect in given}
    acting = [e.label for e in robot.effects if e.acts and e.label not in replaced]
    if acting:
        say(f"with the effects of {source}: {', '.join(acting)}")
    if robot.remainder is not None:
        say(f"with the remainder of {source}: {len(robot.remainder.terms)} terms")


@dataclass(frozen=True)
class GivenEffect:
    """An effect from the command line, whose axes are still text: numbers or joint names.

    ``text`` is the value of the ``option``.
    """

    option: str
    text: str
    name: str
    axes: tuple[str, ...]
    parameters: Mapping[str, float]

    def on(self, robot: Robot) -> Effect:
        """Return the effect on the axes of a robot; raise InputError quoting option and text."""
        try:
            numbered = [axis_of(axis, robot) for axis in self.axes]
            if len(numbered) == 2:
                return Effect(self.name, None, self.parameters, (numbered[0], numbered[1]))
            return Effect(self.name, numbered[0] if numbered else None, self.parameters)
        except InputError as error:
            raise InputError(f"{self.option} {self.text!r}: {error}") from None


def axis_of(text: str, robot: Robot, field: str = "axis") -> int:
    """Return the number (from 1) of an axis from text, a number or a joint name; errors as `axis_number`."""
    number = text.isdecimal() and text not in robot.axis_names
    return axis_number(int(text) if number else text, robot.axis_names, field)


def effects_on(robot: Robot, given: Iterable[GivenEffect]) -> list[Effect]:
    """Return effects on the axes of a robot; raise InputError as `GivenEffect.on`, and for a repeated one."""
    found: dict[str, Effect] = {}
    for one in given:
        effect = one.on(robot)
        if effect.label in found:
            raise InputError(
                f"{one.option} {one.text!r}: expected {effect.label} once, got it twice"
            )
        found[effect.label] = effect
    return list(found.values())


def parse_effects(texts: Sequence[str] | None) -> list[GivenEffect]:
    """Return the effects of a repeated ``--effect``; raise InputError as `parse_effect`."""
    return [parse_effect(text) for text in texts or []]


def parse_effect(text: str, option: str = "--effect") -> GivenEffect:
    """Return the effect of a text ``NAME@AXIS PARAM=VALUE ...``, with its axes still as text.

    Axis and parameters may be left out; ``NAME@AXIS:PARAM=VALUE,...`` is accepted too. Raises
    InputError quoting ``option`` and ``text``.
    """
    head, *rest = re.split(r"[:\s]+", re.sub(r"\s*=\s*", "=", text.strip()), maxsplit=1)
    name, at, place = head.partition("@")
    axes = tuple(place.split(",")) if at else ()
    quoted = f"{option} {text!r}"
    if not all(axes) or len(axes) > 2:
        raise InputError(f"{quoted}: expected one axis or two after @, got {place!r}")
    _check_name(name, quoted)
    parameters: dict[str, float] = {}
    for item in re.split(r"[,\s]+", rest[0]) if rest and rest[0] else []:
        key, equals, value = item.partition("=")
        if not equals:
            raise InputError(f"{quoted}: expected PARAM=VALUE, got {item!r}")
        if key in parameters:
            raise InputError(f"{quoted}: expected {key} once, got it twice")
        _check_parameter(name, key, quoted)
        (parameters[key],) = numbers(f"{quoted}: {key}", value)
    return GivenEffect(option, text, name, axes, parameters)


def _check_name(name: str, quoted: str) -> None:
    """Raise InputError, with the nearest name, for an unknown effect."""
    if name in effect_table():
        return
    near = nearest(name, effect_table())
    meant = "" if near is None else f" Did you mean {near!r}?"
    raise InputError(f"{quoted}: unknown effect {name!r}.{meant} 'axisight effects' lists all.")


def _check_parameter(effect: str, key: str, quoted: str) -> None:
    """Raise InputError, with the nearest name, for a parameter that the effect does not have."""
    known = [p.name for p in effect_info(effect).parameters]
    if key in known:
        return
    near = nearest(key, known)
    meant = "" if near is None else f" Did you mean {near!r}?"
    raise InputError(
        f"{quoted}: unknown parameter {key!r}.{meant} {effect} has {', '.join(known)}."
    )

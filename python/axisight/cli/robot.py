"""What commands that simulate a robot share: its effects, its own and those given; a line says so."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import numbers, say
from axisight.cli.model_options import AS_IT_IS, ModelOptions
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot_file import refuse_effects_beside
from axisight.robot_import import is_model_file

GivenEffects = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        metavar="'NAME@AXIS PARAM=VALUE ...'",
        help="Effect that the simulator has too (repeatable), e.g. 'coulomb_friction@2 "
        "coulomb_nm=0.4'; the whole arm without @AXIS, two axes as @5,6, neutral values for "
        "parameters left out. It takes the place of one of the robot of that name and axis.",
    ),
]


def load_simulator(
    source: Path | str,
    given: Sequence[Effect] = (),
    *,
    options: ModelOptions = AS_IT_IS,
    sample_time_s: float | None = None,
) -> Robot:
    """Return the robot to simulate with the ``given`` effects, and say which of its own act.

    ``options`` as in `ModelOptions.load`, ``sample_time_s`` as in `axisight.load_robot`.
    Raises InputError as `say_effects`, and for a given effect that the robot cannot have.
    """
    robot = options.load(source, sample_time_s=sample_time_s)
    if is_model_file(source):
        say_import(robot)
    say_effects(robot, source, given)
    return with_given(robot, given)


def say_import(robot: Robot) -> None:
    """Print what is to be said of a robot out of a model file: the notes at the head of its text."""
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
    """Print which effects a robot has, but for those that ``given`` ones replace.

    Raises InputError as `refuse_effects_beside`.
    """
    refuse_effects_beside(source, robot)
    replaced = {effect.label for effect in given}
    acting = [e.label for e in robot.effects if e.acts and e.label not in replaced]
    if acting:
        say(f"with the effects of {source}: {', '.join(acting)}")


def parse_effects(texts: Sequence[str] | None) -> list[Effect]:
    """Return the effects of a repeated ``--effect``; raises InputError as `parse_effect`.

    The same effect twice at one place is refused too.
    """
    found: dict[str, Effect] = {}
    for text in texts or []:
        effect = parse_effect(text)
        if effect.label in found:
            raise InputError(f"--effect {text!r}: expected {effect.label} once, got it twice")
        found[effect.label] = effect
    return list(found.values())


def parse_effect(text: str, option: str = "--effect") -> Effect:
    """Return the effect that ``NAME@AXIS PARAM=VALUE ...`` describes.

    Axis and parameters may be left out; ``NAME@AXIS:PARAM=VALUE,...`` is read too. Raises
    InputError quoting ``option`` and ``text``.
    """
    head, *rest = re.split(r"[:\s]+", re.sub(r"\s*=\s*", "=", text.strip()), maxsplit=1)
    name, at, place = head.partition("@")
    axes = place.split(",") if at else []
    if not all(axis.isdecimal() for axis in axes) or len(axes) > 2:
        raise InputError(f"{option} {text!r}: expected an axis number after @, got {place!r}")
    numbered = [int(axis) for axis in axes]
    parameters: dict[str, float] = {}
    for item in re.split(r"[,\s]+", rest[0]) if rest and rest[0] else []:
        key, equals, value = item.partition("=")
        if not equals:
            raise InputError(f"{option} {text!r}: expected PARAM=VALUE, got {item!r}")
        if key in parameters:
            raise InputError(f"{option} {text!r}: expected {key} once, got it twice")
        (parameters[key],) = numbers(f"{option} {text!r}: {key}", value)
    try:
        if len(numbered) == 2:
            return Effect(name, None, parameters, (numbered[0], numbered[1]))
        return Effect(name, numbered[0] if numbered else None, parameters)
    except InputError as error:
        raise InputError(f"{option} {text!r}: {error}") from None

"""The design of a study as self-contained text, for workers and stores."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import short, shown
from axisight.documents import parse_json
from axisight.effects import Effect, core_effects
from axisight.errors import InputError, StudyError
from axisight.montecarlo.study import Study
from axisight.robot import Robot, load_robot
from axisight.robot.axis_names import axis_number, effect_on
from axisight.robot.stated_remainder import refuse_remainder
from axisight.simulation import Integrator

Arrays = dict[str, NDArray[Any]]
"""The accumulators of a block by name; see ``_core.MonteCarloStudy.block``."""

Task = tuple[int, int]
"""First run and number of runs of a block."""


def freeze(study: Study) -> str:
    """Return the design as self-contained canonical JSON, including the robot's text with its effects.

    Seed, number of runs and fields that only affect the reading of results (name, quantiles) are not
    part of it.
    """
    robot = load_robot(study.robot)
    design = study.model_dump(by_alias=True, mode="json", exclude={"seed", "runs", "name", "robot"})
    design["statistics"].pop("quantiles")
    for entry in design["effect"]:
        try:
            (effect,) = robot.placed([Effect(**entry)])
        except InputError as error:
            raise StudyError(str(error)) from None
        entry |= {"axis": effect.axis, "axes": None if effect.axes is None else list(effect.axes)}
    design["robot"] = {"toml": robot.toml}
    design["axisight_version"] = version("axisight")
    return json.dumps(design, sort_keys=True)


def digest(design: str) -> str:
    """Return the SHA-256 of a design."""
    return hashlib.sha256(design.encode()).hexdigest()


def settings_of(design: str) -> dict[str, Any]:
    """Return the settings in a design; raises StudyError for text that is not a JSON object."""
    try:
        found = parse_json(design)
    except (TypeError, ValueError) as error:
        raise StudyError(f"design: expected JSON: {short(str(error), 200)}") from None
    if not isinstance(found, dict):
        raise StudyError(f"design: expected an object, got {type(found).__name__}")
    return found


@lru_cache(maxsize=8)
def core_study(design: str) -> _core.MonteCarloStudy:
    """Return the checked study of a design; raises StudyError naming the field."""
    d = settings_of(design)
    try:
        multisine, square = d["excitation"]["multisine"], d["excitation"]["square"]
        directions = d["excitation"]["directions"]
        named = isinstance(directions, str)
        plant, measurement = d["plant"], d["measurement"]
        robot = Robot.from_toml(d["robot"]["toml"]).with_parameters(d["robot_parameters"])
        refuse_remainder(robot.remainder, "a study")
        return _core.MonteCarloStudy(
            robot.core,
            core_effects(_effects(d, robot)),
            model=plant["model"],
            integrator=Integrator(plant["method"], plant["tolerance"], plant["substeps"]),
            start=plant["start_rad"],
            period_s=multisine["period_s"],
            band_hz=tuple(multisine["band_hz"]),
            grid=multisine["grid"],
            peak_rad_s=multisine["peak_rad_s"],
            clipping_iterations=multisine["clipping_iterations"],
            square=None
            if square is None
            else (square["amplitude_rad_s"], square["period_s"], square["smoothing_samples"]),
            directions=directions if named else "",
            direction_matrix=None if named else [float(v) for row in directions for v in row],
            waiting_periods=measurement["waiting_periods"],
            periods=measurement["periods"],
            noise=measurement["noise"],
            noise_cutoff_hz=measurement["noise_cutoff_hz"],
            resolution=measurement["position_resolution_rad"],
            output=measurement["output"],
            spread=[
                (_numbered(s["parameter"], robot), s["distribution"], s["relative"], s["absolute"])
                for s in d["spread"]
            ],
            relative_accuracy=d["statistics"]["relative_accuracy"],
        )
    except StudyError:
        raise
    except InputError as error:
        raise StudyError(str(error)) from None
    # An edited design can lack any field, or have any type in it.
    except (AttributeError, LookupError, OverflowError, TypeError, ValueError) as error:
        raise StudyError(
            f"design: expected what a study is frozen to: {short(repr(error))}"
        ) from error


def _effects(design: Mapping[str, Any], robot: Robot) -> list[Effect]:
    """Return the effects of a study, and the robot's own effects that it spreads."""
    given = [effect_on(Effect(**entry), robot.axis_names) for entry in design["effect"]]
    labels = {effect.label for effect in given}
    spread = {_numbered(entry["parameter"], robot).rpartition(".")[0] for entry in design["spread"]}
    own = [e for e in robot.effects if e.label in spread - labels]
    return [*own, *given]


def _numbered(parameter: str, robot: Robot) -> str:
    """Return the name of a spread parameter with axis numbers in place of joint names.

    Raises InputError, with the nearest name, for a joint that the robot does not have.
    """
    label, _, name = parameter.rpartition(".")
    effect, at, axes = label.partition("@")
    if not at:
        return parameter
    field = f"spread {parameter!r}: axis"
    numbers = [
        axis if axis.isdigit() else str(axis_number(axis, robot.axis_names, field))
        for axis in axes.split(",")
    ]
    return f"{effect}@{','.join(numbers)}.{name}"


def compute_block(
    design: str, seed: int, first: int, count: int, cancel: _core.CancelToken | None = None
) -> Arrays | None:
    """Return the accumulators of runs ``first`` to ``first + count - 1``; None when cancelled.

    It is a pure function of its arguments, so it can run here, in a thread, or on a remote worker.
    """
    settings = settings_of(design)
    here = version("axisight")
    if (expected := settings.get("axisight_version")) != here:
        raise StudyError(f"axisight_version: expected {shown(expected)}, got {here} on a worker")
    keep = settings["statistics"]["keep_responses"]
    out = core_study(design).block(seed, first, count, keep_responses=keep, cancel=cancel)
    return None if out is None else {name: np.asarray(value) for name, value in out.items()}


def differences(stored: object, wanted: object, where: str = "") -> list[str]:
    """Return the differences of two designs, as ``field: expected A (as stored), got B``."""
    if isinstance(stored, dict) and isinstance(wanted, dict):
        out = []
        for key in sorted(stored.keys() | wanted.keys()):
            path = f"{where}.{key}" if where else key
            out += differences(stored.get(key), wanted.get(key), path)
        return out
    if stored == wanted:
        return []
    if isinstance(stored, str) and "\n" in stored:
        return [f"{where}: expected the text stored, got another"]
    return [f"{where}: expected {stored!r} (as stored), got {wanted!r}"]

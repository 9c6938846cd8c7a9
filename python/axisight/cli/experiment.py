"""Options of the command line for the experiment that a diagnosis designs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from axisight.cli.common import numbers, one_or_each
from axisight.cli.robot import parse_effect
from axisight.errors import InputError
from axisight.gap import ExperimentLimits
from axisight.gap.separate.asked import LIMITS, Asked
from axisight.robot import Robot


def asked_experiment(
    folder: Path | None,
    to_show: str | None,
    velocity_limit: str | None,
    travel_limit: str | None,
    torque_limit: str | None,
    acceleration_limit: str | None,
    room: str | None,
) -> Callable[[Robot], Asked] | None:
    """Return a function from a robot to the requested experiment; None without ``--next-experiment``.

    Raises InputError, naming the option, for options of an experiment without ``--next-experiment``, for an
    unknown effect, and for text that is not a number.
    """
    options = {
        "--to-show": to_show,
        "--velocity-limit": velocity_limit,
        "--travel-limit": travel_limit,
        "--torque-limit": torque_limit,
        "--acceleration-limit": acceleration_limit,
        "--room": room,
    }
    if folder is None:
        for option, given in options.items():
            if given is not None:
                raise InputError(f"{option}: expected --next-experiment FOLDER beside it, got none")
        return None
    limits = ExperimentLimits(
        velocity_rad_s=one_or_each("--velocity-limit", velocity_limit),
        travel_rad=one_or_each("--travel-limit", travel_limit),
        torque_nm=one_or_each("--torque-limit", torque_limit),
        acceleration_rad_s2=one_or_each("--acceleration-limit", acceleration_limit),
        room_m=None if room is None else numbers("--room", room),
    )
    if to_show is None or to_show == LIMITS:
        return lambda _robot: Asked(to_show, limits)
    effect = parse_effect(to_show, "--to-show")
    return lambda robot: Asked(effect.on(robot), limits)

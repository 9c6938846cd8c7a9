"""Step 2: elastic parameters from the frequency responses, from starts that it finds itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from axisight.display.summary import summarized
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.frequency_fit import (
    FrequencyFit,
    FrequencyFitOptions,
    MeasuredResponse,
    fit_responses,
)
from axisight.frequency_fit.options import Criterion
from axisight.frequency_fit.result import STATUS_ADVICE
from axisight.graybox.multiaxis.operating_points import OperatingPoint
from axisight.robot import Robot

QUANTITIES = ("stiffness", "damping", "motor_inertia", "mass", "inertia_scale")
"""Quantities that a response determines and a slow motion hardly."""
STARTS = 6
"""Random starts, within a factor of two of the robot's values, beside the two that are not random."""
_DAMPING_RATIO = 0.03
"""Damping ratio of a robot joint at the start of the search."""
_ABOVE_THE_GEARS = 1.5
"""Start of the frequencies of links, relative to the middle one of the gears."""


@summarized
@dataclass(frozen=True)
class ElasticStep:
    """Result of step 2.

    ``points`` are the operating points, ``fit`` is the best fit to their responses (None without responses),
    ``robot`` has its values except for friction, and ``start`` says where the best search began. ``others`` are
    robots from which step 3 may start again, if it ends at a wrong minimum.
    """

    points: tuple[OperatingPoint, ...]
    fit: FrequencyFit | None
    robot: Robot
    start: str
    others: tuple[Robot, ...]
    findings: tuple[str, ...]


def elastic_step(
    robot: Robot, points: Sequence[OperatingPoint], names: Sequence[str], *, seed: int
) -> ElasticStep:
    """Return the elastic parameters among ``names`` from responses at all points together.

    The search begins at the robot's values, at values read off the responses, and at random values around the
    robot's; the least loss wins. Viscous friction is searched too, as dry friction looks viscous in a
    response, and is not kept.
    """
    wanted = [name for name in names if name.rpartition(".")[2] in QUANTITIES]
    if not wanted or not points:
        return ElasticStep(tuple(points), None, robot, "none", (), ())
    responses = [point.response for point in points]
    linear = [e for e in robot.effects if effect_info(e.name).linear == "parameters"]
    model = robot.with_effects(linear)
    own = robot.parameters()
    searched = {name: _positive(own[name]) for name in wanted}
    drag = {f"{joint}.viscous_friction": 0.0 for joint in robot.axis_names}
    drag = {name: _positive(own[name]) for name in drag}
    weighted = all(r.variance is not None for r in responses)
    criterion: Criterion = "weighted_log_least_squares" if weighted else "log_least_squares"

    def search(start: Mapping[str, float], starts: int) -> FrequencyFit:
        options = FrequencyFitOptions(
            criterion=criterion, starts=starts, start_spread=1.0, seed=seed
        )
        return fit_responses(model, responses, {**start, **drag}, options=options)

    found = {"the robot's values, or random ones around": search(searched, 1 + STARTS)}
    # If the arm has no equilibrium at the values that were read off, the other starts are left.
    with suppress(InputError):
        found["the responses"] = search(read_off(robot, responses, searched), 1)
    ranked = sorted(found.items(), key=lambda pair: pair[1].loss)
    start, fit = ranked[0]

    def with_values(one: FrequencyFit) -> Robot:
        pairs = zip(one.names, one.values.tolist(), strict=True)
        return robot.with_parameters({n: v for n, v in pairs if n not in drag})

    # Step 2 gives starts: only a search that did not end puts them in doubt.
    findings = [f"step 2: {STATUS_ADVICE[fit.status]}"] if fit.status in STATUS_ADVICE else []
    return ElasticStep(
        points=tuple(points),
        fit=fit,
        robot=with_values(fit),
        start=start,
        others=(*(with_values(one) for _, one in ranked[1:]), robot),
        findings=tuple(findings),
    )


def _positive(value: float) -> float:
    return value if value > 0 else 1e-3


def read_off(
    robot: Robot, responses: Sequence[MeasuredResponse], start: Mapping[str, float]
) -> dict[str, float]:
    """Return a start with values read off the responses, over (9.13).

    The motor inertia is one over the gain at the highest lines. A gear's stiffness is the inertia of the arm
    about the joint times the squared frequency of the notch. The links begin above the gears. Parameters of
    other kinds keep their ``start``.
    """
    first = responses[0]
    order = np.argsort(first.frequency_hz)
    frequency, gain = first.frequency_hz[order], np.abs(first.response[order])
    highest = slice(-max(1, len(order) // 10), None)
    equilibrium = robot.equilibrium(list(first.joint_angle_rad))["joint_angle_rad"].values
    inertia = np.diag(robot.inertia_matrix(equilibrium))
    notch = {
        joint: 2 * np.pi * frequency[np.argmin(gain[:, i, i])]
        for i, joint in enumerate(robot.axis_names)
    }
    above = _ABOVE_THE_GEARS * float(np.median(list(notch.values())))
    out = dict(start)
    for i, joint in enumerate(robot.axis_names):
        if f"{joint}.motor_inertia" in out:
            out[f"{joint}.motor_inertia"] = float(1 / np.median(gain[highest, i, i]))
    for joint, about in zip(robot.joint_names, inertia, strict=True):
        speed = notch.get(joint, above)
        if f"{joint}.stiffness" in out:
            out[f"{joint}.stiffness"] = float(about * speed**2)
        if f"{joint}.damping" in out:
            out[f"{joint}.damping"] = float(2 * _DAMPING_RATIO * about * speed)
    return out

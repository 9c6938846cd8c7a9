"""A fit to frequency responses as values of a robot file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight import _core
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fitting import robot_parameters
from axisight.frequency_fit.result import FrequencyFit
from axisight.robot import Robot
from axisight.robot_file import Identified, Provenance
from axisight.robot_file.document import render
from axisight.robot_file.values import noted, values_of


def identified_responses(
    fit: FrequencyFit, provenance: Provenance, *, effects: Sequence[Effect] = ()
) -> Identified:
    """Return the result of :func:`fit_responses` for `axisight.robot_file.write_identified`.

    Names, linear units and covariance are those of the fit. A parameter frozen at another value than
    that of the robot's file is written at its frozen value, with standard error zero. The notes name
    such parameters, the warnings of the fit, and a search that did not converge.

    fit
        The fit. Writing it over the file of its robot gives ``fit.robot``.
    provenance
        Source of the values.
    effects
        The effects given to :func:`fit_responses`. Without them the robot's own effects stay.

    Standard errors are unknown if the covariance is not finite, that is, if the data do not tell some
    parameters apart. Raises InputError for another type, and for a robot whose inertias differ from
    those of its file, because of a frozen ``inertia_scale`` or a change before the fit.
    """
    if not isinstance(fit, FrequencyFit):
        raise InputError(f"fit: expected a FrequencyFit, got {type(fit).__name__}")
    # A robot with changed parameters keeps the text of its file.
    source = Robot.from_toml(fit.robot.toml)
    before, after = robot_parameters(source), robot_parameters(fit.robot)
    held = {n: v for n, v in after.items() if n not in fit.names and v != before[n]}
    notes = [f"held in the fit: {', '.join(held)}"] if held else []
    values = dict(zip(fit.names, fit.values.tolist(), strict=True)) | held
    jacobian = np.eye(len(values), len(fit.names))
    found = values_of(
        values,
        jacobian,
        fit.covariance,
        noted(provenance, [*notes, f"search: {fit.status}", *fit.warnings]),
        effects=effects,
    )
    written = Robot.from_toml(render(source, found, ""))
    links, wanted = _core.inertial_parameters(fit.robot.core)
    rounding = 1e-9 * np.abs(wanted).max(initial=0.0)
    if not np.allclose(
        _core.inertial_parameters(written.core)[1], wanted, rtol=1e-9, atol=rounding
    ):
        names = [source.joint_names[i] for i in links]
        raise InputError(
            "fit: expected a robot with the inertias of its file, got others in one of "
            f"{', '.join(names)}: fit from the robot of a file, with inertia_scale free or 1"
        )
    return found

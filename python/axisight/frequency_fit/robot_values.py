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
    """Return what :func:`fit_responses` found, for `axisight.robot_file.write_identified`.

    Names, units and covariance are those of the fit already (linear units, also where the
    search was over logarithms). Parameters that were frozen at other values than those in the
    robot's file are written with them, standard error zero, and named in the notes. So are the
    warnings of the fit and a search that did not converge.

    fit
        Written over the robot that it was made from, it gives ``fit.robot``.
    provenance
        Where the values come from.
    effects
        Those given to :func:`fit_responses`; the robot's own are kept without.

    A covariance that is not finite (data that do not tell some parameters apart) leaves standard
    errors unknown. Raises InputError for another type, and for a robot whose inertias are not
    those of its file: they were changed by a frozen ``inertia_scale``, or before the fit.
    """
    if not isinstance(fit, FrequencyFit):
        raise InputError(f"fit: expected a FrequencyFit, got {type(fit).__name__}")
    # A robot with changed parameters keeps the text it came from.
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

"""Figures 8.2 and 8.4 to 8.8."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.frf.errors import relative_error
from axisight_thesis.chapter8_robot import weakly_coupled
from axisight_thesis.chapter8_setting import Design, excited_lines, square_lines
from axisight_thesis.chapter8_sinusoid import MULTISINE, SINUSOID
from axisight_thesis.chapter8_study import Experiments, experiments, true_response
from axisight_thesis.chapter8_tables import realizations
from axisight_thesis.context import Context
from axisight_thesis.element_plot import (
    ESTIMATE,
    FAINT,
    MARKED,
    MEAN,
    SINGLE,
    TRUE,
    Curve,
    element_figure,
    element_table,
)
from axisight_thesis.item import Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ERROR = "relative error [1]"
ERROR_RANGE = (1e-4, 1e2)
ACCELERATION = "|G| [rad/s$^2$/Nm]"

# Figures 8.4 to 8.7.
ERROR_FIGURES = {
    "8.4": Design("T1", square=False),
    "8.5": Design("T2", square=False),
    "8.6": Design("T1", square=True),
    "8.7": Design("T2", square=True),
}


@item("figure-8.2")
def figure_8_2(context: Context) -> Item:
    """Return Bode plots of the responses from torque to velocity and to acceleration."""
    frequency = np.geomspace(1.0, 100.0, 600)
    acceleration = true_response(context, frequency)
    velocity = acceleration / (2j * np.pi * frequency[:, None, None])
    magnitudes = [np.abs(velocity), np.abs(acceleration)]
    phase = np.degrees(np.unwrap(np.angle(velocity), axis=0))
    phases = [phase, phase + 90.0]
    labels = ("torque to velocity [rad/s/Nm]", "torque to acceleration [rad/s$^2$/Nm]")
    styles: tuple[dict[str, object], ...] = (ESTIMATE | {"lw": 0.9}, TRUE)

    def curves(values: list[Real]) -> list[Curve]:
        parts = zip(values, labels, styles, strict=True)
        return [Curve(frequency, v, label, style) for v, label, style in parts]

    table = element_table(
        velocity=(frequency, magnitudes[0]),
        acceleration=(frequency, magnitudes[1]),
        velocity_phase_deg=(frequency, phases[0]),
        acceleration_phase_deg=(frequency, phases[1]),
    )
    figures = {
        "": element_figure(curves(magnitudes), "|G|"),
        "phase": element_figure(curves(phases), "phase [deg]", log=False, every=180.0),
    }
    return Item("figure-8.2", "Bode plots of the robot", {"": table}, figures)


def error_item(name: str, design: Design, found: list[Experiments], true: Complex) -> Item:
    """Return the relative error of one realization, and its mean over the realizations ``found``.

    Marks show the lines that the square wave excites too.
    """
    frequency = found[0].frequency_hz
    errors = np.array([np.abs(relative_error(f.estimate, true)) for f in found])
    mean = errors.mean(axis=0)
    curves = [Curve(frequency, errors[0], "one realization", FAINT)]
    name_of_mean = f"mean of {len(found)}"
    if len(found) == 1:  # the mean would be the same curve
        curves, name_of_mean = [], "one realization"
    if design.square:
        at = square_lines(excited_lines())
        curves.append(Curve(frequency[~at], mean[~at], name_of_mean, MEAN))
        curves.append(Curve(frequency[at], mean[at], "lines of the square wave", MARKED))
    else:
        curves.append(Curve(frequency, mean, name_of_mean, MEAN))
    table = element_table(error=(frequency, errors[0]), mean_error=(frequency, mean))
    title = f"Relative error of the MFRF estimate, {design}"
    return Item(name, title, {"": table}, {"": element_figure(curves, ERROR, ylim=ERROR_RANGE)})


def _register_errors(number: str, design: Design) -> None:
    @item(f"figure-{number}")
    def figure(context: Context) -> Item:
        runs = [experiments(context, design, run) for run in range(realizations(context))]
        true = true_response(context, runs[0].frequency_hz)
        return error_item(f"figure-{number}", design, runs, true)


for _number, _design in ERROR_FIGURES.items():
    _register_errors(_number, _design)


@item("figure-8.8")
def figure_8_8(context: Context) -> Item:
    """Return the estimates of a sinusoid and a multisine beside the truth."""
    robot = weakly_coupled(context)
    multisine, single = experiments(robot, MULTISINE), experiments(robot, SINUSOID)
    frequency = multisine.frequency_hz
    true = np.abs(true_response(robot, frequency))
    estimate = np.abs(multisine.estimate)
    sinusoid = np.abs(single.estimate)
    curves = [
        Curve(frequency, true, "true", TRUE),
        Curve(frequency, estimate, "multisine", ESTIMATE),
        Curve(single.frequency_hz, sinusoid, "single sinusoid", SINGLE),
    ]
    table = element_table(
        true=(frequency, true),
        multisine=(frequency, estimate),
        sinusoid=(single.frequency_hz, sinusoid),
    )
    figure = element_figure(curves, ACCELERATION)
    return Item("figure-8.8", f"MFRF estimates, {MULTISINE}", {"": table}, {"": figure})

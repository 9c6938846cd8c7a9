"""Figures 9.2 and 9.3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from axisight.graybox.collocated import collocated
from axisight.palette import AFTER, BEFORE
from axisight_thesis.chapter9_machine import GEAR_RATIO, M3, chain
from axisight_thesis.chapter9_study import BROADBAND, models, responses
from axisight_thesis.chapter9_tables import STANDARD
from axisight_thesis.context import Context
from axisight_thesis.item import Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STYLES = {2: {"color": AFTER, "lw": 0.7}, 3: {"color": AFTER, "lw": 1.7}}
_TRUE = {"color": "#b4b4b4", "lw": 2.2}
_MODEL = {"color": BEFORE, "lw": 1.1, "ls": "-."}


@dataclass(frozen=True)
class _Line:
    """One curve: name of its column, label, frequencies [rad/s], magnitude, style."""

    name: str
    label: str
    angular_rad_s: Real
    magnitude: Real
    style: Mapping[str, object]


def small_motion(frequency_hz: Real) -> Complex:
    """Return the response from torque to acceleration without dry friction and cubic spring."""
    free = replace(chain(), gear_ratio=GEAR_RATIO).acceleration_response(frequency_hz)
    # Viscous friction acts as feedback from the motor's speed to its torque.
    s = 2j * np.pi * frequency_hz
    return np.asarray(free / (1 + M3["viscous_friction"] * free / s))


def two_mass_velocity(parameters: Mapping[str, float], frequency_hz: Real) -> Complex:
    """Return the response (9.13) of two masses, torque to velocity, without cubic spring and dry friction."""
    s = 2j * np.pi * frequency_hz
    spring = parameters["k1"] + s * parameters["d"]
    arm = s**2 * parameters["J_a"]
    load = GEAR_RATIO**2 * spring * arm / (spring + arm)
    return np.asarray(s / (s**2 * parameters["J_m"] + s * parameters["F_v"] + load))


def estimates(context: Context) -> dict[int, tuple[Real, Complex]]:
    """Return frequencies [Hz] and torque to acceleration of sets 2 and 3."""
    found = {}
    for number, response in responses(context, STANDARD).items():
        data = collocated(response)
        found[number] = data.frequency_hz, data.acceleration
    return found


@item("figure-9.2")
def figure_9_2(context: Context) -> Item:
    """Return the responses of data sets 2 and 3 from motor torque to motor acceleration."""
    found = estimates(context)
    grid = found[2][0]
    lines = [
        _Line(
            "small_motion",
            "small motion, no dry friction",
            2 * np.pi * grid,
            np.abs(small_motion(grid)),
            _TRUE,
        )
    ]
    for number in BROADBAND:
        frequency, value = found[number]
        label = f"data set {number}"
        lines.append(
            _Line(f"set_{number}", label, 2 * np.pi * frequency, np.abs(value), _STYLES[number])
        )
    drawing = _figure(lines, "|G| [rad s$^{-2}$/Nm]", (0.5, 800.0))
    title = "Response from motor torque to motor acceleration, data sets 2 and 3"
    return Item("figure-9.2", title, {"": _table(lines)}, {"": drawing})


@item("figure-9.3")
def figure_9_3(context: Context) -> Item:
    """Return the responses from motor torque to motor velocity, with the linearized model m3."""
    found = estimates(context)
    lines = []
    for number in BROADBAND:
        frequency, value = found[number]
        velocity = np.abs(value / (2j * np.pi * frequency))
        label = f"data set {number}"
        lines.append(
            _Line(f"set_{number}", label, 2 * np.pi * frequency, velocity, _STYLES[number])
        )
    grid = np.geomspace(1.0, 40.0, 400)
    model = np.abs(two_mass_velocity(models(context, STANDARD)["m3"], grid))
    lines.append(_Line("m3", "model m3 without k$_3$ and F$_c$", 2 * np.pi * grid, model, _MODEL))
    drawing = _figure(lines, "|G| [rad s$^{-1}$/Nm]", (0.01, 15.0))
    title = "Response from motor torque to motor velocity, data sets 2 and 3, and model m3"
    return Item("figure-9.3", title, {"": _table(lines)}, {"": drawing})


def _figure(lines: Sequence[_Line], label: str, limits: tuple[float, float]) -> Figure:
    figure = Figure(figsize=(5.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for line in lines:
        axes.plot(line.angular_rad_s, line.magnitude, label=line.label, **line.style)  # type: ignore[arg-type]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(2 * np.pi / 1.05, 80 * np.pi * 1.05)
    axes.set_ylim(*limits)
    axes.xaxis.set_major_locator(FixedLocator([10, 20, 40, 60, 80, 100, 200]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda w, _: f"{w:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("angular frequency [rad/s]", fontsize=8)
    axes.set_ylabel(label, fontsize=8)
    axes.grid(True, color="#e4e4e4", lw=0.5)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=7.5, frameon=False)
    return figure


def _table(lines: Sequence[_Line]) -> pd.DataFrame:
    """Return the curves as a table over frequency; a curve is empty at frequencies that it lacks."""
    parts = [
        pd.Series(line.magnitude, np.round(line.angular_rad_s, 9), name=line.name) for line in lines
    ]
    table = pd.concat(parts, axis=1).sort_index()
    return table.rename_axis("angular_frequency_rad_s").reset_index()

"""Draw the pictures of docs/story.md: a real six-axis arm, diagnosed from its rigid simulator.

Usage: python benches/story.py DATA

DATA holds staubli_tx40/ (see real_arms.py). Writes docs/images/story_torque.png, story_friction.png
and story_gap.png, and prints the causes as the page has them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from real_arms import tx40

from axisight import Diagnosis, Log, diagnose
from axisight.palette import AFTER, BEFORE, MEASURED

matplotlib.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
GREY = "#767676"
# Shown of the log that was held out.
SHOWN_S = 1.5


def main() -> None:
    """Diagnose, draw and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    machine = tx40(parser.parse_args().data)
    found = diagnose(
        name="TX40",
        robot=machine.without_friction(),
        estimation=machine.estimation,
        validation=machine.validation,
        signals=True,
    )
    held_out = found.signals[-1]
    _save(_torques(held_out), "story_torque")
    _save(_friction(held_out, machine.validation[-1]), "story_friction")
    _save(_gaps(found), "story_gap")
    print(found.headline)
    for cause in found.causes:
        values = ", ".join(
            f"{name} {x.value:.3g} [{x.low:.3g}, {x.high:.3g}]"
            for name, x in cause.parameters.items()
        )
        print(f"| {cause.axis} | {cause.effect} | {cause.probability:.2f} | {values} |")


def _save(figure: Figure, name: str) -> None:
    figure.savefig(IMAGES / f"{name}.png", dpi=130)
    print(f"{name}.png")


def _panels(height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure of six panels, one for each axis, numbered."""
    figure = Figure(figsize=(8.0, height), layout="constrained")
    panels = list(figure.subplots(3, 2).flat)
    for axis, panel in enumerate(panels, 1):
        panel.set_title(f"axis {axis}", loc="left", fontsize=9)
        panel.axhline(0.0, color=GREY, linewidth=0.5)
    return figure, panels


def _torques(log: xr.Dataset) -> Figure:
    """Draw measured and predicted torques over time."""
    figure, panels = _panels(6.0)
    shown = log.sel(time_s=slice(0.0, SHOWN_S))
    curves = (
        ("simulated_before_torque_nm", BEFORE, 1.0, "simulator as it was"),
        ("measured_torque_nm", MEASURED, 1.6, "measured"),
        ("simulated_after_torque_nm", AFTER, 1.0, "with the causes that were named"),
    )
    for i, panel in enumerate(panels):
        for name, color, width, label in curves:
            torque = shown[name].isel(axis=i)
            panel.plot(shown.time_s, torque, color=color, linewidth=width, label=label)
        panel.set_ylabel("motor torque (Nm)")
    for panel in panels[-2:]:
        panel.set_xlabel("time (s)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    return figure


def _friction(signals: xr.Dataset, log: Log) -> Figure:
    """Draw what the simulator lacks over the motor speed, before and after."""
    figure, panels = _panels(6.0)
    speed = np.gradient(log.position_rad, log.sample_time_s, axis=0)
    speed = speed[:: max(1, round(len(speed) / signals.sizes["time_s"]))]
    for i, panel in enumerate(panels):
        for name, color, label in (
            ("before", BEFORE, "simulator as it was"),
            ("after", AFTER, "with the causes that were named"),
        ):
            missing = -signals[f"residual_{name}_torque_nm"].isel(axis=i)
            panel.plot(speed[:, i], missing, ".", color=color, markersize=1.5, label=label)
        panel.set_ylabel("missing torque (Nm)")
    for panel in panels[-2:]:
        panel.set_xlabel("motor speed (rad/s)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=2, frameon=False, markerscale=6
    )
    return figure


def _gaps(found: Diagnosis) -> Figure:
    """Draw the gap of every axis before and after, and what noise alone leaves."""
    figure = Figure(figsize=(8.0, 2.6), layout="constrained")
    panel = figure.subplots()
    places = np.arange(1, 7)
    gap = found.gap
    for shift, values, color, label in (
        (-0.27, gap.before_per_axis, BEFORE, "simulator as it was"),
        (0.0, gap.after_per_axis, AFTER, "with the causes that were named"),
        (0.27, gap.floor_per_axis, GREY, "noise alone"),
    ):
        bars = panel.bar(places + shift, 100 * np.asarray(values), 0.25, color=color, label=label)
        panel.bar_label(bars, fmt="%.3g", fontsize=7, padding=1)
    panel.set_xticks(places, [f"axis {i}" for i in places])
    panel.set_ylabel("gap, held-out log (%)")
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


if __name__ == "__main__":
    main()

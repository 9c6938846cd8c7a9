"""Draw docs/images/work_precision.png: accuracy against CPU time, method by method.

Usage: python docs/make_work_precision.py [--redraw]

Writes the numbers to docs/data/work_precision.csv and draws them; with ``--redraw`` it only
draws. Measuring takes about two minutes, and times depend on the machine and what else it does,
so this is not part of `make docs`.

Four cases, each one simulated second of the preset `irb6600_like` at 2 kHz, all axes moving
through zero speed several times. Errors are relative RMS errors of the worst position, motors
and joints alike, against a converged run of the same model. Times are CPU times of the process,
the shortest of several rounds through all settings, so that a busy moment of the machine does
not hit all runs of one setting.

Where the plant is not stiff, `auto` takes the steps of `dopri5`; it is measured in panel c only.
"""

import argparse
import csv
import gc
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import axisight
from axisight.palette import AFTER, BEFORE, MEASURED

HERE = Path(__file__).resolve().parent
IMAGE = HERE / "images" / "work_precision.png"
TABLE = HERE / "data" / "work_precision.csv"

SECONDS = 1.0
FEWEST_ROUNDS, MEASURE_S = 3, 80.0
TOLERANCES = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9]
SUBSTEPS = [1, 2, 4, 8, 16]
AXES = (1, 2, 3)
ORDER = 24
FLOOR = 3e-12  # what references are good to
GREY = "#767676"

COLUMNS = ("case", "model", "method", "setting", "error", "cpu_ms", "right_hand_sides", "status")


@dataclass(frozen=True)
class Style:
    """How one method is drawn."""

    color: str
    marker: str


STYLES = {
    "rk4": Style(MEASURED, "s"),
    "rkn4": Style(GREY, "D"),
    "dopri5": Style(AFTER, "o"),
    "radau5": Style(BEFORE, "^"),
    "rodas4": Style(GREY, "v"),
    "auto": Style(MEASURED, "o"),
}


@dataclass(frozen=True)
class Case:
    """One panel."""

    name: str
    title: str
    effects: list[axisight.Effect]
    curves: list[tuple[str, str]]
    reference: dict[str, Any]


@dataclass(frozen=True)
class Run:
    """A row of the table, and what takes its time."""

    row: dict[str, Any]
    action: Callable[[], xr.Dataset]


def everywhere(name: str, **parameters: float) -> list[axisight.Effect]:
    """The same effect on all axes."""
    return [axisight.Effect(name, axis, parameters) for axis in AXES]


def presliding(travel_rad: float) -> list[axisight.Effect]:
    """Bristles that bend by ``travel_rad``, damped critically on the motor of axis 1."""
    stiffness = 0.5 / travel_rad
    damping = 2 * np.sqrt(stiffness * 0.0121)
    return everywhere(
        "presliding_friction",
        coulomb_nm=0.5,
        static_ratio=1.6,
        stribeck_speed_rad_s=1.0,
        presliding_rad=travel_rad,
        bristle_time_s=float(damping / stiffness),
    )


def cases() -> list[Case]:
    """The four panels."""
    ours = [("nonlinear", m) for m in STYLES if m != "auto"]
    tight: dict[str, Any] = {"method": "dopri5", "tolerance": 1e-12}
    ripple = everywhere("torque_ripple", order_1=ORDER, cosine_1_nm=0.3, sine_1_nm=0.2)
    return [
        Case("smooth", "a  Smooth, nonlinear, 20 states", [], ours, tight),
        Case(
            "coulomb",
            "b  Coulomb friction, $v_0$ = 0.01 rad/s",
            everywhere("coulomb_friction", coulomb_nm=0.5, smoothing_rad_s=0.01),
            ours,
            tight,
        ),
        Case(
            "presliding",
            "c  Stiff presliding friction, 0.3 µrad",
            presliding(3e-7),
            [("nonlinear", m) for m in ("dopri5", "radau5", "rodas4", "auto")],
            {"method": "auto", "tolerance": 1e-10},
        ),
        Case(
            "ripple",
            f"d  Torque ripple, harmonic {ORDER}",
            ripple,
            [("nonlinear", "rk4"), ("nonlinear", "dopri5"), ("linear", "rk4")],
            {"method": "rk4", "substeps": 256},
        ),
    ]


def references(sample_time_s: float) -> np.ndarray:
    """Motor-side velocity references (n, 3) [rad/s]: four tones that start smoothly."""
    t = np.arange(round(SECONDS / sample_time_s) + 1) * sample_time_s
    tones = zip([60, 20, 4, 1.5], [0.5, 1, 3.1, 11.3], [0, 1, 2, 3], strict=True)
    wave = sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in tones)
    return np.outer(wave * (1 - np.exp(-((t / 0.05) ** 2))), [1, -0.7, 0.9])


def positions(run: xr.Dataset) -> np.ndarray:
    """All positions of a run, motors then joints."""
    return np.hstack([run["motor_position_rad"].values, run["joint_position_rad"].values])


def relative_rms(run: xr.Dataset, exact: xr.Dataset) -> float:
    """Largest relative RMS error of a position over its excursion; NaN for a failed run."""
    if run.attrs["status"] != "completed":
        return float("nan")
    got, want = positions(run), positions(exact)
    error = np.mean((got - want) ** 2, axis=0)
    return float(np.sqrt(error / np.mean((want - want[0]) ** 2, axis=0)).max())


def runs(robot: axisight.Robot, case: Case) -> Iterator[Run]:
    """The runs of one panel, each with its error."""
    v = references(robot.sample_time_s)
    exact: dict[str, xr.Dataset] = {}
    for model, method in case.curves:
        common = {"effects": case.effects, "model": model}
        if model not in exact:
            exact[model] = axisight.simulate(robot, v, **common, **case.reference)
            assert exact[model].attrs["status"] == "completed", case.name
        settings: list[dict[str, Any]] = [{"tolerance": t} for t in TOLERANCES]
        if method in ("rk4", "rkn4"):
            settings = [{"substeps": n} for n in SUBSTEPS]
        for setting in settings:
            options = {**common, "method": method, **setting}
            out = axisight.simulate(robot, v, **options)
            row = {
                "case": case.name,
                "model": model,
                "method": method,
                "setting": f"{next(iter(setting.values())):g}",
                "error": f"{relative_rms(out, exact[model]):.2e}",
                "right_hand_sides": out.attrs["right_hand_sides"],
                "status": out.attrs["status"],
            }
            yield Run(row, lambda o=options: axisight.simulate(robot, v, **o))


def measure(robot: axisight.Robot) -> list[dict[str, Any]]:
    """One row per run, with its CPU time."""
    todo = [run for case in cases() for run in runs(robot, case)]
    shortest = [float("inf")] * len(todo)
    begin = time.process_time()
    rounds = 0
    while rounds < FEWEST_ROUNDS or time.process_time() - begin < MEASURE_S:
        for i, run in enumerate(todo):
            gc.collect()
            start = time.process_time()
            run.action()
            shortest[i] = min(shortest[i], time.process_time() - start)
        rounds += 1
    pairs = zip(todo, shortest, strict=True)
    return [{**run.row, "cpu_ms": f"{1e3 * s / SECONDS:.3g}"} for run, s in pairs]


# Where names stand: text, point of the curve, offset in points of type, alignment.
LABELS = {
    ("smooth", "nonlinear", "dopri5"): ("dopri5, auto", -1, (-7, -3), "right"),
    ("coulomb", "nonlinear", "dopri5"): ("dopri5, auto", -1, (-7, -3), "right"),
    ("presliding", "nonlinear", "dopri5"): ("dopri5", 0, (0, 10), "center"),
    ("presliding", "nonlinear", "auto"): ("auto", 0, (9, 2), "left"),
    ("ripple", "nonlinear", "rk4"): ("rk4, nonlinear", 0, (6, 4), "left"),
    ("ripple", "nonlinear", "dopri5"): ("dopri5, nonlinear", -1, (-8, -6), "right"),
    ("ripple", "linear", "rk4"): ("rk4, linear", 0, (-5, 11), "left"),
    ("smooth", "nonlinear", "rk4"): ("rk4", 0, (7, 4), "left"),
    ("smooth", "nonlinear", "rkn4"): ("rkn4", 0, (-6, 6), "right"),
    ("coulomb", "nonlinear", "rkn4"): ("rkn4", 1, (-8, -2), "right"),
    ("coulomb", "nonlinear", "rk4"): ("rk4", 0, (-6, 8), "right"),
    ("presliding", "nonlinear", "rodas4"): ("rodas4", -1, (-8, -7), "right"),
}


def draw(axes: Axes, case: Case, rows: list[dict[str, Any]]) -> None:
    """One panel."""
    for model, method in case.curves:
        mine = [r for r in rows if (r["model"], r["method"]) == (model, method)]
        mine = [r for r in mine if np.isfinite(float(r["error"]))]
        if not mine:
            continue
        style = STYLES[method]
        x = [float(r["cpu_ms"]) for r in mine]
        y = [max(float(r["error"]), FLOOR) for r in mine]
        ring = method == "auto"
        axes.loglog(
            x,
            y,
            style.marker,
            ls="" if ring else "--" if model == "linear" else "-",
            color=style.color,
            ms=8 if ring else 4.5,
            mfc="none" if ring else "white" if model == "linear" else style.color,
            mew=0.9,
            lw=1.2,
            zorder=3,
        )
        plain = (method, -1, (7, 0), "left")
        text, index, offset, align = LABELS.get((case.name, model, method), plain)
        axes.annotate(
            text,
            (x[index], y[index]),
            offset,
            textcoords="offset points",
            color=style.color,
            ha=align,
            va="center",
            fontsize=9,
        )
    axes.set_title(case.title, loc="left", fontsize=10)
    axes.grid(color="#e4e4e4", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def figure_of(rows: list[dict[str, Any]]) -> Figure:
    """The four panels, on the same scales."""
    figure = Figure(figsize=(9.2, 7.0), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, case in zip(grid.flat, cases(), strict=True):
        draw(axes, case, [r for r in rows if r["case"] == case.name])
        axes.set(xlim=(2.2, 1500), ylim=(1e-12, 1e-3))
        axes.set_xticks([3, 10, 30, 100, 300, 1000], ["3", "10", "30", "100", "300", "1000"])
        axes.minorticks_off()
    figure.supxlabel("CPU time per simulated second [ms]", fontsize=10)
    figure.supylabel("relative RMS error of the worst position [1]", fontsize=10)
    return figure


def write(rows: list[dict[str, Any]]) -> None:
    """The table of all runs."""
    TABLE.parent.mkdir(exist_ok=True)
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        out = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(rows)


def main() -> None:
    """Measure, write the table, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--redraw", action="store_true", help="draw what was measured before")
    if not parser.parse_args().redraw:
        robot = axisight.load_robot("irb6600_like")
        write(measure(robot))
    with TABLE.open(newline="", encoding="utf-8") as file:
        rows: list[dict[str, Any]] = list(csv.DictReader(file))
    IMAGE.parent.mkdir(exist_ok=True)
    figure_of(rows).savefig(IMAGE, dpi=150)


if __name__ == "__main__":
    main()

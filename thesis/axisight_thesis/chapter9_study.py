"""The experiment of section 9.4 on the simulated machine, and the models of section 9.5."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import ConvergenceError
from axisight.excitation import multisine, square, triangle
from axisight.frf import etfe
from axisight.graybox import (
    AxisData,
    AxisFit,
    AxisModel,
    FitSettings,
    InitialModel,
    fit_axis,
    initial_model,
)
from axisight.records import PeriodicRecords
from axisight.simulation import simulate
from axisight_thesis.chapter8_setting import clipped
from axisight_thesis.chapter9_machine import GEAR_RATIO, Machine, chain
from axisight_thesis.context import Context

Real = NDArray[np.float64]

SAMPLE_TIME_S = 5e-4
PERIOD_S = 5.0
LINES = np.arange(5, 201)
"""1 to 40 Hz in 5 s."""

TRIANGLE_RAD_S, TRIANGLE_S = 40.0, 6.25
# Peak of the multisine and amplitude of the square wave [rad/s].
BROADBAND = {2: (5.0, 8.0), 3: (10.0, 12.0)}
SETS = (1, 2, 3)
MODELS = {"m1": (1, 2), "m2": (1, 3), "m3": (1, 2, 3)}
"""Data sets of each model, Table 9.1."""

MODEL = AxisModel(n_masses=2, gear_ratio=GEAR_RATIO, output="velocity_difference")
THREE_MASSES = replace(MODEL, n_masses=3, cubic=None)
NAMES = ("J_m", "J_a", "k1", "k3", "d", "F_v", "F_c")
# A share of 1e-9 of the loss is a hundredth of a standard error with 32,500 samples.
_SETTINGS = FitSettings(max_iterations=30, loss_tolerance=1e-9, step_tolerance=1e-7, gradual=())


@dataclass(frozen=True)
class Records:
    """The records of the experiment.

    data
        The three data sets of section 9.4, from rest.
    periodic
        Sets 2 and 3 with a second period, which is in steady state.
    """

    data: Mapping[int, AxisData]
    periodic: Mapping[int, AxisData]


def reference(number: int, seed: int = 0, scale: float = 1.0) -> Real:
    """Return the velocity reference of a data set [rad/s]; two periods of sets 2 and 3."""
    if number == 1:
        wave = triangle(PERIOD_S, SAMPLE_TIME_S, amplitude=TRIANGLE_RAD_S).period
        return np.tile(wave, 2)[: round(TRIANGLE_S / SAMPLE_TIME_S)]
    peak, level = BROADBAND[number]
    lines = multisine(PERIOD_S, SAMPLE_TIME_S, lines=LINES, seed=seed, run=number)
    wave = clipped(lines).scaled(peak=scale * peak).period
    wave = wave + square(PERIOD_S, SAMPLE_TIME_S, amplitude=scale * level).period
    return np.tile(wave, 2)


def records(context: Context, machine: Machine, scale: float = 1.0) -> Records:
    """Return the records of a machine, references of sets 2 and 3 times ``scale``."""
    key = "chapter 9 records", machine, scale
    return context.shared(key, lambda: _records(context, machine, scale))


def _records(context: Context, machine: Machine, scale: float) -> Records:
    robot = machine.robot()
    long = {}
    for number in SETS:
        run = simulate(
            robot,
            reference(number, context.seed, scale),
            effects=machine.effects(robot),
            noise_seed=context.seed if machine.noise else None,
            run=number,
            tolerance=1e-6,
        )
        if run.attrs["status"] != "completed":
            raise ConvergenceError(f"data set {number}: simulation ended as {run.attrs['status']}")
        long[number] = _data(run, number)
    samples = round(PERIOD_S / SAMPLE_TIME_S)
    data = {1: long[1]} | {n: _first(long[n], samples) for n in BROADBAND}
    return Records(data, {n: long[n] for n in BROADBAND})


def _data(run: xr.Dataset, number: int) -> AxisData:
    position = run["position_rad"].values[:, 0]
    velocity = np.diff(position, prepend=position[:1]) / SAMPLE_TIME_S
    torque = run["torque_cmd_nm"].values[:, 0]
    name = f"data set {number}"
    return AxisData(torque, velocity, position, sample_time_s=SAMPLE_TIME_S, name=name)


def _first(data: AxisData, samples: int) -> AxisData:
    torque, velocity, position = (
        np.asarray(v)[:samples] for v in (data.torque_nm, data.velocity_rad_s, data.position_rad)
    )
    return replace(data, torque_nm=torque, velocity_rad_s=velocity, position_rad=position)


def initial(context: Context, machine: Machine, scale: float = 1.0) -> InitialModel:
    """Return steps 1 and 2 as in the thesis: (9.14) over samples, without damping."""

    def make() -> InitialModel:
        taken = records(context, machine, scale)
        found = initial_model(
            taken.data[1],
            list(taken.periodic.values()),
            gear_ratio=GEAR_RATIO,
            period_s=PERIOD_S,
            lines=LINES,
            drop_periods=1,
            spring_method="samples",
        )
        return replace(found, start={**found.start, "d": 0.0})

    return context.shared(("chapter 9 initial", machine, scale), make)


def responses(context: Context, machine: Machine, scale: float = 1.0) -> dict[int, xr.Dataset]:
    """Return the responses from torque to motor acceleration of sets 2 and 3, from the steady period."""

    def make() -> dict[int, xr.Dataset]:
        found = {}
        for number, data in records(context, machine, scale).periodic.items():
            steady = round(PERIOD_S / SAMPLE_TIME_S)
            parts = [np.asarray(v)[steady:] for v in (data.torque_nm, data.position_rad)]
            inputs, outputs = (part.reshape(1, 1, -1, 1) for part in parts)
            taken = PeriodicRecords(SAMPLE_TIME_S, inputs, outputs, LINES)
            found[number] = etfe(taken, quantity="acceleration")
        return found

    return context.shared(("chapter 9 responses", machine, scale), make)


def fitted(
    context: Context,
    machine: Machine,
    sets: tuple[int, ...] = SETS,
    *,
    scale: float = 1.0,
    cubic: bool = True,
    start: Mapping[str, float] | None = None,
    max_iterations: int = 30,
) -> AxisFit:
    """Return the fit of step 3 to some data sets; without ``cubic`` k3 is held at zero."""
    key = "chapter 9 fit", machine, sets, scale, cubic, start is None, max_iterations

    def make() -> AxisFit:
        begin = dict(start or initial(context, machine, scale).start)
        taken = records(context, machine, scale)
        return fit_axis(
            MODEL,
            [taken.data[n] for n in sets],
            begin if cubic else {**begin, "k3": 0.0},
            fixed=() if cubic else ("k3",),
            settings=replace(_SETTINGS, max_iterations=max_iterations),
        )

    return context.shared(key, make)


def three_masses(context: Context, machine: Machine, *, cubic: bool = True) -> AxisFit:
    """Return a fit of three masses to all sets, from a start 10 % off the chain of small motion.

    Without ``cubic`` the springs are linear, and the fit starts at the end of the cubic one.
    """

    def make() -> AxisFit:
        true = chain()
        names = {"J_a": true.inertia_kg_m2[1], "J_a2": true.inertia_kg_m2[2]}
        names |= {"k1": true.stiffness_nm_rad[0], "k1_2": true.stiffness_nm_rad[1]}
        names |= {"d": true.damping_nm_s_rad[0], "d_2": true.damping_nm_s_rad[1]}
        begin = {name: 1.1 * float(value) for name, value in names.items()}
        begin |= {"J_m": 0.0133, "F_v": 0.0143, "F_c": 0.71}
        if not cubic:
            ended = three_masses(context, machine).parameters
            begin = {name: value for name, value in ended.items() if name != "r"}
        begin["k3"] = 0.0
        data = list(records(context, machine).data.values())
        fixed = () if cubic else ("k3",)
        return fit_axis(THREE_MASSES, data, begin, fixed=fixed, settings=_SETTINGS)

    return context.shared(("chapter 9 three masses", machine, cubic), make)


def simulated(parameters: Mapping[str, float], data: AxisData) -> Real:
    """Return the output of the two-mass model for a data set."""
    run = MODEL.simulate(parameters, data.torque_nm, data.sample_time_s)
    return np.asarray(run["output"].values)


def measured(data: AxisData) -> Real:
    """Return the measured velocity of a data set, for comparison with :func:`simulated`."""
    return data.measured(MODEL)


def models(context: Context, machine: Machine) -> dict[str, Mapping[str, float]]:
    """Return parameters of m0 to m3."""
    found: dict[str, Mapping[str, float]] = {"m0": initial(context, machine).start}
    for name, sets in MODELS.items():
        found[name] = fitted(context, machine, sets).parameters
    return found

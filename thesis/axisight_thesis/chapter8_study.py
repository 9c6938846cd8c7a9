"""Simulated experiments of chapter 8 as spectra, with their disturbances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.frf import mfrf
from axisight.records import PeriodicRecords
from axisight.simulation import Model, simulate_batch
from axisight_thesis.chapter8_setting import (
    DESIGNS,
    PERIOD_S,
    Design,
    excited_lines,
    references,
    ripple,
    start_angles,
)
from axisight_thesis.context import Context

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Lines = NDArray[np.int64]

# First noise runs of experiments that are not those of Table 8.2.
_SINUSOID_NOISE = 2**32


@dataclass(frozen=True)
class Experiments:
    """Spectra (n_freq, channel, experiment) of the last period, for one realization of a design.

    They are those of commanded torque U [Nm], measured motor velocity Y [rad/s], and their disturbances
    V_u and V_y. The estimate ``Y U^-1`` from torque to acceleration is (n_freq, output, input).
    """

    frequency_hz: Real
    input: Complex
    output: Complex
    input_disturbance: Complex
    output_disturbance: Complex
    estimate: Complex

    def at(self, line: int) -> Experiments:
        """Return the spectra at one place in ``frequency_hz``."""
        kept = slice(line, line + 1)
        return Experiments(*(value[kept] for value in vars(self).values()))


def experiments(context: Context, design: Design, run: int = 0) -> Experiments:
    """Return one realization of a design, with the ripple of Table 8.1 and sensor noise.

    Every realization has its own multisine, noise and start angle. The sinusoid is always the same.
    """
    standard = context.shared(("chapter8", run), lambda: _standard(context, run))
    if design in standard:
        return standard[design]
    return one_design(context, design, run)


def one_design(context: Context, design: Design, run: int = 0) -> Experiments:
    """Return what `experiments` returns, without a simulation of other designs."""
    key = ("chapter8", run, design)
    return context.shared(key, lambda: _simulated(context, [design], run)[design])


def same_excitation(context: Context, design: Design, periods: int) -> list[Experiments]:
    """Return consecutive periods of one design, with the same excitation and new sensor noise."""

    def make() -> list[Experiments]:
        refs = np.tile(references(context.robot, design, context.seed, 0), (1, periods + 1, 1))
        simulated = simulate_batch(
            context.robot,
            refs,
            effects=ripple(context.robot),
            noise_seed=context.seed,
            first_run=2**33,
            model="linear",
            threads=context.threads,
        )
        n = refs.shape[1] // (periods + 1)
        pairs = (simulated.isel(time=slice(k * n, (k + 2) * n)) for k in range(periods))
        return [from_simulation(context, pair, excited_lines()) for pair in pairs]

    return context.shared(("chapter8-same", design, periods), make)


def simulate_nonlinear(context: Context) -> list[Experiments]:
    """Return the designs of Table 8.2, first realization, with the full equations of motion."""

    def make() -> list[Experiments]:
        context.report("12 experiments with the nonlinear model")
        refs = [references(context.robot, d, context.seed, 0) for d in DESIGNS]
        simulated = simulate_period(
            context,
            np.concatenate(refs),
            ripple(context.robot),
            noise_seed=context.seed,
            model="nonlinear",
        )
        parts = (simulated.isel(run=slice(k, k + 3)) for k in range(0, 12, 3))
        return [from_simulation(context, part, excited_lines()) for part in parts]

    return context.shared("chapter8-nonlinear", make)


def true_response(context: Context, frequency_hz: Real) -> Complex:
    """Return the zero-order-hold response from torque to acceleration, (n_freq, 3, 3)."""
    iw = 2j * np.pi * frequency_hz[:, None, None]
    return np.asarray(iw**2 * context.robot.zoh_response(frequency_hz).values)


def _standard(context: Context, run: int) -> dict[Design, Experiments]:
    return _simulated(context, list(DESIGNS), run)


def _noise_run(design: Design, run: int) -> int:
    """Return the number of the noise of a design's first experiment; every one has its own."""
    if design.sinusoid_hz is not None:
        return _SINUSOID_NOISE + 3 * run
    return 3 * (len(DESIGNS) * run + DESIGNS.index(design))


def _simulated(context: Context, designs: list[Design], run: int) -> dict[Design, Experiments]:
    robot, seed = context.robot, context.seed
    refs = np.concatenate([references(robot, d, seed, run) for d in designs])
    first = _noise_run(designs[0], run)
    effects = ripple(robot, start_angles(robot, seed, run))
    simulated = simulate_period(context, refs, effects, noise_seed=seed, first_run=first)
    out = {}
    for k, design in enumerate(designs):
        part = simulated.isel(run=slice(3 * k, 3 * k + 3))
        lines = excited_lines()
        if design.sinusoid_hz is not None:
            lines = np.array([round(design.sinusoid_hz * PERIOD_S)])
        out[design] = from_simulation(context, part, lines)
    return out


def simulate_period(
    context: Context,
    refs: Real,
    effects: Sequence[Effect],
    *,
    noise_seed: int | None = None,
    first_run: int = 0,
    model: Model = "linear",
) -> xr.Dataset:
    """Return the simulation of two periods of references, (experiment, sample, axis).

    The first period is waiting time. With these controllers a longer one changes the estimates by less
    than a millionth.
    """
    return simulate_batch(
        context.robot,
        np.tile(refs, (1, 2, 1)),
        effects=effects,
        noise_seed=noise_seed,
        first_run=first_run,
        model=model,
        threads=context.threads,
    )


def from_simulation(context: Context, simulated: xr.Dataset, lines: Lines) -> Experiments:
    """Return the spectra of the last of two simulated periods."""
    n = simulated.sizes["time"] // 2
    step = context.robot.sample_time_s
    torque = simulated["torque_disturbance_nm"].values[:, n:]
    # The mean over a sample acts on the plant, not the value at its beginning.
    torque = 0.5 * (torque + np.roll(torque, -1, axis=1))
    position = simulated["position_disturbance_rad"].values[:, n:]
    command = simulated["torque_cmd_nm"].values[:, n:]
    measured = _without_drift(simulated["position_rad"].values, n)
    return from_signals(step, lines, (command, measured), (torque, position))


def from_signals(
    step: float, lines: Lines, signals: tuple[Real, Real], disturbances: tuple[Real, Real]
) -> Experiments:
    """Return the spectra of one period of torque and position, (experiment, sample, axis)."""
    (u, y), (v_u, v_y) = ([_spectrum(x, lines) for x in pair] for pair in (signals, disturbances))
    records = PeriodicRecords(step, signals[0][:, None], signals[1][:, None], lines)
    estimate = mfrf(records, quantity="acceleration", remove_drift=False)["response"].values
    iw = 2j * np.pi * records.frequency_hz[:, None, None]
    return Experiments(records.frequency_hz, u, iw * y, v_u, iw * v_y, estimate)


def _spectrum(x: Real, lines: Lines) -> Complex:
    """Return the DFT of (experiment, sample, channel) as (n_freq, channel, experiment)."""
    return np.moveaxis(np.fft.rfft(x, axis=1)[:, lines], 0, -1)


def _without_drift(position: Real, n: int) -> Real:
    """Return the last period minus its drift over a period, a straight line."""
    late = n // 4
    before, after = position[:, n - late : n], position[:, 2 * n - late :]
    slope = (after.mean(axis=1) - before.mean(axis=1)) / n
    return np.asarray(position[:, n:] - slope[:, None] * np.arange(n)[:, None])

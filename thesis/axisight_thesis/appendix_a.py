"""Appendix A: stochastic disturbances (A.1), and spectra of repetitive ones (A.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.simulation import simulate_batch
from axisight_thesis.chapter8_figures import error_item
from axisight_thesis.chapter8_setting import Design, excited_lines, references
from axisight_thesis.chapter8_sinusoid import MULTISINE, snr
from axisight_thesis.chapter8_study import (
    Experiments,
    experiments,
    from_signals,
    true_response,
)
from axisight_thesis.chapter8_tables import realizations
from axisight_thesis.context import Context
from axisight_thesis.element_plot import (
    DISTURBANCE,
    ESTIMATE,
    Curve,
    element_figure,
    element_table,
)
from axisight_thesis.item import Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

CUTOFF_HZ = 40.0
_ORDER = 4

STOCHASTIC_FIGURES = {
    "A.1": Design("T1", square=False),
    "A.2": Design("T2", square=False),
    "A.3": Design("T1", square=True),
    "A.4": Design("T2", square=True),
}


def stochastic_experiments(context: Context, design: Design, run: int = 0) -> Experiments:
    """Return one realization of a design with Gaussian disturbances of torque and velocity.

    Both are flat up to 40 Hz. Their mean power over lines, axes and experiments is that of the
    repetitive disturbances with T1 and square wave. They are independent between axes and
    experiments, and of the excitation. They repeat with the period, so there is no leakage.
    """
    key = ("appendix-a", design, run)
    return context.shared(key, lambda: _simulated(context, design, run))


def _simulated(context: Context, design: Design, run: int) -> Experiments:
    robot = context.robot
    step = robot.sample_time_s
    refs = references(robot, design, context.seed, run)
    n = refs.shape[1]
    frequency = np.asarray(np.fft.rfftfreq(n, step)[1:, None], np.float64)
    index = list(STOCHASTIC_FIGURES.values()).index(design)
    rng = np.random.default_rng([context.seed, run, index, 1])
    like = experiments(context, MULTISINE)
    torque = _low_pass(rng, frequency, refs.shape, like.input_disturbance)
    velocity = _low_pass(rng, frequency, refs.shape, like.output_disturbance)
    position = velocity / (2j * np.pi * frequency)
    v_u, v_y = _signal(torque, n), _signal(position, n)
    # An increase of the reference by this gives the same additional torque command.
    more = _signal(torque / _reference_gain(context, frequency), n)
    run_ = simulate_batch(
        robot,
        np.tile(refs + more, (1, 2, 1)),
        noise=np.tile(v_y, (1, 2, 1)),
        model="linear",
        threads=context.threads,
    )
    command = run_["torque_cmd_nm"].values[:, n:] - v_u
    return from_signals(
        step, excited_lines(), (command, run_["position_rad"].values[:, n:]), (v_u, v_y)
    )


def _low_pass(
    rng: np.random.Generator, frequency: Real, shape: tuple[int, ...], like: Complex
) -> Complex:
    """Return spectra (experiment, line, axis) without DC: Butterworth, with the power of ``like``."""
    size = (shape[0], len(frequency), shape[2])
    gain = 1 / np.sqrt(1 + (frequency / CUTOFF_HZ) ** (2 * _ORDER))
    power = np.mean(np.abs(like) ** 2)
    unit = rng.standard_normal(size) + 1j * rng.standard_normal(size)
    return np.asarray(np.sqrt(power / 2) * gain * unit)


def _reference_gain(context: Context, frequency: Real) -> Complex:
    """Return ``kp + ki T / (z - 1)``, from velocity reference to torque command."""
    gains = context.robot.controller_gains
    step = context.robot.sample_time_s
    z = np.exp(2j * np.pi * frequency * step)
    return np.asarray(gains["kp"] + gains["ki"] * step / (z - 1))


def _signal(spectrum: Complex, n: int) -> Real:
    dc = np.zeros_like(spectrum[:, :1])
    return np.fft.irfft(np.concatenate([dc, spectrum], axis=1), n, axis=1)


def _register_errors(number: str, design: Design) -> None:
    @item(f"figure-{number}")
    def figure(context: Context) -> Item:
        runs = range(realizations(context))
        found = [stochastic_experiments(context, design, run) for run in runs]
        true = true_response(context, found[0].frequency_hz)
        return error_item(f"figure-{number}", design, found, true)


for _number, _design in STOCHASTIC_FIGURES.items():
    _register_errors(_number, _design)


def _register_spectra(number: str, signal: str, unit: str) -> None:
    @item(f"figure-{number}")
    def figure(context: Context) -> Item:
        found = experiments(context, MULTISINE)
        n = round(
            1 / (context.robot.sample_time_s * (found.frequency_hz[1] - found.frequency_hz[0]))
        )
        power, disturbing = (
            np.abs(getattr(found, name)) ** 2 / n for name in (signal, f"{signal}_disturbance")
        )
        curves = [
            Curve(found.frequency_hz, power, signal, ESTIMATE),
            Curve(found.frequency_hz, disturbing, f"{signal} disturbance", DISTURBANCE),
        ]
        table = element_table(
            signal=(found.frequency_hz, power), disturbance=(found.frequency_hz, disturbing)
        )
        return Item(
            f"figure-{number}",
            f"Periodogram of the {signal} and its disturbance, {MULTISINE}",
            {"": table},
            {"": element_figure(curves, f"periodogram [{unit}]")},
        )


_register_spectra("A.5", "input", "Nm$^2$")
_register_spectra("A.6", "output", "(rad/s)$^2$")


def _register_snr(number: str, which: int, signal: str) -> None:
    @item(f"figure-{number}")
    def figure(context: Context) -> Item:
        found = experiments(context, MULTISINE)
        ratio = snr(found)[which]
        curve = Curve(found.frequency_hz, ratio, f"{signal} signal-to-noise ratio", ESTIMATE)
        return Item(
            f"figure-{number}",
            f"Signal-to-noise ratio of the {signal}, {MULTISINE}",
            {"": element_table(snr_db=(found.frequency_hz, ratio))},
            {"": element_figure([curve], "SNR [dB]", log=False)},
        )


_register_snr("A.7", 0, "input")
_register_snr("A.8", 1, "output")

"""The setting of chapter 8: disturbances of Table 8.1, designs and references of section 8.2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import excitation
from axisight.effects import Effect, resolver_ripple, torque_ripple
from axisight.excitation import Clipping, Multisine, multisine, optimize_crest_factor, square
from axisight.robot import Robot

Real = NDArray[np.float64]
Lines = NDArray[np.int64]

# Wernholt (2004), Table 8.1: order n, amplitude, phase [rad] of each sine.
TORQUE_RIPPLE_NM = ((3, 0.06, 1.45), (36, 0.11, 0.90), (72, 0.08, 0.20))
PROPORTIONAL_RIPPLE = ((18, 0.04, 0.0),)
RESOLVER_RIPPLE_RAD = (
    (2, 0.40e-3, -1.84),
    (10, 0.20e-3, 0.81),
    (12, 0.22e-3, 2.94),
    (48, 0.18e-3, 2.94),
)

PERIOD_S = 10.0
BAND_HZ = (1.0, 40.0)
PEAK_RAD_S = 8.0
SQUARE_RAD_S = 9.6
SQUARE_PERIOD_S = 5.0
SMOOTHING_SAMPLES = 40
# Number of the random stream of start angles.
_START = 8
# Of the single sinusoid, which begins at its largest negative velocity. The thesis does not state it.
SINUSOID_PHASE_RAD = 1.5 * np.pi


@dataclass(frozen=True)
class Design:
    """One choice of excitation: ``r = T r_bb + r_sq`` in three experiments.

    ``directions`` is T of (6.6). ``sinusoid_hz`` replaces the multisine by one sinusoid of the same
    peak (section 8.3.2).
    """

    directions: Literal["T1", "T2"] = "T1"
    square: bool = True
    sinusoid_hz: float | None = None

    def __str__(self) -> str:
        """Return the design as in the captions of the thesis."""
        what = "" if self.sinusoid_hz is None else f", sinusoid {self.sinusoid_hz:g} Hz"
        return f"{self.directions}, {'with' if self.square else 'without'} square wave{what}"


# In the order of Table 8.2, left to right and down.
DESIGNS = (
    Design("T1", square=False),
    Design("T1", square=True),
    Design("T2", square=False),
    Design("T2", square=True),
)


def excited_lines() -> Lines:
    """Return the lines of the multisine: 391 from 1 to 40 Hz."""
    low, high = (round(f * PERIOD_S) for f in BAND_HZ)
    return np.arange(low, high + 1)


def square_lines(lines: Lines) -> NDArray[np.bool_]:
    """Return a mask of the lines that the square wave excites too, odd multiples of its frequency."""
    ratio = round(PERIOD_S / SQUARE_PERIOD_S)
    return np.asarray((lines % ratio == 0) & (lines // ratio % 2 == 1))


def strong_square_lines(robot: Robot) -> NDArray[np.bool_]:
    """Return a mask of the lines at which the square wave is stronger than the multisine."""
    lines = excited_lines()
    apart = Design("T1", square=False), Design("T1", square=True)
    without, with_ = (references(robot, d, 0, 0)[0, :, :2] for d in apart)
    broadband, wave = (np.abs(np.fft.rfft(x)[lines]) for x in (without[:, 0], with_[:, 1]))
    return np.asarray(wave > broadband)


def references(robot: Robot, design: Design, seed: int, run: int) -> Real:
    """Return one period of velocity references [rad/s], (experiment, sample, axis).

    The multisine is a function of (seed, run), the same in all experiments and designs.
    """
    step = robot.sample_time_s
    if design.sinusoid_hz is None:
        broadband = _multisine(step, seed, run)
    else:
        line = round(design.sinusoid_hz * PERIOD_S)
        broadband = multisine(PERIOD_S, step, lines=[line], phases=[SINUSOID_PHASE_RAD])
    wave = square(
        SQUARE_PERIOD_S, step, amplitude=SQUARE_RAD_S, smoothing_samples=SMOOTHING_SAMPLES
    )
    return excitation.references(
        broadband.scaled(peak=PEAK_RAD_S),
        robot.n_axes,
        directions=design.directions.lower(),
        square=wave if design.square else None,
    ).period


@lru_cache(maxsize=32)
def _multisine(step: float, seed: int, run: int) -> Multisine:
    return clipped(multisine(PERIOD_S, step, lines=excited_lines(), seed=seed, run=run))


def clipped(signal: Multisine) -> Multisine:
    """Return a multisine of the same amplitudes and of low crest factor, Algorithm 5.1.

    A hundred iterations from the given phases give a crest factor of 1.55 on average, as in the thesis.
    """
    return optimize_crest_factor(
        signal,
        from_signal=True,
        clipping=Clipping(iterations=100),
        refinement="none",
        threads=1,
    ).signal


def start_angles(robot: Robot, seed: int, run: int) -> Real:
    """Return the motor angles [rad] at which a realization begins, (axis,), a function of (seed, run).

    The thesis does not state them, but they set the phase of the ripple. Realization 0 begins at the
    operating point. The others are uniform over a turn, the common period of all orders of the ripple.
    """
    if run == 0:
        return np.zeros(robot.n_axes)
    return np.random.default_rng([seed, run, _START]).uniform(0, 2 * np.pi, robot.n_axes)


def ripple(robot: Robot, start_rad: ArrayLike = 0.0) -> list[Effect]:
    """Return the disturbances (8.2) of Table 8.1 on every axis.

    ``start_rad`` adds a motor angle [rad] to the argument of the ripple, one for all axes or (axis,).

    The model of the thesis is linear, so its commanded torque is the deviation from rest. The torque
    here includes the static load, 22 and 24 Nm on axes 2 and 3, to which proportional ripple would
    apply too. A ripple of constant amplitude therefore subtracts the share of the load.
    """
    static = robot.equilibrium()["motor_torque_nm"].values
    starts = np.broadcast_to(np.asarray(start_rad, float), (robot.n_axes,))
    effects = []
    for axis, torque, start in zip(robot.axis_numbers(), static, starts, strict=True):
        torques = _turned(TORQUE_RIPPLE_NM, start)
        shares = _turned(PROPORTIONAL_RIPPLE, start)
        held = [(n, -share * torque, phase) for n, share, phase in shares]
        effects += torque_ripple(axis, constant_nm=torques, proportional=shares)
        effects += torque_ripple(axis, constant_nm=held)
        effects += resolver_ripple(axis, _turned(RESOLVER_RIPPLE_RAD, start))
    return effects


def _turned(
    sines: tuple[tuple[int, float, float], ...], start_rad: float
) -> list[tuple[float, float, float]]:
    """Return ``a sin(n (x + start) + phase)`` as order, amplitude and phase over x."""
    return [(float(n), a, n * float(start_rad) + phase) for n, a, phase in sines]

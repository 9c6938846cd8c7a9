"""The references of all experiments: one period of each, and their design."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from axisight.arguments import (
    Lines,
    Real,
    instance,
    lines_below,
    positive,
    reals,
    seed_of,
    whole,
    words,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation.checks import few_enough, per_item
from axisight.excitation.directions import MOST_INPUTS, Directions, dft_matrix, direction_matrix
from axisight.excitation.multisine import Multisine, random_phases
from axisight.excitation.signals import PeriodicSignal


@summarized
@dataclass(frozen=True, eq=False)
class References:
    """Velocity references (or other inputs) of a set of experiments.

    sample_time_s
        Sample time [s].
    period
        One period of each experiment, (n_experiments, n_samples, n_inputs).
    lines, detection_lines
        Excited lines and lines left free, as multiples of one over the period.
    unit
        Unit of the samples.
    design
        Signals, directions and settings as plain numbers and text, so that files can hold them.
    """

    sample_time_s: float
    period: Real
    lines: Lines = field(default_factory=lambda: np.empty(0, np.int64))
    detection_lines: Lines = field(default_factory=lambda: np.empty(0, np.int64))
    unit: str = "rad/s"
    design: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the shape."""
        object.__setattr__(self, "sample_time_s", positive("sample_time_s", self.sample_time_s))
        what = "finite numbers of shape (n_experiments, n_samples, n_inputs)"
        object.__setattr__(self, "period", reals("period", self.period, what, 3).copy())
        for name in ("lines", "detection_lines"):
            lines = lines_below(name, getattr(self, name), self.n_samples)
            object.__setattr__(self, name, lines)
        words("unit", self.unit)
        instance("design", self.design, dict)

    @property
    def n_experiments(self) -> int:
        """Number of experiments."""
        return int(self.period.shape[0])

    @property
    def n_samples(self) -> int:
        """Samples of a period."""
        return int(self.period.shape[1])

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return int(self.period.shape[2])

    @property
    def period_s(self) -> float:
        """Period [s]."""
        return self.n_samples * self.sample_time_s

    @property
    def peak(self) -> Real:
        """Largest absolute sample, (n_experiments, n_inputs)."""
        return np.asarray(np.abs(self.period).max(axis=1))

    def repeated(self, periods: int) -> Real:
        """Return consecutive periods, (n_experiments, periods * n_samples, n_inputs)."""
        count = whole("periods", periods)
        few_enough("periods", count * self.period.size)
        return np.tile(self.period, (1, count, 1))


def references(
    broadband: Multisine | PeriodicSignal,
    n_inputs: int,
    *,
    directions: Directions | Literal["dft"] | ArrayLike = "t1",
    square: PeriodicSignal | None = None,
    dc_level: ArrayLike = 0.0,
    seed: int = 0,
    run: int = 0,
    unit: str = "rad/s",
) -> References:
    """Return the references ``r(t) = T r_bb(t) + r_sq(t) + dc``, Wernholt (2004), section 7.1.

    Parameters
    ----------
    broadband : the scalar signal r_bb.
    n_inputs : number of inputs (axes).
    directions : T, see :func:`direction_matrix`; or ``"dft"``, for multisines without snow.
        With ``"dft"`` every input has its own phases: the first those of the signal, input i
        those of (seed, run * n_inputs + i). Experiment e turns them by 2 pi i e / n, see
        :func:`dft_matrix`. No input exceeds the peak of ``broadband``. Only the first input
        keeps optimized phases. The others have the crest factor of random phases, about 3.5
        instead of 1.4, and so 40 % of the amplitude at the same peak.
    square : added to all inputs; its period divides that of the signal.
    dc_level : added to the inputs, one number or (n_inputs,), in ``unit``. A velocity of
        ``(pi / 2) / T0`` moves the motor by a quarter turn per period, so that repetitive
        disturbances differ from period to period (section 7.2.8).
    seed, run : determine the phases of ``"dft"``.
    unit : unit of the samples.

    Raises InputError naming the field.

    """
    instance("broadband", broadband, Multisine, PeriodicSignal)
    n = whole("n_inputs", n_inputs, 1, MOST_INPUTS)
    few_enough("n_inputs", n * n * broadband.n_samples)
    seed, run = seed_of("seed", seed), seed_of("run", run)
    turned = isinstance(directions, str) and directions == "dft"
    if turned:
        period = _orthogonal(broadband, n, seed, run)
        chosen: Any = "dft"
    else:
        matrix = direction_matrix(directions, n)
        period = matrix.T[:, None, :] * broadband.period[None, :, None]
        chosen = directions if isinstance(directions, str) else matrix.tolist()
    if square is not None:
        instance("square", square, PeriodicSignal)
        period = period + repeated(square, broadband)[None, :, None]
    level = per_item("dc_level", dc_level, n)
    detection = getattr(broadband, "detection_lines", np.empty(0, np.int64))
    return References(
        sample_time_s=broadband.sample_time_s,
        period=period + level,
        lines=broadband.lines,
        detection_lines=detection,
        unit=unit,
        design={
            "schema": "axisight.excitation/1",
            "broadband": describe(broadband),
            "directions": chosen,
            "seed": seed,
            "run": run,
            "square": None if square is None else describe(square),
            "dc_level": level.tolist(),
        },
    )


def describe(signal: Multisine | PeriodicSignal) -> dict[str, Any]:
    """Return a signal as plain numbers and text."""
    figures = {"rms": signal.rms, "peak": signal.peak, "crest_factor": signal.crest_factor}
    common = {"sample_time_s": signal.sample_time_s, "n_samples": signal.n_samples, **figures}
    if isinstance(signal, PeriodicSignal):
        return {"kind": signal.kind, **common, **signal.settings}
    names = ("lines", "amplitude", "phase_rad", "detection_lines")
    snow = ("snow_lines", "snow_amplitude", "snow_phase_rad")
    arrays = {name: getattr(signal, name).tolist() for name in (*names, *snow)}
    return {"kind": "multisine", **common, **arrays}


def repeated(square: PeriodicSignal, broadband: Multisine | PeriodicSignal) -> Real:
    """Return as many periods of ``square`` as one of ``broadband`` holds; raises InputError if not whole."""
    count, rest = divmod(broadband.n_samples, square.n_samples)
    if rest or abs(square.sample_time_s / broadband.sample_time_s - 1) > 1e-9:
        raise InputError(
            f"square: expected a period that divides the {broadband.n_samples} samples of "
            f"{broadband.sample_time_s} s, got {square.n_samples} of {square.sample_time_s} s"
        )
    return np.tile(square.period, count)


def _orthogonal(signal: Multisine | PeriodicSignal, n: int, seed: int, run: int) -> Real:
    if not isinstance(signal, Multisine) or signal.snow_lines.size:
        raise InputError("directions: expected a multisine without snow for dft")
    turns = np.angle(dft_matrix(n))
    period = np.empty((n, signal.n_samples, n))
    for i in range(n):
        own = signal.phase_rad
        if i:
            own = random_phases(len(signal.lines), seed, run * n + i)
        inputs = [replace(signal, phase_rad=own + turns[i, e]) for e in range(n)]
        # Different scales of one input's experiments would make rows not orthogonal.
        factor = signal.peak / max(x.peak for x in inputs)
        for e, x in enumerate(inputs):
            period[e, :, i] = factor * x.period
    return period

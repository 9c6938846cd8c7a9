"""Search for phases with a small crest factor."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from axisight import _core
from axisight.arguments import (
    Real,
    instance,
    lines_below,
    not_negative,
    number,
    positive,
    seed_of,
    switch,
    threads_of,
    whole,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation.multisine import Multisine, response_at


@dataclass(frozen=True)
class Clipping:
    """Settings of the clipping algorithm, Wernholt (2004), Algorithm 5.1.

    The clipping level rises from ``first_level`` to ``last_level``, relative to the peak, so that
    1 - level falls geometrically. The clipped part is subtracted ``relaxation`` times: 1 is the
    algorithm as published, and over-relaxation needs fewer iterations. ``oversampling`` of the grid
    is relative to the Nyquist count of the highest line, rounded up to a power of two in samples.
    Below 8 the grid misses peaks between samples.
    """

    iterations: int = 300
    first_level: float = 0.7
    last_level: float = 0.999
    relaxation: float = 4.0
    oversampling: int = 8


@dataclass(frozen=True)
class LpRefinement:
    """Settings of the refinement in the L2p norm (Guillaume et al. 1991).

    The exponent 2p doubles from ``first_exponent`` to ``last_exponent``, with at most ``iterations``
    damped Gauss-Newton steps at each. ``oversampling`` is that of :class:`Clipping`.
    """

    first_exponent: int = 8
    last_exponent: int = 2048
    iterations: int = 100
    oversampling: int = 16


@summarized
@dataclass(frozen=True, eq=False)
class CrestSearch:
    """Result of a search for a small crest factor.

    signal
        The multisine with the best phases (and snow).
    crest_factor
        The minimized crest factor: of the signal, or of its output if a response was given.
    start, seed
        The best start, which began at the random phases of (seed, run=start); -1 for given phases.
    crest_factors
        Crest factors of all starts begun, in order.
    clipping_iterations, refinement_steps
        Totals over all starts.
    status
        ``"completed"``, or ``"out_of_time"`` if the time ended before the starts did.
    """

    signal: Multisine
    crest_factor: float
    start: int
    seed: int
    crest_factors: Real
    clipping_iterations: int
    refinement_steps: int
    status: Literal["completed", "out_of_time"]


def optimize_crest_factor(
    signal: Multisine,
    *,
    starts: int = 16,
    time_s: float | None = None,
    seed: int = 0,
    from_signal: bool = False,
    clipping: Clipping | None = None,
    refinement: LpRefinement | Literal["none"] | None = None,
    snow_lines: ArrayLike = (),
    snow_limit: float = 1.0,
    response: ArrayLike | None = None,
    threads: int = 0,
) -> CrestSearch:
    """Return the signal with new phases, the same amplitudes and a small crest factor.

    Parameters
    ----------
    signal : the multisine; its snow, if any, is replaced.
    starts : number of starts. Without ``time_s`` the result depends only on signal, settings,
        seed and ``starts``.
    time_s : wall time [s] after which no start begins and the running ones end.
    seed : start i begins at the phases of :func:`random_phases` for (seed, i).
    from_signal : start once from the phases of the signal instead.
    clipping : settings of the clipping algorithm, run first.
    refinement : settings of the refinement after clipping; ``"none"`` leaves it out.
    snow_lines : further lines that the search may add ("snowing").
    snow_limit : largest amplitude of snow lines, relative to the rms of the signal's amplitudes.
    response : complex (n_lines,), response G at the lines. The search then minimizes the crest factor
        of the output ``G u`` instead. Not together with snow, because the response at its lines is
        not known.
    threads : number of threads, 0 for all cores. The result does not depend on it.

    Raises InputError naming the field.

    """
    instance("signal", signal, Multisine)
    snow = lines_below("snow_lines", snow_lines, signal.n_samples)
    twice = np.intersect1d(signal.lines, snow)
    if twice.size:
        raise InputError(f"snow_lines: expected lines that are not excited, got {twice[0]}")
    amplitude, turned = signal.amplitude, np.zeros(len(signal.lines))
    if response is not None:
        if snow.size:
            raise InputError(
                "response, snow_lines: expected at most one of them: the response is known at the "
                "excited lines only, so what snow does to the output is not; optimize the output "
                "without snow, or the signal with it"
            )
        gain = response_at(response, len(signal.lines))
        amplitude, turned = amplitude * np.abs(gain), np.angle(gain)
    steps = None
    if not (isinstance(refinement, str) and refinement == "none"):
        steps = _numbers("refinement", LpRefinement() if refinement is None else refinement)
    found = _core.optimize_crest_factor(
        signal.lines.tolist(),
        amplitude.tolist(),
        snow=snow.tolist(),
        snow_limit=not_negative("snow_limit", snow_limit),
        phase=(signal.phase_rad + turned).tolist() if switch("from_signal", from_signal) else None,
        seed=seed_of("seed", seed),
        clipping=_numbers("clipping", Clipping() if clipping is None else clipping),
        refinement=steps,
        starts=whole("starts", starts),
        time_s=None if time_s is None else positive("time_s", time_s),
        threads=threads_of(threads),
    )
    if found is None:  # a cancelled search; without a cancel token only Ctrl-C cancels
        raise KeyboardInterrupt
    count = len(signal.lines)
    size = float(np.sqrt(np.mean(signal.amplitude**2)))
    chosen = replace(
        signal,
        phase_rad=found["phase"][:count] - turned,
        detection_lines=np.setdiff1d(signal.detection_lines, snow),
        snow_lines=snow,
        snow_amplitude=found["snow"] * size,
        snow_phase_rad=found["phase"][count:],
    )
    return CrestSearch(
        signal=chosen,
        crest_factor=found["crest_factor"],
        start=-1 if from_signal else found["start"],
        seed=seed,
        crest_factors=found["crest_factors"],
        clipping_iterations=found["clipping_iterations"],
        refinement_steps=found["refinement_steps"],
        status="out_of_time" if found["out_of_time"] else "completed",
    )


def _numbers(field: str, settings: Clipping | LpRefinement) -> tuple[Any, ...]:
    """Return the settings in the form of the core, which checks their ranges."""
    instance(field, settings, LpRefinement if field == "refinement" else Clipping)
    out: list[float] = []
    for setting in fields(settings):
        name, value = f"{field}.{setting.name}", getattr(settings, setting.name)
        out.append(whole(name, value, 0) if setting.type == "int" else number(name, value))
    return tuple(out)

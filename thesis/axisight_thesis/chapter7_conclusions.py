"""The conclusions of section 7.3 as claims."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight_thesis.chapter7_averages import same
from axisight_thesis.chapter7_landmarks import landmarks, triple
from axisight_thesis.chapter7_machine import Machine, small_signal_response
from axisight_thesis.chapter7_measures import (
    COUPLING,
    distance_db,
    level_db,
    log_mean,
    middle,
    names,
    scatter_db,
)
from axisight_thesis.chapter7_periods import waiting
from axisight_thesis.chapter7_sets import (
    FREQUENCY_HZ,
    LOW,
    STANDARD,
    different,
    four_periods,
    linear,
    many,
    repeats,
)
from axisight_thesis.chapter7_setting import Design
from axisight_thesis.chapter7_signals import HALF, NO_SQUARE, T2
from axisight_thesis.chapter7_sinusoid import LOW_SINUSOIDS, at_sinusoids, sinusoids
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NONE = (0.0, 0.0, 0.0)
ODD, LOW_POWER = Design("odd"), Design("low")


@item("claims-7")
def conclusions(context: Context) -> Item:
    """Return the claims of section 7.3, statement by statement."""
    claims = (*_handling(context), *_averaging(context), *_low_frequencies(context))
    return Item("claims-7", "Conclusions of section 7.3", {"": _summary(context)}, {}, claims)


def _error(context: Context, responses: Complex, rows: NDArray[np.bool_] | None = None) -> Real:
    """Return the mean error relative to the machine without dry friction, (3, 3) [dB]."""
    rows = np.ones(len(LOW), bool) if rows is None else rows
    truth = linear(context)[rows]
    return np.asarray(distance_db(responses[..., rows, :, :], truth))


def _summary(context: Context) -> pd.DataFrame:
    """Return error and randomness of single estimates per design, medians over elements."""
    designs = {
        "standard": STANDARD,
        "no_square": NO_SQUARE,
        "half_amplitude": HALF,
        "T2": T2,
        "more_low_power": LOW_POWER,
    }
    rows = []
    for name, design in designs.items():
        each = different(context, design)
        error = _error(context, each).mean(axis=0)
        low = _error(context, each, LOW).mean(axis=0)
        rows.append(
            {
                "design": name,
                "realizations": len(each),
                "error_db": middle(error),
                "low_coupling_error_db": middle(low, COUPLING),
                "scatter_db": middle(scatter_db(each).mean(axis=0)),
            }
        )
    return pd.DataFrame(rows)


def _handling(context: Context) -> tuple[Claim, ...]:
    """Return the claims on transients, friction, amplitude and permutation matrix."""
    table = waiting(context).set_index("waiting_s")
    worst = {t: table.loc[t, ["low_worst_db", "high_worst_db"]].max() for t in (0.0, 1.0, 2.0)}
    single = different(context)
    error = {d: _error(context, different(context, d)).mean(axis=0) for d in (STANDARD, NO_SQUARE)}
    worse = error[NO_SQUARE] > error[STANDARD]
    marks = landmarks({"normal": many(context), "half": many(context, HALF)})
    moved = {
        c: np.subtract(triple(marks, "half", c), triple(marks, "normal", c))
        for c in ("notch_hz", "peak_hz")
    }
    other = _error(context, different(context, T2)).mean(axis=0)
    change = distance_db(log_mean(single), log_mean(different(context, T2)))
    return (
        Claim(
            "7.3-waiting",
            "7.3",
            "Transients must be waited for; 1 to 2 s are enough.",
            bool(worst[2.0] < 0.5 * middle(scatter_db(single[0])) < worst[0.0]),
            f"worst element off by {worst[0.0]:.1f} dB without waiting, {worst[1.0]:.1f} dB after "
            f"1 s, {worst[2.0]:.1f} dB after 2 s; random from line to line anyway: "
            f"{middle(scatter_db(single[0])):.1f} dB",
        ),
        Claim(
            "7.3-square",
            "7.3",
            "A square wave, or something like it, is needed against static friction.",
            bool(worse[1:, 1:].all()),
            f"error without it, against the response without friction, in axes 2 and 3: "
            f"{middle(error[NO_SQUARE][1:, 1:]):.1f} dB, with it "
            f"{middle(error[STANDARD][1:, 1:]):.1f} dB; not better with it in {names(~worse)}",
        ),
        Claim(
            "7.3-amplitude",
            "7.3",
            "The amplitude changes where notches and peaks lie.",
            bool((np.abs(np.concatenate(list(moved.values()))) > 0.05).sum() >= 4),
            "from standard to half amplitude, (1,1), (2,2), (3,3): notches by "
            f"{_signed(moved['notch_hz'])} Hz, peaks by {_signed(moved['peak_hz'])} Hz",
        ),
        Claim(
            "7.3-permutation",
            "7.3",
            "The permutation matrix has some effect, but neither can be preferred at once.",
            bool(middle(change) > 0.1 and 0 < (other < error[STANDARD]).sum() < 9),
            f"averages with T1 and T2 differ by {middle(change):.2f} dB; T2 has the smaller error "
            f"except in {names(other >= error[STANDARD])}",
        ),
    )


def _signed(values: Real) -> str:
    return ", ".join(f"{v:+.2f}" for v in values)


def _averaging(context: Context) -> tuple[Claim, ...]:
    """Return the claims on averages over periods and realizations."""
    one = scatter_db(four_periods(context).responses()[0, 0])
    long = scatter_db(four_periods(context).averaged()[0])
    repeated = scatter_db(log_mean(same(context)))
    single, several = different(context), many(context)
    n = repeats(context)
    fall = scatter_db(log_mean(single))
    odd = different(context, ODD)
    stochastic, smooth = (scatter_db(x).mean(axis=0) for x in (single[:, ::2], odd))
    short = scatter_db(log_mean(several[:4]))
    return (
        Claim(
            "7.3-realizations",
            "7.3",
            "To reduce the randomness, average over multisines of different realizations.",
            bool((fall < one).all()),
            f"{middle(one):.2f} dB for one, {middle(fall):.2f} dB for {n}, "
            f"{middle(scatter_db(log_mean(several))):.2f} dB for {len(several)}",
        ),
        Claim(
            "7.3-no-gain",
            "7.3",
            "Averaging over periods, or over identical experiments, gives no significant "
            "reduction.",
            bool((long > 0.9 * one).all() and (repeated > 0.9 * one).all()),
            f"{middle(one):.2f} dB for one period, {middle(long):.2f} dB for four, "
            f"{middle(repeated):.2f} dB for {n} identical experiments",
        ),
        Claim(
            "7.3-short-records",
            "7.3",
            "Many short records of one period each are better than a long one.",
            bool((short < long).all()),
            f"four periods: {middle(short):.2f} dB as four realizations, {middle(long):.2f} dB "
            "as one",
        ),
        Claim(
            "7.3-odd",
            "7.3",
            "Odd multisines reduce nonlinear effects further (proposed, not tried there).",
            bool((smooth < stochastic).sum() > 4 and middle(smooth) < middle(stochastic)),
            f"random by {middle(smooth):.2f} dB with odd lines only, {middle(stochastic):.2f} dB "
            "at the same lines of the full multisine; lower in "
            f"{(smooth < stochastic).sum()} of 9 elements",
        ),
    )


def _coupling_error(context: Context, machine: Machine) -> float:
    """Return the error of a machine relative to its linear part, in the coupling up to 5 Hz [dB]."""
    truth = small_signal_response(context, FREQUENCY_HZ[LOW], machine=machine)
    error = distance_db(different(context, machine=machine)[:, LOW], truth)
    return middle(error.mean(axis=0), COUPLING)


def _low_frequencies(context: Context) -> tuple[Claim, ...]:
    """Return the claims on the coupling of axis 1 at low frequencies."""
    low = {
        d: _error(context, different(context, d), LOW).mean(axis=0) for d in (STANDARD, LOW_POWER)
    }
    broad = middle(low[STANDARD], COUPLING)
    rest = middle(low[STANDARD], ~COUPLING)
    quiet = _coupling_error(context, Machine(ripple=False))
    arm = _coupling_error(context, Machine(_NONE, _NONE, ripple=False))
    taken = four_periods(context)
    first, long = (
        middle(_error(context, x, LOW), COUPLING)
        for x in (taken.responses()[0, 0], taken.averaged()[0])
    )
    truth = at_sinusoids(linear(context))[LOW_SINUSOIDS]
    average = at_sinusoids(log_mean(different(context)))[LOW_SINUSOIDS]
    sines, multis = (
        middle(np.abs(level_db(x / truth))[:, COUPLING])
        for x in (sinusoids(context)[LOW_SINUSOIDS], average)
    )
    raised, flat = low[LOW_POWER][COUPLING], low[STANDARD][COUPLING]
    smaller = raised < flat
    return (
        Claim(
            "7.3-coupling",
            "7.3",
            "Broadband excitation does not suffice for the coupling of axis 1 with axes 2 and 3 "
            "at low frequencies.",
            broad > 2 and broad > 2 * rest,
            f"error up to 5 Hz {broad:.1f} dB there, {rest:.1f} dB in the other elements",
        ),
        Claim(
            "7.3-snr",
            "7.3",
            "The probable reason is a poor ratio to the repetitive disturbances.",
            quiet < 0.5 * broad,
            f"without ripple the error is {quiet:.1f} dB instead of {broad:.1f} dB; without dry "
            f"friction and cubic springs as well, {arm:.1f} dB: most of it comes from the arm, "
            "whose coupling changes as it swings with the square wave",
        ),
        Claim(
            "7.3-longer",
            "7.3",
            "A longer record does not improve it.",
            long > 0.9 * first,
            f"error {first:.2f} dB from one period, {long:.2f} dB from four",
        ),
        Claim(
            "7.3-sinusoid",
            "7.3",
            "A single sinusoid for a short time is better; a stepped sine is an alternative.",
            sines < multis,
            f"error {sines:.2f} dB from one period of each sinusoid up to 5 Hz, {multis:.2f} dB "
            f"from {repeats(context)} multisines",
        ),
        Claim(
            "7.3-low-power",
            "7.3",
            "More power at low frequencies is another option.",
            bool(smaller.sum() > 2 and raised.mean() < flat.mean()),
            f"with 60 % of the peak below 5 Hz the mean error up to 5 Hz is {raised.mean():.1f} dB, "
            f"with the flat spectrum {flat.mean():.1f} dB; smaller in {smaller.sum()} of 4 elements",
        ),
    )

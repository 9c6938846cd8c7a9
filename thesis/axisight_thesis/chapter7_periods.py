"""Figures 7.2, 7.3, 7.12 and 7.13: transients and averaging over periods."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight_thesis.chapter7_figure import matrix_figure, response_table, several, thick, thin
from axisight_thesis.chapter7_machine import Machine, small_signal_response
from axisight_thesis.chapter7_measures import (
    DIAGONAL,
    LOW_HZ,
    distance_db,
    level_db,
    log_mean,
    middle,
    names,
    scatter_db,
    spread_db,
)
from axisight_thesis.chapter7_records import records
from axisight_thesis.chapter7_sets import (
    FREQUENCY_HZ,
    LOW,
    STANDARD,
    different,
    four_periods,
    linear,
    linear_curve,
)
from axisight_thesis.chapter7_setting import PERIOD_S, PERIODS, Design
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item

Complex = NDArray[np.complex128]

WAITING_TIMES_S = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
# Above this frequency the elements off the diagonal are weak.
_WEAK_HZ = 30.0
# A quarter of a motor turn per period.
DRIFTING = Design(drift_rad_s=np.pi / 2 / PERIOD_S)


def waiting(context: Context) -> pd.DataFrame:
    """Return the distance of estimates from that after 5 s of waiting, per waiting time [dB].

    The columns are the distance of the largest and the median element, at low and at higher
    frequencies, and for comparison the randomness of the estimates from line to line.
    """
    responses = records(context, STANDARD, starts_s=WAITING_TIMES_S).responses()[0]
    rows = []
    for start, response in zip(WAITING_TIMES_S, responses, strict=True):
        at_low = distance_db(response[LOW], responses[-1][LOW])
        above = distance_db(response[~LOW], responses[-1][~LOW])
        rows.append(
            {
                "waiting_s": start,
                "low_diagonal_db": middle(at_low, DIAGONAL),
                "low_off_diagonal_db": middle(at_low, ~DIAGONAL),
                "low_worst_db": at_low.max(),
                "high_diagonal_db": middle(above, DIAGONAL),
                "high_off_diagonal_db": middle(above, ~DIAGONAL),
                "high_worst_db": above.max(),
            }
        )
    return pd.DataFrame(rows)


def _against_diagonal(context: Context, responses: Complex) -> str:
    """Return why transients show at high frequency too: elements off the diagonal are weak there.

    The error |dG_ij| over sqrt(|G_ii| |G_jj|) does not depend on the size of the element itself.
    """
    size = np.abs(linear(context))
    root = np.sqrt(size[:, np.arange(3), np.arange(3)])
    scale = root[:, :, None] * root[:, None, :]
    error = np.abs(responses[0] - responses[-1]) / scale
    at_low, above, high = (
        np.median(error[m], axis=0) for m in (LOW, ~LOW, FREQUENCY_HZ >= _WEAK_HZ)
    )
    weak = [
        float(np.median((size / scale)[m][:, ~DIAGONAL])) for m in (LOW, FREQUENCY_HZ >= _WEAK_HZ)
    ]
    return (
        f"In units of the diagonal elements the errors up to {LOW_HZ:g} Hz are larger in "
        f"{int((at_low > above).sum())} of 9 elements, by a median factor {np.median(at_low / above):.0f}, "
        f"and {np.median(at_low / high):.0f} over those above {_WEAK_HZ:g} Hz. In these units the elements off "
        f"the diagonal fall from {weak[0]:.2f} to {weak[1]:.2f}"
    )


@item("figure-7.2")
def transients(context: Context) -> Item:
    """Estimates with and without waiting time."""
    responses = records(context, STANDARD, starts_s=WAITING_TIMES_S).responses()[0]
    table = waiting(context)
    at_low, above = (distance_db(responses[0][m], responses[-1][m]) for m in (LOW, ~LOW))
    larger = at_low > above

    def band(low: float, high: float) -> float:
        f = FREQUENCY_HZ
        inside = (f >= low) & (f <= high)
        return middle(distance_db(responses[0][inside], responses[-1][inside]), ~DIAGONAL)

    none, second = table.iloc[0], table[table["waiting_s"] >= 1].iloc[:-1]
    scatter = middle(scatter_db(responses[-1]), ~DIAGONAL)
    claims = (
        Claim(
            "7.2.1-low",
            "7.2.1",
            "Without waiting time, transients change the estimate mainly at low frequencies.",
            bool(larger.sum() >= 7),
            f"larger up to {LOW_HZ:g} Hz than above in {larger.sum()} of 9 elements, not in "
            f"{names(~larger)}; off the diagonal {none['low_off_diagonal_db']:.1f} dB there, but "
            f"{band(8, 22):.1f} dB around the resonances, 8 to 22 Hz, and {band(30, 40):.1f} dB "
            f"above 30 Hz (median over lines and elements). {_against_diagonal(context, responses)}",
        ),
        Claim(
            "7.2.1-off-diagonal",
            "7.2.1",
            "Transients show in particular in the elements off the diagonal.",
            bool(none["low_off_diagonal_db"] > none["low_diagonal_db"]),
            f"up to {LOW_HZ:g} Hz {none['low_off_diagonal_db']:.2f} dB against "
            f"{none['low_diagonal_db']:.2f} dB on the diagonal",
        ),
        Claim(
            "7.2.1-one-second",
            "7.2.1",
            "After 1 s of waiting the estimate hardly differs from that after 5 s.",
            bool(second["low_worst_db"].max() < 0.5 * scatter),
            f"worst element up to {LOW_HZ:g} Hz, after 1, 1.5, 2, 3 s: "
            + ", ".join(f"{v:.2f}" for v in second["low_worst_db"])
            + f" dB, without waiting {none['low_worst_db']:.2f} dB; random from line to line "
            f"anyway: {scatter:.2f} dB; bound: half of that",
        ),
    )
    curves = [
        linear_curve(context),
        thick("waiting time 5 s", FREQUENCY_HZ, responses[-1]),
        thin("no waiting time", FREQUENCY_HZ, responses[0]),
    ]
    return Item(
        "figure-7.2",
        "Magnitude of the estimate without and with waiting time",
        {
            "": response_table(FREQUENCY_HZ, {"no_wait": responses[0], "wait_5_s": responses[-1]}),
            "waiting": table,
        },
        {"": matrix_figure(curves)},
        claims,
    )


@item("figure-7.3")
def single_periods(context: Context) -> Item:
    """Return separate estimates from four periods."""
    taken = four_periods(context)
    each, average = taken.responses()[0], taken.averaged()[0]
    spread, scatter = spread_db(each), scatter_db(each[0])
    bends = np.diff(level_db(each), n=2, axis=1)
    alike = np.array([np.corrcoef(bends[:, :, i, j]) for i in range(3) for j in range(3)])
    lowest = alike.min()
    claims = (
        Claim(
            "7.2.2-periods",
            "7.2.2",
            "Estimates from single periods can hardly be told apart.",
            bool((spread < 0.1 * scatter).all()),
            f"they spread by at most {spread.max():.3f} dB in any element, but are random from "
            f"line to line by {scatter.min():.2f} to {scatter.max():.2f} dB",
        ),
        Claim(
            "7.2.2-average",
            "7.2.2",
            "Averaging over periods makes almost no difference to a single period.",
            bool((np.abs(scatter_db(average) / scatter - 1) < 0.1).all()),
            f"randomness {middle(scatter):.2f} dB of one period, "
            f"{middle(scatter_db(average)):.2f} dB of four; independent errors would fall to half",
        ),
        Claim(
            "7.2.2-dependent",
            "7.2.2",
            "Disturbances are not independent from period to period.",
            bool(lowest > 0.9),
            f"correlation of the random part between two periods at least {lowest:.3f} "
            "in every element",
        ),
    )
    return Item(
        "figure-7.3",
        "Magnitude of the estimate from four different periods",
        {"": response_table(FREQUENCY_HZ, {"period": each})},
        {
            "": matrix_figure(
                [linear_curve(context), *several("four single periods", FREQUENCY_HZ, each)]
            )
        },
        claims,
    )


@item("figure-7.12")
def drifting_periods(context: Context) -> Item:
    """Estimates from four periods a quarter of a motor turn apart."""
    each = four_periods(context, DRIFTING).responses()[0]
    fixed = four_periods(context).responses()[0]
    smooth = four_periods(context, DRIFTING, Machine(ripple=False)).responses()[0]
    drifting, still, quiet = (middle(spread_db(x)) for x in (each, fixed, smooth))
    angle = _drifted_angle(context)
    change = distance_db(small_signal_response(context, FREQUENCY_HZ, angle), linear(context))
    claims = (
        Claim(
            "7.2.8-spread",
            "7.2.8",
            "With a slightly varying operating point the periods differ considerably.",
            drifting > 10 * still,
            f"spread of the four {drifting:.2f} dB against {still:.3f} dB at "
            "a fixed point (median over lines and elements)",
        ),
        Claim(
            "7.2.8-insignificant",
            "7.2.8",
            "For the arm the change of the operating point is insignificant.",
            bool((change < 0.5 * spread_db(each)).all()),
            f"{np.degrees(max(angle)):.2f} degrees in three periods change the response without "
            f"friction by {middle(change):.3f} dB (median element), at most "
            f"{(change / spread_db(each)).max():.2f} of the spread of the periods",
        ),
        Claim(
            "7.2.8-repetitive",
            "7.2.8",
            "That the periods differ points to repetitive disturbances.",
            quiet < 0.5 * drifting,
            f"the same machine without ripple spreads by {quiet:.2f} dB "
            f"instead of {drifting:.2f} dB",
        ),
    )
    return Item(
        "figure-7.12",
        "Magnitude of the estimate from four periods with a slightly varying operating point",
        {"": response_table(FREQUENCY_HZ, {"period": each})},
        {
            "": matrix_figure(
                [
                    linear_curve(context),
                    *several("four periods, a quarter of a motor turn apart", FREQUENCY_HZ, each),
                ]
            )
        },
        claims,
    )


@item("figure-7.13")
def averages_over_periods(context: Context) -> Item:
    """Averages over periods at a fixed and at a varying operating point."""
    fixed, varying = (four_periods(context, d).averaged()[0] for d in (STANDARD, DRIFTING))
    others = different(context)[:PERIODS]
    several = log_mean(others)
    scatter = {k: scatter_db(v) for k, v in zip("fds", (fixed, varying, several), strict=True)}
    lower = scatter["s"] < scatter["d"]
    claims = (
        Claim(
            "7.2.8-average",
            "7.2.8",
            "Averaging over periods with a varying operating point reduces the randomness.",
            bool((scatter["d"] < scatter["f"]).sum() > 6),
            f"{middle(scatter['d']):.2f} dB against {middle(scatter['f']):.2f} dB at a fixed "
            f"point, on the diagonal {middle(scatter['d'], DIAGONAL):.2f} against "
            f"{middle(scatter['f'], DIAGONAL):.2f} dB; lower in "
            f"{(scatter['d'] < scatter['f']).sum()} of 9 elements",
        ),
        Claim(
            "7.2.8-multisines-better",
            "7.2.8",
            "Averaging over different multisines is more effective than that.",
            bool(middle(scatter["s"]) < middle(scatter["d"]) and lower.sum() > 4),
            f"{len(others)} multisines leave {middle(scatter['s']):.2f} dB, four periods with a "
            f"varying operating point {middle(scatter['d']):.2f} dB; lower in {lower.sum()} of 9 "
            f"elements, not in {names(~lower)}",
        ),
    )
    curves = [
        linear_curve(context),
        thick("varying operating point", FREQUENCY_HZ, varying),
        thin("fixed operating point", FREQUENCY_HZ, fixed),
    ]
    table = response_table(FREQUENCY_HZ, {"fixed": fixed, "varying": varying})
    title = "Magnitude of the estimate averaged over periods at a varying and a fixed point"
    return Item("figure-7.13", title, {"": table}, {"": matrix_figure(curves)}, claims)


def _drifted_angle(context: Context) -> list[float]:
    """Return the driven joint angles [rad] after three periods of drift."""
    turn = (PERIODS - 1) * np.pi / 2
    robot = context.robot
    return list(robot.operating_point + turn * robot.gear_ratio)

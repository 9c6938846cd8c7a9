"""Figures 7.8 to 7.11: averaging over experiments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.frf import right_divide
from axisight_thesis.chapter7_figure import matrix_figure, response_table, several, thick, thin
from axisight_thesis.chapter7_machine import Machine
from axisight_thesis.chapter7_measures import (
    distance_db,
    level_db,
    log_mean,
    middle,
    names,
    scatter_db,
    spread_db,
)
from axisight_thesis.chapter7_records import periods, records
from axisight_thesis.chapter7_sets import (
    FREQUENCY_HZ,
    STANDARD,
    different,
    linear_curve,
    many,
    repeats,
)
from axisight_thesis.chapter7_setting import (
    PERIOD_S,
    PERIODS,
    WAITING_S,
    broadband,
)
from axisight_thesis.context import Context
from axisight_thesis.decision import interval, positive
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def same(context: Context) -> Complex:
    """Return estimates of experiments with the same excitation, (experiment, n_freq, 3, 3).

    Each is an average over four periods, with different noise.
    """
    starts = periods(1 if context.quick else PERIODS)
    return records(context, STANDARD, (0,) * repeats(context), starts).averaged()


@item("figure-7.8")
def same_excitation(context: Context) -> Item:
    """Estimates from experiments with the same excitation."""
    each = same(context)
    spread, scatter = spread_db(each), scatter_db(each[0])
    average = scatter_db(log_mean(each))
    silent = records(context, STANDARD, machine=Machine(noise=False)).responses()[0, 0]
    left, apart, together = _unsynchronized(context)
    first = _order_matters(context)
    claims = (
        Claim(
            "7.2.7-same",
            "7.2.7",
            "Estimates from experiments with the same excitation are almost identical.",
            bool((spread < 0.1 * scatter).all()),
            f"{len(each)} of them spread by at most {spread.max():.3f} dB in any element, but "
            f"are random from line to line by {middle(scatter):.2f} dB (median element)",
        ),
        Claim(
            "7.2.7-same-average",
            "7.2.7",
            "Averaging over them does not reduce the randomness.",
            bool((np.abs(average / scatter - 1) < 0.1).all()),
            f"{middle(scatter):.2f} dB before, {middle(average):.2f} dB after",
        ),
        Claim(
            "7.2.7-not-noise",
            "7.2.7",
            "The randomness does not come from stochastic disturbances but from nonlinearities "
            "and repetitive disturbances.",
            bool((np.abs(scatter_db(silent) / scatter - 1) < 0.1).all()),
            f"without any noise the randomness is {middle(scatter_db(silent)):.2f} dB, with "
            f"noise {middle(scatter):.2f} dB",
        ),
        Claim(
            "7.2.7-synchronization",
            "7.2.7",
            "Spectra of records that are not synchronized must not be averaged: half a period "
            "apart only noise is left. Responses may.",
            positive(np.log(apart / together)),
            f"at odd lines {interval(left, '.0f')} dB of the input are left ({len(left)} "
            f"realizations, 95 %); the estimate is random by {interval(apart, '.2f')} dB, the average "
            f"of the two estimates by {interval(together, '.2f')} dB",
        ),
        Claim(
            "7.2.7-order",
            "7.2.7",
            "Averaging before or after the inversion gives different results.",
            bool(middle(first) > 0.1),
            f"over different multisines the two differ by {middle(first):.2f} dB (median over "
            "lines and elements)",
        ),
    )
    label = f"{len(each)} experiments, same multisine"
    return Item(
        "figure-7.8",
        "Magnitude of the estimate from experiments with the same excitation",
        {"": response_table(FREQUENCY_HZ, {"experiment": each})},
        {"": matrix_figure([linear_curve(context), *several(label, FREQUENCY_HZ, each)])},
        claims,
    )


def _unsynchronized(context: Context) -> tuple[Real, Real, Real]:
    """Return the effect of averaging spectra of two records half a period apart, at odd lines.

    The results, per realization, are the remaining share of the input, the randomness of the estimate
    from the averaged spectra, and that of the average of both estimates, all in dB.
    """
    starts = (WAITING_S, WAITING_S + PERIOD_S / 2)
    taken = records(context, STANDARD, range(repeats(context)), starts)
    odd = slice(None, None, 2)  # line 5 is the first
    diagonal = np.diagonal(taken.input[:, :, odd], axis1=-2, axis2=-1)
    share = np.abs(diagonal.mean(axis=1)) / np.abs(diagonal[:, 0])
    left = 20 * np.log10(np.median(share, axis=(1, 2)))
    apart = [middle(scatter_db(one)) for one in taken.averaged()[:, odd]]
    together = [middle(scatter_db(log_mean(pair))) for pair in taken.responses()[:, :, odd]]
    return np.asarray(left), np.array(apart), np.array(together)


def _order_matters(context: Context) -> NDArray[np.float64]:
    """Return the distance between the mean of estimates and the estimate from mean spectra [dB]."""
    taken = records(context, STANDARD, range(repeats(context)))
    u, y = taken.input[:, 0], taken.output[:, 0]
    single, together = right_divide(y, u)[0], right_divide(y.mean(axis=0), u.mean(axis=0))[0]
    return distance_db(single.mean(axis=0), together)


@item("figure-7.9")
def different_multisines(context: Context) -> Item:
    """Estimates from experiments with different multisines."""
    each = different(context)
    spread, alike = middle(spread_db(each)), middle(spread_db(same(context)))
    varied = Claim(
        "7.2.7-different",
        "7.2.7",
        "Estimates from different multisines of the same spectrum vary much more.",
        spread > 10 * alike,
        f"spread {spread:.2f} dB, with the same multisine {alike:.4f} dB (median over lines "
        "and elements)",
    )
    step = context.robot.sample_time_s
    crest = [broadband(STANDARD, step, context.seed, k).crest_factor for k in range(len(each))]
    made = Claim(
        "7.1-crest",
        "7.1",
        "Random initial phases and the clipping algorithm give a crest factor of about 1.55.",
        bool(abs(np.mean(crest) - 1.55) < 0.05),
        f"{np.mean(crest):.3f} on average, {min(crest):.3f} to {max(crest):.3f} in {len(crest)} "
        "multisines of 196 lines",
    )
    label = f"{len(each)} experiments, different multisines"
    return Item(
        "figure-7.9",
        "Magnitude of the estimate from experiments with different multisines",
        {"": response_table(FREQUENCY_HZ, {"realization": each})},
        {"": matrix_figure([linear_curve(context), *several(label, FREQUENCY_HZ, each)])},
        (varied, made),
    )


@item("figure-7.10")
def averages_over_multisines(context: Context) -> Item:
    """Logarithmic means over experiments with the same and with different multisines."""
    alike, varied = log_mean(same(context)), log_mean(different(context))
    scatter, less = scatter_db(alike), scatter_db(varied)
    all_of_them = many(context)
    least = scatter_db(log_mean(all_of_them))
    n, more = repeats(context), len(all_of_them)
    claims = (
        Claim(
            "7.2.7-reduced",
            "7.2.7",
            "Averaging over different multisines reduces the randomness.",
            bool((less < scatter).all()),
            f"{middle(scatter):.2f} dB with the same, {middle(less):.2f} dB with {n} different; "
            f"lower in {(less < scatter).sum()} of 9 elements",
        ),
        Claim(
            "7.2.7-more",
            "7.2.7",
            "With more experiments it would fall further.",
            bool((least < less).all()),
            f"{middle(less):.2f} dB with {n} realizations, {middle(least):.2f} dB with {more}; "
            f"lower in {(least < less).sum()} of 9 elements",
        ),
    )
    curves = [
        linear_curve(context),
        thick(f"log mean of {n}, different multisines", FREQUENCY_HZ, varied),
        thin(f"log mean of {n}, same multisine", FREQUENCY_HZ, alike),
    ]
    return Item(
        "figure-7.10",
        "Magnitude of the logarithmic mean over the same and over different multisines",
        {"": response_table(FREQUENCY_HZ, {"same": alike, "different": varied})},
        {"": matrix_figure(curves)},
        claims,
    )


@item("figure-7.11")
def arithmetic_or_logarithmic(context: Context) -> Item:
    """Arithmetic and logarithmic mean over different multisines."""
    each = different(context)
    arithmetic, logarithmic = each.mean(axis=0), log_mean(each)
    size = repeats(context)
    drawn = many(context)
    groups = [drawn[k : k + size] for k in range(0, len(drawn) - size + 1, size)]
    rough = np.mean([scatter_db(g.mean(axis=0)) for g in groups], axis=0)
    smooth = np.mean([scatter_db(log_mean(g)) for g in groups], axis=0)
    lower = smooth < rough
    outlier = [np.abs(level_db(np.stack([g.mean(axis=0), log_mean(g)]))) for g in groups]
    apart = np.mean([middle(np.median(np.abs(o[0] - o[1]), axis=0)) for o in outlier])
    claims = (
        Claim(
            "7.2.7-log-smoother",
            "7.2.7",
            "The logarithmic mean is smoother than the arithmetic mean.",
            bool(middle(smooth) < middle(rough) and lower.sum() > 4),
            f"random by {middle(smooth):.2f} against {middle(rough):.2f} dB (median element, "
            f"{len(groups)} groups of {size} multisines); lower in {lower.sum()} of 9 elements, "
            f"not in {names(~lower)}; the two means differ by {apart:.2f} dB",
        ),
    )
    curves = [
        linear_curve(context),
        thick("logarithmic mean", FREQUENCY_HZ, logarithmic),
        thin("arithmetic mean", FREQUENCY_HZ, arithmetic),
    ]
    return Item(
        "figure-7.11",
        "Magnitude of the arithmetic and the logarithmic mean",
        {"": response_table(FREQUENCY_HZ, {"arithmetic": arithmetic, "logarithmic": logarithmic})},
        {"": matrix_figure(curves)},
        claims,
    )

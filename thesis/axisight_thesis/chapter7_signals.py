"""Figures 7.4 to 7.7: square wave, amplitude, permutation matrix, multisine and chirp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight_thesis.chapter7_figure import (
    matrix_figure,
    response_table,
    thick,
    thin,
    zoom_figure,
)
from axisight_thesis.chapter7_landmarks import NOTCH_HZ, landmarks, triple
from axisight_thesis.chapter7_machine import Machine
from axisight_thesis.chapter7_measures import (
    distance_db,
    level_db,
    log_mean,
    middle,
    names,
    notch_hz,
    scatter_db,
)
from axisight_thesis.chapter7_sets import (
    FREQUENCY_HZ,
    LOW,
    STANDARD,
    different,
    four_periods,
    linear,
    linear_curve,
    many,
    repeats,
)
from axisight_thesis.chapter7_setting import PEAK_RAD_S, Design, broadband, references
from axisight_thesis.context import Context
from axisight_thesis.decision import all_of, interval, positive
from axisight_thesis.item import Claim, Item, item

Complex = NDArray[np.complex128]

NO_SQUARE = Design(square=False)
HALF = Design(scale=0.5)
T2 = Design(directions="T2")
CHIRP, CENTRED_CHIRP = Design("chirp"), Design("centred chirp")

# Axis 1 with the friction of axis 2.
_ROUGH_AXIS_1 = Machine(coulomb_nm=(2.0, 2.0, 1.6))
_NO_CUBE = Machine(cubic_nm_rad3=(0.0, 0.0, 0.0))


def _text(values: list[float], digits: int = 2) -> str:
    return ", ".join(f"{v:.{digits}f}" for v in values)


def _two(
    name: str, title: str, context: Context, one: Complex, other: Complex, labels: list[str]
) -> Item:
    """Return an item of two responses without claims, with ``one`` drawn thin and ``other`` thick."""
    columns = [label.replace(" ", "_").replace(",", "") for label in labels]
    curves = [
        linear_curve(context),
        thick(labels[1], FREQUENCY_HZ, other),
        thin(labels[0], FREQUENCY_HZ, one),
    ]
    table = response_table(FREQUENCY_HZ, dict(zip(columns, (one, other), strict=True)))
    return Item(name, title, {"": table}, {"": matrix_figure(curves)})


def _first(context: Context, other: Design) -> tuple[Complex, Complex]:
    """Return the first estimate of the standard and of another design."""
    return different(context)[0], different(context, other)[0]


@item("figure-7.4")
def square_wave(context: Context) -> Item:
    """Estimates with and without the square wave."""
    title = "Magnitude of the estimate with and without a square wave in the excitation"
    labels = ["with square wave", "without square wave"]
    drawn = _two("figure-7.4", title, context, *_first(context, NO_SQUARE), labels)
    marks = landmarks(
        {
            "with": different(context),
            "without": different(context, NO_SQUARE),
            "with, rough axis 1": different(context, machine=_ROUGH_AXIS_1, count=1),
            "without, rough axis 1": different(context, NO_SQUARE, _ROUGH_AXIS_1, 1),
        }
    )
    high, flat = triple(marks, "with", "peak_db"), triple(marks, "without", "peak_db")
    kept = [b / a for a, b in zip(high, flat, strict=True)]
    up, down = triple(marks, "with", "notch_hz"), triple(marks, "without", "notch_hz")
    rough = triple(marks, "without, rough axis 1", "peak_db")[0]
    rough /= triple(marks, "with, rough axis 1", "peak_db")[0]
    crossings = [_crossings(context, d) for d in (NO_SQUARE, STANDARD)]
    claims = (
        Claim(
            "7.2.3-peaks",
            "7.2.3",
            "Without the square wave the resonance peaks almost disappear, except in (1,1).",
            max(kept[1:]) < 0.5 and kept[0] > 0.75,
            f"height of the first peak over the level above 30 Hz, axes 1 to 3: "
            f"{_text(high, 1)} dB with and {_text(flat, 1)} dB without (log mean of realizations)",
        ),
        Claim(
            "7.2.3-notches",
            "7.2.3",
            "Without the square wave notches lie lower, except in (1,1).",
            down[1] < up[1] and down[2] < up[2] and down[0] >= up[0] - 0.1,
            f"first notch, axes 1 to 3: {_text(up)} Hz with and {_text(down)} Hz without",
        ),
        Claim(
            "7.2.3-axis-1",
            "7.2.3",
            "That (1,1) is an exception comes from less friction on axis 1.",
            rough < 0.75 * kept[0],
            f"with the friction of axis 2 on axis 1, (1,1) keeps {100 * rough:.0f} % of its peak "
            f"in dB instead of {100 * kept[0]:.0f} %",
        ),
        Claim(
            "7.1-crossings",
            "7.1",
            "The square wave reduces the number of zero crossings of the velocity.",
            crossings[1] < 0.5 * crossings[0],
            f"{crossings[0]:.0f} sign changes of the reference per period without, "
            f"{crossings[1]:.0f} with (mean over axes moved)",
        ),
    )
    return Item(drawn.name, title, drawn.tables | {"landmarks": marks}, drawn.figures, claims)


def _crossings(context: Context, design: Design) -> float:
    refs = references(context.robot, design, context.seed, 0)
    signs = np.sign(refs[np.arange(3), :, np.arange(3)])
    return float((np.diff(signs, axis=1) != 0).sum(axis=1).mean())


@item("figure-7.5")
def amplitude(context: Context) -> Item:
    """Estimates at the standard and at half the amplitude."""
    title = "Magnitude of the estimate for different amplitudes"
    labels = ["normal amplitude", "half amplitude"]
    drawn = _two("figure-7.5", title, context, *_first(context, HALF), labels)
    marks = landmarks(
        {
            "normal": many(context),
            "half": many(context, HALF),
            "normal, linear springs": many(context, machine=_NO_CUBE),
            "half, linear springs": many(context, HALF, _NO_CUBE),
        }
    )
    full, half = triple(marks, "normal", "notch_hz"), triple(marks, "half", "notch_hz")
    fall = list(np.subtract(full, half))
    cube_free = list(
        np.subtract(
            triple(marks, "normal, linear springs", "notch_hz"),
            triple(marks, "half, linear springs", "notch_hz"),
        )
    )
    change = distance_db(log_mean(different(context)), log_mean(different(context, HALF)))
    scatter = scatter_db(different(context)[0])
    claims = (
        Claim(
            "7.2.4-notch",
            "7.2.4",
            "The notch frequencies of (1,1) and (2,2) fall when the amplitude is halved.",
            min(fall[:2]) > 0,
            f"first notch of (1,1), (2,2), (3,3): {_text(full)} Hz, halved {_text(half)} Hz "
            "(log mean of realizations)",
        ),
        Claim(
            "7.2.4-hard-to-see",
            "7.2.4",
            "Otherwise the two amplitudes are hard to tell apart.",
            bool((change < scatter).all()),
            f"averages differ by {middle(change):.2f} dB; one estimate is random from line to "
            f"line by {middle(scatter):.2f} dB (median element)",
        ),
        Claim(
            "7.2.4-stiffness",
            "7.2.4",
            "The fall agrees with gears that get stiffer for larger amplitudes.",
            cube_free[0] < 0.5 * fall[0] and cube_free[1] < 0.5 * fall[1],
            f"fall of the notch {_text(fall)} Hz; with linear springs {_text(cube_free)} Hz: what "
            "remains is dry friction's",
        ),
    )
    means = {"normal": log_mean(different(context)), "half": log_mean(different(context, HALF))}
    of = f"amplitude, log mean of {repeats(context)}"
    curves = [
        linear_curve(context),
        thick(f"half {of}", FREQUENCY_HZ, means["half"]),
        thin(f"normal {of}", FREQUENCY_HZ, means["normal"]),
    ]
    figures = drawn.figures | {
        "notches": zoom_figure(curves, {(1, 1): (3.0, 7.0), (2, 2): (6.0, 11.0)})
    }
    tables = {"landmarks": marks, "notches": response_table(FREQUENCY_HZ, means)}
    return Item(drawn.name, title, drawn.tables | tables, figures, claims)


@item("figure-7.6")
def permutation(context: Context) -> Item:
    """Estimates with the permutation matrices T1 and T2."""
    title = "Magnitude of the estimate for the permutation matrices T1 and T2"
    drawn = _two("figure-7.6", title, context, *_first(context, T2), ["T1", "T2"])
    sets = {"T1": different(context), "T2": different(context, T2)}
    marks = landmarks({"T1": many(context), "T2": many(context, T2)})
    one, two = triple(marks, "T1", "notch_hz"), triple(marks, "T2", "notch_hz")
    # Compared by realization, because the multisine is the same with T1 and T2.
    singles = [many(context), many(context, T2)]
    alone = np.array(
        [
            [[notch_hz(FREQUENCY_HZ, g[:, i, i], NOTCH_HZ[i]) for g in x] for x in singles]
            for i in (0, 2)
        ]
    )
    higher = alone[:, 1] - alone[:, 0]
    truth = linear(context)
    error = {k: np.median(distance_db(v, truth), axis=0) for k, v in sets.items()}
    near = {k: distance_db(v[:, LOW], truth[LOW]).mean(axis=0)[0, 1:] for k, v in sets.items()}
    at_low = {
        k: np.median(level_db(v[:, LOW]) - level_db(truth[LOW]), axis=(0, 1))[0, 1:]
        for k, v in sets.items()
    }
    better = error["T2"] < error["T1"]
    claims = (
        Claim(
            "7.2.5-no-winner",
            "7.2.5",
            "It is hard to say which permutation matrix is better: neither is throughout.",
            0 < better.sum() < 9,
            f"T2 is closer to the response without friction in {better.sum()} of 9 elements "
            f"({middle(error['T2']):.2f} against {middle(error['T1']):.2f} dB), not in "
            f"{names(~better)}",
        ),
        Claim(
            "7.2.5-notch",
            "7.2.5",
            "With T2 the notch is higher in (1,1) and lower in (3,3).",
            all_of([positive(higher[0]), positive(-higher[1])]),
            f"T2 less T1 in {higher.shape[1]} realizations: (1,1) {interval(higher[0])} Hz, (3,3) "
            f"{interval(higher[1])} Hz (95 %); of the log means: (1,1) {one[0]:.2f} Hz with T1, "
            f"{two[0]:.2f} Hz with T2; (3,3) {one[2]:.2f} and {two[2]:.2f} Hz",
        ),
        Claim(
            "7.2.5-coupling",
            "7.2.5",
            "T2 gives lower estimates of (1,2) and (1,3), closer to the true values.",
            bool((at_low["T2"] < at_low["T1"]).all() and (near["T2"] < near["T1"]).all()),
            "up to 5 Hz relative to the response without friction: (1,2) "
            f"{at_low['T1'][0]:+.1f} dB with T1, {at_low['T2'][0]:+.1f} dB with T2; (1,3) "
            f"{at_low['T1'][1]:+.1f} and {at_low['T2'][1]:+.1f} dB; mean error (1,2) "
            f"{near['T1'][0]:.1f} and {near['T2'][0]:.1f} dB, (1,3) {near['T1'][1]:.1f} and "
            f"{near['T2'][1]:.1f} dB",
        ),
    )
    return Item(drawn.name, title, drawn.tables | {"landmarks": marks}, drawn.figures, claims)


@item("figure-7.7")
def chirp(context: Context) -> Item:
    """Estimates with the chirp and with the multisine."""
    title = "Magnitude of the estimate using a chirp and a multisine"
    taken = {d: four_periods(context, d).averaged()[0] for d in (STANDARD, CHIRP, CENTRED_CHIRP)}
    drawn = _two(
        "figure-7.7", title, context, taken[STANDARD], taken[CHIRP], ["multisine", "chirp"]
    )
    truth = linear(context)
    error = {d: distance_db(g, truth) for d, g in taken.items()}
    scatter = {d: scatter_db(g) for d, g in taken.items()}
    usual = distance_db(different(context), truth)
    inside = (error[CHIRP] > 0.8 * usual.min(axis=0)) & (error[CHIRP] < 1.25 * usual.max(axis=0))
    mean = PEAK_RAD_S * broadband(CHIRP, context.robot.sample_time_s, context.seed, 0).period.mean()
    lower = scatter[CHIRP] < scatter[CENTRED_CHIRP]
    claims = (
        Claim(
            "7.2.6-same",
            "7.2.6",
            "Multisine and chirp give about the same; it is hard to say which to use.",
            int(inside.sum()) >= 8,
            f"error of the chirp {middle(error[CHIRP]):.2f} dB, of multisines "
            f"{middle(usual.min(axis=0)):.2f} to {middle(usual.max(axis=0)):.2f} dB (median "
            f"element); within that range, a quarter wider, in {inside.sum()} of 9 elements",
        ),
        Claim(
            "7.2.6-mean",
            "7.2.6",
            "The chirp has a small mean, which improves the average over periods slightly.",
            bool(middle(scatter[CHIRP] / scatter[CENTRED_CHIRP]) < 1 and lower.sum() > 4),
            f"mean {mean:.3f} rad/s; average of four periods random by "
            f"{middle(scatter[CHIRP]):.2f} dB, with the phase that leaves no mean "
            f"{middle(scatter[CENTRED_CHIRP]):.2f} dB; lower in {lower.sum()} of 9 elements",
        ),
    )
    return Item(drawn.name, title, drawn.tables, drawn.figures, claims)

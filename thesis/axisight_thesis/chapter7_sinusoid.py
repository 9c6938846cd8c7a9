"""Figure 7.14: single sinusoids and broadband excitation."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight_thesis.chapter7_figure import markers, matrix_figure, response_table, thin
from axisight_thesis.chapter7_measures import (
    COUPLING,
    LOW_HZ,
    level_db,
    log_mean,
    middle,
    scatter_db,
)
from axisight_thesis.chapter7_records import records
from axisight_thesis.chapter7_sets import FREQUENCY_HZ, different, linear, linear_curve
from axisight_thesis.chapter7_setting import PERIOD_S, Design, broadband
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Even lines, which the square wave does not excite, away from resonances.
SINUSOIDS_HZ = (1.2, 2.0, 3.2, 16.0, 32.0)
LOW_SINUSOIDS = np.array(SINUSOIDS_HZ) <= LOW_HZ


def sinusoids(context: Context) -> Complex:
    """Return the estimate of one period of each sinusoid, (sinusoid, 3, 3)."""
    taken = [records(context, Design(sinusoid_hz=f)).responses()[0, 0, 0] for f in SINUSOIDS_HZ]
    return np.stack(taken)


def at_sinusoids(response: Complex) -> Complex:
    """Return a broadband response at the frequencies of the sinusoids."""
    rows = [int(np.argmin(np.abs(FREQUENCY_HZ - f))) for f in SINUSOIDS_HZ]
    return np.asarray(response[..., rows, :, :])


@item("figure-7.14")
def single_sinusoids(context: Context) -> Item:
    """Single sinusoids against the average over multisines."""
    sines, average = sinusoids(context), log_mean(different(context))
    truth = at_sinusoids(linear(context))
    error = np.abs(level_db(sines) - level_db(truth))
    broad = np.abs(level_db(at_sinusoids(average)) - level_db(truth))
    apart = np.abs(level_db(sines) - level_db(at_sinusoids(average)))
    special = LOW_SINUSOIDS[:, None, None] & COUPLING
    scatter = scatter_db(average)
    elsewhere, coupling = middle(apart, ~special), middle(apart, special)
    closer = error[special] < broad[special]
    total, line = _power(context)
    claims = (
        Claim(
            "7.2.9-power",
            "7.2.9",
            "A sinusoid of the same peak has about the power of the multisine, but much more at "
            "its frequency.",
            abs(total) < 3 and line > 10,
            f"total power {total:+.1f} dB, at its line {line:+.1f} dB",
        ),
        Claim(
            "7.2.9-agree",
            "7.2.9",
            "Sinusoids and multisines agree closely, except at low frequencies in the coupling "
            "of axis 1 with axes 2 and 3.",
            elsewhere < middle(scatter) < coupling,
            f"apart by {coupling:.2f} dB up to {LOW_HZ:g} Hz in (1,2), (1,3), (2,1), (3,1), by "
            f"{elsewhere:.2f} dB elsewhere (medians); the average is random by "
            f"{middle(scatter):.2f} dB",
        ),
        Claim(
            "7.2.9-closer",
            "7.2.9",
            "There the sinusoids are closer to the true values.",
            bool(closer.mean() > 0.5 and middle(error, special) < middle(broad, special)),
            f"error {middle(error, special):.2f} dB against {middle(broad, special):.2f} dB; "
            f"closer in {closer.sum()} of {closer.size} values",
        ),
    )
    curves = [
        linear_curve(context),
        thin(f"log mean of {len(different(context))} multisines", FREQUENCY_HZ, average),
        markers("single sinusoids", np.array(SINUSOIDS_HZ), sines),
    ]
    tables = {
        "": response_table(FREQUENCY_HZ, {"log_mean": average}),
        "sinusoids": _values(sines, at_sinusoids(average), truth),
    }
    title = "Magnitude of the estimate from single sinusoids and from multisines"
    return Item("figure-7.14", title, tables, {"": matrix_figure(curves)}, claims)


def _power(context: Context) -> tuple[float, float]:
    """Return the power of sinusoid over multisine [dB], in total and at the line of the sinusoid."""
    step = context.robot.sample_time_s
    sine, multi = (
        np.abs(np.fft.rfft(broadband(d, step, context.seed, 0).period)) ** 2
        for d in (Design(sinusoid_hz=SINUSOIDS_HZ[0]), Design())
    )
    line = round(SINUSOIDS_HZ[0] * PERIOD_S)
    ratios = sine.sum() / multi.sum(), sine[line] / multi[line]
    return 10 * float(np.log10(ratios[0])), 10 * float(np.log10(ratios[1]))


def _values(sines: Complex, average: Complex, truth: Complex) -> pd.DataFrame:
    """Return the values at the sinusoids side by side."""
    named = {"sinusoid": sines, "log_mean": average, "without_dry_friction": truth}
    return response_table(np.array(SINUSOIDS_HZ), named)

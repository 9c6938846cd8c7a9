"""Section 8.3.2: Tables 8.3 and 8.4, one frequency with a sinusoid and with a multisine."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.frf.errors import relative_error, signal_to_noise_ratio
from axisight_thesis.agreement import Agreement
from axisight_thesis.chapter8_robot import CONTROLLER_SPEED, weakly_coupled
from axisight_thesis.chapter8_setting import PERIOD_S, Design, excited_lines
from axisight_thesis.chapter8_study import Experiments, one_design, true_response
from axisight_thesis.chapter8_tables import THESIS_8_2, mean_error_table, realizations
from axisight_thesis.context import Context
from axisight_thesis.element_plot import decibel
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]

# Wernholt (2004), Tables 8.3 [dB], (input or output, sinusoid or multisine), and 8.4 [%].
THESIS_8_3 = np.array(
    [
        [
            [[49.1, 57.9, 50.4], [50.9, 53.1, 52.7], [54.1, 53.8, 51.2]],
            [[14.3, 8.8, -1.9], [4.9, 26.1, 31.7], [-0.8, 33.2, 21.4]],
        ],
        [
            [[85.3, 66.7, 54.8], [67.3, 86.2, 78.2], [51.1, 82.0, 85.8]],
            [[65.1, 53.3, 37.8], [39.2, 62.9, 66.9], [33.8, 61.6, 62.7]],
        ],
    ]
)
THESIS_8_4 = np.array(
    [
        [[0.36, 0.60, 0.81], [0.29, 0.32, 0.42], [0.34, 0.45, 0.37]],
        [[19.0, 163.0, 309.0], [225.0, 19.0, 29.0], [431.0, 29.0, 23.0]],
    ]
)

# The thesis does not state the frequency. Odd multiples of 0.1 Hz have no ripple of the square wave
# alone, as the balanced signal-to-noise ratios of the sinusoid in Table 8.3 require.
SINUSOID_HZ = 1.3
SINUSOID = Design("T1", square=True, sinusoid_hz=SINUSOID_HZ)
MULTISINE = Design("T1", square=True)
EXCITATIONS = ("sinusoid", "multisine")
SIGNALS = ("input", "output")

# Factors that hold for 95 % and for half of the errors at one line, whose magnitude scatters as a
# Rayleigh variable about its mean.
RAYLEIGH_FACTORS = (3.9, 1.46)
_LINES_HZ = (1.1, 1.2, 1.3, 1.5, 1.9)
_LINE_RUNS = 6
# Speeds of the controller over the preset's.
_SPEEDS = (1.0, 0.5)


def single_frequency(
    context: Context, frequency_hz: float = SINUSOID_HZ, runs: int | None = None
) -> list[list[Experiments]]:
    """Return realizations of sinusoid and of multisine at one frequency, on the robot of ``context``.

    By default 24, because a single line scatters more than the means over lines of Table 8.2.
    """
    line = int(np.flatnonzero(excited_lines() == round(frequency_hz * PERIOD_S))[0])
    usual = realizations(context) * (1 if context.quick else 3)
    chosen = range(min(runs or usual, usual))
    sinusoid = Design("T1", square=True, sinusoid_hz=frequency_hz)
    multisines = [one_design(context, MULTISINE, run).at(line) for run in chosen]
    return [[one_design(context, sinusoid, run) for run in chosen], multisines]


def snr(found: Experiments) -> tuple[Real, Real]:
    """Return input and output signal-to-noise ratio [dB], (n_freq, channel, experiment)."""
    u = signal_to_noise_ratio(found.input, found.input_disturbance)
    y = signal_to_noise_ratio(found.output, found.output_disturbance)
    return decibel(u), decibel(y)


def snr_runs(context: Context, runs: int | None = None) -> Real:
    """Return Table 8.3 [dB], (realization, input or output, sinusoid or multisine, row, column)."""
    found = [[snr(f) for f in each] for each in single_frequency(context, runs=runs)]
    return np.asarray(np.array(found)[:, :, :, 0].transpose(1, 2, 0, 3, 4))


def error_runs(
    context: Context, frequency_hz: float = SINUSOID_HZ, runs: int | None = None
) -> Real:
    """Return relative errors [1], (realization, sinusoid or multisine, output, input)."""

    def error(found: Experiments) -> Real:
        true = true_response(context, found.frequency_hz)
        return np.asarray(np.abs(relative_error(found.estimate, true)[0]))

    found = single_frequency(context, frequency_hz, runs)
    return np.array([[error(f) for f in each] for each in found]).swapaxes(0, 1)


def single_frequency_snr(context: Context) -> Real:
    """Return Table 8.3 [dB], (sinusoid or multisine, input or output, row, column)."""
    return np.asarray(snr_runs(weakly_coupled(context)).mean(axis=0).swapaxes(0, 1))


def single_frequency_error(context: Context) -> Real:
    """Return the relative errors of Table 8.4 [1], (sinusoid or multisine, output, input)."""
    return np.asarray(error_runs(weakly_coupled(context)).mean(axis=0))


@item("table-8.3")
def table_8_3(context: Context) -> Item:
    """Return signal-to-noise ratios at one frequency, sinusoid and multisine."""
    runs, preset = (snr_runs(c) for c in (weakly_coupled(context), context))
    rows, claims = [], []
    for m, name in enumerate(SIGNALS):
        for k, what in enumerate(EXCITATIONS):
            here, before = (x[:, m, k].mean(axis=0) for x in (runs, preset))
            rows += _rows(
                {"signal": name, "excitation": what}, THESIS_8_3[m, k], here, before, "db"
            )
        # An amplitude ratio grows tenfold in 20 dB.
        amplitudes = [10 ** (x / 20) for x in (THESIS_8_3[m], runs[:, m], preset[:, m])]
        same, other = (Agreement.of(amplitudes[0], x) for x in amplitudes[1:])
        claims += _agreements("8.3", same, other, f"-{name}", f"{name} SNR")
    title = f"Signal-to-noise ratio at {SINUSOID_HZ} Hz"
    return Item("table-8.3", title, {"": pd.DataFrame(rows)}, {}, tuple(claims))


@item("table-8.4")
def table_8_4(context: Context) -> Item:
    """Return relative errors at one frequency, sinusoid and multisine, and what they depend on."""
    runs, preset = (100 * error_runs(c) for c in (weakly_coupled(context), context))
    rows = []
    for k, what in enumerate(EXCITATIONS):
        means = [x[:, k].mean(axis=0) for x in (runs, preset)]
        rows += _rows({"excitation": what}, THESIS_8_4[k], means[0], means[1], "percent")
    factor, before = _factor(runs, THESIS_8_4), _factor(preset, THESIS_8_4)
    largest, median = RAYLEIGH_FACTORS
    value = Claim(
        "table-8.4",
        "8.3.2",
        "Table 8.4 comes out as far as one line of one realization allows: every entry within a factor "
        f"{largest:g} (95 % of single errors), the median within {median:g} (half of them).",
        bool(factor.max() <= largest and np.median(factor) <= median),
        f"largest factor {factor.max():.2f}, median {np.median(factor):.2f} ({len(runs)} start angles); "
        f"on the preset {before.max():.2f} and {np.median(before):.2f}",
    )
    same, other = (Agreement.of(THESIS_8_4, x) for x in (runs, preset))
    claims = (value, *_agreements("8.4", same, other, "", "errors"))
    tables = {"": pd.DataFrame(rows), "robots": _robots(context), "lines": _lines(context)}
    return Item("table-8.4", f"Relative error at {SINUSOID_HZ} Hz", tables, {}, claims)


def _agreements(
    table: str, found: Agreement, preset: Agreement, suffix: str, what: str
) -> list[Claim]:
    """Return the claims on pattern and size of a table."""
    return [
        Claim(
            f"table-{table}{suffix}-pattern",
            "8.3.2",
            f"Table {table}, {what}: large and small entries are those of the thesis, as well as in "
            "single realizations of this study.",
            found.alike,
            f"{found.correlations()}; on the preset {preset.correlation:.3f}",
        ),
        Claim(
            f"table-{table}{suffix}-scatter",
            "8.3.2",
            f"Table {table}, {what}: the thesis could be one realization of this study.",
            found.scattered,
            f"{found.intervals()}; {found.factors()}; on the preset "
            f"{int(preset.outside.sum())} entries, {preset.factors()}",
        ),
    ]


def _robots(context: Context) -> pd.DataFrame:
    """Return how far the tables are from the thesis, for both robots and for slower control."""
    weak = weakly_coupled(context)
    rows = []
    for name, robot in (("preset", context), ("section 8.3.2", weak)):
        designs = np.exp(np.abs(np.log(mean_error_table(robot) / THESIS_8_2)))
        row = {
            "table_8.2_largest_factor": designs.max(),
            "table_8.2_median_factor": _middle(designs),
        }
        rows.append({"robot": name, **row, **_distances(robot)})
    for speed in _SPEEDS:
        slower = context.shared(("chapter8-speed", speed), partial(_at_speed, context, speed))
        name = f"section 8.3.2, controller speed {speed:g}"
        rows.append({"robot": name, **_distances(slower, _LINE_RUNS)})
    return pd.DataFrame(rows)


def _at_speed(context: Context, speed: float) -> Context:
    """Return the robot of section 8.3.2 with another speed of the controller."""
    weak = weakly_coupled(context)
    robot = weak.robot.with_controller_speed(speed / CONTROLLER_SPEED)
    return replace(weak, robot=robot, _studies={})


def _distances(robot: Context, runs: int | None = None) -> dict[str, float]:
    """Return the distances of Tables 8.3 [dB] and 8.4 from the thesis."""
    decibels = np.abs(snr_runs(robot, runs).mean(axis=0) - THESIS_8_3)
    factor = _factor(100 * error_runs(robot, runs=runs), THESIS_8_4)
    return {
        "table_8.3_median_db": _middle(decibels),
        "table_8.3_input_median_db": _middle(decibels[0]),
        "table_8.3_output_median_db": _middle(decibels[1]),
        "table_8.4_largest_factor": float(factor.max()),
        "table_8.4_median_factor": _middle(factor),
    }


def _middle(values: Real) -> float:
    return float(np.median(values))


def _lines(context: Context) -> pd.DataFrame:
    """Return how far Table 8.4 is from the thesis if the sinusoid has another frequency."""
    rows = []
    for name, robot in (("preset", context), ("section 8.3.2", weakly_coupled(context))):
        for frequency in _LINES_HZ:
            factor = _factor(100 * error_runs(robot, frequency, _LINE_RUNS), THESIS_8_4)
            row: dict[str, object] = {"robot": name, "frequency_hz": frequency}
            for k, what in enumerate(EXCITATIONS):
                row[f"{what}_largest_factor"] = factor[k].max()
                row[f"{what}_median_factor"] = np.median(factor[k])
            rows.append(row)
    return pd.DataFrame(rows)


def _factor(runs: Real, thesis: Real) -> Real:
    """Return the factors between the means over realizations and the thesis, at least one."""
    return np.asarray(np.exp(np.abs(np.log(runs.mean(axis=0) / thesis))))


def _rows(
    head: dict[str, str], thesis: Real, here: Real, preset: Real, unit: str
) -> list[dict[str, object]]:
    return [
        {
            **head,
            "row": i + 1,
            "column": j + 1,
            f"thesis_{unit}": thesis[i, j],
            f"here_{unit}": here[i, j],
            f"preset_{unit}": preset[i, j],
        }
        for i in range(3)
        for j in range(3)
    ]

"""A real two-mass bench: response, noise and distortion from two multisine runs.

Run: python run.py [--data FOLDER] [--out FOLDER]. The data is not part of this
repository; see README.md for where it comes from. FOLDER holds MultisineTypeA.mat
and MultisineTypeB.mat; the default is fditools_multisine/ under AXISIGHT_DATA.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.io import loadmat

from axisight import frf, records
from axisight.palette import MEASURED, SERIES

HERE = Path(__file__).resolve().parent
OUTPUTS = ("motor angle", "load angle")
PERIOD_S = 1.0
BANDS_HZ = ((11, 45), (45, 61), (61, 70), (70, 85), (85, 120), (120, 250))
RESONANCE_HZ = (70, 85)
LINEAR_DB = -30.0  # distortion against the output below which a band counts as linear
NEIGHBOURS = 6  # detection lines of a kind that make the level at a line


@dataclass(frozen=True)
class Findings:
    """What the two runs say.

    full, odd_odd
        Responses, outputs motor and load angle, of run A (full grid) and of run B (odd-odd
        grid); ``variance`` holds noise and distortion in both.
    levels
        Amplitude [rad] over (frequency_hz, output, kind), run B: ``output_amplitude`` at excited
        lines; ``level`` (noise, odd, even), the last two corrected for the distortion of the
        current and for noise; ``uncorrected``.
    agreement
        Over (frequency_hz, output), at the lines of run B: ``ratio``, difference of the runs
        over the radius of its 95 % disc, and ``relative_difference``.
    modes
        {(run, "anti-resonance" or "resonance"): (Hz, standard error in Hz, damping ratio)}.
    prepared
        How the records were cut, by run.
    """

    full: xr.Dataset
    odd_odd: xr.Dataset
    levels: xr.Dataset
    agreement: xr.Dataset
    modes: dict[tuple[str, str], tuple[float, float, float]]
    prepared: dict[str, records.Prepared]


def default_data() -> Path:
    """Return where the data is expected."""
    root = os.environ.get("AXISIGHT_DATA")
    folder = Path(root) if root else HERE.parents[2] / "shared" / "data"
    return folder / "fditools_multisine"


def read_run(path: Path) -> records.Prepared:
    """Return the periods in steady state: current in, motor and load angle out."""
    file = loadmat(path)
    sample_time_s = 1.0 / float(file["fs"].item())
    # The two angles count in opposite directions.
    angles = np.hstack([file["theta_mx"], -file["theta_my"]])
    # The reference ends one sample early: the last period is no copy of the others.
    stop = len(angles) - round(PERIOD_S / sample_time_s)
    run = records.Experiment(
        sample_time_s,
        file["iq_adx"][:stop],
        angles[:stop],
        file["iq_refx"][:stop],
        name=path.stem,
    )
    return records.prepare_records([run], period_s=PERIOD_S, input_unit="A")


def nearest(at_hz: np.ndarray, frequency_hz: np.ndarray, count: int) -> np.ndarray:
    """Indices (len(at_hz), count) of the nearest frequencies."""
    distance = np.abs(np.asarray(at_hz)[:, None] - frequency_hz)
    return np.argsort(distance, axis=1, kind="stable")[:, :count]


def nearest_mean(at_hz: np.ndarray, frequency_hz: np.ndarray, power: np.ndarray) -> np.ndarray:
    """Mean power (frequency, output) of the nearest detection lines, not below zero."""
    return np.maximum(power[nearest(at_hz, frequency_hz, NEIGHBOURS)].mean(axis=1), 0.0)


def distortion_levels(run: records.PeriodicRecords, found: frf.FastMethod) -> xr.Dataset:
    """Return the levels of run B at its excited lines [rad]."""
    spectrum = np.fft.rfft(run.output[0].mean(axis=0), axis=0)[run.lines]
    lines = found.distortion.isel(experiment=0)
    noise = lines["noise_variance"].values
    at, free = run.frequency_hz, lines["frequency_hz"].values
    level = {"noise": nearest_mean(at, free, noise)}
    raw = {"noise": level["noise"]}
    for kind in ("odd", "even"):
        chosen = lines["kind"].values == kind
        for into, name in ((level, "distortion"), (raw, "uncorrected")):
            power = np.abs(lines[name].values) ** 2 - noise
            into[kind] = nearest_mean(at, free[chosen], power[chosen])
    dims = ("frequency_hz", "output", "kind")
    return xr.Dataset(
        {
            "level": (dims, np.sqrt(np.stack(list(level.values()), axis=-1)), {"units": "rad"}),
            "uncorrected": (dims, np.sqrt(np.stack(list(raw.values()), axis=-1))),
            "output_amplitude": (dims[:2], 2 / run.n_samples * np.abs(spectrum)),
        },
        coords={"frequency_hz": at, "output": [1, 2], "kind": list(level)},
    )


def full_grid_response(run: records.PeriodicRecords) -> xr.Dataset:
    """Return the response of run A, scatter over the lines as its variance.

    A full grid leaves no line free to detect distortion. But the response is smooth and
    stochastic distortion is not: the scatter of ``Y U^-1`` about the local rational estimate of
    the averaged period is noise and distortion together. It is taken relative to the response:
    the median of the m nearest lines over ln 2 (exponential distribution; the line in the
    anti-resonance must not rule its neighbours), times m / q for the q degrees of freedom that
    a window of m lines leaves. Run B does not enter.
    """
    result = frf.mfrf(run)
    mean = replace(
        run,
        input=run.input.mean(axis=1, keepdims=True),
        output=run.output.mean(axis=1, keepdims=True),
        reference=None,
    )
    smooth = frf.local_rational(mean)
    lines = 2 * smooth.attrs["half_width"] + 1
    g = result["response"].values
    scatter = np.abs(1 - smooth["response"].values / g)[:, :, 0] ** 2
    f = result["frequency_hz"].values
    level = np.median(scatter[nearest(f, f, lines)], axis=1) / np.log(2)
    level *= lines / smooth.attrs["degrees_of_freedom"]
    variance = np.maximum(level[:, :, None] * np.abs(g) ** 2, result["noise_variance"].values)
    result["variance"] = (result["variance"].dims, variance, result["variance"].attrs)
    # Of as many lines as the window frees: the scatter of neighbours is shared.
    result["degrees_of_freedom"] = xr.full_like(
        result["variance"], smooth.attrs["degrees_of_freedom"]
    )
    return result


def agreement(full: xr.Dataset, odd_odd: xr.Dataset) -> xr.Dataset:
    """Compare the runs at the lines of run B."""
    a = full.sel(frequency_hz=odd_odd["frequency_hz"], method="nearest", tolerance=1e-6)
    difference = np.abs(a["response"].values - odd_odd["response"].values)[:, :, 0]
    variance = (a["variance"].values + odd_odd["variance"].values)[:, :, 0]
    dims = ("frequency_hz", "output")
    return xr.Dataset(
        {
            "ratio": (dims, difference / np.sqrt(-np.log(0.05) * variance)),
            "relative_difference": (dims, difference / np.abs(odd_odd["response"].values[:, :, 0])),
        },
        coords={"frequency_hz": odd_odd["frequency_hz"].values, "output": [1, 2]},
    )


def mode(response: xr.Dataset, near_hz: float, *, pole: bool) -> tuple[float, float, float]:
    """Return frequency [Hz], its standard error [Hz] and damping ratio of a pole or zero pair.

    Where the phase of the motor's response passes -90 degrees G, or 1 / G for a pole, is
    imaginary; it is smooth there, so that a cubic through the four nearest lines will do. With
    x = Re: f0 is its root, and the damping ratio Im / (f0 dx/df), that of
    ``f0^2 - f^2 + 2 i zeta f0 f``.
    """
    motor = response.sel(output=1, input=1)
    frequency = motor["frequency_hz"].values
    g = motor["response"].values
    value = 1 / g if pole else g
    scale = np.abs(g) ** 2 if pole else 1.0  # |d(1/G)| = |dG| / |G|^2
    error = np.sqrt(motor["variance"].values / 2) / scale
    crossing = np.flatnonzero(np.diff(np.sign(value.real)))
    k = crossing[np.argmin(np.abs(frequency[crossing] - near_hz))]
    part = slice(k - 1, k + 3)
    offset = frequency[part] - frequency[k]
    real = np.polynomial.Polynomial.fit(offset, value.real[part], 3)
    imaginary = np.polynomial.Polynomial.fit(offset, value.imag[part], 3)
    step = frequency[k + 1] - frequency[k]
    roots = real.roots()
    inside = roots.real[
        (np.abs(roots.imag) < 1e-9) & (roots.real >= -1e-9) & (roots.real <= step + 1e-9)
    ]
    root = float(inside[0])
    slope = float(real.deriv()(root))
    f0 = float(frequency[k] + root)
    damping = abs(float(imaginary(root))) / abs(slope) / f0
    return f0, float(error[k : k + 2].max() / abs(slope)), damping


def two_mass_error(found: Findings) -> float:
    """Return how far run A is from two masses and a spring, below 30 Hz, relative.

    There load over motor angle is ``1 / (1 - (f / f_a)^2)``, f_a the anti-resonance. The damping
    of the coupling turns the phase by another degree or two: magnitudes are compared.
    """
    low = found.full["response"].sel(frequency_hz=slice(0, 30), input=1)
    f_anti = found.modes["A", "anti-resonance"][0]
    ratio = np.abs(low.sel(output=2) / low.sel(output=1)) * (
        1 - (low["frequency_hz"] / f_anti) ** 2
    )
    return float(np.abs(ratio - 1).max())


def analyse(data: Path) -> Findings:
    """Estimate everything from both files."""
    prepared = {run: read_run(data / f"MultisineType{run}.mat") for run in "AB"}
    a, b = prepared["A"].records, prepared["B"].records
    fast = frf.fast_method(b)
    levels = distortion_levels(b, fast)
    full = full_grid_response(a)
    modes = {
        (run, name): mode(response, near, pole=name == "resonance")
        for run, response in (("A", full), ("B", fast.response))
        for name, near in (("anti-resonance", 53.0), ("resonance", 77.0))
    }
    together = agreement(full, fast.response)
    return Findings(full, fast.response, levels, together, modes, prepared)


def decibels(power: float, against: float) -> float:
    """Return a level [dB]; NaN where nothing is left above the noise."""
    return float(10 * np.log10(power / against)) if power > 0 else float("nan")


def summary(found: Findings) -> list[dict[str, float | str]]:
    """Return a row per output and band: levels in dB against the output, and agreement."""
    rows: list[dict[str, float | str]] = []
    for o, name in enumerate(OUTPUTS, 1):
        for low, high in BANDS_HZ:
            here = found.levels.sel(frequency_hz=slice(low, high - 1e-6), output=o)
            both = found.agreement.sel(frequency_hz=slice(low, high - 1e-6), output=o)
            out = float((here["output_amplitude"] ** 2).mean())
            row: dict[str, float | str] = {"output": name, "low_hz": low, "high_hz": high}
            for of, end in (("level", "db"), ("uncorrected", "uncorrected_db")):
                for kind in ("noise", "odd", "even"):
                    power = float((here[of].sel(kind=kind) ** 2).mean())
                    row[f"{kind}_{end}"] = decibels(power, out)
            both_kinds = (here["level"].sel(kind=["odd", "even"]) ** 2).sum("kind")
            row["linear"] = int(decibels(float(both_kinds.mean()), out) < LINEAR_DB)
            row["lines"] = both.sizes["frequency_hz"]
            row["inside_95"] = int((both["ratio"] <= 1).sum())
            row["median_difference_percent"] = 100 * float(both["relative_difference"].median())
            rows.append(row)
    return rows


def report(found: Findings) -> str:
    """Return the findings in words and figures."""
    text = []
    for run, prepared in found.prepared.items():
        text.append(
            f"run {run}: {prepared.records.n_periods} periods kept, "
            f"{prepared.dropped_periods} of transient dropped, {len(prepared.records.lines)} lines"
        )
    for name in ("anti-resonance", "resonance"):
        each = [
            f"{run} {f0:.2f} +- {1.96 * error:.2f} Hz, damping {100 * damping:.1f} %"
            for run, (f0, error, damping) in ((r, found.modes[r, name]) for r in "AB")
        ]
        text.append(f"{name}: {'; '.join(each)}")
    text.append(
        "below 30 Hz load and motor move as two masses with this anti-resonance (run A), within "
        f"{100 * two_mass_error(found):.1f} %"
    )
    text += [
        "",
        f"{'':22s}against the output [dB]    uncorrected    lines of A and B that differ by",
        f"{'output':12s}band [Hz]  noise   odd  even     odd   even     "
        "less than the 95 % radius, and median",
    ]
    rows = summary(found)
    text += [
        f"{row['output']:12s}{row['low_hz']:4d}-{row['high_hz']:<4d}"
        f"{row['noise_db']:7.1f}{row['odd_db']:6.1f}{row['even_db']:6.1f}"
        f"{row['odd_uncorrected_db']:8.1f}{row['even_uncorrected_db']:7.1f}"
        f"{row['inside_95']:7d} of {row['lines']:2d}{row['median_difference_percent']:8.1f} %"
        + ("" if row["linear"] else "   not linear")
        for row in rows
    ]
    text.append("")
    for name in OUTPUTS:
        chosen = [r for r in rows if r["output"] == name and r["linear"]]
        away = [r for r in chosen if r["low_hz"] != RESONANCE_HZ[0]]
        at = next(r for r in rows if r["output"] == name and r["low_hz"] == RESONANCE_HZ[0])
        text.append(
            f"{name}: where linear (distortion below {LINEAR_DB:g} dB), away from the resonance, "
            f"{sum(int(r['inside_95']) for r in away)} of {sum(int(r['lines']) for r in away)} "
            f"lines agree; at the resonance the runs differ by "
            f"{at['median_difference_percent']:.0f} %"
        )
    # "noise" stands for a level that is not above it.
    return "\n".join(text).replace("    nan", "  noise")


def draw(found: Findings) -> Figure:
    """Return the figure: responses with bands, and levels, a column for each output."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    grid = figure.subplots(3, 2, sharex=True, sharey="row", height_ratios=(3, 2, 3))
    runs = (("A, full grid", found.full, "-"), ("B, odd-odd grid", found.odd_odd, "."))
    for k, (label, response, style) in enumerate(runs):
        radius = frf.confidence_radius(response)
        for o in (1, 2):
            top, middle = grid[0, o - 1], grid[1, o - 1]
            g = response["response"].sel(output=o, input=1).values
            r = radius.sel(output=o, input=1).values
            f = response["frequency_hz"].values
            color = SERIES[k]
            top.plot(f, 20 * np.log10(np.abs(g)), style, ms=5, lw=1.1, color=color, label=label)
            # A disc that holds zero has no lower end in dB.
            low = np.where(r < np.abs(g), np.abs(g) - r, 1e-9)
            band = 20 * np.log10(low), 20 * np.log10(np.abs(g) + r)
            # The turn that never wraps: up to 90 deg for the motor, down to -450 for the load.
            start = (-270, -450)[o - 1]
            phase = (np.degrees(np.angle(g)) - start) % 360 + start
            half = np.degrees(np.arcsin(np.minimum(r / np.abs(g), 1)))
            half = np.where(r < np.abs(g), half, 180)
            middle.plot(f, phase, style, ms=5, lw=1.1, color=color)
            for axes, (a, b) in ((top, band), (middle, (phase - half, phase + half))):
                if style == "-":
                    axes.fill_between(f, a, b, color=color, alpha=0.25, lw=0)
                else:
                    axes.vlines(f, a, b, color=color, lw=0.9)
    for o, name in enumerate(OUTPUTS, 1):
        levels = found.levels.sel(output=o)
        f, axes = levels["frequency_hz"].values, grid[2, o - 1]
        output = levels["output_amplitude"].values
        axes.plot(f, 20 * np.log10(output), ".", ms=5, color=MEASURED, label="output")
        for kind, color, style in zip(
            ("odd", "even", "noise"), (SERIES[2], SERIES[3], "0.55"), ("-", "-", "--"), strict=True
        ):
            level = levels["level"].sel(kind=kind).values
            level = np.where(level > 0, level, np.nan)
            label = kind if kind == "noise" else f"{kind} distortion"
            axes.plot(f, 20 * np.log10(level), style, lw=1.3, color=color, label=label)
        axes.set_xlabel("frequency [Hz]")
        grid[0, o - 1].set_title(f"current to {name}", fontsize=10)
    dress(grid)
    return figure


def dress(grid: np.ndarray) -> None:
    """Labels, ranges and legends."""
    grid[0, 0].set_ylabel("magnitude [dB re 1 rad/A]")
    grid[1, 0].set_ylabel("phase [deg]")
    grid[2, 0].set_ylabel("amplitude, run B [dB re 1 rad]")
    grid[0, 0].set(xscale="log", xlim=(10.5, 262), ylim=(-120, -28))
    grid[1, 0].set(ylim=(-440, 40), yticks=[-360, -270, -180, -90, 0])
    grid[2, 0].set_ylim(-145, -25)
    ticks = [20, 50, 100, 200]
    grid[0, 0].set_xticks(ticks, [str(t) for t in ticks])
    grid[0, 0].set_xticks([], minor=True)
    for axes in grid.flat:
        axes.grid(True, lw=0.4, color="0.85")
        axes.spines[["top", "right"]].set_visible(False)
    for axes in (grid[0, 0], grid[2, 0]):
        axes.legend(loc="lower left", fontsize=8, frameon=False)


def write_responses(found: Findings, path: Path) -> None:
    """Write both responses with their 95 % radii as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            ("run", "output", "frequency_hz", "real_rad_a", "imag_rad_a", "radius_95_rad_a")
        )
        for run, response in (("A", found.full), ("B", found.odd_odd)):
            radius = frf.confidence_radius(response)
            for o, name in enumerate(OUTPUTS, 1):
                g = response["response"].sel(output=o, input=1)
                r = radius.sel(output=o, input=1).values
                for f, value, band in zip(g["frequency_hz"].values, g.values, r, strict=True):
                    writer.writerow((run, name, f, value.real, value.imag, band))


def main() -> int:
    """Analyse both runs; write figure and tables, print the findings."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--out", type=Path, default=Path("fditools"))
    arguments = parser.parse_args()
    if not (arguments.data / "MultisineTypeA.mat").exists():
        print(f"not run: no multisine data in {arguments.data}; see {HERE / 'README.md'}")
        return 0
    found = analyse(arguments.data)
    print(report(found))
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_responses(found, arguments.out / "responses.csv")
    rows = summary(found)
    with (arguments.out / "bands.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    draw(found).savefig(arguments.out / "fditools.png", dpi=150)
    print(f"figure and tables in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Warnings about an axis fit from its residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_checks import label, motion, noise_std
from axisight.graybox.axis_model import AxisData
from axisight.graybox.axis_search import Point, Task, free_places, search
from axisight.statistics.correlation import pooled_autocovariance

Array = NDArray[np.float64]

# Fit (3.54) [%] below which the residuals have more than a quarter of the power of the motion.
LOW_FIT = 50.0
# A poor start does not explain a larger ratio between the total inertias of start and end.
FAR = 3.5
# Factors between motions in wrong units and in rad and rad/s.
UNITS = {
    180 / np.pi: "degrees instead of radians",
    30 / np.pi: "revolutions per minute instead of rad/s",
    np.pi / 180: "a conversion from degrees where there were radians",
    1 / (2 * np.pi): "revolutions instead of radians",
}
# A start shows wrong units only if it knows inertia and motion within this factor.
NEAR = 2.0
# A warning follows if the two kinds of standard errors differ by more than this factor.
DISAGREE = 2.0
# A larger ratio of the variances of records enlarges standard errors by more than 6 %.
UNEQUAL = 2.0
# Probability of a warning by chance.
CHANCE = 1e-3
_LAG_S = 0.25
# Relative departure of the rise of the loss from a parabola; it shifts an eighth of a standard error.
BENT = 0.25


def total_inertia(values: Mapping[str, float]) -> float:
    """Return the inertia of all masses on the motor side [kg m^2]."""
    arms = sum(v for n, v in values.items() if n.startswith("J_a"))
    return values["J_m"] + values["r"] ** 2 * arms


def motion_ratio(task: Task) -> float:
    """Return the ratio of measured motion to the motion simulated from the start.

    The ratio of rms speeds does not need equal phases.
    """
    measured, simulated = 0.0, 0.0
    for record in task.data:
        run = task.model.simulate(task.start, record.torque_nm, record.sample_time_s).output.values
        key = "position_rad" if task.model.output == "position" else "velocity_rad_s"
        measured += float(np.sum(motion(task.model, record) ** 2))
        simulated += float(np.sum(motion(task.model, replace(record, **{key: run})) ** 2))
    return float(np.sqrt(measured / simulated)) if simulated > 0 else 1.0


def scale_words(factor: float, ratio: float) -> str:
    """Return text on the units or gear sides that explain a motion too large by ``factor``."""
    named = dict(UNITS)
    if ratio != 1:
        named[ratio] = "the joint's side of the gear instead of the motor's"
        named[180 / np.pi * ratio] = "degrees on the joint's side of the gear"
    likely = [
        f"{text} (factor {value:.4g})"
        for value, text in named.items()
        if 1 / NEAR < factor / value < NEAR
    ]
    return (
        f"As if the motion were measured about {factor:.2g} times as large as it is"
        + (f": {', or '.join(likely)}?" if likely else "")
        + (" " if likely else ". ")
        + "Look at the units and the side of the gear of motion and torque, or at the start"
    )


def fit_findings(
    task: Task,
    parameters: Mapping[str, float],
    fits: Sequence[float],
) -> list[str]:
    """Return warnings about records that the simulation does not fit, and about wrong units."""
    low = []
    for i, (record, fit) in enumerate(zip(task.data, fits, strict=True)):
        measured = record.measured(task.model)
        rest = (1 - fit / 100) * float(np.std(measured))
        # Large noise gives a right model a low fit too, so only larger residuals count.
        if fit < LOW_FIT and rest > 2 * noise_std(measured):
            low.append(f"{label(i, record)} {fit:.1f} %")
    if low:
        factor = motion_ratio(task)
        words = (
            f"the simulation does not fit: {', '.join(low)} by (3.54); at {LOW_FIT:g} % half of "
            "the motion is left over, below 0 a constant does better. The values mean nothing "
            "until the reason is found. Look at units (rad, rad/s, Nm), side of the gear (motor), "
            "signs, state at the start (initial='free'), start of the search (multistart_axis), "
            "and effects that the model lacks"
        )
    else:
        begin, end = total_inertia(task.start), total_inertia(parameters)
        factor = begin / end
        words = (
            f"the total inertia, {end:.3g} kg m^2 on the motor's side, is far from that of the "
            f"start, {begin:.3g}"
        )
    if not 1 / FAR < factor < FAR:
        return [f"{words}. {scale_words(factor, task.start['r'])}"]
    return [words] if low else []


def _autocorrelation(parts: Sequence[Array], lags: int) -> Array:
    """Return the mean autocorrelation of all parts about zero, one at lag zero."""
    total = pooled_autocovariance(parts, lags)
    return np.asarray(total / total[0] if total[0] > 0 else total)


def _lags(record: AxisData) -> int:
    """Return the lags up to 0.25 s, at most a fiftieth of the record, so that sums are well known."""
    return max(1, min(round(_LAG_S / record.sample_time_s), len(record) // 50))


def slow_share(data: Sequence[AxisData], residuals: Sequence[Array]) -> float:
    """Return the power of the residuals at low frequency, relative to white residuals.

    It is 1 + 2 sum_k (1 - k / (L + 1)) rho(k), k from 1 to L: the power at frequency zero with
    Bartlett's window. Slow derivatives average errors, so this power decides their effect.
    """
    lags = min(_lags(d) for d in data)
    rho = _autocorrelation(residuals, lags)
    weights = 1 - np.arange(1, lags + 1) / (lags + 1)
    return float(1 + 2 * weights @ rho[1:])


def start_findings(task: Task, point: Point, token: _core.CancelToken) -> tuple[str, ...]:
    """Return warnings about records that start in motion, if a free start fits better than by chance.

    ``point`` is the end of an output-error fit from rest. A likelihood ratio compares its loss with
    the loss for free starts. The power of the residuals at low frequency sets the effective number of
    samples.
    """
    if not task.doubts:
        return ()
    free = replace(task, model=replace(task.model, initial="free"))
    try:
        other = search(free, point, token)
    except InputError as error:
        return tuple(
            f"{text}; could not be judged: the free start failed ({error})" for text in task.doubts
        )
    lengths = np.cumsum([len(d) for d in task.data])[:-1]
    share = max(slow_share(task.data, np.split(other.errors, lengths)), 1.0)
    more = len(task.data) * (2 * task.model.n_masses - 1)
    if other.loss > 0:
        fall = point.errors.size / share * np.log(point.loss / other.loss)
        if fall < stats.chi2.isf(CHANCE, more):
            return ()
    return tuple(
        f"{text}; it lowers the loss to {other.loss / point.loss:.2g}" for text in task.doubts
    )


def covariance_findings(
    task: Task,
    names: Sequence[str],
    covariance: Array,
    sandwich: Array,
    counts: tuple[int, int],
    residuals: Sequence[Array],
) -> tuple[list[str], bool]:
    """Return warnings about errors that are not white, and whether to trust the sandwich instead.

    ``counts`` are the number of blocks of the sandwich and its degrees of freedom.
    """
    n = len(names)
    blocks, freedom = counts
    differenced = ""
    if task.model.output == "velocity_difference":
        first = _autocorrelation(residuals, 1)[1]
        if first < -1 / 3:
            differenced = (
                ". They look like differences of position noise (correlation "
                f"{first:.2f} from sample to sample, -0.5 if nothing else): fit "
                "AxisModel(output='position'), whose errors are then white, and narrower"
            )
    share = slow_share(task.data, residuals)
    samples = sum(map(len, residuals)) / max(blocks, 1)
    # The share of low-frequency power is also the number of samples that count as one.
    if np.isfinite(sandwich).all() and share < samples:
        size = np.diag(covariance)
        seen = np.isfinite(size) & (size > 0)
        ratio = np.where(seen, np.sqrt(np.diag(sandwich) / np.where(seen, size, 1.0)), 1.0)
        # The scatter of the blocks that white errors would have.
        chance = stats.chi2.ppf([CHANCE / 2 / n, 1 - CHANCE / 2 / n], freedom) / freedom
        low, high = np.sqrt(chance)
        off = (ratio > max(high, DISAGREE)) | (ratio < min(low, 1 / DISAGREE))
        if not off.any():
            return [], False
        worst = int(np.argmax(np.where(off, np.abs(np.log(ratio)), 0.0)))
        return [
            "the prediction errors are not white: standard errors that trust it (std) are "
            f"{1 / ratio[worst]:.2g} times those from the scatter of blocks for {names[worst]}. "
            "The summary and interval() take the latter (kind='sandwich')" + differenced
        ], True
    if 1 / DISAGREE**2 < share < DISAGREE**2:
        return [], False
    size_words = "small" if share > 1 else "large"
    return [
        "the prediction errors are not white: at low frequency they have "
        f"{share:.2g} times the power of white ones, so that standard errors (std) may be too "
        f"{size_words} by up to {np.sqrt(max(share, 1 / share)):.2g}, and the records are too "
        "short for blocks that tell (FitSettings.block_s). Add records, or give a noise model"
        + differenced
    ], False


def rise_of_loss(task: Task, point: Point, covariance: Array, n: int) -> Array:
    """Return the rise of the loss one standard error away, over the variance; 1 for a linear model.

    The rise is the mean of both directions along each principal axis of the first ``n`` parameters,
    scaled to unit variance. All other parameters follow the linear model. NaN if the motion diverges.
    """
    std = np.sqrt(np.diag(covariance)[:n])
    scaled = covariance[:n, :n] / np.outer(std, std)
    sizes, axes = np.linalg.eigh(scaled)
    steps = (axes / np.sqrt(sizes) / std[:, None]).T @ covariance[:n]
    places = free_places(task, point)
    model, shared, states = task.model, len(task.model.vector({})), 2 * task.model.n_masses

    def loss(step: Array) -> float:
        theta = np.array(point.vector(task))
        theta[places] += step
        total = 0.0
        for i, record in enumerate(task.data):
            begin = shared + i * states
            own = [*theta[:shared], *theta[begin : begin + states]]
            try:
                run = _core.axis_simulate(
                    model.core(), record.core(model), own, predicts=point.predicts
                )[0]
            except InputError:
                return np.nan
            error = signal.lfilter([1.0, *point.whitening], [1.0], run - record.measured(model))
            total += record.weight * float(np.sum(error[len(point.whitening) :] ** 2))
        return total

    here = loss(np.zeros(len(places)))
    return np.array([(loss(s) + loss(-s)) / 2 - here for s in steps])


def curvature_findings(task: Task, point: Point, covariance: Array, variance: float) -> list[str]:
    """Return a warning if the loss is not a parabola within one standard error.

    Only a noise filter makes the loss so rough; without one it is within 4 % at noise of 3 %.
    """
    n = len(task.free_names)
    if not (point.whitening and np.isfinite(covariance).all() and variance > 0):
        return []
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = rise_of_loss(task, point, covariance, n) / variance
    rise = rise[np.isfinite(rise)]
    worst = float(rise[np.argmax(np.abs(rise - 1))]) if rise.size else 1.0
    if abs(worst - 1) <= BENT:
        return []
    return [
        f"one standard error away the loss rises {worst:.2g} times as much as the linear model "
        "says: the intervals, which trust it, are approximate and may be too narrow. More data or "
        "less noise helps; or use noise_model='output_error' with its sandwich"
    ]


def noise_weights(residuals: Sequence[Array]) -> tuple[float, ...]:
    """Return one over the variance of each record's residuals, scaled to one for the first record."""
    power = np.array([float(np.mean(r**2)) for r in residuals])
    floor = np.finfo(np.float64).tiny
    return tuple((max(power[0], floor) / np.maximum(power, floor)).tolist())


def weight_findings(task: Task, residuals: Sequence[Array]) -> list[str]:
    """Return a warning if the weighted residuals of records differ by more than chance and UNEQUAL."""
    if len(residuals) < 2:
        return []
    power, freedom = [], []
    for record, x in zip(task.data, residuals, strict=True):
        power.append(record.weight * float(np.mean(x**2)))
        rho = _autocorrelation([x], _lags(record))
        # Correlated errors have fewer degrees of freedom than samples.
        freedom.append(max(len(x) / (1 + 2 * float(rho[1:] @ rho[1:])), 2.0))
    small, large = int(np.argmin(power)), int(np.argmax(power))
    if power[small] <= 0:
        return []
    ratio = power[large] / power[small]
    pairs = len(power) * (len(power) - 1)
    limit = stats.f.isf(CHANCE / pairs, freedom[large], freedom[small])
    if ratio < max(limit, UNEQUAL):
        return []
    advice = ", ".join(f"{w:.3g}" for w in noise_weights(residuals))
    return [
        f"the residuals of {label(large, task.data[large])} have {ratio:.3g} times the variance "
        f"of those of {label(small, task.data[small])} with the weights given: standard errors "
        "that take them for equal (std) are wrong, and the noisy records count too much. Unless "
        "an effect is missing there, fit with weights='residuals', or give the records the "
        f"weights {advice}"
    ]

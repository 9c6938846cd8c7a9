"""Joint input-output estimate from few experiments, by local models of the loop."""

from __future__ import annotations

import numpy as np
import xarray as xr

from axisight.arguments import Complex, Lines, Real, lines_below, whole
from axisight.errors import InputError
from axisight.frf._lines import (
    SMALLEST,
    Quantity,
    condition_and_flag,
    expect_options,
    line_factor,
    line_spectra,
    output_unit,
    provenance,
)
from axisight.frf._reference_window import Windows, fit_windows
from axisight.frf.local_window import DEGREES_OF_FREEDOM, HIGHEST_ORDER
from axisight.frf.response import Flag, frequency_response
from axisight.records.periodic import PeriodicRecords


def local_joint_input_output(
    records: PeriodicRecords,
    *,
    order: int = 4,
    denominator_order: int = 2,
    half_width: int | None = None,
    lines: Lines | None = None,
    quantity: Quantity = "position",
    remove_drift: bool = True,
) -> xr.Dataset:
    """Return G = G_yr G_ur^-1 from any number of experiments, also from a single one.

    Both responses from the reference are estimated by local rational models over windows of
    neighbouring excited lines, then divided. So a single experiment with other inputs excited at
    neighbouring lines (zippered), or with other random phases for every input, gives the full response.
    Sources: Wernholt (2004), section 3.4.2; Pintelon and Schoukens (2012), chapter 7; McKelvey and
    Guérin (2012).

    records
        Periods in steady state, with the reference. Detection lines are not used.
    order, denominator_order
        Orders of the polynomials N and D in ``Z = N / D R``, 0 to 8, over a window. All signals have
        the same D, because they have the poles of the closed loop.
    half_width
        Lines of the window on either side of the estimated one, counted in excited lines. None takes
        the smallest that leaves 12 degrees of freedom.
    lines
        Excited lines to estimate, None for all.
    quantity, remove_drift
        As for `mfrf`. The window is fitted to the velocity in any case: from a velocity reference it
        is smoother than the position.

    ``variance`` follows from the residuals of ``Y - G U`` in the window, with ``degrees_of_freedom``
    complex degrees of freedom. It includes noise, nonlinear distortion and lack of fit.

    Bias: none from noise, to first order, because the reference is known exactly. The local model
    has a bias if a resonance of the closed loop is narrow. Keep the lines of one input at most a
    third of the narrowest bandwidth ``2 zeta f`` apart, see the page on optimal experiments. Local
    models of G itself need lines as dense as its open-loop resonances, which are narrower.

    Raises InputError without a reference, for fewer references than inputs, for lines that are not
    excited, and for fewer lines than a window needs.
    """
    expect_options(records, quantity, remove_drift, 1)
    reference = _reference(records)
    order = whole("order", order, 0, HIGHEST_ORDER)
    poles = whole("denominator_order", denominator_order, 0, HIGHEST_ORDER)
    excited = np.any(np.abs(reference) > SMALLEST * np.abs(reference).max(), axis=(1, 2))
    used = records.lines[excited]
    count = _count(records, half_width, order, poles, len(used))
    wanted = used if lines is None else lines_below("lines", lines, records.n_samples)
    if not np.isin(wanted, used).all() or not len(wanted):
        raise InputError(f"lines: expected excited lines, got {np.setdiff1d(wanted, used)[:1]}")
    velocity = line_factor(used / (records.n_samples * records.sample_time_s), "velocity")
    u = line_spectra(records.input, used)
    y = line_spectra(records.output, used, remove_drift=remove_drift)
    y = y * velocity[:, None, None, None]
    n_out, n_in = y.shape[1], u.shape[1]
    freedom = float(count * records.n_experiments - (order + 1) * n_in - poles / max(n_out, 1))
    found = fit_windows(
        used,
        reference[excited],
        np.concatenate([y.mean(axis=3), u.mean(axis=3)], axis=1),
        count=count,
        order=order,
        denominator_order=poles,
        freedom=freedom,
    )
    condition, flag = condition_and_flag(found.response[:, n_out:])
    flag = np.where(found.full_rank, flag, Flag.RANK_DEFICIENT).astype(np.int8)
    response, variance = _divided(found, n_out, flag, freedom)
    chosen = np.isin(used, wanted)
    factor = (line_factor(used / (records.n_samples * records.sample_time_s), quantity) / velocity)[
        :, None, None
    ]
    return frequency_response(
        used[chosen] / (records.n_samples * records.sample_time_s),
        (response * factor)[chosen],
        estimator="local_joint_input_output",
        variance=(variance * np.abs(factor) ** 2)[chosen],
        condition=condition[chosen],
        flag=flag[chosen],
        input_unit=records.input_unit,
        output_unit=output_unit(records, quantity),
        attrs={
            **provenance(records, quantity),
            "order": order,
            "denominator_order": poles,
            "half_width": count // 2,
            "degrees_of_freedom": freedom,
        },
    )


def _reference(records: PeriodicRecords) -> Complex:
    """Return the mean spectrum of the reference, (n_freq, n_references, n_experiments)."""
    if records.reference is None:
        raise InputError("records.reference: expected the recorded reference, got None")
    if records.reference.shape[3] != records.n_inputs:
        raise InputError(
            f"records.reference: expected one channel per input ({records.n_inputs}), "
            f"got {records.reference.shape[3]}"
        )
    return np.asarray(line_spectra(records.reference, records.lines).mean(axis=3))


def _count(
    records: PeriodicRecords, half_width: int | None, order: int, poles: int, available: int
) -> int:
    """Return the number of lines of a window; raises InputError if there are too few."""
    unknowns = (order + 1) * records.n_inputs + -(-poles // records.n_outputs)
    fewest = -(-(unknowns + 1) // records.n_experiments)
    if half_width is None:
        count = -(-(unknowns + DEGREES_OF_FREEDOM) // records.n_experiments)
    else:
        count = 2 * whole("half_width", half_width, 1) + 1
        if count < fewest:
            raise InputError(f"half_width: expected at least {fewest // 2}, got {half_width}")
    if count > available:
        raise InputError(
            f"records.lines: expected at least {count} excited lines for order {order} and "
            f"denominator_order {poles}, got {available}"
        )
    return count


def _divided(found: Windows, n_out: int, flag: np.ndarray, freedom: float) -> tuple[Complex, Real]:
    """Return G and its variance."""
    to_output, to_input = found.response[:, :n_out], found.response[:, n_out:]
    lost = np.isin(flag, (Flag.RANK_DEFICIENT, Flag.NO_EXCITATION))
    inverse = np.full(to_input.shape, np.nan, np.complex128)
    inverse[~lost] = np.linalg.inv(to_input[~lost])
    g = to_output @ inverse
    # To first order only the noise of Y - G U reaches the quotient.
    residual = found.residual[:, :, :n_out] - found.residual[:, :, n_out:] @ np.swapaxes(g, 1, 2)
    power = np.sum(np.abs(residual) ** 2, axis=1) / freedom
    gain = np.einsum("kja,kjl,kla->ka", inverse, found.gram, inverse.conj()).real
    variance = power[:, :, None] * gain[:, None, :]
    if found.denominator_slope is not None and found.denominator_covariance is not None:
        slope = found.denominator_slope
        slope = slope[:, :, :n_out] - g[:, None] @ slope[:, :, n_out:]
        slope = slope @ inverse[:, None]
        variance = (
            variance
            + np.einsum(
                "kdia,kdf,kfia->kia",
                slope,
                found.denominator_covariance,
                slope.conj(),
                optimize=True,
            ).real
        )
    return g, variance

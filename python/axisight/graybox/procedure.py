"""The three steps of chapter 9 in one call.

Wernholt (2004), section 9.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display import html
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData, AxisModel
from axisight.graybox.axis_records import as_data, reference_of
from axisight.graybox.axis_result import AxisFit
from axisight.graybox.axis_search import FitSettings
from axisight.graybox.first_steps import InitialModel, Lines, initial_model
from axisight.graybox.prediction_error import NoiseKind, fit_axis
from axisight.graybox.procedure_report import report
from axisight.graybox.validation import ResidualTests, fit_percent, residual_tests
from axisight.logs import Log

Real = NDArray[np.float64]

_LAG_S = 0.005
"""Spacing of the lags of residual tests [s]; a robot's motion has little power above 100 Hz."""


@summarized
@dataclass(frozen=True)
class AxisIdentification:
    """Result of :func:`identify_axis`: the values of each step.

    model
        Structure of the axis.
    data_sets
        Fitted records: the low-frequency one, then the broadband ones.
    initial
        Result of steps 1 and 2.
    fit
        Result of step 3.
    initial_fit_percent
        Fit (3.54) of the initial model to each of ``data_sets`` [%]; that of step 3 is
        ``fit.fit_percent``.
    tests
        Residual tests of step 3, one for each of ``data_sets``.
    """

    model: AxisModel
    data_sets: tuple[AxisData, ...]
    initial: InitialModel
    fit: AxisFit
    initial_fit_percent: tuple[float, ...]
    tests: tuple[ResidualTests, ...]

    def _repr_html_(self) -> str:
        """Return the values of step 3 and the fit to each record, for notebooks."""
        columns = (self.initial_fit_percent, self.fit.fit_percent)
        fits = zip(*(map(html.number, column) for column in columns), strict=True)
        names = [data.name for data in self.data_sets]
        rows = ((name, *fit) for name, fit in zip(names, fits, strict=True))
        return self.fit._repr_html_() + html.table(
            ("record", "fit of steps 1 and 2 [%]", "of step 3 [%]"), rows, "Fit of each record"
        )

    def report(self) -> str:
        """Return the values of each step, fits, tests and findings as text."""
        return report(
            [data.name for data in self.data_sets],
            self.model,
            self.initial,
            self.fit,
            self.initial_fit_percent,
            self.tests,
        )


def identify_axis(
    rigid: AxisData | Log,
    broadband: Sequence[AxisData | Log],
    *,
    gear_ratio: float,
    axis: int = 1,
    model: AxisModel | None = None,
    initial: InitialModel | None = None,
    fixed: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    noise_model: NoiseKind = "output_error",
    settings: FitSettings | None = None,
    closed_loop: bool = True,
    period_s: float | None = None,
    lines: Lines | None = None,
    drop_periods: int | None = None,
    cutoff_hz: float = 5.0,
    notch_band_hz: tuple[float, float] | None = None,
    plateau_from_hz: float | None = None,
) -> AxisIdentification:
    """Identify rigid body, friction and flexibility of one axis from motor-side records.

    Wernholt (2004), section 9.3. Steps 1 and 2 give a start (:func:`initial_model`). Step 3 fits
    all records together by their prediction errors (:func:`fit_axis`). Residual tests follow
    (:func:`residual_tests`), against the reference of logs or else against the torque.

    Parameters
    ----------
    rigid : low-frequency motion in both directions, from rest.
    broadband : periodic records of several periods, from rest, of different amplitudes.
    gear_ratio : r, joint angle per motor angle.
    axis : axis of the logs, from 1.
    model : structure of step 3; default two masses with a cubic gear spring, Coulomb friction
        and the backward difference of the position as output.
    initial : start of step 3, instead of steps 1 and 2.
    fixed, bounds, noise_model, settings : arguments of :func:`fit_axis`.
    closed_loop : whether a controller was active, for the residual tests.
    period_s, lines, drop_periods, cutoff_hz, notch_band_hz, plateau_from_hz : arguments of
        :func:`initial_model`.

    Raises InputError as the three steps do.

    """
    model = model or AxisModel(gear_ratio=gear_ratio, output="velocity_difference")
    if not np.isclose(model.gear_ratio, gear_ratio, rtol=1e-12):
        raise InputError(
            f"gear_ratio: expected that of the model, {model.gear_ratio}, got {gear_ratio}"
        )
    if initial is None:
        initial = initial_model(
            rigid,
            broadband,
            gear_ratio=gear_ratio,
            axis=axis,
            n_masses=model.n_masses,
            period_s=period_s,
            lines=lines,
            drop_periods=drop_periods,
            cutoff_hz=cutoff_hz,
            notch_band_hz=notch_band_hz,
            plateau_from_hz=plateau_from_hz,
        )
    data = tuple(
        as_data(d, axis, name)
        for d, name in zip(
            [rigid, *broadband], ["rigid", *map("broadband {}".format, range(1, 99))], strict=False
        )
    )
    known = set(model.parameter_names)
    start = {name: value for name, value in initial.start.items() if name in known}
    fit = fit_axis(
        model, data, start, fixed=fixed, bounds=bounds, noise_model=noise_model, settings=settings
    )
    before = tuple(
        fit_percent(
            d.measured(model),
            model.simulate(start, d.torque_nm, d.sample_time_s)["output"].values,
        )
        for d in data
    )
    tests = tuple(
        _tests(residual, d, reference_of(record, axis), closed_loop)
        for residual, d, record in zip(fit.residuals, data, [rigid, *broadband], strict=True)
    )
    return AxisIdentification(model, data, initial, fit, before, tests)


def _tests(
    residual: Real, data: AxisData, reference: Real | None, closed_loop: bool
) -> ResidualTests:
    """Return tests against the reference, which has no feedback, or else against the torque."""
    step = max(1, round(_LAG_S / data.sample_time_s))
    signal = np.asarray(data.torque_nm) if reference is None else reference
    return residual_tests(
        residual,
        signal[-len(residual) :],
        lag_step=step,
        closed_loop=closed_loop and reference is None,
    )

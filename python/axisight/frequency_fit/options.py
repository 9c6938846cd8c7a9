"""Settings of a frequency-domain fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from axisight.arguments import one_of
from axisight.errors import InputError
from axisight.frequency_fit.measured import Sampling, check_sampling
from axisight.frf.pooled import check_neighbours

Criterion = Literal[
    "least_squares",
    "weighted_least_squares",
    "log_least_squares",
    "weighted_log_least_squares",
]
CRITERIA = (
    "least_squares",
    "weighted_least_squares",
    "log_least_squares",
    "weighted_log_least_squares",
)


@dataclass(frozen=True)
class FrequencyFitOptions:
    """Settings of :func:`fit_responses`.

    criterion
        ``least_squares`` compares G; ``log_least_squares`` compares the logarithm of its magnitude
        and its phase, (3.44). The prefix ``weighted_`` weights residuals by variance or covariance,
        (3.42), (3.43).
    sampling
        ``zero_order_hold`` compares with ``G(e^{i w T})``, ``continuous`` with ``G(i w)``.
    loss, loss_scale
        ``squared``, ``huber`` or ``soft_l1`` of the magnitude of a whitened complex residual
        (mean square 2). The robust losses limit the influence of lines that the model misses by more
        than ``loss_scale``, for example at resonances.
    reweightings
        How often a fit is repeated with weights from the magnitude of the fitted response. This
        applies to weighted fits that are logarithmic or use ``neighbours``. Their first pass uses the
        measured magnitude, which favours errors that enlarge G: a bias of the order of the relative
        variance.
    neighbours
        Number of neighbouring lines, half of them on either side, whose variances are pooled for the
        weight of a line: an even number from 4. ``None``: no pooling if the variance is known (no
        ``degrees_of_freedom``) or has at least 30 degrees of freedom; otherwise enough lines for 30
        together. 0: each line by its own variance; the covariance is then enlarged by the cost of
        such weights.
    uncertainty
        ``response`` takes standard deviations from the variance of the response. ``sandwich`` takes
        them from the scatter of the residuals over blocks of ``block_lines`` lines, or of fewer lines
        if that leaves less than five blocks per parameter. ``auto`` takes the first, or the second if
        the residuals are larger than the variance explains, residuals at neighbouring lines are
        correlated, the loss is robust, or lines are weighted by their own variance from few
        realizations.
    starts, start_spread, seed
        Number of starting points, and their scatter. The first is as given; the others scale it up
        or down by at most ``1 + start_spread``, as a function of (seed, number of the start).
    max_iterations, gain_tolerance, step_tolerance
        A search stops when a step promises to lower the loss by less than the share
        ``gain_tolerance``, or when no parameter moves by ``step_tolerance`` (relative).

    Raises InputError naming the field.
    """

    criterion: Criterion = "weighted_log_least_squares"
    sampling: Sampling = "zero_order_hold"
    loss: Literal["squared", "huber", "soft_l1"] = "squared"
    loss_scale: float = 3.0
    reweightings: int = 2
    neighbours: int | None = None
    uncertainty: Literal["auto", "response", "sandwich"] = "auto"
    block_lines: int = 10
    starts: int = 1
    start_spread: float = 0.5
    seed: int = 0
    max_iterations: int = 100
    gain_tolerance: float = 1e-13
    step_tolerance: float = 1e-10

    def __post_init__(self) -> None:
        """Check all fields."""
        one_of("criterion", self.criterion, CRITERIA)
        check_sampling(self.sampling)
        if self.loss not in ("squared", "huber", "soft_l1"):
            raise InputError(f"loss: expected squared, huber or soft_l1, got {self.loss!r}")
        if self.uncertainty not in ("auto", "response", "sandwich"):
            raise InputError(
                f"uncertainty: expected auto, response or sandwich, got {self.uncertainty!r}"
            )
        check_neighbours(self.neighbours)
        if self.neighbours and not self.weighted:
            raise InputError(
                f"neighbours: expected None or 0 with the criterion {self.criterion}, which has "
                f"no weights, got {self.neighbours}"
            )
        for name, least in (
            ("reweightings", 0),
            ("block_lines", 1),
            ("starts", 1),
            ("seed", 0),
            ("max_iterations", 1),
        ):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise InputError(f"{name}: expected a whole number from {least}, got {value!r}")
        for name in ("loss_scale", "start_spread", "gain_tolerance", "step_tolerance"):
            value = getattr(self, name)
            if not np.isfinite(value) or value <= 0:
                raise InputError(f"{name}: expected a positive number, got {value!r}")

    @property
    def weighted(self) -> bool:
        """Whether the criterion weights residuals by the uncertainty of the response."""
        return self.criterion.startswith("weighted")

    @property
    def logarithmic(self) -> bool:
        """Whether the criterion compares logarithms."""
        return "log" in self.criterion


@dataclass(frozen=True)
class CoreOptions:
    """The settings in the form of the compiled core."""

    sampled: bool
    logarithmic: bool
    weighted: bool
    loss: str
    loss_scale: float
    block_lines: int
    max_iterations: int
    gain_tolerance: float
    step_tolerance: float


def core_options(options: FrequencyFitOptions) -> CoreOptions:
    """Return the settings in the form of the compiled core."""
    return CoreOptions(
        options.sampling == "zero_order_hold",
        options.logarithmic,
        options.weighted,
        options.loss,
        float(options.loss_scale),
        options.block_lines,
        options.max_iterations,
        float(options.gain_tolerance),
        float(options.step_tolerance),
    )

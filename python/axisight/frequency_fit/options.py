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
        ``least_squares`` compares G, ``log_least_squares`` the logarithm of its magnitude and
        its phase, (3.44); with ``weighted_`` each by its variance or covariance, (3.42), (3.43).
    sampling
        ``zero_order_hold`` compares with ``G(e^{i w T})``, ``continuous`` with ``G(i w)``.
    loss, loss_scale
        ``squared``, ``huber`` or ``soft_l1`` of the magnitude of a whitened complex residual
        (mean square 2): the robust ones hold back lines, at resonances say, that the model
        misses by more than ``loss_scale``.
    reweightings
        How often a weighted fit whose weights need it is repeated with the magnitude of the
        fitted response in them: logarithmic, or weighed by neighbouring lines. With the
        measured one (first pass) errors that enlarge G count more: a bias of the order of the
        relative variance.
    neighbours
        How many neighbouring lines, half of them on either side, say by which variance a line
        is weighed: an even number from 4. ``None``: none where the variance is known (no
        ``degrees_of_freedom``) or rests on 30, else as many as make 30 together. 0: each line
        by its own; then the covariance is enlarged by what such weights cost.
    uncertainty
        ``response`` takes standard deviations from the variance of the response, ``sandwich``
        from the scatter of the residuals over blocks of ``block_lines`` lines (fewer where that
        would leave less than five blocks a parameter), ``auto`` the first, and the second where
        the first does not hold: residuals larger than the variance explains, residuals of
        neighbouring lines that resemble each other, a robust loss, or lines weighed by their own
        variance of few realizations.
    starts, start_spread, seed
        Searches from ``starts`` starting points; the first as given, the others with factors
        up to ``1 + start_spread`` up or down, a function of (seed, number of the start).
    max_iterations, gain_tolerance, step_tolerance
        A search stops when a step promises to lower the loss by less than the share
        ``gain_tolerance`` or no parameter moves by ``step_tolerance`` (relative).
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
        """Check."""
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
        """Whether residuals are weighed by the uncertainty of the response."""
        return self.criterion.startswith("weighted")

    @property
    def logarithmic(self) -> bool:
        """Whether logarithms are compared."""
        return "log" in self.criterion


@dataclass(frozen=True)
class CoreOptions:
    """The settings as the compiled core reads them."""

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
    """Return the settings as the compiled core reads them."""
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

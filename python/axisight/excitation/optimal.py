"""Optimal power of the lines of a multisine for the question that an experiment has to answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from axisight.arguments import (
    Lines,
    Real,
    did_you_mean,
    instance,
    not_negative,
    one_of,
    reals,
    seed_of,
    several,
    shown,
    whole,
)
from axisight.display.summary import summarized
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.excitation.directions import Directions, direction_matrix
from axisight.excitation.multisine import Multisine
from axisight.fitting import Parameter
from axisight.frequency_fit.line_information import LineInformation, Power, line_information
from axisight.frequency_fit.parameters import specs
from axisight.identifiability import OptimalEffort, optimal_effort
from axisight.robot import Robot

ALL = "all"
RESPONSES = ("relative_response", "absolute_response")
USUAL = ("*.stiffness", "*.damping")

MOST_MODELS = 1000
Parameters = Sequence[str | Parameter] | Mapping[str, float]
Criterion = Literal["determinant", "variance", "relative_response", "absolute_response"]


Limited = Literal["torque", "velocity", "reference", "both"]
_LIMITED: dict[Limited, tuple[Power, ...]] = {
    "torque": ("torque",),
    "velocity": ("velocity",),
    "reference": ("reference",),
    "both": ("torque", "velocity"),
}


@summarized
@dataclass(frozen=True, eq=False)
class OptimalSpectrum:
    """A multisine with the optimal power at every line, and what it gains over the flat one.

    signal
        The multisine: lines with power, optimal amplitudes, phases of the flat multisine.
    criterion, limited
        What is minimized, and the power that does not exceed that of the flat multisine.
    rms, flat_rms
        Root mean squares over axes and experiments of motor ``torque`` [Nm], motor ``velocity`` and
        ``reference`` [rad/s], of this signal and of the flat one.
    lines, shares
        Candidate lines and the share of the limited power of each, (n_lines,). If two powers are
        limited, it is a share of their weighted sum. ``flat_shares`` are those of the flat multisine.
    dispersion
        Of the equivalence theorem, (n_lines,): no value is far above one if the spectrum is optimal.
        NaN for responses, which have a closed form.
    gain
        Criterion of the flat multisine over that of this one: ratio of variances, or for a
        determinant of the n-th root of the determinants of the information.
    relative_std, flat_relative_std
        Predicted relative standard deviations of the parameters by name, of both signals; in metres
        for centres of mass.
    gap, status
        As in :class:`axisight.identifiability.OptimalEffort`; ``"closed_form"`` for responses.
    left_out
        Effects of the robot without linear model, which the design leaves out.
    """

    signal: Multisine
    criterion: Criterion
    limited: Limited
    rms: dict[Power, float]
    flat_rms: dict[Power, float]
    lines: Lines = field(repr=False)
    shares: Real
    flat_shares: Real = field(repr=False)
    dispersion: Real
    gain: float
    relative_std: dict[str, float]
    flat_relative_std: dict[str, float]
    gap: float
    status: Literal["converged", "max_iterations", "closed_form"]
    left_out: tuple[str, ...] = ()


def optimal_spectrum(
    robot: Robot,
    flat: Multisine,
    optimal_for: str | Sequence[str] = ALL,
    *,
    parameters: Parameters | None = None,
    directions: Directions | ArrayLike = "t1",
    limited: Limited = "both",
    n_periods: int = 1,
    noise_std_rad: ArrayLike | None = None,
    operating_points_rad: ArrayLike | None = None,
    flat_share: float = 0.1,
    relative_uncertainty: float = 0.0,
    models: int = 32,
    seed: int = 0,
    measured_information: ArrayLike | None = None,
    least_share: float = 1e-4,
    tolerance: float = 1e-3,
    max_iterations: int = 10_000,
) -> OptimalSpectrum:
    """Return the amplitudes that answer a question best with the power of a flat multisine.

    Source: Wernholt (2004), section 5.3, (5.1) to (5.3), for the closed loop: the limited power is
    that of the torque and velocity that the references cause.

    Parameters
    ----------
    robot : the model, with a ``pi_velocity`` or ``p_velocity`` controller.
    flat : multisine with the candidate lines. Its amplitudes set the power, and it is the signal of
        the comparison.
    optimal_for : the question.

        - ``"all"``: all parameters, by the determinant of their information (D-optimal)
        - names of parameters, with wildcards: the sum of their relative variances (c- or A-optimal)
        - ``"relative_response"``: equal relative accuracy of the response at all lines, (5.2)
        - ``"absolute_response"``: equal absolute accuracy, (5.1)
    parameters : all parameters that the fit estimates, as for `axisight.frequency_fit.fit_responses`.
        None takes all stiffnesses and dampings.
    directions : T of :func:`references`, the same in all experiments of this signal.
    limited : what may not have more power than with the flat multisine, as a sum over axes and
        experiments: ``torque`` or ``velocity`` of the motors, ``both`` of them, or the ``reference``.
    n_periods, noise_std_rad, operating_points_rad : as for
        `axisight.frequency_fit.line_information`.
    flat_share : share of the power that stays spread as in ``flat``, for questions about parameters.
        It shows errors of the model at lines that the optimum leaves out.
    relative_uncertainty, models, seed : optimize the mean criterion over ``models`` models, whose
        parameters scatter about those of the robot by this relative standard deviation.
    measured_information : information of earlier experiments, for example ``fit.information``,
        (n_parameters, n_parameters).
    least_share : lines with a smaller share than this part of the largest are left out.
    tolerance, max_iterations : of the search, see `axisight.identifiability.optimal_effort`.

    Raises InputError naming the field.

    """
    instance("robot", robot, Robot)
    instance("flat", flat, Multisine)
    one_of("limited", limited, _LIMITED)
    linear, left_out = _linear_part(robot)
    usual = [n for n in robot.parameters() if any(fnmatchcase(n, p) for p in USUAL)]
    chosen = usual if parameters is None else _named(parameters)

    def lines_of(values: Parameters) -> LineInformation:
        return line_information(
            linear,
            values,
            flat.frequency_hz,
            directions=direction_matrix(directions, robot.n_axes),
            n_samples=flat.n_samples,
            n_periods=n_periods,
            noise_std_rad=noise_std_rad,
            operating_points_rad=operating_points_rad,
        )

    free = tuple(s.name for s in specs(robot, chosen) if not s.frozen)
    criterion, weight = _question(optimal_for, free)
    share = not_negative("flat_share", flat_share)
    least = not_negative("least_share", least_share)
    if share >= 1 or least >= 1:
        raise InputError(f"flat_share, least_share: expected below 1, got {share:g}, {least:g}")
    prior = _prior(measured_information, free)
    problem = _Problem(flat, lines_of(chosen), criterion, weight, prior, limited)
    if criterion in RESPONSES:
        return problem.result(problem.response_variance, left_out)
    drawn = _scattered(robot, chosen, relative_uncertainty, models, seed)
    each = [lines_of(values).information for values in drawn]
    every = np.array(each or [problem.nominal.information])
    before = flat.amplitude**2
    found = optimal_effort(
        (1 - share) * every,
        weight=weight,
        costs=problem.costs,
        prior=prior + share * np.einsum("k,skij->sij", before, every),
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    after = (1 - share) * found.amounts + share * before
    cost = found.prices @ problem.costs
    used = after * cost
    after = np.where(used >= least * used.max(), after, 0.0)
    return problem.result(after, left_out, found)


@dataclass(frozen=True, eq=False)
class _Problem:
    """What is minimized over which lines, at the powers of the flat multisine."""

    flat: Multisine
    nominal: LineInformation
    criterion: Criterion
    weight: Real | None
    prior: Real
    limited: Limited

    @property
    def costs(self) -> Real:
        """Power for amplitude one relative to that of the flat multisine, (n_limits, n_lines)."""
        powers = np.array([self.nominal.power[name] for name in _LIMITED[self.limited]])
        return np.asarray(powers / (powers @ self.flat.amplitude**2)[:, None])

    @property
    def response_variance(self) -> Real:
        """Variance of the response for amplitude one, relative or absolute."""
        if self.criterion == "relative_response":
            return self.nominal.relative_variance
        return self.nominal.absolute_variance

    def total(self, squared: Real) -> Real:
        """Return the information with squared amplitudes, and what was there before."""
        return np.asarray(self.prior + np.einsum("k,kij->ij", squared, self.nominal.information))

    def stds(self, squared: Real) -> dict[str, float]:
        variance = np.diag(_inverse(self.total(squared)))
        names = self.nominal.names
        return {name: float(np.sqrt(v)) for name, v in zip(names, variance, strict=True)}

    def loss(self, squared: Real) -> float:
        """Return the variance, or its geometric mean over the parameters for a determinant."""
        if self.criterion in RESPONSES:
            return float(np.max(self.response_variance / squared))
        matrix = self.total(squared)
        if self.weight is None:
            return float(np.exp(-np.linalg.slogdet(matrix)[1] / len(matrix)))
        return float(np.trace(self.weight @ _inverse(matrix)))

    def result(
        self, squared: Real, left_out: tuple[str, ...], found: OptimalEffort | None = None
    ) -> OptimalSpectrum:
        """Return the result of squared amplitudes, scaled until the first limit is reached."""
        flat, kept, costs = self.flat, squared > 0, self.costs
        before, after = flat.amplitude**2, squared / np.max(costs @ squared)
        cost = (np.ones(len(costs)) / len(costs) if found is None else found.prices) @ costs
        powers = self.nominal.power.items()
        return OptimalSpectrum(
            signal=replace(
                flat,
                lines=flat.lines[kept],
                amplitude=np.sqrt(after[kept]),
                phase_rad=flat.phase_rad[kept],
            ),
            criterion=self.criterion,
            limited=self.limited,
            rms={name: float(np.sqrt(p @ after)) for name, p in powers},
            flat_rms={name: float(np.sqrt(p @ before)) for name, p in powers},
            lines=flat.lines,
            shares=after * cost / (after @ cost),
            flat_shares=before * cost / (before @ cost),
            dispersion=np.full(len(after), np.nan) if found is None else found.dispersion,
            gain=self.loss(before) / self.loss(after),
            relative_std=self.stds(after),
            flat_relative_std=self.stds(before),
            gap=0.0 if found is None else found.gap,
            status="closed_form" if found is None else found.status,
            left_out=left_out,
        )


def _linear_part(robot: Robot) -> tuple[Robot, tuple[str, ...]]:
    """Return the robot with those of its effects that a linear model includes, and the other effects."""
    kept = [e for e in robot.effects if effect_info(e.name).linear == "parameters"]
    others = tuple(f"{e.name}@{e.axis}" for e in robot.effects if e not in kept)
    return (robot.with_effects(kept) if others else robot), others


def _named(parameters: object) -> Parameters:
    """Return the parameters; raises InputError unless they are a list or a dict of names."""
    what = "a list of names or Parameter, or a dict of names and starts"
    names = (
        list(parameters) if isinstance(parameters, Mapping) else several("parameters", parameters)
    )
    if not all(isinstance(name, str | Parameter) for name in names):
        raise InputError(f"parameters: expected {what}, got {shown(parameters)}")
    return parameters if isinstance(parameters, Mapping) else names


def _prior(measured_information: ArrayLike | None, names: tuple[str, ...]) -> Real:
    n = len(names)
    if measured_information is None:
        return np.zeros((n, n))
    what = f"finite numbers of shape ({n}, {n})"
    prior = reals("measured_information", measured_information, what, 2)
    if prior.shape != (n, n):
        raise InputError(f"measured_information: expected {what}, got {prior.shape}")
    return prior


def _question(
    optimal_for: str | Sequence[str], names: tuple[str, ...]
) -> tuple[Criterion, Real | None]:
    """Return the criterion, and the weight matrix of named parameters."""
    wanted = [optimal_for] if isinstance(optimal_for, str) else several("optimal_for", optimal_for)
    if wanted == [ALL]:
        return "determinant", None
    if wanted == ["relative_response"]:
        return "relative_response", None
    if wanted == ["absolute_response"]:
        return "absolute_response", None
    asked = np.zeros(len(names))
    for word in wanted:
        hits = [isinstance(word, str) and fnmatchcase(name, word) for name in names]
        if not any(hits):
            known = (ALL, *RESPONSES, *names)
            raise InputError(
                f"optimal_for: expected {ALL}, {', '.join(RESPONSES)} or parameters of "
                f"{', '.join(names)}, got {shown(word)}{did_you_mean(word, known)}"
            )
        asked[hits] = 1.0
    if not wanted:
        raise InputError("optimal_for: expected at least one parameter, got none")
    return "variance", np.diag(asked)


def _scattered(
    robot: Robot,
    parameters: Parameters,
    relative_std: float,
    models: int,
    seed: int,
) -> list[dict[str, float]]:
    """Return starts of the parameters that scatter about the model, a function of the seed."""
    chosen, count = specs(robot, parameters), whole("models", models, 1, MOST_MODELS)
    rng = np.random.default_rng([seed_of("seed", seed), count])
    if not_negative("relative_uncertainty", relative_std) > 1:
        raise InputError(f"relative_uncertainty: expected 0 to 1, got {relative_std:g}")
    if relative_std == 0:
        return []
    draws = rng.standard_normal((count, len(chosen)))
    spread = np.log1p(relative_std)
    return [
        {
            s.name: s.initial * float(np.exp(spread * x))
            if s.logarithmic and not s.frozen
            else s.initial
            for s, x in zip(chosen, row, strict=True)
        }
        for row in draws
    ]


def _inverse(matrix: Real) -> Real:
    size = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(size, size)) / np.outer(size, size))

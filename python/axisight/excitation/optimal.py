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
from axisight.frequency_fit.line_information import POWERS, LineInformation, Power, line_information
from axisight.frequency_fit.parameters import specs
from axisight.identifiability import OptimalShares, optimal_shares
from axisight.robot import Robot

ALL = "all"
RESPONSES = ("relative_response", "absolute_response")
USUAL = ("*.stiffness", "*.damping")

Parameters = Sequence[str | Parameter] | Mapping[str, float]
Criterion = Literal["determinant", "variance", "relative_response", "absolute_response"]


@summarized
@dataclass(frozen=True, eq=False)
class OptimalSpectrum:
    """A multisine with the optimal power at every line, and what it gains over the flat one.

    signal
        The multisine: lines with power, optimal amplitudes, phases of the flat multisine.
    criterion, power
        What is minimized, and the quantity whose total power equals that of the flat multisine.
    rms
        Root mean square of this quantity over axes and experiments, of both signals.
    lines, shares
        Candidate lines and the share of the power of each, (n_lines,); ``flat_shares`` are those of
        the flat multisine.
    dispersion
        d_k of the equivalence theorem, (n_lines,), relative to its bound: no value exceeds one by more
        than ``gap`` if the spectrum is optimal. NaN for responses, which have a closed form.
    gain
        Criterion of the flat multisine over that of this one: ratio of variances, or for a
        determinant of the n-th root of the determinants of the information.
    relative_std, flat_relative_std
        Predicted relative standard deviations of the parameters by name, of both signals.
    gap, status
        As in :class:`axisight.identifiability.OptimalShares`.
    left_out
        Effects of the robot without linear model, which the design leaves out.
    """

    signal: Multisine
    criterion: Criterion
    power: Power
    rms: float
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
    power: Power = "torque",
    n_periods: int = 1,
    noise_std_rad: ArrayLike | None = None,
    operating_points_rad: ArrayLike | None = None,
    flat_share: float = 0.1,
    relative_uncertainty: float = 0.0,
    models: int = 16,
    seed: int = 0,
    measured_information: ArrayLike | None = None,
    least_share: float = 1e-4,
    tolerance: float = 1e-4,
    max_iterations: int = 20_000,
) -> OptimalSpectrum:
    """Return the amplitudes that answer a question best with the power of a flat multisine.

    Source: Wernholt (2004), section 5.3, (5.1) to (5.3), for the closed loop: the limited power is
    that of the torque or velocity that the references cause.

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
    power : quantity whose power is limited: ``torque``, ``velocity`` (of the motors) or ``reference``.
    n_periods, noise_std_rad, operating_points_rad : as for
        `axisight.frequency_fit.line_information`.
    flat_share : share of the power that stays spread as in ``flat``, for questions about parameters.
        It shows errors of the model at lines that the optimum leaves out.
    relative_uncertainty, models, seed : optimize the mean criterion over ``models`` models, whose
        parameters scatter about those of the robot by this relative standard deviation.
    measured_information : information of earlier experiments, for example ``fit.information``,
        (n_parameters, n_parameters).
    least_share : lines with a smaller share than this part of the largest are left out.
    tolerance, max_iterations : of the search, see `axisight.identifiability.optimal_shares`.

    Raises InputError naming the field.

    """
    instance("robot", robot, Robot)
    instance("flat", flat, Multisine)
    one_of("power", power, POWERS)
    linear, left_out = _linear_part(robot)
    usual = [n for n in robot.parameters() if any(fnmatchcase(n, p) for p in USUAL)]
    chosen = usual if parameters is None else parameters

    def lines_of(values: Parameters) -> LineInformation:
        return line_information(
            linear,
            values,
            flat.frequency_hz,
            directions=direction_matrix(directions, robot.n_axes),
            n_samples=flat.n_samples,
            n_periods=n_periods,
            power=power,
            noise_std_rad=noise_std_rad,
            operating_points_rad=operating_points_rad,
        )

    free = tuple(s.name for s in specs(robot, chosen) if not s.frozen)
    criterion, weight = _question(optimal_for, free)
    problem = _Problem(
        flat, lines_of(chosen), criterion, weight, _prior(measured_information, free)
    )
    if criterion in RESPONSES:
        return _result(problem, problem.response_shares(), power, left_out)
    share = not_negative("flat_share", flat_share)
    least = not_negative("least_share", least_share)
    if share >= 1 or least >= 1:
        raise InputError(f"flat_share, least_share: expected below 1, got {share:g}, {least:g}")
    drawn = _scattered(robot, chosen, relative_uncertainty, models, seed)
    informations = [lines_of(values).information for values in drawn]
    every = np.array(informations or [problem.nominal.information])
    every = every * problem.per_share[None, :, None, None]
    found = optimal_shares(
        (1 - share) * every,
        weight=weight,
        prior=problem.prior + share * np.einsum("k,skij->sij", problem.flat_shares, every),
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    shares = (1 - share) * found.shares + share * problem.flat_shares
    kept = np.where(shares >= least * shares.max(), shares, 0.0)
    return _result(problem, kept / kept.sum(), power, left_out, found)


@dataclass(frozen=True, eq=False)
class _Problem:
    """What is minimized over which lines, at the power of the flat multisine."""

    flat: Multisine
    nominal: LineInformation
    criterion: Criterion
    weight: Real | None
    prior: Real

    @property
    def budget(self) -> float:
        return float(np.sum(self.flat.amplitude**2 * self.nominal.power))

    @property
    def per_share(self) -> Real:
        """Squared amplitude of each line if it got the whole power."""
        return np.asarray(self.budget / self.nominal.power)

    @property
    def flat_shares(self) -> Real:
        return np.asarray(self.flat.amplitude**2 / self.per_share)

    @property
    def response_variance(self) -> Real:
        """Variance of the response for amplitude one, relative or absolute."""
        if self.criterion == "relative_response":
            return self.nominal.relative_variance
        return self.nominal.absolute_variance

    def response_shares(self) -> Real:
        """Return shares of power with equal accuracy at all lines."""
        needed = self.response_variance * self.nominal.power
        return np.asarray(needed / needed.sum())

    def total(self, shares: Real) -> Real:
        """Return the information of the nominal model with these shares, and what was there before."""
        amounts = shares * self.per_share
        return np.asarray(self.prior + np.einsum("k,kij->ij", amounts, self.nominal.information))

    def stds(self, shares: Real) -> dict[str, float]:
        variance = np.diag(_inverse(self.total(shares)))
        names = self.nominal.names
        return {name: float(np.sqrt(v)) for name, v in zip(names, variance, strict=True)}

    def loss(self, shares: Real) -> float:
        """Return the variance, or its geometric mean over the parameters for a determinant."""
        if self.criterion in RESPONSES:
            return float(np.max(self.response_variance / (shares * self.per_share)))
        matrix = self.total(shares)
        if self.weight is None:
            return float(np.exp(-np.linalg.slogdet(matrix)[1] / len(matrix)))
        return float(np.trace(self.weight @ _inverse(matrix)))


def _result(
    problem: _Problem,
    shares: Real,
    power: Power,
    left_out: tuple[str, ...],
    found: OptimalShares | None = None,
) -> OptimalSpectrum:
    flat, kept = problem.flat, shares > 0
    amplitude = np.sqrt(shares * problem.per_share)
    dispersion = np.full(len(shares), np.nan)
    if found is not None:
        dispersion = found.dispersion / float(found.shares @ found.dispersion)
    return OptimalSpectrum(
        signal=replace(
            flat,
            lines=flat.lines[kept],
            amplitude=amplitude[kept],
            phase_rad=flat.phase_rad[kept],
        ),
        criterion=problem.criterion,
        power=power,
        rms=float(np.sqrt(problem.budget)),
        lines=flat.lines,
        shares=shares,
        flat_shares=problem.flat_shares,
        dispersion=dispersion,
        gain=problem.loss(problem.flat_shares) / problem.loss(shares),
        relative_std=problem.stds(shares),
        flat_relative_std=problem.stds(problem.flat_shares),
        gap=0.0 if found is None else found.gap,
        status="closed_form" if found is None else found.status,
        left_out=left_out,
    )


def _linear_part(robot: Robot) -> tuple[Robot, tuple[str, ...]]:
    """Return the robot with those of its effects that a linear model includes, and the other effects."""
    kept = [e for e in robot.effects if effect_info(e.name).linear == "parameters"]
    others = tuple(f"{e.name}@{e.axis}" for e in robot.effects if e not in kept)
    return (robot.with_effects(kept) if others else robot), others


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
    chosen, count = specs(robot, parameters), whole("models", models)
    rng = np.random.default_rng([seed_of("seed", seed), count])
    if not not_negative("relative_uncertainty", relative_std):
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

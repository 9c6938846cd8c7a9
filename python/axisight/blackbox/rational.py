"""Rational models, with common poles, of frequency responses with several inputs and outputs.

    G(x) = sum_k R_k / (x - p_k) + I_1 / x + I_2 / x^2 + D

Vector fitting finds first poles. A search over the poles alone, which solves for the residues at every
step (variable projection), then finds the weighted least-squares optimum. That is the maximum of the
likelihood if the variance of the response is known.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import optimize, stats

from axisight.blackbox import _vector_fitting
from axisight.blackbox._data import Complex, Real, lines, whole
from axisight.blackbox._sections import Domain, Sections, Solved, Weighted
from axisight.blackbox._weights import UsableLines, Weighting, usable_lines
from axisight.display.summary import summarized
from axisight.errors import AxisightError, InputError
from axisight.frf.pooled import MISFIT_EXPLAINED, few_words
from axisight.frf.response import DIMS, frequency_response
from axisight.statistics.evaluation import last_value
from axisight.statistics.least_squares import inverse_root


@summarized
@dataclass(frozen=True)
class RationalModel:
    """A rational model with its uncertainty.

    ``poles`` (n,) leave out integrators; they are in rad/s (s) or, with ``sample_time_s``, in the z
    plane. ``integrators`` is the number of factors 1/s, or 1/(z - 1), in every element. ``direct``
    (n_out, n_in) is zero if not fitted. ``status`` is ``converged``, or ``not_converged`` for the best
    model found until then; ``warnings`` say what to do. ``loss`` is the sum of squares of the real and
    imaginary parts of weighted residuals. Its expectation is ``degrees_of_freedom`` if the weights
    come from a known variance.
    """

    poles: Complex
    sample_time_s: float | None
    integrators: int
    direct: Real
    status: str
    warnings: tuple[str, ...]
    loss: float
    degrees_of_freedom: int
    n_parameters: int
    n_out: int
    n_in: int
    iterations: int
    domain: Domain = field(repr=False)
    sections: Sections = field(repr=False)
    numerators: Real = field(repr=False)
    """(n_elements, order + extras), elements row by row."""
    problem: Weighted = field(repr=False)
    used: UsableLines = field(repr=False)
    pole_covariance: Real = field(repr=False)
    """Covariance of the coefficients of the sections."""
    units: tuple[str, str] = field(repr=False)
    """Units of input and output."""

    @property
    def order(self) -> int:
        """Number of poles without integrators."""
        return self.sections.order

    @property
    def weighting(self) -> Weighting:
        """The weighting of the lines, as in `fit_rational`."""
        return self.used.weighting

    @property
    def variance_freedom(self) -> float | None:
        """Complex degrees of freedom of an estimated variance, None for a known one."""
        return self.used.degrees_of_freedom

    @property
    def stable(self) -> bool:
        """Whether all poles but the integrators are stable."""
        return self.domain.stable(self.sections.poles())

    def zeros(self, output: int = 1, input_: int = 1) -> Complex:
        """Return the zeros (n,) of element (``output``, ``input_``), both from 1, in the units of ``poles``.

        Works for models with a direct term and without integrators; raises InputError for others.
        """
        for name, value, most in (("output", output, self.n_out), ("input_", input_, self.n_in)):
            if whole(name, value, 1) > most:
                raise InputError(f"{name}: expected at most {most}, got {value}")
        top = self.numerators[(output - 1) * self.n_in + input_ - 1]
        if self.integrators or not self._direct or top[-1] == 0:
            raise InputError(
                "zeros: expected a model with a direct term and no integrators, got "
                f"{self.integrators} integrators and the direct term {self.direct}"
            )
        return self.domain.natural(self.sections.zeros(top[: self.order], float(top[-1])))

    def modes(self) -> xr.Dataset:
        """Return the poles as modes, slowest first, with standard errors.

        Variables over ``mode``: ``pole``, ``eigenvalue_rad_s``, ``frequency_hz``, ``damping_ratio``,
        ``frequency_std_hz``, ``damping_std``; a complex pair is one mode.
        """
        x = self.sections.poles()
        rate, by_x = self.domain.rate(x)
        slope = self._pole_slopes(x) * by_x[:, None]
        kept = (x.imag >= 0) | (np.abs(x.imag) <= 1e-12 * np.abs(x))
        order = np.argsort(np.abs(rate[kept]), kind="stable")
        rate, slope, x = rate[kept][order], slope[kept][order], x[kept][order]
        size = np.abs(rate)
        by_size = (rate.conj()[:, None] * slope).real / size[:, None]
        by_damping = -slope.real / size[:, None] + (rate.real / size**2)[:, None] * by_size
        spread = [
            np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", d, self.pole_covariance, d), 0.0))
            for d in (by_size / (2 * np.pi), by_damping)
        ]
        return xr.Dataset(
            {
                "pole": ("mode", self.domain.natural(x)),
                "eigenvalue_rad_s": ("mode", rate, {"units": "rad/s"}),
                "frequency_hz": ("mode", size / (2 * np.pi), {"units": "Hz"}),
                "damping_ratio": ("mode", -rate.real / size),
                "frequency_std_hz": ("mode", spread[0], {"units": "Hz"}),
                "damping_std": ("mode", spread[1]),
            }
        )

    def _pole_slopes(self, x: Complex) -> Complex:
        out = np.zeros((self.order, self.order), np.complex128)
        for k, (b, _) in enumerate(self.sections.quadratic):
            for p in (2 * k, 2 * k + 1):
                steep = 2 * x[p] + b
                if steep != 0:  # a double pole has no derivative
                    out[p, 2 * k : 2 * k + 2] = [-x[p] / steep, -1 / steep]
        if len(self.sections.linear):
            out[-1, -1] = -1.0
        return out

    def response(self, frequency_hz: ArrayLike) -> xr.Dataset:
        """Return the response and its variance, in the format of `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends. At 0 Hz a model with integrators is NaN. The variance comes from
        poles and residues together, to first order. Raises InputError for other frequencies.
        """
        f = lines(frequency_hz, self.sample_time_s)
        x = self.domain.points(f)
        columns = np.hstack([self.sections.basis(x), _extras(x, self.integrators, self._direct)])
        g = columns @ self.numerators.T
        variance = self._variance(x, columns)
        shape = (len(f), self.n_out, self.n_in)
        return frequency_response(
            f,
            g.reshape(shape),
            estimator="rational",
            variance=variance.reshape(shape),
            input_unit=self.units[0],
            output_unit=self.units[1],
            attrs={"order": self.order, "integrators": self.integrators, "status": self.status},
        )

    def _chance(self, reduced: float) -> float:
        """Return the probability of a larger reduced loss."""
        count, nu = self.degrees_of_freedom, self.variance_freedom
        if nu is None:
            return float(stats.chi2.sf(reduced * count, count))
        if self.used.neighbours:
            # Real and imaginary part of every element count.
            return float(stats.f.sf(reduced, count, 2 * nu * self.problem.values.size))
        # Over its own variance a squared residual is F(2, 2 nu), which scatters nu / (nu - 2) times more.
        if nu <= 2:
            return np.nan
        fewer = count * (nu - 2) / nu
        return float(stats.chi2.sf(reduced * fewer, fewer))

    def _variance(self, x: Complex, columns: Complex) -> Real:
        """Return the variance of every element: from residues at fixed poles, plus from poles.

        With rows Q r of an element, noise e changes the residues by r^-1 Q^T e, and a change dp of the
        poles changes them by -r^-1 Q^T S dp with the slopes S. Both parts are nearly uncorrelated,
        because dp is orthogonal to Q.
        """
        solved = self.problem.residues(self.sections)
        slopes = _slopes(self.problem, self.sections, solved)
        spread = self.noise_scale**2 * self.problem.row_spread
        out = np.empty((len(x), len(self.numerators)))
        for e, theta in enumerate(self.numerators):
            q = solved.q[e]
            direct = columns @ np.linalg.pinv(solved.r[e])
            total = self.sections.slopes(x, theta[: self.order]) - direct @ (q.T @ slopes[e])
            out[:, e] = _quadratic(direct, q.T @ (spread[e][:, None] * q))
            out[:, e] += _quadratic(total, self.pole_covariance)
        return out

    @property
    def _direct(self) -> bool:
        return bool(self.problem.extra.shape[1] > self.integrators)

    @property
    def reduced_loss(self) -> float:
        """Loss divided by its expectation from the variance: one if the model holds."""
        return self.loss / max(self.degrees_of_freedom * self.loss_scale, 1e-300)

    @property
    def loss_scale(self) -> float:
        """Expected square of a weighted residual, from the variance."""
        return float(self.problem.spread.mean()) * self.used.own.misfit

    @property
    def noise_scale(self) -> float:
        """Factor on the standard deviations of weighted residuals, one for a known variance."""
        if self.weighting == "variance":
            return float(np.sqrt(self.used.own.variance))
        return float(np.sqrt(self.loss / max(self.degrees_of_freedom, 1)))

    def residual_tests(self, lags: int = 10) -> xr.Dataset:
        """Return tests whether the residuals have the given variance and are white over the lines.

        Attributes: ``reduced_loss`` is the loss divided by its expectation from the variance, one if
        the model holds. ``loss_p`` is the probability of so large a loss by chance, NaN without a
        variance; it uses the F distribution if the variance itself is estimated.
        Over (output, input): ``whiteness_p`` is the probability of so much correlation between lines
        up to ``lags`` apart, and ``largest`` the largest residual in standard deviations. Raises
        InputError for fewer than four times ``lags`` lines.
        """
        most = whole("lags", lags, 1)
        n = len(self.problem.x)
        if n < 4 * most:
            raise InputError(f"lags: expected at most {n // 4} for {n} lines, got {most}")
        left = self.problem.residues(self.sections).left
        r = left[:, :n] + 1j * left[:, n:]
        power = np.sum(np.abs(r) ** 2, axis=1)
        related = [
            np.abs(np.sum(r[:, lag:] * r[:, :-lag].conj(), axis=1)) for lag in range(1, most + 1)
        ]
        statistic = 2 * n * np.sum((np.stack(related) / power) ** 2, axis=0)
        shape = (self.n_out, self.n_in)
        reduced = self.reduced_loss
        known = self.weighting == "variance"
        chance = self._chance(reduced) if known else np.nan
        scale = np.sqrt(self.loss_scale) if known else self.noise_scale
        return xr.Dataset(
            {
                "whiteness_p": (DIMS[1:], stats.chi2.sf(statistic, 2 * most).reshape(shape)),
                "largest": (DIMS[1:], (np.abs(r).max(axis=1) / scale).reshape(shape)),
            },
            coords={"output": np.arange(1, shape[0] + 1), "input": np.arange(1, shape[1] + 1)},
            attrs={
                "reduced_loss": reduced,
                "loss_p": chance,
            },
        )


def fit_rational(
    response: xr.Dataset,
    order: int,
    *,
    sample_time_s: float | None = None,
    integrators: int = 0,
    direct: bool = False,
    weighting: Weighting = "variance",
    neighbours: int | None = None,
    stable: bool = True,
    start_rad_s: ArrayLike | None = None,
    max_iterations: int = 60,
) -> RationalModel:
    """Return the rational model with common poles that fits a frequency response.

    response
        Dataset of `axisight.frf.frequency_response`. Lines that are NaN are left out, as are lines
        without finite variance if ``weighting`` is ``"variance"``.
    order
        Number of poles besides the integrators.
    sample_time_s
        Sample time T [s]: fit in z at e^{iwT}, the response of a sampled loop with held input. None:
        fit in s.
    integrators
        Poles at s = 0 or z = 1 of every element: 0, 1, or 2 (from torque to angle, if friction is
        not visible).
    direct
        Whether there is a constant term; without it the model is strictly proper.
    weighting
        ``"variance"``: by one over the standard deviation of the response, which makes the loss a
        chi-square; ``"relative"``: by one over the magnitude; ``"absolute"``: all lines alike. With
        the last two the noise is estimated from the residuals.
    neighbours
        Number of neighbouring lines whose variances are pooled for the weight of a line. Pooling
        keeps a line whose variance is too small by chance from dominating the fit. None: no pooling
        if the variance is known (no ``degrees_of_freedom``) or has at least 30 degrees of freedom;
        otherwise enough lines for 30 together, an even number from 4. 0: each line by its own
        variance, with uncertainties enlarged by the cost of such weights. With pooled weights,
        uncertainties come from the variance as given.
    stable
        Whether to keep the poles stable: vector fitting mirrors unstable poles, and the search does
        not leave the stable region. Integrators stay.
    start_rad_s
        Poles to start from, closed under conjugation [rad/s]. By default pairs of 1 % damping, spread
        over the band linearly or logarithmically, whichever fits better.
    max_iterations
        Most iterations of vector fitting, and most evaluations of the search.

    Non-convergence is a status. Raises InputError for misuse, for a variance that is missing, and
    for fewer lines than unknowns.
    """
    n = whole("order", order, 0)
    limit = whole("max_iterations", max_iterations, 1)
    if integrators not in (0, 1, 2) or isinstance(integrators, bool):
        raise InputError(f"integrators: expected 0, 1 or 2, got {integrators!r}")
    if n + integrators + direct == 0:
        raise InputError("order: expected at least one pole, integrator or direct term, got none")
    used = usable_lines(response, weighting, neighbours)
    f = used.frequency_hz
    if sample_time_s is not None and not (np.isfinite(sample_time_s) and sample_time_s > 0):
        raise InputError(f"sample_time_s: expected a positive time, got {sample_time_s}")
    lines(f, sample_time_s)
    if integrators and f[0] == 0:
        raise InputError("response: expected lines above 0 Hz with integrators")
    unknowns = n + integrators + direct
    if 2 * len(f) <= unknowns + n:
        raise InputError(
            f"response: expected more than {(unknowns + n) // 2} lines for order {n}, got {len(f)}"
        )
    domain = Domain(2 * np.pi * float(np.sqrt(max(f[0], f[-1] * 1e-3) * f[-1])), sample_time_s)
    x = domain.points(f)
    extra = _extras(x, integrators, direct)
    problem = _weighed(used, x, extra, np.abs(used.values))
    if n == 0:
        sections, steps, settled = Sections(np.zeros((0, 2)), np.zeros(0)), 0, True
    else:
        starts = _starts(f, n, domain, start_rad_s, stable)
        found = [
            _vector_fitting.fitted(problem, s, domain, stable=stable, iterations=limit)
            for s in starts
        ]
        first, _, steps, _ = min(found, key=lambda item: item[1])
        sections, evaluations, settled = _searched(problem, first, domain, stable, limit)
        steps += evaluations
        for _ in range(RENEWALS if used.neighbours else 0):
            # Variances are pooled relative to the model, because the measured magnitude has errors.
            columns = problem.columns(sections)
            modelled = np.abs(columns @ problem.residues(sections).numerators.T)
            problem = _weighed(used, x, extra, modelled.reshape(used.values.shape))
            sections, evaluations, settled = _searched(problem, sections, domain, stable, limit)
            steps += evaluations
    return _packed(response, problem, sections, domain, integrators, used, steps, settled)


RENEWALS = 2
"""How often pooled weights are computed again from the magnitude of the model."""


def _weighed(used: UsableLines, x: Complex, extra: Complex, magnitude: Real) -> Weighted:
    weight, spread = used.weights(magnitude)
    shape = (len(x), -1)
    return Weighted(
        x, used.values.reshape(shape), weight.reshape(shape), extra, spread.reshape(shape)
    )


def _extras(x: Complex, integrators: int, direct: bool) -> Complex:
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = [x ** -(k + 1) for k in range(integrators)]
    if direct:
        columns.append(np.ones_like(x))
    return np.stack(columns, axis=1) if columns else np.zeros((len(x), 0), np.complex128)


def _starts(
    f: Real, n: int, domain: Domain, given: ArrayLike | None, stable: bool
) -> list[Complex]:
    if given is not None:
        s = np.atleast_1d(np.asarray(given, np.complex128))
        balanced = np.allclose(np.sort_complex(s), np.sort_complex(s.conj()))
        if s.shape != (n,) or not np.isfinite(s).all() or not balanced:
            raise InputError(
                f"start_rad_s: expected {n} finite poles closed under conjugation, got {given!r}"
            )
        x = domain.from_continuous(s)
        return [domain.stabilized(x) if stable else x]
    low, high = max(f[0], f[-1] * 1e-3), f[-1]
    out = []
    for spread in (np.linspace, np.geomspace):
        centre = 2 * np.pi * spread(low, high, n // 2 + 2)[1:-1]
        upper = centre * (-0.01 + 1j)
        poles = np.concatenate(
            [upper, upper.conj(), [-centre.mean() if n > 1 else -2 * np.pi * low]]
        )
        out.append(domain.from_continuous(poles[: 2 * (n // 2)] if n % 2 == 0 else poles))
    return out


def _searched(
    problem: Weighted, start: Sections, domain: Domain, stable: bool, limit: int
) -> tuple[Sections, int, bool]:
    solved = last_value(lambda vector: problem.residues(Sections.of_vector(vector)))

    def residual(vector: Real) -> Real:
        sections = Sections.of_vector(vector)
        if stable and not domain.stable(sections.poles()):
            return np.full(2 * problem.values.size, np.nan)
        return solved(vector).left.ravel()

    def jacobian(vector: Real) -> Real:
        return projected_jacobian(problem, Sections.of_vector(vector), solved(vector))

    result = optimize.least_squares(
        residual,
        start.vector,
        jacobian,
        method="trf",
        x_scale="jac",
        xtol=1e-10,
        ftol=1e-10,
        gtol=1e-12,
        max_nfev=limit,
    )
    return Sections.of_vector(np.asarray(result.x)), int(result.nfev), result.status > 0


def projected_jacobian(problem: Weighted, sections: Sections, solved: Solved) -> Real:
    """Return the derivative of the residuals by the sections, with residues eliminated (Kaufman).

    Its normal matrix at the optimum is the Fisher information of the poles for free residues.
    """
    slopes = _slopes(problem, sections, solved)
    left = slopes - solved.q @ (np.swapaxes(solved.q, 1, 2) @ slopes)
    return np.asarray(left.reshape(-1, sections.order))


def _slopes(problem: Weighted, sections: Sections, solved: Solved) -> Real:
    of = [sections.slopes(problem.x, theta[: sections.order]) for theta in solved.numerators]
    return problem.rows(np.stack(of))


def _packed(
    response: xr.Dataset,
    problem: Weighted,
    sections: Sections,
    domain: Domain,
    integrators: int,
    used: UsableLines,
    steps: int,
    settled: bool,
) -> RationalModel:
    solved = problem.residues(sections)
    numerators = solved.numerators
    shape = (response.sizes["output"], response.sizes["input"])
    loss = solved.loss
    n_parameters = sections.order + numerators.size
    freedom = solved.left.size - n_parameters
    scale = used.own.variance if used.variance is not None else loss / max(freedom, 1)
    covariance, warnings = _covariance(problem, sections, scale)
    direct = np.zeros(shape)
    if problem.extra.shape[1] > integrators:
        direct = numerators[:, -1].reshape(shape)
    if not settled:
        warnings.insert(
            0,
            "the search reached its limit: allow more iterations, start closer, or lower the order",
        )
    model = RationalModel(
        poles=domain.natural(sections.poles()),
        sample_time_s=domain.sample_time_s,
        integrators=integrators,
        direct=direct,
        status="converged" if settled else "not_converged",
        warnings=tuple(warnings),
        loss=loss,
        degrees_of_freedom=freedom,
        n_parameters=n_parameters,
        used=used,
        n_out=shape[0],
        n_in=shape[1],
        iterations=steps,
        domain=domain,
        sections=sections,
        numerators=numerators,
        problem=problem,
        pole_covariance=covariance,
        units=(
            str(response.attrs.get("input_unit", "")),
            str(response.attrs.get("output_unit", "")),
        ),
    )
    return replace(model, warnings=(*model.warnings, *_doubts(model)))


def _doubts(model: RationalModel) -> list[str]:
    """Return reasons to doubt standard errors that come from the variance of the response."""
    out = []
    if model.weighting == "variance" and model.reduced_loss > MISFIT_EXPLAINED:
        out.append(
            f"the residuals are {model.reduced_loss:.3g} times what the variance explains: raise "
            "the order, or the variance is too small; standard errors are too small"
        )
    if model.used.own.few and model.variance_freedom is not None:
        out.append(
            f"{few_words(model.variance_freedom)}; standard errors are uncertain, NaN where they "
            "have no bound"
        )
    return out


def _covariance(problem: Weighted, sections: Sections, scale: float) -> tuple[Real, list[str]]:
    """Return the covariance of the sections and warnings, from the spread of weighted residuals."""
    if sections.order == 0:
        return np.zeros((0, 0)), []
    jacobian = projected_jacobian(problem, sections, problem.residues(sections))
    root = inverse_root(jacobian, 1e-10)
    if root is None:
        text = "the lines do not determine all poles: lower the order; standard errors are NaN"
        return np.full((sections.order,) * 2, np.nan), [text]
    scores = jacobian.T @ (scale * problem.row_spread.reshape(-1, 1) * jacobian)
    return root @ (root.T @ scores @ root) @ root.T, []


def _quadratic(rows: Complex, matrix: Real) -> Real:
    """Return a M a^H of every row a."""
    return np.asarray(np.sum((rows @ matrix) * rows.conj(), axis=1).real)


def rational_orders(response: xr.Dataset, orders: Iterable[int], **options: object) -> xr.Dataset:
    """Return the losses of `fit_rational` for several orders, and the best orders.

    response, options
        Arguments of `fit_rational`.
    orders
        Numbers of poles.

    Variables over ``order``: ``loss``, ``reduced_loss``, ``n_parameters``, ``aic``, ``bic``,
    ``status`` (``failed`` if the lines are too few) and ``stable``. The criteria use the likelihood,
    or the residual power if the variance is not known. ``attrs["best_bic"]`` and
    ``attrs["best_aic"]`` are orders. Raises InputError without orders, and if every order fails.
    """
    wanted = sorted({whole("orders", n, 0) for n in orders})
    if not wanted:
        raise InputError("orders: expected at least one, got none")
    names = ("loss", "reduced_loss", "n_parameters", "aic", "bic")
    rows: dict[str, list[float]] = {name: [] for name in names}
    status, stable = [], []
    failure: AxisightError | None = None
    for n in wanted:
        try:
            model = fit_rational(response, n, **options)  # type: ignore[arg-type]
        except InputError as error:
            failure = error
            status.append("failed")
            stable.append(False)
            for column in rows.values():
                column.append(np.nan)
            continue
        count = model.degrees_of_freedom + model.n_parameters
        level = model.loss / model.loss_scale
        if model.weighting != "variance" or np.isnan(model.loss_scale):
            level = count * float(np.log(max(model.loss, 1e-300) / count))
        d = model.n_parameters
        values = (model.loss, model.reduced_loss, d, level + 2 * d)
        for name, value in zip(names, (*values, level + d * np.log(count)), strict=True):
            rows[name].append(value)
        status.append(model.status)
        stable.append(model.stable)
    if failure is not None and all(s == "failed" for s in status):
        raise failure
    return xr.Dataset(
        {
            **{name: ("order", np.asarray(column)) for name, column in rows.items()},
            "status": ("order", np.asarray(status)),
            "stable": ("order", np.asarray(stable)),
        },
        coords={"order": wanted},
        attrs={f"best_{name}": wanted[int(np.nanargmin(rows[name]))] for name in ("aic", "bic")},
    )

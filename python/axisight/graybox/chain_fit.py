"""Chains of masses fitted to a measured collocated response."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from axisight.blackbox.rational import fit_rational
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.graybox.collocated import Collocated, collocated, standard_errors
from axisight.graybox.spring_masses import SpringMassChain, reconstruct_chain

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MOST_PASSES = 20
_SETTLED = 1e-4
_START_DAMPING = 0.03
_ROOM = 0.05
_POOR_DB = 3.0
_UNCERTAIN = 0.5
_SPAN = 1e3
# A value this close to the end of its span, relative to the span, counts as on the bound, because
# steps of the trust region approach a bound and do not reach it.
_AT_END = 0.01
_BEYOND = 1.2


@summarized
@dataclass(frozen=True, eq=False)
class ChainFit:
    """A chain of masses that fits a response.

    chain
        Masses, springs, dampers.
    inertia_standard_error, stiffness_standard_error, damping_standard_error
        In the units and shapes of the chain's values. They come from the scatter of every line about
        the model (:func:`axisight.graybox.collocated.sandwich`), which errors of the model enlarge.
        Infinite for values that the lines do not show, NaN for values that a single line decides. Not
        valid for values on a bound.
    viscous_friction_nm_s_rad
        Viscous friction of the motor, motor side, with its standard error.
    delay_s
        Pure delay [s]; a held torque gives half a sample.
    error_db
        Median over the lines of the error of modelled over measured response [dB], magnitude and phase
        together (1 rad counts as 8.7 dB).
    status
        ``"converged"``, ``"not_converged"``, or ``"on_bound"``: masses, springs or dampers reached a
        thousandfold of the start, the limit of the search, and the minimum lies elsewhere.
    findings
        Warnings to read before using the values.
    """

    chain: SpringMassChain
    inertia_standard_error: Real
    stiffness_standard_error: Real
    damping_standard_error: Real
    viscous_friction_nm_s_rad: float
    viscous_friction_standard_error: float
    delay_s: float
    error_db: float
    status: str
    findings: tuple[str, ...] = ()


def fit_chain(
    response: xr.Dataset,
    n_masses: int,
    *,
    gear_ratio: float = 1.0,
    axis: int = 1,
    quantity: str | None = None,
    band_hz: tuple[float, float] | None = None,
    start: SpringMassChain | None = None,
    delay: bool = True,
) -> ChainFit:
    """Fit a chain of ``n_masses`` to a collocated response, and return it with standard errors.

    The start comes from a rational function with n - 1 pairs of zeros and poles, and a real pole for
    the friction of the motor, fitted with relative weights (:func:`axisight.blackbox.fit_rational`).
    Its frequencies give a chain by the inverse eigenvalue problem
    (:func:`axisight.graybox.reconstruct_chain`). If its poles and zeros do not alternate, the start
    comes from the peaks and the notches between them, and the findings say so.

    From this start, masses, springs, dampers, viscous friction and delay are fitted to the logarithm
    of the response, (3.44), with exact gradients. Poles and zeros of a chain alternate for any noise.

    Parameters
    ----------
    response, axis, quantity, band_hz : see :func:`axisight.graybox.collocated`.
    n_masses : 2 or more, including the motor.
    gear_ratio : r, joint angle per motor angle; masses beyond the motor, springs and dampers
        are on the joint side.
    start : chain at which the fit starts instead.
    delay : whether to fit a pure delay too.

    Raises InputError for fewer than 2 masses, too few lines, or fewer resonances in the band
    than the chain has.

    """
    if isinstance(n_masses, bool) or n_masses != int(n_masses) or n_masses < 2:
        raise InputError(f"n_masses: expected a whole number of at least 2, got {n_masses}")
    if not (np.isfinite(gear_ratio) and gear_ratio != 0):
        raise InputError(f"gear_ratio: expected a finite number other than zero, got {gear_ratio}")
    data = collocated(response, axis=axis, quantity=quantity, band_hz=band_hz)
    if len(data.frequency_hz) < 3 * n_masses + 2:
        raise InputError(
            f"response: expected at least {3 * n_masses + 2} lines for {n_masses} masses, "
            f"got {len(data.frequency_hz)}"
        )
    findings: list[str] = []
    if start is None:
        start = _start(data, n_masses - 1, gear_ratio, findings)
    elif start.n_masses != n_masses:
        raise InputError(f"start: expected {n_masses} masses, got {start.n_masses}")
    return _polish(data, replace(start, gear_ratio=gear_ratio), delay, findings)


def _start(data: Collocated, pairs: int, ratio: float, findings: list[str]) -> SpringMassChain:
    """Return the chain with the poles and zeros of a rational fit, or with peaks and notches."""
    why, found = "", []
    # Friction of the motor adds a real pole, but with noise the fit can be better without it.
    for real in (1, 0):
        try:
            zeros, poles, gain = _rational(data, pairs, real)
            if poles[0][-1] <= _BEYOND * data.angular_rad_s[-1]:
                found.append(_reconstruct(poles, zeros, 1 / gain, ratio))
            else:
                why = "has a resonance beyond the band"
        except InputError:
            why = "has poles and zeros that do not alternate"
    if found:
        return min(found, key=lambda chain: _distance(data, chain))
    findings.append(f"the rational fit {why}; started from peaks and notches")
    peaks, notches = _peaks(data, pairs)
    damping = np.full(pairs, _START_DAMPING)
    above = np.abs(data.acceleration)[data.angular_rad_s > peaks[-1]]
    gain = float(np.median(above)) if len(above) else float(np.median(np.abs(data.acceleration)))
    return _reconstruct((peaks, damping), (notches, damping), 1 / gain, ratio)


def _distance(data: Collocated, chain: SpringMassChain) -> float:
    """Return the median error of the lines, as a logarithm."""
    model = chain.acceleration_response(data.frequency_hz)
    return float(np.median(np.abs(np.log(model / data.acceleration))))


def _reconstruct(
    poles: tuple[Real, Real], zeros: tuple[Real, Real], motor: float, ratio: float
) -> SpringMassChain:
    return reconstruct_chain(
        poles[0],
        zeros[0],
        motor_inertia_kg_m2=motor,
        gear_ratio=ratio,
        pole_damping=poles[1],
        zero_damping=zeros[1],
    )


def _rational(
    data: Collocated, pairs: int, real: int
) -> tuple[tuple[Real, Real], tuple[Real, Real], float]:
    """Return zeros and poles in pairs (frequencies, damping ratios), and the gain, of a rational fit.

    ``real`` is the number of real zeros and poles besides the pairs.
    """
    response = frequency_response(
        data.frequency_hz,
        data.acceleration[:, None, None],
        estimator="collocated",
        output_unit="rad/s^2",
    )
    model = fit_rational(response, 2 * pairs + real, direct=True, weighting="relative")
    gain = float(model.direct[0, 0])
    if gain <= 0:
        raise InputError("response: expected a positive high-frequency gain")
    return _upper(model.zeros(), pairs, "zeros"), _upper(model.poles, pairs, "poles"), gain


def _upper(roots: Complex, pairs: int, name: str) -> tuple[Real, Real]:
    upper = roots[roots.imag > 0]
    if len(upper) != pairs:
        raise InputError(f"response: expected {pairs} complex pairs of {name}, got {roots}")
    upper = upper[np.argsort(np.abs(upper))]
    return np.abs(upper), np.clip(-upper.real / np.abs(upper), 0.0, 1.0)


def _peaks(data: Collocated, pairs: int) -> tuple[Real, Real]:
    """Return the most prominent resonances, and the lowest line below each."""
    level = np.log(np.abs(data.acceleration))
    found, properties = scipy.signal.find_peaks(level, prominence=0.1)
    if len(found) < pairs:
        raise InputError(
            f"response: expected {pairs} resonances for {pairs + 1} masses, found {len(found)} "
            "in the band; fit fewer masses, or widen the band"
        )
    strongest = np.sort(found[np.argsort(properties["prominences"])[-pairs:]])
    before = np.concatenate([[0], strongest[:-1]])
    notches = [a + int(np.argmin(level[a:b])) for a, b in zip(before, strongest, strict=True)]
    omega = data.angular_rad_s
    peaks, low = omega[strongest], omega[notches]
    # A notch on the line of a resonance would not alternate.
    floor = np.concatenate([[0.0], peaks[:-1]])
    return peaks, np.clip(low, floor + _ROOM * (peaks - floor), peaks - _ROOM * (peaks - floor))


class _Problem:
    """Residuals of the logarithm of the response, and their exact derivatives.

    Until a call of ``reweigh``, weights come from noise relative to the measured response.

    Unknowns are the logarithms of masses and springs (within a thousandfold of the start), and
    dampers, friction and delay relative to a scale.
    """

    def __init__(self, data: Collocated, start: SpringMassChain, delay: bool) -> None:
        self._omega = data.angular_rad_s
        self._log = np.log(data.acceleration)
        self._data = data
        self._weight = data.weight(data.acceleration)
        self.n = start.n_masses
        self._ratio = start.gear_ratio
        middle = float(np.sqrt(self._omega[0] * self._omega[-1]))
        self.damper = np.maximum(start.damping_nm_s_rad, 0.01 * start.stiffness_nm_rad / middle)
        self.friction = 0.1 * middle * start.inertia_kg_m2[0]
        self.time = 0.1 / middle
        self._delay = delay
        springs = np.log(start.stiffness_nm_rad)
        self.first = np.concatenate(
            [
                np.log(start.inertia_kg_m2),
                springs,
                np.maximum(start.damping_nm_s_rad / self.damper, 0.1),
                [0.1],
                [0.0] if delay else [],
            ]
        )
        free = 2 * self.n - 1
        self.lower = np.full(len(self.first), -np.inf)
        self.upper = np.full(len(self.first), np.inf)
        self.lower[free : free + self.n] = 0.0
        self.upper[free : free + self.n] = _SPAN
        self.lower[:free] = self.first[:free] - np.log(_SPAN)
        self.upper[:free] = self.first[:free] + np.log(_SPAN)

    def at_end(self, x: Real) -> list[int]:
        """Return the indices of masses, springs and dampers at the end of their span.

        Dampers at zero do not count, because an undamped chain is valid.
        """
        free = 2 * self.n - 1
        apart = np.abs(x[:free] - self.first[:free]) >= np.log(_SPAN * (1 - _AT_END))
        large = x[free : free + self.n - 1] >= _SPAN * (1 - _AT_END)
        return np.flatnonzero(np.concatenate([apart, large])).tolist()

    def parts(self, x: Real) -> tuple[Real, Real, Real, float, float]:
        """Return inertias, stiffnesses, dampers, friction (joint side) and delay."""
        n = self.n
        return (
            np.exp(x[:n]),
            np.exp(x[n : 2 * n - 1]),
            x[2 * n - 1 : 3 * n - 2] * self.damper,
            float(x[3 * n - 2] * self.friction),
            float(x[3 * n - 1] * self.time) if self._delay else 0.0,
        )

    def _motion(self, x: Real) -> Complex:
        """Return the angles of all masses per torque on the first, (n_lines, n)."""
        inertia, stiffness, damping, friction, _ = self.parts(x)
        s = 1j * self._omega
        spring = stiffness + s[:, None] * damping
        system = np.zeros((len(s), self.n, self.n), np.complex128)
        at = np.arange(self.n)
        system[:, at, at] = s[:, None] ** 2 * inertia
        system[:, 0, 0] += s * friction
        system[:, at[:-1], at[:-1]] += spring
        system[:, at[1:], at[1:]] += spring
        system[:, at[:-1], at[1:]] = system[:, at[1:], at[:-1]] = -spring
        unit = np.zeros((self.n, 1), np.complex128)
        unit[0] = 1.0
        return np.asarray(np.linalg.solve(system, unit[None])[..., 0])

    def _model(self, x: Real) -> Complex:
        """Return the response from torque to acceleration of the motor, without delay."""
        return np.asarray(-(self._omega**2) * self._motion(x)[:, 0] / self._ratio**2)

    def reweigh(self, x: Real) -> float:
        """Take the weights from the model, and return their mean relative change."""
        before, self._weight = self._weight, self._data.weight(self._model(x))
        return float(np.mean(np.abs(self._weight / before - 1)))

    def error(self, x: Real) -> Complex:
        """Return the logarithm of modelled over measured response, with phase within half a turn."""
        apart = np.log(self._model(x)) - 1j * self._omega * self.parts(x)[4] - self._log
        return np.asarray(apart.real + 1j * np.angle(np.exp(1j * apart.imag)))

    def residual(self, x: Real) -> Real:
        """Return the weighted errors, real, then imaginary parts."""
        left = self.error(x) * self._weight
        return np.concatenate([left.real, left.imag])

    def standard_errors(self, x: Real) -> Real:
        """Return the standard errors of the unknowns, with the weights of the model ``x``."""
        noise = self._weight**2 * self._data.noise(self._model(x))
        return standard_errors(self.jacobian(x), self.residual(x), noise)

    def jacobian(self, x: Real) -> Real:
        """Return the derivatives of the residuals, by d(e^T D^-1 e) = -x^T dD x for symmetric D."""
        inertia, stiffness, _, _, _ = self.parts(x)
        motion = self._motion(x)
        s = 1j * self._omega[:, None]
        stretch = (motion[:, :-1] - motion[:, 1:]) ** 2
        columns = [
            -(s**2) * motion**2 * inertia,
            -stretch * stiffness,
            -s * stretch * self.damper,
            -s * motion[:, :1] ** 2 * self.friction,
        ]
        slope = np.hstack(columns) / motion[:, :1]
        if self._delay:
            slope = np.hstack([slope, -s * self.time])
        slope = slope * self._weight[:, None]
        return np.vstack([slope.real, slope.imag])


def _reweighted(problem: _Problem) -> tuple[scipy.optimize.OptimizeResult, bool]:
    """Return the fit whose weights from the model no longer change, and whether they settled."""
    at = problem.first
    for _ in range(_MOST_PASSES):
        found: scipy.optimize.OptimizeResult = scipy.optimize.least_squares(
            problem.residual,
            at,
            jac=problem.jacobian,
            bounds=(problem.lower, problem.upper),
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=300,
        )
        at = found.x
        if problem.reweigh(at) < _SETTLED:
            return found, True
    return found, False


def _polish(data: Collocated, start: SpringMassChain, delay: bool, findings: list[str]) -> ChainFit:
    problem = _Problem(data, start, delay)
    found, settled = _reweighted(problem)
    inertia, stiffness, damping, friction, late = problem.parts(found.x)
    n, ratio = problem.n, start.gear_ratio
    deviation = problem.standard_errors(found.x)
    error = 20 / np.log(10) * float(np.median(np.abs(problem.error(found.x))))
    found_chain = SpringMassChain(inertia, stiffness, damping, ratio)
    converged = found.status > 0 and settled
    if not converged:
        findings.append("the fit stopped before it converged: try fewer masses or another start")
    if error > _POOR_DB:
        findings.append(
            f"half of the lines are more than {error:.1f} dB off the chain: other masses, or noise"
        )
    beyond = found_chain.poles_rad_s > _BEYOND * data.angular_rad_s[-1]
    if beyond.any():
        findings.append(
            f"resonance {found_chain.poles_rad_s[beyond][0]:.3g} rad/s lies beyond the band: its "
            "mass and spring are guesses; fit fewer masses"
        )
    ends = problem.at_end(found.x)
    findings += _doubts(n, ends, deviation)
    status = "on_bound" if ends else "converged"
    return ChainFit(
        chain=found_chain,
        inertia_standard_error=inertia * deviation[:n],
        stiffness_standard_error=stiffness * deviation[n : 2 * n - 1],
        damping_standard_error=problem.damper * deviation[2 * n - 1 : 3 * n - 2],
        viscous_friction_nm_s_rad=float(friction * ratio**2),
        viscous_friction_standard_error=float(problem.friction * ratio**2 * deviation[3 * n - 2]),
        delay_s=late,
        error_db=error,
        status=status if converged else "not_converged",
        findings=tuple(findings),
    )


def _doubts(n: int, ends: list[int], deviation: Real) -> list[str]:
    """Return warnings about values on a bound, and about values that the lines do not show."""
    names = [f"inertia {i + 1}" for i in range(n)]
    names += [f"{kind} {i + 1}" for kind in ("spring", "damper") for i in range(n - 1)]
    relative = deviation[: 2 * n - 1]
    out = []
    for places, words in (
        (ends, "on a bound, a thousandfold from the start: start closer, or fit fewer masses"),
        (np.flatnonzero(relative > _UNCERTAIN), "hardly seen in this band; fit fewer masses"),
        (
            np.flatnonzero(np.isnan(relative)),
            "decided by a single line, standard error unknown; excite more lines there",
        ),
    ):
        if len(places):
            out.append(f"{', '.join(names[i] for i in places)}: {words}")
    return out

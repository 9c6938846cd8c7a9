"""Notch, resonance and high-frequency gain of a collocated response, estimated between its lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.graybox.collocated import Collocated, standard_errors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_WINDOW = 0.3
_SURROUNDINGS = 3
_FEWEST = 8
_DEPTH_DB = 6.0
_EDGE_LINES = 2
_PLATEAU_FROM = 1.6
_PEAK_DB = 3.0
_LARGEST_STEP = 0.25
_PASSES = 4


@summarized
@dataclass(frozen=True)
class Landmark:
    """A notch or a resonance.

    frequency_rad_s, damping_ratio
        Natural frequency and damping ratio of the pair of zeros or poles.
    frequency_standard_error_rad_s, damping_standard_error
        From the scatter about the local model; NaN if a single line decides.
    n_lines
        Number of lines used.
    """

    frequency_rad_s: float
    damping_ratio: float
    frequency_standard_error_rad_s: float
    damping_standard_error: float
    n_lines: int


@summarized
@dataclass(frozen=True)
class HighFrequencyGain:
    """Level of the response from torque to acceleration far above the resonances, 1 / J_m.

    gain, standard_error
        Gain at infinite frequency [rad/s^2/Nm]. The standard error is that of noise. It does not
        include the truncation of the series, up to 1 % for lines from 1.6 times the last peak on.
    correction
        Excess of the response at the upper end of the band over the gain, relative to the gain.
    from_rad_s, to_rad_s
        Lowest and highest line used [rad/s].
    """

    gain: float
    standard_error: float
    correction: float
    from_rad_s: float
    to_rad_s: float


def find_notch(data: Collocated, *, band_rad_s: tuple[float, float] | None = None) -> Landmark:
    """Return the first notch, estimated between the lines.

    The search starts at the lowest line of ``band_rad_s`` (default: of all lines below the highest
    resonance), after a median over three lines. Within 30 % of it, the logarithm of the response is a
    pair of zeros and surroundings,

        log G = log(w0^2 - w^2 + 2 i zeta w0 w) + c0 + c1 x + c2 x^2,  x = w / w0 - 1,

    with complex c for delay, friction and the flanks of neighbours. Nonlinear least squares gives w0
    and zeta, and linear least squares c (variable projection). Weights come from the variance of a
    line and a tolerance of 5 % for errors of the local model, both relative to the model of the last
    of four passes.

    Raises InputError if the band holds no notch, that is, if the lowest line is at the edge of the
    band or not 6 dB below the response on both sides.
    """
    omega, level = data.angular_rad_s, _level_db(data)
    inside = np.ones(len(omega), bool)
    if band_rad_s is not None:
        inside = (omega >= band_rad_s[0]) & (omega <= band_rad_s[1])
        if not inside.any():
            raise InputError(
                f"band_rad_s: expected lines between {band_rad_s[0]:g} and {band_rad_s[1]:g} rad/s"
            )
    at = int(np.argmin(np.where(inside, level, np.inf)))
    depth = min(level[: at + 1].max(), level[at:].max()) - level[at]
    edge = at < _EDGE_LINES or at >= len(omega) - _EDGE_LINES
    if edge or depth < _DEPTH_DB:
        where = "at the edge of the band" if edge else f"only {depth:.1f} dB below its surroundings"
        raise InputError(
            f"response: expected a notch between {omega[0]:.3g} and {omega[-1]:.3g} rad/s, but the "
            f"lowest value, at {omega[at]:.3g} rad/s, is {where}; excite a band that holds the "
            "notch and the resonance above it, or give the band of the notch"
        )
    return _pair(data, omega[at], 1.0)


def find_resonance(
    data: Collocated, *, above_rad_s: float = 0.0, below_rad_s: float = np.inf
) -> Landmark:
    """Return the highest resonance between ``above_rad_s`` and ``below_rad_s``.

    The estimate between the lines is that of :func:`find_notch`.

    Raises InputError if the band is empty or the highest line is at its edge.
    """
    omega, level = data.angular_rad_s, _level_db(data)
    inside = (omega > above_rad_s) & (omega < below_rad_s)
    if not inside.any():
        raise InputError(f"response: expected lines above {above_rad_s:.3g} rad/s, got none")
    at = int(np.argmax(np.where(inside, level, -np.inf)))
    if at < _EDGE_LINES or at >= len(omega) - _EDGE_LINES:
        raise InputError(
            f"response: expected a resonance between {max(above_rad_s, omega[0]):.3g} and "
            f"{min(below_rad_s, omega[-1]):.3g} rad/s, but the largest value is at the edge of the "
            "band; excite higher frequencies"
        )
    return _pair(data, omega[at], -1.0)


def high_frequency_gain(data: Collocated, *, from_rad_s: float) -> HighFrequencyGain:
    """Return the gain far above the resonances from lines above ``from_rad_s``.

    There |G| = g (1 + c / w^2 + e / w^4), with an error of sixth order in 1 / w; c is the sum of the
    squared resonances minus that of the squared notches. Least squares on the logarithm, which noise
    does not bias, gives g, c and e. Weights come from the variance of a line and a tolerance of 5 %,
    both relative to the model of the last of four passes. The standard error comes from the scatter.

    Raises InputError if fewer than eight lines are left, or if the response at the upper end of the
    band is still a quarter from the gain, because the band then has no plateau.
    """
    high = data.between(from_rad_s, np.inf)
    omega, size = high.angular_rad_s, np.abs(high.acceleration)
    top = data.angular_rad_s[-1]
    advice = (
        "excite up to three times the highest resonance, or give the motor inertia (data sheet) "
        "instead"
    )
    if len(omega) < _FEWEST:
        raise InputError(
            f"response: expected at least {_FEWEST} lines above {from_rad_s:.3g} rad/s for the "
            f"high-frequency gain 1 / J_m, got {len(omega)} up to {top:.3g} rad/s; {advice}"
        )
    basis = np.vander((from_rad_s / omega) ** 2, 3, increasing=True)
    modelled = size
    for _ in range(_PASSES):
        weight = high.weight(modelled)
        # A Gauss-Newton step for the logarithm, so that errors are relative.
        slope = basis * (weight / modelled)[:, None]
        level, covariance = _least_squares(slope, (1 + np.log(size / modelled)) * weight)
        modelled = np.abs(basis @ level)
    gain = level[0]
    correction = float(basis[-1] @ level / gain - 1)
    if not abs(correction) < _LARGEST_STEP:
        raise InputError(
            f"response: expected a plateau at high frequency, but at {omega[-1]:.3g} rad/s it is "
            f"still {100 * correction:+.0f} % from the level it tends to; {advice}"
        )
    return HighFrequencyGain(
        float(gain), float(np.sqrt(covariance[0, 0])), correction, float(omega[0]), float(omega[-1])
    )


def plateau_start(data: Collocated) -> float:
    """Return the frequency from which a plateau is possible [rad/s]: 1.6 times the last peak of 3 dB."""
    peaks, _ = scipy.signal.find_peaks(_level_db(data), prominence=_PEAK_DB)
    if not len(peaks):
        raise InputError("response: expected a resonance of 3 dB or more in the band, got none")
    return float(_PLATEAU_FROM * data.angular_rad_s[peaks[-1]])


def _level_db(data: Collocated) -> Real:
    """Return the magnitude [dB], after a median that removes single outliers."""
    return np.asarray(scipy.signal.medfilt(20 * np.log10(np.abs(data.acceleration)), 3))


def _least_squares(basis: Real, target: Real) -> tuple[Real, Real]:
    """Return solution and covariance, with the variance of the residuals."""
    solution, _, _, _ = np.linalg.lstsq(basis, target, rcond=None)
    left = target - basis @ solution
    freedom = max(len(target) - basis.shape[1], 1)
    covariance = np.linalg.inv(basis.T @ basis) * float(left @ left) / freedom
    return np.asarray(solution, np.float64), np.asarray(covariance, np.float64)


def _pair(data: Collocated, start_rad_s: float, sign: float) -> Landmark:
    """Return a fitted pair of zeros (sign 1) or poles (-1) with smooth surroundings."""
    near = data.between((1 - _WINDOW) * start_rad_s, (1 + _WINDOW) * start_rad_s)
    omega = near.angular_rad_s
    if len(omega) < _FEWEST:
        raise InputError(
            f"response: expected at least {_FEWEST} lines within 30 % of {start_rad_s:.3g} rad/s, "
            f"got {len(omega)}; excite more lines there"
        )
    local = _Local(near, start_rad_s, sign)
    at = np.array([start_rad_s, 0.05])
    spacing = float(np.median(np.diff(omega)))
    for _ in range(_PASSES):
        found = scipy.optimize.least_squares(
            local.residual,
            at,
            jac=local.slope,
            bounds=([omega[0], 1e-6], [omega[-1], 1.0]),
            x_scale=np.array([spacing, 0.01]),
        )
        at, modelled = found.x, local.modelled(found.x)
        error = local.standard_errors(found.x, modelled)
        local.weigh(modelled)
    frequency, damping = (float(v) for v in at)
    return Landmark(frequency, damping, float(error[0]), float(error[1]), len(omega))


class _Local:
    """A pair of zeros (sign 1) or poles (-1) with smooth surroundings, which are projected out.

    Unknowns are frequency and damping ratio. Until a call of ``weigh``, weights come from noise
    relative to the measured response.
    """

    def __init__(self, data: Collocated, start_rad_s: float, sign: float) -> None:
        self._data = data
        self._omega = data.angular_rad_s
        self._sign = sign
        value = data.acceleration
        self._log = np.log(np.abs(value)) + 1j * np.unwrap(np.angle(value))
        self._shape = np.vander(self._omega / start_rad_s - 1, _SURROUNDINGS, increasing=True)
        self.weigh(value)

    def weigh(self, modelled: Complex) -> None:
        """Take weights from a modelled response."""
        self._weight = self._data.weight(modelled)
        self._smooth, self._mix = np.linalg.qr(self._shape * self._weight[:, None])

    def _free(self, values: Complex) -> Real:
        """Return the weighted part that the surroundings cannot explain, real, then imaginary parts."""
        left = values * self._weight
        left = left - self._smooth @ (self._smooth.T @ left)
        return np.concatenate([left.real, left.imag])

    def _pair(self, theta: Real) -> Complex:
        omega = self._omega
        return np.asarray(theta[0] ** 2 - omega**2 + 2j * theta[1] * theta[0] * omega)

    def _rest(self, theta: Real) -> Complex:
        """Return the logarithm of the response without the pair."""
        factor = self._pair(theta)
        phase = np.unwrap(np.angle(factor))
        return np.asarray(self._log - self._sign * (np.log(np.abs(factor)) + 1j * phase))

    def residual(self, theta: Real) -> Real:
        """Return the weighted errors."""
        return self._free(self._rest(theta))

    def slope(self, theta: Real) -> Real:
        """Return the derivatives of the residuals by frequency and damping, (2 n, 2)."""
        factor = self._pair(theta)
        by_frequency = (2 * theta[0] + 2j * theta[1] * self._omega) / factor
        by_damping = 2j * theta[0] * self._omega / factor
        return -self._sign * np.stack([self._free(by_frequency), self._free(by_damping)], axis=1)

    def modelled(self, theta: Real) -> Complex:
        """Return the response of pair and surroundings."""
        weighted = self._smooth.T @ (self._rest(theta) * self._weight)
        around = self._shape @ np.linalg.solve(self._mix, weighted)
        return np.asarray(self._pair(theta) ** self._sign * np.exp(around))

    def standard_errors(self, theta: Real, modelled: Complex) -> Real:
        """Return the standard errors of frequency and damping, (2,)."""
        noise = self._weight**2 * self._data.noise(modelled)
        # The surroundings also absorb part of the residuals.
        around = scipy.linalg.block_diag(self._smooth, self._smooth)
        slope = np.hstack([self.slope(theta), around])
        return standard_errors(slope, self.residual(theta), noise)[:2]

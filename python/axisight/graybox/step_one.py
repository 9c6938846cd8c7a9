"""Step 1 of chapter 9: rigid body and friction of one axis by linear regression.

Wernholt (2004), sections 4.3, 9.3.1 and 9.5.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import series_pair
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.logs.filters import lowpass
from axisight.statistics.least_squares import condition, unit_columns

Real = NDArray[np.float64]

_FILTER_ORDER = 4
_FEWEST = 50
_EDGE_PERIODS = 2.5
_LAG_PERIODS = 3.0
_LEAST_SHARE = 0.02
_LARGEST_CONDITION = 1e3


@summarized
@dataclass(frozen=True)
class RigidBodyFriction:
    """Estimate of (9.12), motor side, with standard errors.

    inertia_kg_m2
        J_m + r^2 J_a.
    viscous_friction_nm_s_rad, coulomb_friction_nm
        F_v and F_c.
    offset_nm
        Constant torque; None where it was not estimated.
    covariance
        Covariance of inertia, viscous and Coulomb friction (and offset), in that order.
    residual_rms_nm, fit_percent
        Rms residual of the filtered torque, and fit (3.54) of the regression to it.
    cutoff_hz
        Frequency at which the zero-phase low-pass filter (both passes) halves the amplitude.
    condition
        Condition number of the regressor, columns scaled to one.
    n_used
        Number of samples used.
    findings
        Warnings to read before using the values.
    """

    inertia_kg_m2: float
    viscous_friction_nm_s_rad: float
    coulomb_friction_nm: float
    offset_nm: float | None
    inertia_standard_error: float
    viscous_friction_standard_error: float
    coulomb_friction_standard_error: float
    covariance: Real
    residual_rms_nm: float
    fit_percent: float
    cutoff_hz: float
    condition: float
    n_used: int
    findings: tuple[str, ...] = ()


def rigid_body_friction(
    torque_nm: ArrayLike,
    position_rad: ArrayLike,
    sample_time_s: float,
    *,
    cutoff_hz: float = 5.0,
    least_speed_rad_s: float = 0.0,
    offset: bool = False,
) -> RigidBodyFriction:
    """Return J_m + r^2 J_a, F_v and F_c of one axis by the regression (9.11).

    Position and torque pass the same zero-phase low-pass filter (Butterworth of order 4, forward and
    backward). Velocity and acceleration are central differences of the filtered position, and the
    sign of that velocity passes the filter too. Thus all columns and the torque pass one filter,
    which causes no bias if the model holds. The regression leaves out two and a half periods of the
    cutoff at either end.

    Standard errors allow for residuals that are correlated over time (Newey and West 1987,
    Econometrica 55), because errors of the rigid model last for many samples.

    Parameters
    ----------
    torque_nm, position_rad : motor side, (n,).
    sample_time_s : sample time [s].
    cutoff_hz : well below the first resonance, well above the motion's own frequency.
    least_speed_rad_s : the regression leaves out slower samples, at which friction is not a sign
        function.
    offset : whether to estimate a constant torque too.

    Raises InputError for wrong or short arrays, a cutoff out of range, motion in one direction only
    (Coulomb friction then equals a constant torque), constant speed (viscous and Coulomb friction
    are then one) and no acceleration.

    """
    torque, position = series_pair("torque_nm", torque_nm, "position_rad", position_rad)
    if not (np.isfinite(sample_time_s) and sample_time_s > 0):
        raise InputError(f"sample_time_s: expected a positive time, got {sample_time_s}")
    nyquist = 0.5 / sample_time_s
    if not 0 < cutoff_hz < 0.8 * nyquist:
        raise InputError(
            f"cutoff_hz: expected above 0 and below 0.8 of Nyquist, {0.8 * nyquist:g}, got {cutoff_hz}"
        )
    if not (np.isfinite(least_speed_rad_s) and least_speed_rad_s >= 0):
        raise InputError(f"least_speed_rad_s: expected 0 or more, got {least_speed_rad_s}")
    edge = round(_EDGE_PERIODS / cutoff_hz / sample_time_s)
    if len(torque) < 2 * edge + _FEWEST:
        raise InputError(
            f"torque_nm: expected more than {2 * edge + _FEWEST} samples "
            f"({(2 * edge + _FEWEST) * sample_time_s:.2g} s at this cutoff), got {len(torque)}"
        )

    def low_pass(signal: Real) -> Real:
        return lowpass(signal, sample_time_s, cutoff_hz, _FILTER_ORDER)

    smooth = low_pass(position)
    velocity = np.gradient(smooth, sample_time_s)
    acceleration = np.gradient(velocity, sample_time_s)
    columns = [acceleration, velocity, low_pass(np.sign(velocity))]
    names = ["acceleration", "velocity", "sign of the velocity"]
    if offset:
        columns.append(np.ones(len(velocity)))
        names.append("constant")
    kept = np.zeros(len(torque), bool)
    kept[edge : len(torque) - edge] = True
    kept &= np.abs(velocity) >= least_speed_rad_s
    if kept.sum() < _FEWEST:
        raise InputError(
            f"least_speed_rad_s: expected at least {_FEWEST} faster samples, got {kept.sum()}"
        )
    regressor = np.stack(columns, axis=1)[kept]
    _check_excitation(velocity[kept], regressor)
    return _regress(regressor, low_pass(torque)[kept], names, cutoff_hz, sample_time_s)


def _check_excitation(velocity: Real, regressor: Real) -> None:
    forward = float(np.mean(velocity > 0))
    if not _LEAST_SHARE < forward < 1 - _LEAST_SHARE:
        raise InputError(
            "position_rad: expected motion in both directions, got "
            f"{100 * max(forward, 1 - forward):.0f} % in one; Coulomb friction cannot be told from "
            "a constant torque without reversals: use a reference that changes sign, such as a "
            "triangle wave"
        )
    if not regressor[:, :2].any(axis=0).all():
        raise InputError("position_rad: expected motion, got a constant")
    scaled, _ = unit_columns(regressor)
    _, values, directions = np.linalg.svd(scaled, full_matrices=False)
    if values[0] > _LARGEST_CONDITION * values[-1]:
        weak = np.abs(directions[-1])
        names = ("inertia", "viscous friction", "Coulomb friction", "offset")
        involved = [n for n, w in zip(names, weak, strict=False) if w > 0.3]
        raise InputError(
            f"position_rad: expected motion that tells {' and '.join(involved)} apart; accelerate, "
            "and use several speeds"
        )


def _regress(
    regressor: Real, torque: Real, names: list[str], cutoff_hz: float, sample_time_s: float
) -> RigidBodyFriction:
    scaled, size = unit_columns(regressor)
    q, upper = np.linalg.qr(scaled)
    solution = np.linalg.solve(upper, q.T @ torque)
    left = torque - scaled @ solution
    # The filter correlates residuals over at least the inverse of the cutoff.
    lags = min(round(_LAG_PERIODS / cutoff_hz / sample_time_s), len(torque) // 8)
    inverse = np.linalg.inv(upper)
    covariance = _long_run(q * left[:, None], lags, inverse) / np.outer(size, size)
    estimate = solution / size
    error = np.sqrt(np.diag(covariance))
    findings = []
    what = ("inertia", "viscous friction", "Coulomb friction")
    for name, value, own in zip(what, estimate, error, strict=False):
        if value <= 0:
            findings.append(f"{name} is not positive ({value:.3g}): wrong sign of torque or motion")
        elif value < 3 * own:
            findings.append(f"{name} is hardly above its standard error: excite it more")
    variation = float(np.sqrt(np.sum((torque - torque.mean()) ** 2)))
    return RigidBodyFriction(
        inertia_kg_m2=float(estimate[0]),
        viscous_friction_nm_s_rad=float(estimate[1]),
        coulomb_friction_nm=float(estimate[2]),
        offset_nm=float(estimate[3]) if len(names) == 4 else None,
        inertia_standard_error=float(error[0]),
        viscous_friction_standard_error=float(error[1]),
        coulomb_friction_standard_error=float(error[2]),
        covariance=covariance,
        residual_rms_nm=float(np.sqrt(np.mean(left**2))),
        fit_percent=100 * (1 - float(np.linalg.norm(left)) / variation) if variation else 0.0,
        cutoff_hz=float(cutoff_hz),
        condition=condition(regressor),
        n_used=len(torque),
        findings=tuple(findings),
    )


def _long_run(scores: Real, lags: int, inverse: Real) -> Real:
    """Return the covariance of the solution, from scores that are correlated up to ``lags``."""
    triangle = 1 - np.abs(np.arange(-lags, lags + 1)) / (lags + 1)
    total = scores.T @ scipy.signal.fftconvolve(scores, triangle[:, None], mode="same", axes=0)
    # Degrees of freedom of the averaged spectrum near zero frequency. There the estimate has removed
    # a sine and a cosine of each column from the residuals.
    freedom = 1.5 * len(scores) / lags
    scale = freedom / max(freedom - 2 * scores.shape[1], 1.0)
    return np.asarray(scale * inverse @ total @ inverse.T)

"""Step 2 of chapter 9: initial values of the flexibility from frequency responses.

Wernholt (2004), sections 9.3.2 and 9.5.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.graybox.collocated import collocated
from axisight.graybox.landmarks import (
    HighFrequencyGain,
    Landmark,
    find_notch,
    find_resonance,
    high_frequency_gain,
    plateau_start,
)

Real = NDArray[np.float64]

_ALIKE = 1.1


@summarized
@dataclass(frozen=True)
class Flexibility:
    """Two-mass parameters from one frequency response, with standard errors.

    motor_inertia_kg_m2
        J_m, the inverse of the high-frequency gain.
    arm_inertia_kg_m2
        J_a = (J - J_m) / r^2, J from step 1.
    stiffness_nm_rad
        k = J_a w_n^2.
    damping_nm_s_rad
        d = 2 zeta w_n J_a, from the width of the notch.
    notch, resonance, gain
        Features of the response from which the values follow.
    findings
        Warnings to read before using the values.
    """

    motor_inertia_kg_m2: float
    arm_inertia_kg_m2: float
    stiffness_nm_rad: float
    damping_nm_s_rad: float
    motor_inertia_standard_error: float
    arm_inertia_standard_error: float
    stiffness_standard_error: float
    damping_standard_error: float
    notch: Landmark
    resonance: Landmark
    gain: HighFrequencyGain
    findings: tuple[str, ...] = ()


def initial_flexibility(
    response: xr.Dataset,
    *,
    rigid_inertia_kg_m2: float,
    gear_ratio: float,
    rigid_standard_error: float = 0.0,
    axis: int = 1,
    quantity: str | None = None,
    band_hz: tuple[float, float] | None = None,
    notch_band_hz: tuple[float, float] | None = None,
    plateau_from_hz: float | None = None,
) -> Flexibility:
    """Return J_m, J_a, k and d from notch and high-frequency gain, (9.13).

    The response of two masses from torque to motor acceleration, with damping in the gear, is

        s (J_a s^2 + d s + k) / (J_m J_a s^3 + ...),

    so that 1 / J_m is its high-frequency gain and sqrt(k / J_a) its notch. The notch is estimated
    between the lines (:func:`axisight.graybox.find_notch`). The gain is corrected for the
    contribution of the resonances (:func:`axisight.graybox.high_frequency_gain`). The thesis ignores
    d here; this function takes d from the width of the notch.

    Parameters
    ----------
    response : Dataset of an estimator of `axisight.frf`.
    rigid_inertia_kg_m2, rigid_standard_error : J = J_m + r^2 J_a on the motor side, step 1.
    gear_ratio : r, joint angle per motor angle.
    axis, quantity, band_hz : see :func:`axisight.graybox.collocated`.
    notch_band_hz : band of the search for the notch [Hz]; default the whole band.
    plateau_from_hz : lowest line of the high-frequency gain [Hz]; default 1.6 times the highest peak.

    Raises InputError if the response has no notch or resonance in the band or no plateau above it,
    and if the inertia of step 1 is not above that of the motor.

    """
    for name, value in (("rigid_inertia_kg_m2", rigid_inertia_kg_m2), ("gear_ratio", gear_ratio)):
        if not (np.isfinite(value) and value != 0) or (name != "gear_ratio" and value < 0):
            raise InputError(f"{name}: expected a positive number, got {value}")
    if not (np.isfinite(rigid_standard_error) and rigid_standard_error >= 0):
        raise InputError(f"rigid_standard_error: expected 0 or more, got {rigid_standard_error}")
    data = collocated(response, axis=axis, quantity=quantity, band_hz=band_hz)
    where = None
    if notch_band_hz is not None:
        where = 2 * np.pi * notch_band_hz[0], 2 * np.pi * notch_band_hz[1]
    notch = find_notch(data, band_rad_s=where)
    resonance = find_resonance(data, above_rad_s=notch.frequency_rad_s)
    start = plateau_start(data)
    if plateau_from_hz is not None:
        start = 2 * np.pi * plateau_from_hz
    gain = high_frequency_gain(data, from_rad_s=start)
    motor = 1 / gain.gain
    motor_error = gain.standard_error / gain.gain**2
    if motor >= rigid_inertia_kg_m2:
        raise InputError(
            f"rigid_inertia_kg_m2: expected more than J_m = {motor:.4g} kg m^2 of the "
            f"high-frequency gain, got {rigid_inertia_kg_m2:.4g}; is it on the motor side of the "
            "gear, and the torque that of the motor?"
        )
    arm = (rigid_inertia_kg_m2 - motor) / gear_ratio**2
    arm_error = float(np.hypot(rigid_standard_error, motor_error)) / gear_ratio**2
    stiffness = arm * notch.frequency_rad_s**2
    damping = 2 * notch.damping_ratio * notch.frequency_rad_s * arm
    by_notch = 2 * notch.frequency_standard_error_rad_s / notch.frequency_rad_s
    by_width = notch.damping_standard_error / notch.damping_ratio
    return Flexibility(
        motor_inertia_kg_m2=motor,
        arm_inertia_kg_m2=arm,
        stiffness_nm_rad=stiffness,
        damping_nm_s_rad=damping,
        motor_inertia_standard_error=motor_error,
        arm_inertia_standard_error=arm_error,
        stiffness_standard_error=stiffness * float(np.hypot(arm_error / arm, by_notch)),
        damping_standard_error=damping * float(np.hypot(arm_error / arm, by_width)),
        notch=notch,
        resonance=resonance,
        gain=gain,
        findings=_findings(rigid_inertia_kg_m2, motor, notch, resonance, gear_ratio),
    )


def _findings(
    rigid: float, motor: float, notch: Landmark, resonance: Landmark, ratio: float
) -> tuple[str, ...]:
    """Return warnings about properties that two masses do not have."""
    found = []
    expected = notch.frequency_rad_s * np.sqrt(rigid / motor)
    apart = resonance.frequency_rad_s / expected - 1
    if abs(apart) > 0.1:
        found.append(
            f"two masses of these inertias with this notch resonate at {expected:.1f} rad/s, the "
            f"response at {resonance.frequency_rad_s:.1f}: more masses (fit_chain), or the inertia "
            "of step 1 is off"
        )
    if abs(ratio) > 1:
        found.append(
            f"gear_ratio {ratio:g}: it is joint angle per motor angle, below one for a reduction"
        )
    # Written with "not", so that an unknown (NaN) error also counts as no damping shown.
    if not notch.damping_ratio >= 2 * notch.damping_standard_error:
        found.append("the notch is too narrow or too noisy to show damping: d is a guess")
    return tuple(found)


@summarized
@dataclass(frozen=True)
class CubicSpring:
    """Spring torque k1 x + k3 x^3, from stiffnesses at several amplitudes.

    linear_nm_rad, cubic_nm_rad3
        k1 and k3, with standard errors from those of the stiffnesses (NaN without).
    deflection_rms_rad
        Rms deflection of each data set.
    """

    linear_nm_rad: float
    cubic_nm_rad3: float
    linear_standard_error: float
    cubic_standard_error: float
    deflection_rms_rad: tuple[float, ...]
    findings: tuple[str, ...] = ()


def cubic_spring(
    stiffness_nm_rad: Sequence[float],
    deflection_rad: Sequence[ArrayLike],
    *,
    standard_error_nm_rad: Sequence[float] | None = None,
    method: Literal["samples", "sets"] = "samples",
) -> CubicSpring:
    """Return k1 and k3 from the stiffness k_i at several amplitudes.

    ``stiffness_nm_rad`` holds k_i [Nm/rad] of each set, and ``deflection_rad`` its deflection x [rad],
    see :func:`simulate_deflection`.

    method
        ``"samples"`` minimises (9.14), the sum over sets and samples of (k_i x - k1 x - k3 x^3)^2.
        Within a set the data are a straight line, which biases k3 towards zero: normally distributed
        deflections at amplitudes 1 : 2 give 14 % of k3, and a k1 near the stiffness of the larger set.
        ``"sets"`` fits the equivalent gain k_i = k1 + k3 E[x^4] / E[x^2] of every set by least squares
        over the sets. That gain is the least-squares stiffness of one set; for normal x its cubic part
        is 3 s^2 k3, the describing function. The method is exact if the k_i are equivalent gains.
    standard_error_nm_rad
        Standard errors of the k_i; both methods are linear in the k_i.

    Raises InputError for fewer than two sets, for zero deflections, and for amplitudes less than 10 %
    apart, which do not separate k1 and k3.
    """
    stiffness, sets = _amplitudes(stiffness_nm_rad, deflection_rad)
    rms = np.array([np.sqrt(np.mean(x**2)) for x in sets])
    if rms.max() < _ALIKE * rms.min():
        raise InputError(
            f"deflection_rad: expected amplitudes at least 10 % apart, got rms {rms.min():.3g} to "
            f"{rms.max():.3g} rad; k1 and k3 cannot be told apart, measure at another amplitude"
        )
    # Deflections relative to the largest rms keep the equations well scaled.
    unit = rms.max()
    second, fourth, sixth = (np.array([np.sum((x / unit) ** p) for x in sets]) for p in (2, 4, 6))
    if method == "samples":
        normal = [[second.sum(), fourth.sum()], [fourth.sum(), sixth.sum()]]
        share = np.linalg.solve(np.array(normal), np.stack([second, fourth]))
    elif method == "sets":
        share = np.linalg.pinv(np.stack([np.ones(len(sets)), fourth / second], axis=1))
    else:
        raise InputError(f"method: expected samples or sets, got {method!r}")
    linear, cubic = share @ stiffness
    errors = np.full(2, np.nan)
    if standard_error_nm_rad is not None:
        given = np.asarray(standard_error_nm_rad, dtype=np.float64)
        if given.shape != stiffness.shape or not np.isfinite(given).all() or np.any(given < 0):
            raise InputError(
                f"standard_error_nm_rad: expected {len(stiffness)} numbers, 0 or more, got {given}"
            )
        errors = np.sqrt(share**2 @ given**2)
    found = []
    if linear <= 0:
        found.append("k1 is not positive: the stiffnesses differ more than a cubic spring can")
    if cubic < 0:
        found.append("k3 is negative: the gear is softer at larger amplitude, as with backlash")
    if errors[1] > 0.5 * abs(cubic):
        found.append("k3 is hardly above its standard error")
    return CubicSpring(
        float(linear),
        float(cubic / unit**2),
        float(errors[0]),
        float(errors[1] / unit**2),
        tuple(float(v) for v in rms),
        tuple(found),
    )


def _amplitudes(
    stiffness: Sequence[float], deflection: Sequence[ArrayLike]
) -> tuple[Real, list[Real]]:
    values = np.asarray(stiffness, dtype=np.float64)
    sets = [np.asarray(x, dtype=np.float64).ravel() for x in deflection]
    if values.ndim != 1 or len(sets) != len(values) or len(sets) < 2:
        raise InputError(
            "stiffness_nm_rad, deflection_rad: expected the same number of sets, at least two of "
            f"different amplitude, got {values.size} and {len(sets)}; with one amplitude take "
            "k1 = k and k3 = 0, or measure a second one"
        )
    for i, x in enumerate(sets, 1):
        if not x.size or not np.isfinite(x).all() or not np.any(x):
            raise InputError(f"deflection_rad: expected finite numbers, not all zero, in set {i}")
    if not np.isfinite(values).all():
        raise InputError(f"stiffness_nm_rad: expected finite numbers, got {values}")
    return values, sets


def simulate_deflection(
    torque_nm: ArrayLike,
    velocity_rad_s: ArrayLike,
    sample_time_s: float,
    *,
    motor_inertia_kg_m2: float,
    arm_inertia_kg_m2: float,
    stiffness_nm_rad: float,
    damping_nm_s_rad: float,
    viscous_friction_nm_s_rad: float,
    coulomb_friction_nm: float,
    gear_ratio: float,
) -> Real:
    """Return the deflection x1 = r phi_m - phi_a [rad], (n,), of (9.9) with a linear spring.

    The simulation starts at rest. Coulomb friction takes the sign of the measured velocity, so that
    the remaining model is linear and exact for a torque held from sample to sample.

    Parameters
    ----------
    torque_nm, velocity_rad_s : torque and velocity of the motor, (n,).
    sample_time_s : sample time [s].
    motor_inertia_kg_m2, viscous_friction_nm_s_rad, coulomb_friction_nm : J_m, F_v, F_c, motor side.
    arm_inertia_kg_m2, stiffness_nm_rad, damping_nm_s_rad : J_a, k, d, joint side.
    gear_ratio : r, joint angle per motor angle.

    Raises InputError for arrays that differ in length or are not finite.

    """
    torque, velocity = (
        np.asarray(v, dtype=np.float64).ravel() for v in (torque_nm, velocity_rad_s)
    )
    if torque.shape != velocity.shape or not torque.size:
        raise InputError(
            f"velocity_rad_s: expected {torque.size} samples as torque_nm, got {velocity.size}"
        )
    if not (np.isfinite(torque).all() and np.isfinite(velocity).all()):
        raise InputError("torque_nm, velocity_rad_s: expected finite numbers")
    r, k, d = gear_ratio, stiffness_nm_rad, damping_nm_s_rad
    motor, arm = motor_inertia_kg_m2, arm_inertia_kg_m2
    # With the held input as a fourth state, one exponential gives both matrices.
    system = np.zeros((4, 4))
    system[0, :3] = 0.0, r, -1.0
    system[1, :3] = np.array([-r * k, -viscous_friction_nm_s_rad - r * d * r, r * d]) / motor
    system[2, :3] = np.array([k, d * r, -d]) / arm
    system[1, 3] = 1 / motor
    step = scipy.linalg.expm(system * sample_time_s)
    values, vectors = np.linalg.eig(step[:3, :3])
    drive = np.linalg.solve(vectors, step[:3, 3])
    moving = torque - coulomb_friction_nm * np.sign(velocity)
    parts = [
        vectors[0, i]
        * scipy.signal.lfilter([0.0, drive[i]], [1.0, -values[i]], moving.astype(np.complex128))
        for i in range(3)
    ]
    return np.asarray(np.sum(parts, axis=0).real)

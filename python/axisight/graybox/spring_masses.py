"""Chains of masses and springs from the poles and zeros of their collocated response.

This is an inverse eigenvalue problem. A free chain of n masses has n - 1 resonances, and its response
at the first mass has n - 1 notches. They determine its Jacobi matrix, and together with one inertia
all masses and springs (Gantmacher and Krein 1950; Gladwell 2004, Inverse Problems in Vibration,
chapters 3 and 4; for robots Berglund and Hovland 2000, thesis section 4.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@summarized
@dataclass(frozen=True, eq=False)
class SpringMassChain:
    """A chain of masses, with spring and damper between neighbours and two free ends.

    The motor is the first mass. All values are on the joint side of the gear. The gear ratio r
    (joint angle per motor angle) gives ``motor_inertia_kg_m2 = r^2 inertia_kg_m2[0]`` and the
    response on the motor side.

    inertia_kg_m2
        (n,), positive.
    stiffness_nm_rad, damping_nm_s_rad
        (n - 1,), springs, positive, and dampers, not negative.
    gear_ratio
        r.

    Raises InputError naming the field.
    """

    inertia_kg_m2: Real
    stiffness_nm_rad: Real
    damping_nm_s_rad: Real
    gear_ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check all fields."""
        n = np.size(self.inertia_kg_m2)
        sizes = {"inertia_kg_m2": n, "stiffness_nm_rad": n - 1, "damping_nm_s_rad": n - 1}
        if n < 2:
            raise InputError(f"inertia_kg_m2: expected at least two masses, got {n}")
        for name, size in sizes.items():
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != (size,) or not np.isfinite(value).all():
                raise InputError(f"{name}: expected {size} finite numbers, got {value}")
            low = value < 0 if name == "damping_nm_s_rad" else value <= 0
            if low.any():
                raise InputError(f"{name}: expected positive numbers, got {value[low][0]}")
            object.__setattr__(self, name, value)
        ratio = self.gear_ratio
        if not (np.isfinite(ratio) and ratio != 0):
            raise InputError(f"gear_ratio: expected a finite number other than zero, got {ratio}")

    @property
    def n_masses(self) -> int:
        """Number of masses, the motor included."""
        return len(self.inertia_kg_m2)

    @property
    def motor_inertia_kg_m2(self) -> float:
        """Inertia of the first mass on the motor side, r^2 times that on the joint side."""
        return float(self.gear_ratio**2 * self.inertia_kg_m2[0])

    @cached_property
    def poles_rad_s(self) -> Real:
        """Resonances, (n - 1,): undamped natural frequencies of the free chain [rad/s]."""
        return self._natural(0)[0]

    @cached_property
    def zeros_rad_s(self) -> Real:
        """Notches, (n - 1,): natural frequencies with the motor held [rad/s]."""
        return self._natural(1)[0]

    @property
    def pole_damping(self) -> Real:
        """Damping ratios of the resonances, to first order in the damping, (n - 1,)."""
        return np.asarray(self._natural(0)[1] @ self.damping_nm_s_rad / (2 * self.poles_rad_s))

    @property
    def zero_damping(self) -> Real:
        """Damping ratios of the notches, to first order in the damping, (n - 1,)."""
        return np.asarray(self._natural(1)[1] @ self.damping_nm_s_rad / (2 * self.zeros_rad_s))

    def _natural(self, held: int) -> tuple[Real, Real]:
        """Return natural frequencies, and modal damping 2 zeta w per unit of each damper.

        The first ``held`` masses (0 or 1) are held.
        """
        stretch = _stretch(self.n_masses)[:, held:]
        root = np.sqrt(self.inertia_kg_m2[held:])
        scaled = stretch / root
        values, vectors = np.linalg.eigh(scaled.T @ (self.stiffness_nm_rad[:, None] * scaled))
        start = 1 - held  # skips the rigid motion of the free chain
        modal = (scaled @ vectors[:, start:]) ** 2
        return np.sqrt(values[start:]), np.ascontiguousarray(modal.T)

    def acceleration_response(self, frequency_hz: ArrayLike) -> Complex:
        """Return the damped response from motor torque to acceleration [rad/s^2/Nm] at frequencies [Hz]."""
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        # Eliminates masses from the free end, so that each step adds the rest of the chain as a load.
        load = np.zeros(len(s), np.complex128)
        for i in range(self.n_masses - 1, 0, -1):
            body = s**2 * self.inertia_kg_m2[i] + load
            spring = self.stiffness_nm_rad[i - 1] + s * self.damping_nm_s_rad[i - 1]
            load = spring * body / (spring + body)
        motor = s**2 * self.inertia_kg_m2[0] + load
        return np.asarray(s**2 / motor / self.gear_ratio**2)


def reconstruct_chain(
    poles_rad_s: ArrayLike,
    zeros_rad_s: ArrayLike,
    *,
    motor_inertia_kg_m2: float | None = None,
    rigid_inertia_kg_m2: float | None = None,
    gear_ratio: float = 1.0,
    pole_damping: ArrayLike | None = None,
    zero_damping: ArrayLike | None = None,
) -> SpringMassChain:
    """Return the chain that has these resonances and notches.

    The response of the motor to its torque is

        phi'' / tau = (1 / J_m) prod (s^2 + z_i^2) / prod (s^2 + p_i^2).

    The weights of its partial fractions over ``-s^2`` are the squares of the first components of the
    eigenvectors of ``M^-1/2 K M^-1/2``. Lanczos' recursion on the poles from these components gives
    the tridiagonal matrix. The rigid motion, which deflects no spring, gives the masses.

    Parameters
    ----------
    poles_rad_s, zeros_rad_s : n - 1 each, ascending, undamped [rad/s], alternating:
        ``0 < z_1 < p_1 < z_2 < p_2 < ...``.
    motor_inertia_kg_m2 : J_m on the motor side, the inverse of the high-frequency gain.
    rigid_inertia_kg_m2 : J of the whole axis on the motor side, from step 1. Give exactly one of both
        inertias; the other follows from ``J_m / J = prod z^2 / prod p^2``.
    gear_ratio : r, joint angle per motor angle.
    pole_damping, zero_damping : damping ratios, (n - 1,) each. The dampers are the non-negative
        least-squares fit to this modal damping, to first order in the damping. Without both
        arguments the chain is undamped.

    Raises InputError naming the field, also for poles and zeros that no chain has.

    """
    poles, zeros = (
        _ascending(n, v) for n, v in (("poles_rad_s", poles_rad_s), ("zeros_rad_s", zeros_rad_s))
    )
    if len(poles) != len(zeros):
        raise InputError(f"zeros_rad_s: expected {len(poles)} as the poles, got {len(zeros)}")
    _check_alternating(poles, zeros)
    first = _motor_inertia(poles, zeros, motor_inertia_kg_m2, rigid_inertia_kg_m2)
    if not (np.isfinite(gear_ratio) and gear_ratio != 0):
        raise InputError(f"gear_ratio: expected a finite number other than zero, got {gear_ratio}")
    # Relative to the highest pole, the recursion works with numbers near one.
    scale = poles[-1]
    free = np.concatenate([[0.0], poles / scale])
    off, rigid = _lanczos(free**2, _weights(free, zeros / scale))
    inertia = first / gear_ratio**2 * (rigid / rigid[0]) ** 2
    stiffness = scale**2 * off * np.sqrt(inertia[:-1] * inertia[1:])
    bare = SpringMassChain(inertia, stiffness, np.zeros(len(poles)), gear_ratio)
    if pole_damping is None and zero_damping is None:
        return bare
    return SpringMassChain(
        inertia, stiffness, _dampers(bare, pole_damping, zero_damping), gear_ratio
    )


def _stretch(n: int) -> Real:
    """Return the deflections of the springs per angle of the masses, (n - 1, n)."""
    return np.asarray(np.eye(n - 1, n) - np.eye(n - 1, n, k=1))


def _ascending(name: str, value: ArrayLike) -> Real:
    array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    good = array.ndim == 1 and array.size and np.isfinite(array).all()
    if not good or array[0] <= 0 or np.any(np.diff(array) <= 0):
        raise InputError(f"{name}: expected positive, ascending frequencies, got {array}")
    return array


def _check_alternating(poles: Real, zeros: Real) -> None:
    below = np.concatenate([[0.0], poles[:-1]])
    for i, (low, zero, high) in enumerate(zip(below, zeros, poles, strict=True), 1):
        if not low < zero < high:
            raise InputError(
                f"zeros_rad_s: expected notch {i} between {low:g} and {high:g} rad/s, got "
                f"{zero:g}; in a chain driven and measured at its first mass notches and "
                "resonances alternate, beginning with a notch"
            )


def _motor_inertia(poles: Real, zeros: Real, motor: float | None, rigid: float | None) -> float:
    if (motor is None) == (rigid is None):
        raise InputError("motor_inertia_kg_m2, rigid_inertia_kg_m2: expected exactly one of them")
    name, value = (
        ("motor_inertia_kg_m2", motor) if motor is not None else ("rigid_inertia_kg_m2", rigid)
    )
    if value is None or not (np.isfinite(value) and value > 0):
        raise InputError(f"{name}: expected a positive inertia, got {value}")
    return value if motor is not None else value * float(np.prod((zeros / poles) ** 2))


def _weights(poles: Real, zeros: Real) -> Real:
    """Return the residues of the partial fractions over the squared poles, which sum to one."""

    def apart(others: Real) -> Real:
        # The product form of a difference of squares loses no digits for near pairs.
        return np.abs((poles[:, None] - others) * (poles[:, None] + others))

    among = apart(poles)[~np.eye(len(poles), dtype=bool)].reshape(len(poles), -1)
    # Sorted quotients keep the product from under- or overflow.
    return np.asarray((np.sort(apart(zeros), axis=1) / np.sort(among, axis=1)).prod(axis=1))


def _lanczos(values: Real, weights: Real) -> tuple[Real, Real]:
    """Return the off-diagonal of the Jacobi matrix with these eigenvalues and weights, and its eigenvector 1.

    The first eigenvalue is zero, and its eigenvector is the rigid motion.
    """
    n = len(values)
    basis = np.zeros((n, n))
    off = np.zeros(n - 1)
    basis[:, 0] = np.sqrt(weights / weights.sum())
    for j in range(n - 1):
        v = values * basis[:, j]
        for _ in range(2):  # one pass leaves rounding errors above machine precision
            v -= basis[:, : j + 1] @ (basis[:, : j + 1].T @ v)
        off[j] = np.linalg.norm(v)
        basis[:, j + 1] = v / off[j]
    return off, basis[0]


def _dampers(chain: SpringMassChain, poles: ArrayLike | None, zeros: ArrayLike | None) -> Real:
    n = chain.n_masses - 1
    rows: list[Real] = []
    targets: list[Real] = []
    given = (
        ("pole_damping", poles, 0, chain.poles_rad_s),
        ("zero_damping", zeros, 1, chain.zeros_rad_s),
    )
    for name, value, held, frequency in given:
        if value is None:
            continue
        ratio = np.atleast_1d(np.asarray(value, dtype=np.float64))
        if ratio.shape != (n,) or not np.isfinite(ratio).all():
            raise InputError(f"{name}: expected {n} finite damping ratios, got {value}")
        # As damping ratios, slow and fast modes have equal weight.
        rows.append(chain._natural(held)[1] / (2 * frequency)[:, None])
        targets.append(ratio)
    return np.asarray(scipy.optimize.nnls(np.vstack(rows), np.concatenate(targets))[0])

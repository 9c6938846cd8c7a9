"""Two masses with LuGre friction on the motor under the sampled loop, in plain NumPy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

# Preset two_mass_axis, without its effects.
STIFFNESS, DAMPING, RATIO = 1.46e6, 2.63e3, 0.004458314757021846
MOTOR_INERTIA, VISCOUS, LINK_INERTIA = 0.0121, 0.013, 1130.0
KP, KI, SAMPLE_TIME_S = 7.0, 180.0, 5e-4


@dataclass(frozen=True)
class Lugre:
    """Friction of Canudas de Wit et al. (1995) in the parametrization of ``presliding_friction``."""

    coulomb_nm: float
    static_ratio: float
    stribeck_speed_rad_s: float
    presliding_rad: float
    bristle_time_s: float

    def level(self, speed: float) -> float:
        """Return the deflection at which the bristles slip."""
        hump = np.exp(-((speed / self.stribeck_speed_rad_s) ** 2))
        return float(1 + (self.static_ratio - 1) * hump)

    def rate(self, speed: float, z: float) -> float:
        return (speed - abs(speed) * z / self.level(speed)) / self.presliding_rad

    def torque(self, speed: float, z: float) -> float:
        return self.coulomb_nm * (z + self.bristle_time_s * self.rate(speed, z))


def slope(x: Array, command: float, friction: Lugre) -> Array:
    """Return the rate of ``[phi, q, phi', q', z]``."""
    phi, q, w, v, z = x
    gear = STIFFNESS * (RATIO * phi - q) + DAMPING * (RATIO * w - v)
    motor = command - VISCOUS * w - friction.torque(w, z) - RATIO * gear
    return np.array([w, v, motor / MOTOR_INERTIA, gear / LINK_INERTIA, friction.rate(w, z)])


def jacobian(x: Array, friction: Lugre) -> Array:
    w, z = x[2], x[4]
    f, g = friction, friction.level(w)
    bend = (g - 1) * -2 * w / f.stribeck_speed_rad_s**2
    by_speed = (1 - np.sign(w) * z / g + abs(w) * z * bend / g**2) / f.presliding_rad
    by_z = -abs(w) / g / f.presliding_rad
    bristles = f.coulomb_nm * f.bristle_time_s
    spring = np.array([RATIO, -1.0]) * STIFFNESS
    damper = np.array([RATIO, -1.0]) * DAMPING
    out = np.zeros((5, 5))
    out[0, 2] = out[1, 3] = 1.0
    out[2, :2], out[2, 2:4] = -RATIO * spring, -RATIO * damper
    out[2, 2] -= VISCOUS + bristles * by_speed
    out[2, 4] = -(f.coulomb_nm + bristles * by_z)
    out[2] /= MOTOR_INERTIA
    out[3, :2], out[3, 2:4] = spring / LINK_INERTIA, damper / LINK_INERTIA
    out[4, 2], out[4, 4] = by_speed, by_z
    return out


def closed_loop(reference: Array, friction: Lugre, tolerance: float) -> tuple[Array, Array]:
    """Return states (n, 5) and commands (n,) by SciPy's Radau, restarted at every sample."""
    x, states, commands = np.zeros(5), [], []
    angle, previous = 0.0, None
    # Typical sizes of the states.
    absolute = tolerance * np.array([1e-3, 1e-5, 1e-3, 1e-5, 1e-3])
    for w_ref in reference:
        speed = 0.0 if previous is None else (x[0] - previous) / SAMPLE_TIME_S
        previous = x[0]
        u = KP * (w_ref - speed) + KI * (angle - x[0])
        angle += SAMPLE_TIME_S * w_ref
        states.append(x)
        commands.append(u)
        out = solve_ivp(
            lambda _, y, u=u: slope(y, u, friction),
            (0, SAMPLE_TIME_S),
            x,
            "Radau",
            jac=lambda _, y: jacobian(y, friction),
            rtol=tolerance,
            atol=absolute,
        )
        assert out.success
        x = out.y[:, -1]
    return np.array(states), np.array(commands)

"""Motion of a floating base: what inverse dynamics needs of it, in the axes of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError

Array = NDArray[np.float64]

# Rotations are products of a few turns, or quaternions written with seven digits.
_ORTHOGONAL = 1e-5


@summarized
@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Motion of the base link at the origin of its frame, in the axes of that frame.

    The arrays have shape (3,) or (n, 3).

    angular_velocity_rad_s
        Angular velocity [rad/s].
    angular_acceleration_rad_s2
        Angular acceleration [rad/s^2].
    proper_acceleration_m_s2
        Acceleration of the origin minus gravity [m/s^2]. An accelerometer at the origin measures it: +9.81
        upwards at rest, zero in free fall.

    Forces depend on nothing else of the base: not on its position, orientation and linear velocity.
    `at_rest`, `from_world` and `from_imu` convert other quantities. Raises InputError for other shapes and
    numbers that are not finite.
    """

    angular_velocity_rad_s: Array
    angular_acceleration_rad_s2: Array
    proper_acceleration_m_s2: Array

    def __post_init__(self) -> None:
        """Check the arrays and give them one shape."""
        names = (
            "angular_velocity_rad_s",
            "angular_acceleration_rad_s2",
            "proper_acceleration_m_s2",
        )
        arrays = _same_shape(**{name: getattr(self, name) for name in names})
        for name, array in zip(names, arrays, strict=True):
            object.__setattr__(self, name, array)

    @classmethod
    def at_rest(
        cls, rotation: ArrayLike, gravity_m_s2: ArrayLike = (0.0, 0.0, -9.81)
    ) -> BaseMotion:
        """Return the motion of a base at rest.

        ``rotation`` (3, 3) or (n, 3, 3) turns vectors in base axes into world axes; ``gravity_m_s2`` (3,) is
        in world axes.
        """
        turned = _rotations(rotation)
        nothing = np.zeros(turned.shape[:-1])
        return cls.from_world(turned, nothing, nothing, nothing, gravity_m_s2)

    @classmethod
    def from_world(
        cls,
        rotation: ArrayLike,
        angular_velocity_rad_s: ArrayLike,
        angular_acceleration_rad_s2: ArrayLike,
        acceleration_m_s2: ArrayLike,
        gravity_m_s2: ArrayLike = (0.0, 0.0, -9.81),
    ) -> BaseMotion:
        """Return the motion from quantities in world axes, such as those of motion capture.

        ``rotation`` (3, 3) or (n, 3, 3) turns vectors in base axes into world axes. ``acceleration_m_s2`` is
        the second derivative of the position of the base frame's origin. Arrays are (3,) or (n, 3).
        """
        turned = _rotations(rotation)
        velocity, growth, acceleration = _same_shape(
            angular_velocity_rad_s=angular_velocity_rad_s,
            angular_acceleration_rad_s2=angular_acceleration_rad_s2,
            acceleration_m_s2=acceleration_m_s2,
        )
        (gravity,) = _same_shape(gravity_m_s2=gravity_m_s2)
        back = np.swapaxes(turned, -1, -2)
        proper = acceleration - gravity
        return cls(*((back @ x[..., None])[..., 0] for x in (velocity, growth, proper)))

    @classmethod
    def from_imu(
        cls,
        angular_velocity_rad_s: ArrayLike,
        angular_acceleration_rad_s2: ArrayLike,
        specific_force_m_s2: ArrayLike,
        *,
        position_m: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike | None = None,
    ) -> BaseMotion:
        """Return the motion from an inertial measurement unit on the base, without its orientation.

        Arrays are (3,) or (n, 3), in the axes of the unit: gyroscope, its derivative, accelerometer.
        ``position_m`` (3,) is the place of the unit in the base frame; ``rotation`` (3, 3) turns vectors in axes
        of the unit into base axes, by default the identity.

        The acceleration of the origin is ``f - e x p - w x (w x p)``.
        """
        turned = np.eye(3) if rotation is None else _rotations(rotation)
        rate, growth, force = (
            x @ turned.T
            for x in _same_shape(
                angular_velocity_rad_s=angular_velocity_rad_s,
                angular_acceleration_rad_s2=angular_acceleration_rad_s2,
                specific_force_m_s2=specific_force_m_s2,
            )
        )
        (place,) = _same_shape(position_m=position_m)
        swing = np.cross(growth, place) + np.cross(rate, np.cross(rate, place))
        return cls(rate, growth, force - swing)

    @property
    def is_single(self) -> bool:
        """Whether the motion is one instant."""
        return self.angular_velocity_rad_s.ndim == 1

    def __len__(self) -> int:
        """Return the number of instants."""
        return 1 if self.is_single else len(self.angular_velocity_rad_s)

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> BaseMotion:
        """Return the instants ``chosen``."""
        return BaseMotion(*(x[chosen] for x in self.parts()))

    def parts(self) -> tuple[Array, Array, Array]:
        """Return angular velocity, angular acceleration and proper acceleration, (n, 3) each."""
        return (
            np.atleast_2d(self.angular_velocity_rad_s),
            np.atleast_2d(self.angular_acceleration_rad_s2),
            np.atleast_2d(self.proper_acceleration_m_s2),
        )


def _same_shape(**arrays: ArrayLike) -> list[Array]:
    """Return float64 arrays of one shape, (3,) or (n, 3); single rows are repeated."""
    out = []
    for name, value in arrays.items():
        try:
            x = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"{name}: expected numbers of shape (3,) or (n, 3), got {error}"
            ) from None
        if x.ndim not in (1, 2) or x.shape[-1] != 3:
            raise InputError(f"{name}: expected shape (3,) or (n, 3), got {x.shape}")
        if not np.isfinite(x).all():
            raise InputError(f"{name}: expected finite numbers, got NaN or infinity")
        out.append(x)
    try:
        return [np.array(x) for x in np.broadcast_arrays(*out)]
    except ValueError:
        shapes = ", ".join(f"{name} {x.shape}" for name, x in zip(arrays, out, strict=True))
        raise InputError(f"base: expected arrays of one shape, got {shapes}") from None


def _rotations(value: ArrayLike) -> Array:
    """Return checked rotation matrices (3, 3) or (n, 3, 3)."""
    x = np.asarray(value, dtype=np.float64)
    if x.ndim not in (2, 3) or x.shape[-2:] != (3, 3):
        raise InputError(f"rotation: expected shape (3, 3) or (n, 3, 3), got {x.shape}")
    off = np.abs(x @ np.swapaxes(x, -1, -2) - np.eye(3)).max(initial=0.0)
    if not (off <= _ORTHOGONAL and (np.linalg.det(x) > 0).all()):
        raise InputError("rotation: expected rotation matrices, got others")
    return x

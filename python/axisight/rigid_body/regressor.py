"""The torque of a chain as a linear function of its parameters (thesis (4.2))."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.rigid_body.coupling import MotorCoupling, gear_coupling
from axisight.rigid_body.friction import DriveTerms, ModelSide
from axisight.rigid_body.parameters import Column, drive_columns, link_columns
from axisight.robot import Robot

Array = NDArray[np.float64]


class TorqueModel:
    """The linear torque model: robot, drive terms, side of the torques, couplings.

    Parameters
    ----------
    robot : chain and gears. Its masses and inertias are nominal values only.
    terms : rotor, friction, offset and spring parameters; default none.
    side : ``"joint"``: torques of all joints; ``"motor"``: motor torques of the driven axes;
        ``"base"``: the wrench on a floating base alone.
    coupling : gears between motors and joints; default the gear ratios of the robot.
    hung_at_m : (3,) point of a floating base [m], in its frame, at which a rope or a ball joint holds it with a
        force that nothing measures. Only the moments about this point count.

    Motions are always those of all joints, (n, n_joints) [rad, rad/s, rad/s^2]; on a
    prismatic joint rad reads m and Nm reads N. Motors and gears are rigid. With a floating base, six
    coordinates come before the joints: :func:`floating_motion` makes such motions, and the rows begin
    with the external force [N] and moment [Nm] on the base. Raises InputError for
    another side, a coupling of another number of axes, and ``hung_at_m`` of a fixed base.

    """

    def __repr__(self) -> str:
        """Return robot, side and number of parameters."""
        return (
            f"<TorqueModel of {self.robot.name!r}: {self.side} side, {self.n_rows} torques, "
            f"{len(self.names)} parameters>"
        )

    def __init__(
        self,
        robot: Robot,
        *,
        terms: DriveTerms | None = None,
        side: ModelSide = "joint",
        coupling: MotorCoupling | None = None,
        hung_at_m: ArrayLike | None = None,
    ) -> None:
        if side not in ("motor", "joint", "base"):
            raise InputError(f'side: expected "motor", "joint" or "base", got {side!r}')
        if side == "base" and robot.floating_base is None:
            raise InputError('side: expected "motor" or "joint" for a fixed base, got "base"')
        if hung_at_m is not None and robot.floating_base is None:
            raise InputError("hung_at_m: expected none for a fixed base")
        self.robot = robot
        self.hung_at_m = (
            None if hung_at_m is None else rows("hung_at_m", np.atleast_2d(hung_at_m), 3)[0]
        )
        self.terms = DriveTerms() if terms is None else terms
        self.side: ModelSide = side
        self.coupling = gear_coupling(robot) if coupling is None else coupling
        if self.coupling.n_axes != robot.n_axes:
            raise InputError(
                f"coupling: expected matrices for {robot.n_axes} axes, got {self.coupling.n_axes}"
            )

    @cached_property
    def row_map(self) -> Array:
        """Map from forces in all coordinates to rows, shape (n_rows, n_coordinates)."""
        identity = np.eye(self.n_coordinates)
        base = self.base_map @ identity[: self.first_joint]
        if self.side == "base":
            return base
        if self.side == "joint":
            return np.vstack([base, identity[self.first_joint :]])
        driven = identity[self.axis_coordinates]
        rows: Array = np.linalg.solve(self.coupling.torque, driven).astype(np.float64)
        rows[np.abs(rows) < 1e-14 * np.abs(rows).max()] = 0.0
        return np.vstack([base, rows])

    @cached_property
    def base_map(self) -> Array:
        """Map from the wrench on a floating base to its rows, shape (n_base_rows, 6); (0, 0) for a fixed base."""
        if self.hung_at_m is None:
            return np.eye(self.first_joint)
        # The moment about the point p is m - p x f, and its component i is m_i + (p x e_i) . f.
        return np.hstack([np.cross(self.hung_at_m, np.eye(3)), np.eye(3)])

    @property
    def n_base_rows(self) -> int:
        """Rows of a floating base, which come first: 6, 3 if it is hung, 0 for a fixed base."""
        return len(self.base_map)

    @cached_property
    def coordinate_names(self) -> list[str]:
        """Names of the coordinates: six of a floating base, then the joints."""
        return self.robot.coordinate_names

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates."""
        return len(self.coordinate_names)

    @property
    def first_joint(self) -> int:
        """Number of coordinates before the joints: 6 with a floating base, else 0."""
        return self.n_coordinates - self.robot.n_joints

    @property
    def axis_coordinates(self) -> list[int]:
        """Index among the coordinates of the joint that each axis drives."""
        return [self.first_joint + joint for joint in self.robot.axis_joints]

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Parameters: ten for each link with mass, then those of the drives, then springs."""
        drives = drive_columns(self.robot, self.terms, self.coupling, self.row_map)
        return (*link_columns(self.robot), *drives)

    @property
    def n_rows(self) -> int:
        """Torques per sample: joints on the joint side, axes on the motor side; a floating base has six more."""
        return len(self.row_map)

    @property
    def n_parameters(self) -> int:
        """Number of parameters."""
        return len(self.columns)

    @cached_property
    def names(self) -> list[str]:
        """Names of the parameters, ``<joint>.<quantity>``."""
        return [column.name for column in self.columns]

    @property
    def units(self) -> list[str]:
        """Units of the parameters."""
        return [column.unit for column in self.columns]

    @property
    def nominal(self) -> Array:
        """Values of the robot file, shape (n_parameters,), zero for parameters that it does not have."""
        return np.array([column.nominal for column in self.columns])

    @property
    def row_names(self) -> list[str]:
        """Names of the rows: those of their coordinates."""
        base = self.coordinate_names[self.first_joint - self.n_base_rows : self.first_joint]
        if self.side == "base":
            return base
        return base + (self.robot.joint_names if self.side == "joint" else self.robot.axis_names)

    @property
    def row_dim(self) -> str:
        """Name of the dimension of rows."""
        if self.first_joint:
            return "row"
        return "joint" if self.side == "joint" else "axis"

    @property
    def row_labels(self) -> list[str] | list[int]:
        """Coordinates of the rows: names, or axis numbers from 1 on the motor side of a fixed base."""
        by_name = self.side == "joint" or self.first_joint
        return self.row_names if by_name else self.robot.axis_numbers()

    @cached_property
    def extras(self) -> list[tuple[str, list[float], list[float], float, float]]:
        """Extra columns in the form of the core."""
        return [column.extra for column in self.columns if column.extra is not None]

    def motion(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> tuple[Array, Array, Array]:
        """Return a checked motion ``q``, ``v``, ``a`` as float64 arrays (n, n_coordinates).

        Raises InputError for wrong shapes and values that are not finite.
        """
        arrays = [
            rows(name, value, self.n_coordinates) for name, value in (("q", q), ("v", v), ("a", a))
        ]
        for name, array in zip(("v", "a"), arrays[1:], strict=True):
            if len(array) != len(arrays[0]):
                raise InputError(f"{name}: expected {len(arrays[0])} rows as q, got {len(array)}")
        return arrays[0], arrays[1], arrays[2]

    def matrix(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, threads: int = 0) -> Array:
        """Return the regressor, shape (n, n_rows, n_parameters).

        Arguments ``q``, ``v``, ``a``, ``threads`` are those of :func:`torque_regressor`.
        """
        q, v, a = self.motion(q, v, a)
        return _core.torque_regressor(
            self.robot.core, q, v, a, rows=self.row_map, extras=self.extras, threads=threads
        )


def as_model(
    robot: Robot | TorqueModel,
    terms: DriveTerms | None,
    side: ModelSide | None,
    coupling: MotorCoupling | None,
) -> TorqueModel:
    """Return the torque model of a robot with options, or the given model."""
    if isinstance(robot, TorqueModel):
        if not (terms is None and side is None and coupling is None):
            raise InputError(
                "terms, side, coupling: expected none of them with a TorqueModel, which holds them"
            )
        return robot
    if not isinstance(robot, Robot):
        raise InputError(f"robot: expected a Robot or a TorqueModel, got {type(robot).__name__}")
    return TorqueModel(robot, terms=terms, side=side or "joint", coupling=coupling)


def torque_regressor(
    robot: Robot,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    *,
    terms: DriveTerms | None = None,
    side: ModelSide = "joint",
    coupling: MotorCoupling | None = None,
    threads: int = 0,
) -> xr.DataArray:
    """Return the regressor H of (4.2): torques are ``H @ parameters``.

    Parameters
    ----------
    robot : chain and gears.
    q, v, a : (n, n_joints) joint angles, velocities, accelerations [rad, rad/s, rad/s^2].
    terms : rotor, friction and offset parameters of every axis; default none.
    side : ``"joint"``: rows are torques of all joints [Nm]; ``"motor"``: motor torques of
        the driven axes [Nm].
    coupling : gears between motors and joints; default the gear ratios of the robot.
    threads : number of threads, 0 for all cores; the result does not depend on it.

    Returns
    -------
    DataArray (sample, joint, parameter), or (sample, axis, parameter) on the motor side.
    Parameters are, for every link with mass, ``<joint>.mass`` [kg], ``mass_x``, ``mass_y``,
    ``mass_z`` (first moments m c [kg m]) and ``inertia_xx`` .. ``inertia_yz`` (about the
    origin of the link frame, link axes [kg m^2]), then those of ``terms``. Coordinates along
    ``parameter`` are ``unit`` and ``nominal``, the values of the robot. The regressor times
    ``nominal`` is the inverse dynamics. Raises InputError for wrong shapes and non-finite values.

    """
    model = TorqueModel(robot, terms=terms, side=side, coupling=coupling)
    return xr.DataArray(
        model.matrix(q, v, a, threads=threads),
        dims=("sample", model.row_dim, "parameter"),
        coords={
            model.row_dim: model.row_labels,
            "parameter": model.names,
            "unit": ("parameter", model.units),
            "nominal": ("parameter", model.nominal),
        },
        attrs={"units": "Nm per unit of the parameter", "side": side},
    )


def rows(field: str, value: ArrayLike, width: int) -> Array:
    """Return a checked array (n, width) of finite numbers with at least one row."""
    try:
        raw = np.asarray(value)
        if raw.dtype.kind not in "fiu":
            raise TypeError(f"{raw.dtype} numbers")
        x = np.ascontiguousarray(raw, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{field}: expected real numbers of shape (n, {width}), got {error}"
        ) from error
    if x.ndim != 2 or x.shape[1] != width or len(x) == 0:
        raise InputError(f"{field}: expected shape (n, {width}), n at least 1, got {x.shape}")
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if len(bad):
        raise InputError(
            f"{field}: expected finite numbers, got {len(bad)} rows with NaN or infinity, "
            f"the first at row {bad[0]}"
        )
    return x

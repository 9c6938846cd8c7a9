"""Robots: reading descriptions, kinematics, dynamics and linearization."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import did_you_mean, instance, positive
from axisight.effects import Effect, core_effects, effect_of_core
from axisight.errors import InputError
from axisight.remainder import Remainder
from axisight.robot import dynamics
from axisight.robot.accelerometer import (
    Accelerometer,
    accelerometer_of,
    by_direction,
    described_with,
)
from axisight.robot.axis_names import axis_number, effect_on
from axisight.robot.base_motion import BaseMotion
from axisight.robot.description import Joint, Link, is_chain, joint_of, moved_by_axis
from axisight.robot.limits import JointLimits, limits_of
from axisight.robot.notebook import page_of
from axisight.robot.stated_remainder import described_with_remainder, stated_remainder

Array = NDArray[np.float64]

ControllerKind = Literal[
    "pi_velocity", "p_velocity", "cascade", "pd_position", "cascade_position", "none"
]
TOLD_POSITIONS: tuple[ControllerKind, ...] = ("pd_position", "cascade_position")
"""Kinds of controllers whose references are positions."""

# The line of a robot file that states the sample time.
_SAMPLE_TIME = re.compile(r"^sample_time\s*=.*$", re.MULTILINE)


class Robot:
    """A robot in the format ``axisight.robot/1`` or ``/2``, with the effects of its simulator.

    Joint arrays run over all joints, driven and elastic, parents first; axis arrays over driven joints only.
    ``q`` [rad or m], ``v`` [rad/s or m/s], ``a`` [rad/s^2 or m/s^2] and forces [Nm or N] may have shape
    (n_joints,) or (n, n_joints).

    ``core`` is the robot for functions of the compiled core; users need only the attributes and methods
    here. The robot's own `effects` act in every simulation, linearization and fit. An effect that is passed
    to a call replaces the robot's effect of that name and axis.
    """

    def __init__(self, core: _core.Robot) -> None:
        self.core = core
        self._torque_constants: tuple[float | None, ...] = (None,) * core.n_axes
        self._states_pose = True
        self._imported_from: Path | None = None
        self._joint_limits = (JointLimits(),) * core.n_axes

    def _with_core(self, core: _core.Robot) -> Robot:
        """Return a robot with another core and what the core does not hold."""
        out = Robot(core)
        out._torque_constants = self._torque_constants
        out._states_pose = self._states_pose
        out._joint_limits = self._joint_limits
        return out

    @classmethod
    def from_toml(cls, text: str) -> Robot:
        """Return the robot of a description `text`; raise RobotError naming line, key and expectation."""
        out = cls(_core.Robot.from_toml(text))
        document = tomllib.loads(text)
        out._states_pose = "operating_point" in document
        out._joint_limits = limits_of(document)
        stated_remainder(text, out.n_axes)  # refuses a table that is none
        return out

    def __repr__(self) -> str:
        """Return the name and the number of axes and joints."""
        return f"<Robot {self.name!r}: {self.n_axes} axes, {self.n_joints} joints>"

    def _repr_html_(self) -> str:
        """Return the axes with drives and operating point as HTML, for notebooks."""
        return page_of(self)

    @property
    def name(self) -> str:
        """Name from the description."""
        return self.core.name

    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
        return self.core.n_axes

    @property
    def n_joints(self) -> int:
        """Number of joints, driven and elastic."""
        return self.core.n_joints

    @property
    def sample_time_s(self) -> float:
        """Sample time of controller and log [s]."""
        return self.core.sample_time_s

    @property
    def joint_names(self) -> list[str]:
        """Names of all joints, parents first."""
        return self.core.joint_names

    @property
    def toml(self) -> str:
        """The description as it was read, without parameters and effects that were replaced since."""
        return self.core.toml

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects that the simulator models: those of the description, unless replaced since."""
        return tuple(effect_of_core(effect) for effect in self.core.effects)

    @property
    def tolerances(self) -> dict[str, float]:
        """Tolerances of the own parameters (relative standard deviation [1]) that the description states.

        Quantities are ``mass``, ``inertia_scale``, ``stiffness``, ``damping``, ``motor_inertia``, ``viscous_friction``,
        and the gains of a controller of position targets: ``kp`` and ``kd``, or ``kv``, ``kp`` and ``ki``.
        """
        return dict(self.core.tolerances)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints with link, spring and drive, parents first, at the current parameters."""
        return tuple(joint_of(entry) for entry in self.core.joints())

    @property
    def is_chain(self) -> bool:
        """Whether the robot is one chain; False if it has branches."""
        return is_chain(self.core.joints())

    @property
    def floating_base(self) -> Link | None:
        """The link of a floating base; None for a fixed base."""
        return dynamics.floating_base(self.core)

    @property
    def coordinate_names(self) -> list[str]:
        """Names of all coordinates: six of a floating base (shifts, turns), then the joints."""
        return dynamics.coordinate_names(self.core)

    @property
    def accelerometers(self) -> tuple[Accelerometer, ...]:
        """The accelerometers on its links."""
        return tuple(map(accelerometer_of, _core.accelerometers(self.core)))

    @property
    def remainder(self) -> Remainder | None:
        """The modelled remainder that the description states: torque [Nm] that its simulation adds."""
        return stated_remainder(self.core.toml, self.n_axes)

    @property
    def gravity_m_s2(self) -> Array:
        """Gravity in the base frame; in the world frame if the base floats [m/s^2], shape (3,)."""
        return np.array(self.core.gravity_m_s2)

    @property
    def axis_joints(self) -> list[int]:
        """Index in the chain, from 0, of the joint that each axis drives."""
        return self.core.axis_joints

    @property
    def axis_names(self) -> list[str]:
        """Name of the joint that each axis drives."""
        names = self.joint_names
        return [names[joint] for joint in self.axis_joints]

    def axis_number(self, axis: int | str) -> int:
        """Return the number (from 1) of an `axis` that is given by number or by the joint it drives.

        Raises InputError, with the joint names and the nearest one, for an axis that is not there.
        """
        if type(axis) is int and 1 <= axis <= self.n_axes:
            return axis
        return axis_number(axis, self.axis_names)

    def axis_parameter(self, axis: int | str, quantity: str) -> str | None:
        """Return the name of a parameter of an axis (``axis1.stiffness``), or None if there is none.

        ``axis`` is a number from 1 or the name of the joint that the axis drives. ``quantity`` belongs to a
        joint (``stiffness``) or to a link (``mass``): that of the axis, or an elastic one between it and the
        next ones. Raises InputError for an axis that is not there.
        """
        axis = self.axis_number(axis)
        moved = moved_by_axis(self.core.joints(), self.axis_joints[axis - 1])
        known = self.parameters()
        return next((x for joint in moved if (x := f"{joint}.{quantity}") in known), None)

    @property
    def axis_is_prismatic(self) -> list[bool]:
        """Whether each axis is prismatic."""
        return self.core.axis_is_prismatic

    @property
    def axis_is_rigid(self) -> list[bool]:
        """Whether each axis has a rigid transmission."""
        return self.core.axis_is_rigid

    @property
    def gear_ratio(self) -> Array:
        """Joint angle per motor angle, shape (n_axes,) [1, or m/rad on a prismatic axis]."""
        return self.core.gear_ratio

    @property
    def operating_point(self) -> Array:
        """Driven joint angles at the operating point, shape (n_axes,) [rad or m]."""
        return self.core.operating_point

    @property
    def states_operating_point(self) -> bool:
        """Whether the description states the operating point; without it, all angles there are zero.

        An import puts it into the middle of a joint's range where zero lies outside, and states nothing.
        """
        return self._states_pose

    @property
    def position_noise_std(self) -> float:
        """Standard deviation of the white noise on motor positions, per sample [rad]."""
        return self.core.position_noise_std

    @property
    def controller_kind(self) -> ControllerKind:
        """Kind of controller: one of the words of `ControllerKind`, ``none`` without a controller."""
        return self.core.controller_kind

    @property
    def told_positions(self) -> bool:
        """Whether the references of the controller are positions."""
        return self.controller_kind in TOLD_POSITIONS

    @property
    def told_speeds(self) -> bool:
        """Whether the references of the controller are speeds."""
        return self.controller_kind != "none" and not self.told_positions

    @property
    def controller_gains(self) -> dict[str, Array]:
        """Gains by name, shape (n_axes,) each, motor side.

        ``kp`` [Nm s/rad] and ``ki`` [Nm/rad]; cascades also have ``kv`` [1/s]. ``pd_position`` has ``kp``
        [Nm/rad] and ``kd`` [Nm s/rad]; with `computed_torque` they are in [1/s^2] and [1/s].
        """
        return self.core.controller_gains

    @property
    def torque_constants(self) -> tuple[float | None, ...]:
        """Torque constant of each motor [Nm/A], to convert currents in logs; None if it is unknown.

        The drive data of a model file state them; robot files cannot.
        """
        return self._torque_constants

    def with_torque_constants(self, nm_per_a: Sequence[float | None]) -> Robot:
        """Return the same robot with torque constants ``nm_per_a`` (n_axes,) [Nm/A], None for unknown ones.

        Raises InputError for another number of constants, or one that is not positive.
        """
        if len(nm_per_a) != self.n_axes:
            raise InputError(f"nm_per_a: expected {self.n_axes} entries, got {len(nm_per_a)}")
        out = self._with_core(self.core)
        out._torque_constants = tuple(
            None if x is None else positive("nm_per_a", x) for x in nm_per_a
        )
        return out

    def parameters(self) -> dict[str, float]:
        """Return all physical parameters by name (``axis1.stiffness``), in SI units."""
        return dict(self.core.parameters())

    def with_parameters(self, values: Mapping[str, float]) -> Robot:
        """Return the same robot with some parameters replaced, by name, in SI units.

        Raises InputError, with the nearest name, for a name that `parameters` does not have.
        """
        try:
            return self._with_core(self.core.with_parameters(list(values.items())))
        except InputError as error:
            known = self.parameters()
            meant = "".join(did_you_mean(name, known) for name in values if name not in known)
            raise InputError(f"{error}{meant}") from None

    @property
    def velocity_feedforward(self) -> bool:
        """Whether a controller of position targets takes the rate of the targets as its speed reference.

        It is True for every other controller.
        """
        return self.core.velocity_feedforward

    @property
    def computed_torque(self) -> bool:
        """Whether the controller computes torques from accelerations by the robot's inverse dynamics.

        The controller uses the robot as its file states it. Fitted effects and parameters change the machine
        only.
        """
        return self.core.computed_torque

    @property
    def stepped(self) -> tuple[float, Array] | None:
        """Time step of the simulator that runs the controller, and its added inertia; None for a machine.

        A target acts from half a step [s] earlier. The simulator's treatment of damping adds the inertia
        (n_axes,) [kg m^2] to the motors.
        """
        found = self.core.stepped
        return None if found is None else (found[0], np.array(found[1]))

    def with_velocity_feedforward(self, on: bool) -> Robot:
        """Return the robot with `velocity_feedforward` on or off; raise InputError if it is told speeds."""
        return self._with_core(self.core.with_velocity_feedforward(on))

    def with_operating_point(self, angle_rad: ArrayLike) -> Robot:
        """Return the same robot with another operating point ``angle_rad`` (n_axes,) [rad or m].

        Raises InputError for another number of driven joint angles, or ones that are not finite.
        """
        out = self._with_core(self.core.with_operating_point(np.asarray(angle_rad, float).tolist()))
        out._states_pose = True
        return out

    @property
    def imported_from(self) -> Path | None:
        """The model file whose import this robot is, with nothing added or changed since; else None."""
        return self._imported_from

    @property
    def joint_ranges(self) -> tuple[tuple[float, float] | None, ...]:
        """Smallest and largest angle of each driven joint [rad or m]; None where the description states none."""
        return tuple(limits.position for limits in self._joint_limits)

    @property
    def joint_limits(self) -> tuple[JointLimits, ...]:
        """What each driven joint may do (n_axes), as the description states it.

        Experiments stay within these limits. No simulation stops at them.
        """
        return self._joint_limits

    def with_joint_limits(self, limits: Sequence[JointLimits]) -> Robot:
        """Return the same robot with other `joint_limits` (n_axes); raise InputError for another number."""
        if len(limits) != self.n_axes:
            raise InputError(f"limits: expected {self.n_axes} entries, got {len(limits)}")
        out = self._with_core(self.core)
        out._joint_limits = tuple(instance("limits", one, JointLimits) for one in limits)
        return out

    def as_imported(self, source: Path | None, *, states_pose: bool) -> Robot:
        """Return the same robot with its `imported_from` and `states_operating_point`."""
        out = self._with_core(self.core)
        out._imported_from, out._states_pose = source, states_pose
        return out

    def with_sample_time(self, sample_time_s: float) -> Robot:
        """Return the same robot with another sample time [s], and the control loop that its file states.

        Raises InputError unless the sample time is positive, and the file states one on a line of its own.
        """
        seconds = positive("sample_time_s", sample_time_s)
        text, found = _SAMPLE_TIME.subn(f"sample_time = {seconds!r}", self.core.toml, count=1)
        if not found:
            raise InputError(f"robot {self.name!r}: expected a line sample_time = ..., got none")
        return self._with_core(_core.described_as(self.core, text).with_controller_speed(1.0))

    def with_accelerometers(self, accelerometers: Sequence[Accelerometer]) -> Robot:
        """Return the same robot with ``accelerometers`` in place of all its own.

        Raises RobotError for a name that comes twice and for a joint that the robot does not have.
        """
        text = described_with(self.core.toml, accelerometers)
        return self._with_core(_core.described_as(self.core, text))

    def with_remainder(self, remainder: Remainder | None) -> Robot:
        """Return the same robot with another `remainder`; raise InputError for other axes."""
        text = described_with_remainder(self.core.toml, remainder, self.n_axes)
        return self._with_core(_core.described_as(self.core, text))

    def with_controller_speed(self, factor: float) -> Robot:
        """Return the same robot with a control loop ``factor`` [1] times as fast as stated.

        The shape of the loop stays: gains on speed grow by the factor, gains on angle by its square, and
        ``kv`` of a cascade by the factor. Raises InputError unless the factor is positive.
        """
        return self._with_core(self.core.with_controller_speed(factor))

    def with_effects(self, effects: Iterable[Effect]) -> Robot:
        """Return the same robot with ``effects`` in place of all its own; an empty list removes them.

        Raises InputError for an effect that the robot cannot have: an axis that is not there, a
        spring in a rigid transmission, parameters outside their bounds.
        """
        return self._with_core(self.core.with_effects(core_effects(self.placed(effects))))

    def stable_substeps(self, effects: Iterable[Effect] = ()) -> int:
        """Return how many fixed steps of ``"rk4"`` a sample needs to be stable near standstill, from 1 to 16.

        Dry friction that changes its sign within a small speed needs more than one.
        """
        return self.core.stable_substeps(core_effects(self.placed(effects)))

    def placed(self, effects: Iterable[Effect]) -> list[Effect]:
        """Return effects with axis numbers in place of joint names.

        Every method and function that takes a robot and effects calls this itself. Raises InputError for
        an object that is not an effect, and, with the nearest name, for a name that no driven joint has.
        """
        names: list[str] | None = None
        out = []
        for effect in effects:
            instance("effects", effect, Effect)
            if effect.joints and names is None:
                names = self.axis_names
            out.append(effect_on(effect, names or []))
        return out

    def inertia_matrix(self, q: ArrayLike) -> Array:
        """Return M(q), shape (n_joints, n_joints) or (n, n_joints, n_joints) [kg m^2].

        With a floating base, its six coordinates come first, as in `inverse_dynamics`. Raises InputError for
        another shape of ``q`` [rad or m].
        """
        return dynamics.inertia_matrix(self.core, q)

    def bias(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Return Coriolis, centrifugal and gravity forces c(q, v) + g(q) [Nm or N], in the shape of ``q``.

        Raises InputError for other shapes of ``q`` and ``v`` than those of the class.
        """
        return dynamics.bias(self.core, q, v)

    def gravity(self, q: ArrayLike) -> Array:
        """Return gravity forces g(q) [Nm or N], in the shape of ``q``; raise InputError for another shape."""
        return dynamics.gravity(self.core, q)

    def inverse_dynamics(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, base: BaseMotion | None = None
    ) -> Array:
        """Return joint forces M(q) a + c(q, v) + g(q) [Nm or N], without motors and springs.

        The result has the shape of ``q``. With a floating base, it needs the motion ``base`` and has six more
        columns in front: the external force [N], then the moment [Nm] on the base link, in its axes about its
        origin. They are zero in free flight. Raises InputError for other shapes than those of the class.
        """
        return dynamics.inverse_dynamics(self.core, q, v, a, base)

    def forward_dynamics(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, *, base: BaseMotion | None = None
    ) -> Array:
        """Return joint accelerations [rad/s^2 or m/s^2] under joint forces ``tau`` [Nm or N].

        The result has the shape of ``q``, ``v`` and ``tau``. With a floating base, only the angular velocity of
        ``base`` counts, and ``tau`` may have the external wrench in six more columns in front. The result then
        has the proper acceleration [m/s^2] and the angular acceleration [rad/s^2] of the base there. Raises
        InputError for other shapes than those of the class.
        """
        return dynamics.forward_dynamics(self.core, q, v, tau, base)

    def specific_force(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Return what the accelerometers read along a motion of all joints [m/s^2].

        Shape (n_accelerometers, 3) or (n, n_accelerometers, 3), NaN where no direction is measured. Arguments
        and errors are those of `inverse_dynamics`.
        """
        dynamics.need_fixed_base(self.core, "accelerometers", "leave them out")
        (rows, rates, accelerations), single = dynamics.joint_rows(self.n_joints, q=q, v=v, a=a)
        out = _core.specific_force(self.core, rows, rates, accelerations)
        # Without readings, the core cannot say how many rows there are.
        by_place = by_direction(out.reshape(len(rows), out.shape[1]), self.accelerometers)
        return by_place[0] if single else by_place

    def pose(self, q: ArrayLike, joint: int | str = -1) -> tuple[Array, Array]:
        """Return rotation (3, 3) and origin (3,) [m] of a link frame in the base frame.

        ``q`` (n_joints,) are the joint positions [rad or m]. ``joint`` is a joint name or an index in the
        chain (from 0; -1 is the last). Raises InputError for another shape and for an unknown joint.
        """
        (rows,), _ = dynamics.joint_rows(self.n_joints, q=q)
        return self.core.pose(rows[0].tolist(), self._joint(joint))

    def jacobian(
        self, q: ArrayLike, joint: int | str = -1, point_m: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Array:
        """Return the Jacobian (6, n_joints) of a point fixed in a link frame.

        Rows: linear velocity [m/s], then angular velocity [rad/s], in the base frame, per joint speed.
        ``point_m`` (3,) [m] is the point in the frame of the link of ``joint``. ``q``, ``joint`` and errors
        are as in `pose`.
        """
        (rows,), _ = dynamics.joint_rows(self.n_joints, q=q)
        x, y, z = (float(c) for c in point_m)
        return self.core.jacobian(rows[0].tolist(), self._joint(joint), (x, y, z))

    def _joint(self, joint: int | str) -> int:
        if isinstance(joint, str):
            if joint not in self.joint_names:
                meant = did_you_mean(joint, self.joint_names)
                raise InputError(
                    f"joint: expected one of {', '.join(self.joint_names)}, got {joint!r}{meant}"
                )
            return self.joint_names.index(joint)
        index = joint + self.n_joints if joint < 0 else joint
        if not 0 <= index < self.n_joints:
            raise InputError(f"joint: expected 0 to {self.n_joints - 1}, got {joint}")
        return index

    def equilibrium(
        self, joint_angle_rad: Sequence[float] | None = None, effects: Iterable[Effect] = ()
    ) -> xr.Dataset:
        """Return the static equilibrium with the driven joints at ``joint_angle_rad``.

        ``joint_angle_rad`` (n_axes,) [rad or m] is by default the operating point. ``effects`` are added to
        the robot's own. Variables are ``joint_angle_rad`` (joint), ``motor_angle_rad`` (axis) and
        ``motor_torque_nm`` (axis). Raises InputError if the elastic joints do not settle.
        """
        at = None if joint_angle_rad is None else [float(a) for a in joint_angle_rad]
        out = self.core.equilibrium(core_effects(self.placed(effects)), at)
        return xr.Dataset(
            {
                "joint_angle_rad": ("joint", out["joint_angle"], {"units": "rad"}),
                "motor_angle_rad": ("axis", out["motor_angle"], {"units": "rad"}),
                "motor_torque_nm": ("axis", out["motor_torque"], {"units": "Nm"}),
            },
            coords={"joint": self.joint_names, "axis": self.axis_numbers()},
        )

    def linearize(
        self, joint_angle_rad: Sequence[float] | None = None, effects: Iterable[Effect] = ()
    ) -> tuple[Array, Array, Array]:
        """Return A, B, C of ``x' = A x + B u``, ``phi = C x`` at rest at an operating point.

        States are ``[phi, q, phi', q']``, inputs motor torques [Nm], outputs motor angles [rad]; derivatives
        are exact (dual numbers). ``joint_angle_rad`` and ``effects`` are as in `equilibrium`.
        """
        at = None if joint_angle_rad is None else [float(a) for a in joint_angle_rad]
        return self.core.linearize(core_effects(self.placed(effects)), at)

    def modes(
        self, joint_angle_rad: Sequence[float] | None = None, effects: Iterable[Effect] = ()
    ) -> xr.Dataset:
        """Return the modes of the linearized robot, slowest first.

        Variables are ``eigenvalue_rad_s`` [rad/s], ``frequency_hz`` [Hz], ``damping_ratio`` [1] (mode) and
        ``shape`` (mode, state; largest element one). The states are those of `linearize`;
        ``joint_angle_rad`` and ``effects`` are as in `equilibrium`.
        """
        at = None if joint_angle_rad is None else [float(a) for a in joint_angle_rad]
        values, frequency, damping, shapes = self.core.modes(core_effects(self.placed(effects)), at)
        return xr.Dataset(
            {
                "eigenvalue_rad_s": ("mode", values[:, 0] + 1j * values[:, 1]),
                "frequency_hz": ("mode", frequency, {"units": "Hz"}),
                "damping_ratio": ("mode", damping),
                "shape": (("mode", "state"), shapes[..., 0] + 1j * shapes[..., 1]),
            }
        )

    def zoh_response(
        self,
        frequency_hz: ArrayLike,
        joint_angle_rad: Sequence[float] | None = None,
        effects: Iterable[Effect] = (),
    ) -> xr.DataArray:
        """Return the zero-order-hold response from motor torque to motor angle.

        Dims (frequency_hz, output, input), complex [rad/Nm]; ``frequency_hz`` (n,) is in Hz. The response of
        a sampled loop is this one, not the continuous one. ``joint_angle_rad`` and ``effects`` are as in
        `equilibrium`.
        """
        f = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        at = None if joint_angle_rad is None else [float(a) for a in joint_angle_rad]
        pairs = self.core.zoh_response(f.tolist(), core_effects(self.placed(effects)), at)
        return xr.DataArray(
            pairs[..., 0::2] + 1j * pairs[..., 1::2],
            dims=("frequency_hz", "output", "input"),
            coords={
                "frequency_hz": f,
                "output": self.axis_numbers(),
                "input": self.axis_numbers(),
            },
            attrs={"units": "rad/Nm"},
        )

    def axis_numbers(self) -> list[int]:
        """Return the axis numbers, from 1."""
        return list(range(1, self.n_axes + 1))

"""The compiled core: thin bindings, no defaults beyond those shown.

Arrays are row-major in meaning, ``(n_samples, n_axes)``, and are copied on the way in; array
arguments must be float64 (other types raise TypeError). Units are SI; "axis" means a driven
axis, "joint" any joint of the chain. On a prismatic axis rad reads m and Nm reads N. Axes of
effects count from 1; indices of joints, logs, effects and parameters in lists count from 0.

Misuse raises `axisight.errors.InputError` naming the field; a model that a fit of logs cannot simulate is
an answer, `Diverged`. Calls that take ``cancel`` release
the interpreter lock and raise KeyboardInterrupt on Ctrl-C. After `CancelToken.cancel` a
simulation returns early with status "cancelled" and a fit raises KeyboardInterrupt.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NotRequired, Protocol, TypeAlias, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CancelToken",
    "Column",
    "Courses",
    "Diverged",
    "FitResult",
    "FrequencyFitResult",
    "Linearization",
    "MeasuredMotions",
    "MonteCarloEnsemble",
    "MonteCarloStudy",
    "Robot",
    "SimulatedLogs",
    "__version__",
    "accelerometers",
    "axis_fit",
    "axis_linearize",
    "axis_simulate",
    "base_names",
    "check_integrator",
    "described_as",
    "design_poses",
    "directions",
    "effect_table",
    "energy_regressor",
    "failure_kinds",
    "fit_frequency_responses",
    "floating_base",
    "floating_forward_dynamics",
    "floating_inertia",
    "floating_inverse_dynamics",
    "frequency_information",
    "frequency_response",
    "frf_local_model",
    "frf_local_periodic",
    "inertial_parameters",
    "invert_matrices",
    "linear_states",
    "measurement_noise",
    "multisine_peak",
    "multivariable",
    "optimize_crest_factor",
    "random_phases",
    "record_spectra",
    "recursive",
    "regression_factors",
    "right_divide_matrices",
    "simulate_batch",
    "specific_force",
    "square_period",
    "state_at_rest",
    "state_rates",
    "status_advice",
    "torque_regressor",
]

__version__: str

_Array: TypeAlias = NDArray[np.float64]
_Numbers: TypeAlias = Sequence[float] | NDArray[np.float64]
# Name in the effect table, 1-based axis or two of them (None for the whole arm), parameters in
# table order.
_Effect: TypeAlias = tuple[str, int | tuple[int, int] | None, _Numbers]
_Effects: TypeAlias = Sequence[_Effect]
# Frequencies [Hz], weights [1/unit of the residual], decimation; one per axis.
_Weighting: TypeAlias = tuple[_Numbers, _Numbers, int]
_Sensed: TypeAlias = tuple[Literal["joint_angle", "acceleration"], int, _Weighting]
_Model: TypeAlias = Literal["nonlinear", "linear"]

@type_check_only
class ParameterInfo(TypedDict):
    """One row of an effect's parameter table; numbers are in ``unit``."""

    name: str
    unit: str
    role: Literal["amplitude", "shape"]
    neutral: float
    lower: float
    upper: float
    typical: float
    prior: Literal["half_normal", "log_normal", "uniform"]
    spread: float
    sizes: str
    marks: list[
        Literal["optional", "place", "notation", "fastest_time", "shows_inverse", "held_first"]
    ]

@type_check_only
class FormulaInfo(TypedDict):
    """What two formulas of an effect may differ by, as shares [1]."""

    kind: Literal["lag", "friction", "exact"] | None
    error: float
    held: Literal["always", "near_noise", "next_to_nothing"]
    white: bool
    value_error: float
    of_each: bool

@type_check_only
class PlainerInfo(TypedDict):
    """The law that an effect is without what it adds."""

    law: str
    adds: list[str]
    likelier: float
    shown: Literal["sizes", "rise"]

@type_check_only
class ResemblesInfo(TypedDict):
    """Another effect that one is like, and with which parameters."""

    law: str
    size: str
    ratio: float
    shape: list[tuple[str, float]]
    rarer: float

@type_check_only
class BegunFromInfo(TypedDict):
    """A law that a fit may begin from; ``takes``: its parameters, each with the one that takes its value."""

    law: str
    takes: list[tuple[str, str]]

@type_check_only
class LaterInfo(TypedDict):
    """Numbers that are looked for where the fit without them ended."""

    amplitude: str
    begin: float
    most: float
    shape: str
    as_of: str

@type_check_only
class SpringChangeInfo(TypedDict):
    """How a law makes a gear another spring."""

    sums: list[list[str]]
    without_middle: str

@type_check_only
class EffectInfo(TypedDict):
    """One effect; ``parameters`` are in the order in which `simulate` and the fits take them."""

    name: str
    summary: str
    equation: str
    source: str
    scope: Literal["axis", "axes", "arm"]
    acts: Literal[
        "torque_path", "motor", "transmission", "joint", "arm", "base", "sensor", "controller"
    ]
    family: str
    contains: list[str]
    parts: list[str]
    usual: list[str]
    usual_odds: float
    twins: list[str]
    twins_alone: bool
    resembles: ResemblesInfo | None
    plainer: PlainerInfo | None
    begun_from: BegunFromInfo | None
    later: LaterInfo | None
    law_of: Literal["gear", "dry_friction"] | None
    formula: FormulaInfo
    spring: SpringChangeInfo | None
    scales: Literal["own", "carriers", "every"] | None
    stands_for: tuple[str, str] | None
    linear: str
    inverse_dynamics: bool
    beside: list[str]
    unrepeatable: bool
    needs_chain: bool
    absorbed_by: list[str]
    shown_by: list[str]
    parameters: list[ParameterInfo]

@type_check_only
class JointEntry(TypedDict):
    """A joint: ``origin`` [m] and unit ``axis`` in the parent link's frame, and what it carries.

    ``parent`` index of the joint whose link carries it, None on the base.

    ``spring`` stiffness, damping [Nm/rad, Nm s/rad] or [N/m, N s/m], None if rigid; ``link`` mass
    [kg], centre of mass [m] and inertia about it, xx yy zz xy xz yz [kg m^2], None if massless;
    ``drive`` joint angle per motor angle, motor inertia [kg m^2] and viscous friction
    [Nm s/rad], motor side, None if no motor acts.
    """

    name: str
    parent: int | None
    prismatic: bool
    origin: list[float]
    axis: list[float]
    spring: tuple[float, float] | None
    link: tuple[float, list[float], list[float]] | None
    drive: tuple[float, float, float] | None

@type_check_only
class Equilibrium(TypedDict):
    """A robot at rest: ``joint_angle`` (n_joints,) [rad], the others (n_axes,) [rad], [Nm]."""

    joint_angle: _Array
    motor_angle: _Array
    motor_torque: _Array

@type_check_only
class BatchOutput(TypedDict):
    """What simulated runs recorded, by run.

    Arrays have shape (n_runs, n_samples, n_axes) except ``joint_position_rad`` (n_runs,
    n_samples, n_joints) and ``acceleration_m_s2`` (n_runs, n_samples, n_readings), which is there if the
    robot has accelerometers. ``position_rad`` is the measurement: ``motor_position_rad`` plus
    ``position_disturbance_rad``, which includes the noise. ``status`` is "completed",
    "diverged", "step_size_collapsed" or "cancelled"; ``stopped_at`` the sample (from 0) at which a
    run that did not complete ended, after which it is NaN. The counters are right-hand sides,
    sub-steps, rejected sub-steps, Jacobians, factorized matrices and samples that were
    integrated by an implicit method; all zero for the linear model.
    """

    torque_cmd_nm: _Array
    position_rad: _Array
    motor_position_rad: _Array
    joint_position_rad: _Array
    torque_disturbance_nm: _Array
    position_disturbance_rad: _Array
    acceleration_m_s2: NotRequired[_Array]
    status: list[str]
    stopped_at: list[int | None]
    evaluations: list[int]
    steps: list[int]
    rejections: list[int]
    jacobians: list[int]
    factorizations: list[int]
    implicit_samples: list[int]

@type_check_only
class IntegratorSpec(Protocol):
    """How to integrate: any object with these attributes, see `axisight.simulation.Integrator`."""

    @property
    def method(self) -> str: ...
    @property
    def substeps(self) -> int: ...
    @property
    def tolerance(self) -> float: ...

@type_check_only
class ParameterSpec(Protocol):
    """One number to fit: any object with these attributes.

    Exactly one of ``robot`` (a name from `Robot.parameters`) and ``effect`` (position in the
    list of effects, then in that effect's parameter table, both from 0) is not None.
    ``initial``, ``lower``, ``upper``, ``scale`` and ``prior`` (mean, standard deviation) are in
    the parameter's unit; ``scale`` is the natural size of a change. A ``nuisance`` parameter's
    Jacobian column is computed once and refreshed only after the search has settled.
    ``amplitude``: of a shape, the place of its effect's only size in that effect's table.
    The logarithm of a ``logarithmic`` parameter is searched; its ``lower`` is above zero.
    """

    @property
    def robot(self) -> str | None: ...
    @property
    def effect(self) -> tuple[int, int] | None: ...
    @property
    def initial(self) -> float: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def scale(self) -> float: ...
    @property
    def prior(self) -> tuple[float, float] | None: ...
    @property
    def frozen(self) -> bool: ...
    @property
    def nuisance(self) -> bool: ...
    @property
    def amplitude(self) -> int | None: ...
    @property
    def logarithmic(self) -> bool: ...

@type_check_only
class OptionSpec(Protocol):
    """Settings of a fit: any object with these attributes.

    ``loss`` is "squared", "huber" or "soft_l1"; ``loss_scale`` is in standard deviations.
    ``loss_tolerance`` is a share of the loss, ``step_tolerance`` a share of each parameter's
    scale.
    """

    @property
    def max_iterations(self) -> int: ...
    @property
    def loss_tolerance(self) -> float: ...
    @property
    def step_tolerance(self) -> float: ...
    @property
    def loss(self) -> str: ...
    @property
    def loss_scale(self) -> float: ...
    @property
    def nuisance_refreshes(self) -> int: ...

@final
class CancelToken:
    """Lets one thread stop the long calls of others."""

    def __new__(cls) -> CancelToken: ...
    def cancel(self) -> None:
        """Ask every call that holds this token to stop."""

@final
class Robot:
    """A robot description with its rigid-body algorithms; made by `from_toml`, picklable.

    The algorithms see the chain of all joints without motors and springs; their arguments
    and results have shape (n, n_joints), one configuration per row: ``q`` [rad], ``v`` [rad/s],
    ``a`` [rad/s^2], ``tau`` [Nm], joint side.
    """

    @staticmethod
    def from_toml(text: str) -> Robot:
        """Read a description in the format ``axisight.robot/1`` or ``/2``; raises RobotError."""
    @property
    def toml(self) -> str:
        """The text the robot was read from."""
    @property
    def name(self) -> str:
        """Name of the robot."""
    @property
    def sample_time_s(self) -> float:
        """Sample time of controller and logs [s]."""
    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
    @property
    def n_joints(self) -> int:
        """Number of joints, driven and elastic."""
    @property
    def joint_names(self) -> list[str]:
        """Names of all joints, base to tip."""
    @property
    def axis_joints(self) -> list[int]:
        """Index (from 0) of the joint each axis drives."""
    @property
    def gear_ratio(self) -> _Array:
        """Joint angle per motor angle r, shape (n_axes,)."""
    @property
    def axis_is_prismatic(self) -> list[bool]:
        """Whether each axis slides."""
    @property
    def axis_is_rigid(self) -> list[bool]:
        """Whether each axis has a rigid transmission."""
    @property
    def operating_point(self) -> _Array:
        """Driven joint angles at rest [rad], shape (n_axes,)."""
    @property
    def position_noise_std(self) -> float:
        """Standard deviation of the motor position measurement [rad], white, per sample."""
    @property
    def controller_kind(
        self,
    ) -> Literal["pi_velocity", "p_velocity", "cascade", "pd_position", "cascade_position", "none"]:
        """Kind of controller."""
    @property
    def controller_gains(self) -> dict[str, _Array]:
        """Gains by name, shape (n_axes,) each, motor side.

        ``kp`` [Nm s/rad] and ``ki`` [Nm/rad]; a cascade also has ``kv`` [1/s]. ``pd_position`` has ``kp``
        [Nm/rad] and ``kd`` [Nm s/rad].
        """
    @property
    def gravity_m_s2(self) -> list[float]:
        """Gravity in the base frame [m/s^2], shape (3,)."""
    def joints(self) -> list[JointEntry]:
        """Every joint, base to tip, with the parameters replaced since it was read."""
    def parameters(self) -> list[tuple[str, float]]:
        """Names (``<joint>.<quantity>``) and SI values of all physical parameters."""
    def with_parameters(self, values: Sequence[tuple[str, float]]) -> Robot:
        """Return the same robot with some parameters replaced, by name, in SI units.

        Raises InputError for a name that `parameters` does not list.
        """
    @property
    def effects(self) -> list[tuple[str, int | tuple[int, int] | None, list[float]]]:
        """Effects that its simulator has; they act wherever the robot does.

        An effect given to a call takes the place of an own one of the same name and place.
        """
    def with_controller_speed(self, factor: float) -> Robot:
        """Return the same robot with a controller for a loop so many times as fast as stated."""
    def with_effects(self, effects: _Effects) -> Robot:
        """Return the same robot with other effects of its own; raises InputError."""
    def with_operating_point(self, angle: Sequence[float]) -> Robot:
        """Return the same robot with another operating point [rad]; raises InputError."""
    @property
    def velocity_feedforward(self) -> bool:
        """Whether a controller with targets of positions takes their rate as its speed reference."""
    @property
    def computed_torque(self) -> bool:
        """Whether the gains of a controller are of accelerations [1/s^2, 1/s]."""
    @property
    def stepped(self) -> tuple[float, list[float]] | None:
        """Step of the simulator that holds the controller's law [s], and inertia that it adds [kg m^2]."""

    def with_velocity_feedforward(self, on: bool) -> Robot:
        """Return the same robot with or without it; raises InputError for another controller."""
    @property
    def tolerances(self) -> list[tuple[str, float]]:
        """Relative standard deviation [1] of its own parameters by quantity, where stated."""
    def inertia_matrix(self, q: _Array) -> _Array:
        """M(q) [kg m^2], shape (n, n_joints, n_joints)."""
    def bias(self, q: _Array, v: _Array) -> _Array:
        """Coriolis, centrifugal and gravity torques c(q, v) + g(q) [Nm]."""
    def gravity(self, q: _Array) -> _Array:
        """Gravity torques g(q) [Nm]."""
    def inverse_dynamics(self, q: _Array, v: _Array, a: _Array) -> _Array:
        """Torques M(q) a + c(q, v) + g(q) [Nm]."""
    def forward_dynamics(self, q: _Array, v: _Array, tau: _Array) -> _Array:
        """Accelerations [rad/s^2] under the torques ``tau``."""
    def energy(self, q: _Array, v: _Array) -> _Array:
        """Kinetic and potential energy of the links [J], shape (n, 2)."""
    def pose(self, q: _Numbers, joint: int) -> tuple[_Array, _Array]:
        """Rotation (3, 3) and origin (3,) [m] of the frame of ``joint`` (from 0), base frame.

        ``q`` is one configuration (n_joints,) [rad].
        """
    def jacobian(self, q: _Numbers, joint: int, point: _Numbers) -> _Array:
        """Jacobian (6, n_joints) of a point fixed in the frame of ``joint`` (from 0).

        Rows: linear velocity [m], then angular velocity, base frame. ``q`` is one configuration
        (n_joints,) [rad], ``point`` three coordinates [m] in the joint's frame.
        """
    def equilibrium(self, effects: _Effects, joint_angle: _Numbers | None = None) -> Equilibrium:
        """Equilibrium with the driven joints at ``joint_angle`` (n_axes,) [rad].

        None is the operating point; elastic joints settle under gravity.
        """
    def stable_substeps(self, effects: _Effects) -> int:
        """Steps of Runge-Kutta (order 4) per sample that stay stable near standstill, at most 16.

        Dry friction that changes its sign within a small speed needs more than one.
        """
    def linearize(
        self, effects: _Effects, joint_angle: _Numbers | None = None
    ) -> tuple[_Array, _Array, _Array]:
        """Matrices A, B, C about the equilibrium, states [phi, q, phi', q'].

        Input motor torque [Nm], output motor angle [rad]; shapes (n_states, n_states),
        (n_states, n_axes), (n_axes, n_states). ``joint_angle`` as for `equilibrium`.
        """
    def modes(
        self, effects: _Effects, joint_angle: _Numbers | None = None
    ) -> tuple[_Array, _Array, _Array, _Array]:
        """Modes of the linearization, slowest first; a complex pair appears once.

        Eigenvalues (n_modes, 2) [rad/s], frequencies (n_modes,) [Hz], damping ratios
        (n_modes,) [1], shapes (n_modes, n_states, 2); a last axis of 2 is real, imaginary.
        """
    def zoh_response(
        self, frequency_hz: _Numbers, effects: _Effects, joint_angle: _Numbers | None = None
    ) -> _Array:
        """Zero-order-hold response from motor torque [Nm] to motor angle [rad].

        Shape (n_freq, n_axes, 2 n_axes): output, then input with real and imaginary part
        interleaved; NaN where a frequency hits a pole. ``frequency_hz`` is (n_freq,) [Hz].
        """

_Status = Literal["loss_converged", "step_converged", "exact", "max_iterations", "stalled"]

def status_advice() -> list[tuple[str, str]]:
    """What to mind of every status that is no convergence: pairs of status and advice."""

@final
class Column:
    """A column of a Jacobian, kept where it was computed for other fits to use."""

    def part(self, rows: list[tuple[int, int]]) -> Column:
        """Return ranges of rows (first, behind the last) as a column; raises InputError."""
    @property
    def values(self) -> _Array:
        """A copy, (n_residuals,)."""

@final
class Courses:
    """Runs of a model over all logs, for models close to it; see `SimulatedLogs.run`."""

@final
class Diverged:
    """A model that does not hold: an answer of a fit, no misuse. Its text says why.

    It cannot be run along some log (unstable, too stiff), or not at all (no equilibrium, a link without mass,
    an axis that lacks what an effect needs).
    """

    def __new__(
        cls, reason: str, logs: Sequence[int] = ..., sample: int | None = None
    ) -> Diverged: ...
    @property
    def logs(self) -> list[int]:
        """The logs (from 0) that ran in lock-step, one of which diverged; empty without a run."""
    @property
    def sample(self) -> int | None:
        """The sample (from 0) at which one did; None without a run."""

@final
class FitResult:
    """Result of a fit. Arrays are copies.

    Residuals are whitened, model minus measurement, in the order log, axis, sample; matrices
    are over the ``free`` parameters. The loss is the sum over residuals of rho, rho = r^2 near
    zero (twice the usual half sum of squares).
    """

    @property
    def status(self) -> _Status:
        """How the search ended."""
    @property
    def theta(self) -> _Array:
        """All parameters, frozen ones included, in their units, shape (n_parameters,)."""
    @property
    def loss(self) -> float:
        """Loss at the end, prior excluded."""
    @property
    def initial_loss(self) -> float:
        """Loss at the start, prior excluded."""
    @property
    def n_residuals(self) -> int:
        """Number of residuals."""
    @property
    def iterations(self) -> int:
        """Accepted steps."""
    @property
    def evaluations(self) -> int:
        """Evaluations of the problem."""
    @property
    def free(self) -> list[int]:
        """Indices (from 0) of the free parameters, the order of all matrices."""
    @property
    def covariance(self) -> _Array:
        """Inverse of the normal matrix, prior included, shape (n_free, n_free).

        The covariance when whitened residuals are white with unit variance; NaN if singular.
        """
    @property
    def sandwich(self) -> _Array:
        """Covariance from the scatter of block gradients, shape (n_free, n_free)."""
    @property
    def condition(self) -> float:
        """Condition number of the normal matrix scaled to unit diagonal."""
    @property
    def up_to_date(self) -> bool:
        """Whether all columns of the Jacobian were computed where the fit ended."""
    @property
    def at_bound(self) -> list[int]:
        """Indices (from 0) of the free parameters that ended on a bound."""
    @property
    def residual(self) -> _Array:
        """Whitened residuals, shape (n_residuals,)."""
    @property
    def jacobian(self) -> _Array:
        """Derivatives of the residuals, shape (n_free, n_residuals): one row per parameter."""
    @property
    def columns(self) -> list[Column]:
        """Rows of ``jacobian``, kept where they are: for ``warm``."""

    @property
    def blocks(self) -> list[tuple[int, int, int, int]]:
        """Blocks of the residual vector: (log, axis, start, length), all from 0."""
    @property
    def block_matrix(self) -> _Array:
        """J^T W J by block, shape (n_blocks, n_free, n_free)."""
    @property
    def block_gradient(self) -> _Array:
        """J^T W r by block, shape (n_blocks, n_free)."""
    @property
    def block_loss(self) -> _Array:
        """Loss by block, shape (n_blocks,)."""

@final
class Linearization:
    """A model at given parameters. Arrays are copies; order and units as in `FitResult`."""

    @property
    def theta(self) -> _Array:
        """All parameters, frozen ones included, in their units, shape (n_parameters,)."""
    @property
    def loss(self) -> float:
        """Loss, prior excluded."""
    @property
    def free(self) -> list[int]:
        """Indices (from 0) of the free parameters, the order of all matrices."""
    @property
    def at_bound(self) -> list[int]:
        """Indices (from 0) of the free parameters that lie on a bound."""
    @property
    def residual(self) -> _Array:
        """Whitened residuals, shape (n_residuals,)."""
    @property
    def jacobian(self) -> _Array:
        """Derivatives of the residuals, shape (n_free, n_residuals): one row per parameter."""
    @property
    def columns(self) -> list[Column]:
        """The same, kept where they are for fits that use them."""
    @property
    def blocks(self) -> list[tuple[int, int, int, int]]:
        """Blocks of the residual vector: (log, axis, start, length), all from 0."""
    @property
    def block_matrix(self) -> _Array:
        """J^T W J by block, shape (n_blocks, n_free, n_free)."""
    @property
    def block_gradient(self) -> _Array:
        """J^T W r by block, shape (n_blocks, n_free)."""
    @property
    def block_loss(self) -> _Array:
        """Loss by block, shape (n_blocks,)."""

@type_check_only
class FrequencyParameterSpec(Protocol):
    """A parameter of a frequency-domain fit; ``prior`` is mean and standard deviation."""

    @property
    def name(self) -> str: ...
    @property
    def initial(self) -> float: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def logarithmic(self) -> bool: ...
    @property
    def prior(self) -> tuple[float, float] | None: ...
    @property
    def frozen(self) -> bool: ...

@type_check_only
class FrequencyOptionSpec(Protocol):
    """Settings of a frequency-domain fit.

    ``sampled``: G(e^{i w T}), else G(i w); ``logarithmic``: residuals are log(model / measured);
    ``weighted``: by variance or covariance. ``loss`` is "squared", "huber" or "soft_l1".
    """

    @property
    def sampled(self) -> bool: ...
    @property
    def logarithmic(self) -> bool: ...
    @property
    def weighted(self) -> bool: ...
    @property
    def loss(self) -> str: ...
    @property
    def loss_scale(self) -> float: ...
    @property
    def block_lines(self) -> int: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def gain_tolerance(self) -> float: ...
    @property
    def step_tolerance(self) -> float: ...

@type_check_only
class PoseDesign(TypedDict):
    """Chosen operating points: relaxed weights, sensitivities, certificate, whole choice."""

    weights: _Array
    sensitivity: _Array
    gap: float
    bound: float
    chosen: list[int]
    log_det: float
    iterations: int

# Joint angles [rad], frequencies [Hz], then flat over line, output, input: response, variance,
# covariance (line, element, element), reference of logarithmic weights; order of derivative.
_PoseResponse: TypeAlias = tuple[
    _Numbers,
    _Array,
    NDArray[np.complex128],
    _Array | None,
    _Array | None,
    NDArray[np.complex128] | None,
    NDArray[np.complex128] | None,
    int,
    Sequence[tuple[int, int, float]],
]

@final
class FrequencyFitResult:
    """Result of a frequency-domain fit. Arrays are copies.

    Matrices are over the ``free`` parameters as searched: logarithms where asked for.
    """

    @property
    def status(self) -> _Status:
        """How the search ended."""
    @property
    def values(self) -> _Array:
        """All parameters, frozen ones included, in their units, shape (n_parameters,)."""
    @property
    def slopes(self) -> _Array:
        """Slope of the value over the searched number, shape (n_free,)."""
    @property
    def free(self) -> list[int]:
        """Indices (from 0) of the free parameters."""
    @property
    def loss(self) -> float:
        """Loss at the end, prior excluded."""
    @property
    def initial_loss(self) -> float:
        """Loss at the start, prior excluded."""
    @property
    def iterations(self) -> int:
        """Accepted steps."""
    @property
    def evaluations(self) -> int:
        """Evaluations of the model with its derivatives."""
    @property
    def n_residuals(self) -> int:
        """Residuals that count; real and imaginary part are two."""
    @property
    def at_bound(self) -> list[int]:
        """Indices (from 0) of the free parameters that ended on a bound."""
    @property
    def information(self) -> _Array:
        """J^T W J with priors, shape (n_free, n_free)."""
    @property
    def expected_scatter(self) -> _Array | None:
        """Covariance of J^T W r by the response's uncertainty; None if that is unknown."""
    @property
    def block_scatter(self) -> _Array:
        """The same from the scatter of the residuals over blocks of lines."""
    @property
    def residual(self) -> _Array:
        """Whitened residuals, shape (n, 2): real and imaginary parts."""

def fit_frequency_responses(
    robot: Robot,
    effects: _Effects,
    parameters: Sequence[FrequencyParameterSpec],
    poses: Sequence[_PoseResponse],
    options: FrequencyOptionSpec,
    *,
    cancel: CancelToken | None = None,
) -> FrequencyFitResult:
    """Fit the linearized robot to responses at several operating points."""

def frequency_information(
    robot: Robot,
    effects: _Effects,
    parameters: Sequence[FrequencyParameterSpec],
    poses: Sequence[_PoseResponse],
    options: FrequencyOptionSpec,
    *,
    cancel: CancelToken | None = None,
) -> _Array:
    """Information each pose gives at the initial values, shape (n_poses, n_free, n_free)."""

def frequency_response(
    robot: Robot,
    effects: _Effects,
    joint_angle: _Numbers,
    frequency_hz: _Numbers,
    sampled: bool,
) -> _Array:
    """Response from torque to motor angle [rad/Nm], shape (n_freq, n_axes, 2 n_axes).

    Real and imaginary parts are interleaved along the last axis.
    """

def design_poses(
    information: _Array,
    prior: _Array,
    count: int,
    *,
    repeats: bool,
    gap_tolerance: float,
    max_iterations: int,
) -> PoseDesign:
    """Choose ``count`` operating points by information (n, p, p), besides a prior (p, p)."""

def effect_table() -> list[EffectInfo]:
    """Every effect with its description and parameters."""

def check_integrator(integrator: IntegratorSpec) -> None:
    """Raise InputError for an integrator that no simulation would take."""

def simulate_batch(
    robot: Robot,
    effects: _Effects,
    input: _Array,
    *,
    reference: bool,
    integrator: IntegratorSpec,
    noise: _Array | None = None,
    start: Sequence[_Numbers] | None = None,
    model: _Model | str = "nonlinear",
    resolution: float = 0.0,
    threads: int = 0,
    beside: Callable[[float, _Array, _Array, _Array, _Array], _Array] | None = None,
    cancel: CancelToken | None = None,
) -> BatchOutput:
    """Simulate runs from rest.

    ``input`` (n_runs, n_samples, n_axes) are motor-side velocity references [rad/s] through the
    controller if ``reference``, else commanded torques [Nm]. ``noise`` [rad], of the same
    shape, is added to the measured position. ``start`` (1 or n_runs, n_axes) [rad] are the driven joint
    angles at rest, None the operating point. ``resolution`` [rad] is the step of the position
    sensor, 0 for none. ``threads`` 0 takes every core; results do not depend on it. ``beside`` gives a
    torque (n_axes,) [Nm] on the motors, held over a sample, for its time [s] and angle [rad], speed [rad/s],
    acceleration [rad/s^2] and gear load [Nm] of the motors (n_axes,); only of the nonlinear model.
    """

def state_at_rest(robot: Robot, effects: _Effects, joint_angle: Sequence[float]) -> _Array:
    """Return the state (n_states,) at rest at angles (n_joints,) [rad] of `state_rates`."""

def accelerometers(
    robot: Robot,
) -> list[tuple[str, str, list[float], list[list[float]]]]:
    """Return name, joint, position [m] and directions of each accelerometer."""

def specific_force(robot: Robot, q: _Array, v: _Array, a: _Array) -> _Array:
    """Return the readings (m, n_readings) of the accelerometers [m/s^2] along motions (m, n_joints)."""

def floating_base(
    robot: Robot,
) -> tuple[float, list[float], list[float]] | None:
    """Return mass [kg], centre of mass [m] and inertia [kg m^2] of a floating base; None for a fixed one."""

def base_names() -> list[str]:
    """Return the names of the six coordinates of a floating base."""

def floating_inertia(robot: Robot, q: _Array) -> _Array:
    """Return inertia matrices (m, 6 + n, 6 + n) of a robot with a floating base."""

def floating_inverse_dynamics(
    robot: Robot, q: _Array, v: _Array, a: _Array, base: _Array
) -> _Array:
    """Return forces (m, 6 + n): wrench on the base (force, moment), joint forces.

    ``base`` (m, 9) are angular velocity, angular acceleration and proper acceleration, in base axes.
    """

def floating_forward_dynamics(
    robot: Robot, q: _Array, v: _Array, tau: _Array, angular_velocity: _Array
) -> _Array:
    """Return accelerations (m, 6 + n) under ``tau`` (m, 6 + n): of the base (proper, angular), of the joints."""

def described_as(robot: Robot, text: str) -> Robot:
    """Return the same robot with another description; changed parameters, effects and controller stay."""

def state_rates(robot: Robot, effects: _Effects, state: _Array, torque: Sequence[float]) -> _Array:
    """Return the rates (m, n_states) of states under delivered motor torques (n_axes,) [Nm].

    A state has the angles of motors behind elastic gears [rad], those of the joints, their speeds in the
    same order [rad/s], then what effects remember.
    """

def measurement_noise(
    seed: int,
    run: int,
    n_samples: int,
    n_axes: int,
    std: float,
    *,
    cutoff_hz: float | None = None,
    sample_time: float | None = None,
) -> _Array:
    """Gaussian position noise, shape (n_samples, n_axes), in the unit of ``std`` [rad].

    White, or of first order with corner ``cutoff_hz`` at ``sample_time`` [s].

    A function of ``seed``, ``run`` and axis alone, so that any run can be made again.
    """

@final
class SimulatedLogs:
    """Logs that a robot is simulated along: converted once, for any number of fits.

    ``records`` are (input, target, certainty, start, lead), the first three of shape (n_samples, n_axes), one
    per log: a velocity reference [rad/s] or commanded torque [Nm], and a commanded torque [Nm] or
    measured motor position [rad], as ``input`` and ``output`` say; the certainty, from 0 to 1, is a
    factor on the weighted error of its sample, None for one everywhere. Every run begins at rest, at
    ``start`` (n_axes,) [rad], None for the operating point; the first ``lead`` samples of input and target,
    of which the certainty has none, are simulated and not compared. ``weighting`` has one entry per axis.
    ``sensed`` are readings of sensors on the arm that are compared as well: kind, index (from 0) and weighting
    of each. A ``joint_angle`` [rad] belongs to an axis, an ``acceleration`` [m/s^2] is one of the readings of
    `specific_force`. ``readings`` holds the measured ones (n_samples, n_sensed) of each log; NaN, or None, for
    sensors that it lacks. The mean error of each reading over a log is removed. Readings count as further axes
    in the blocks. ``own`` are (effect, parameter, value), both from 0, that hold in one log only.
    ``block_s`` [s] is the length of the blocks of `FitResult.blocks`; ``integrator`` by default rk4 with one
    step a sample.
    """

    def __new__(
        cls,
        robot: Robot,
        records: Sequence[tuple[_Array, _Array, _Array | None, _Numbers | None, int]],
        weighting: Sequence[_Weighting],
        *,
        input: Literal["reference", "torque", "tracking"] = "reference",
        output: Literal["torque", "position"] = "torque",
        sensed: Sequence[_Sensed] = ...,
        readings: Sequence[_Array | None] = ...,
        own: Sequence[Sequence[tuple[int, int, float]]] = ...,
        block_s: float = 1.0,
        integrator: IntegratorSpec | None = None,
    ) -> SimulatedLogs: ...
    def part(self, logs: Sequence[int]) -> SimulatedLogs:
        """Return the same of some logs, by their numbers (from 0)."""
    def first(self, samples: Sequence[int]) -> SimulatedLogs:
        """Return the same of the first so many samples of each log that are compared, (n_logs,)."""
    def fit(
        self,
        effects: _Effects,
        parameters: Sequence[ParameterSpec],
        options: OptionSpec,
        *,
        warm: Sequence[tuple[int, Column]] = ...,
        courses: Courses | None = None,
        cancel: CancelToken | None = None,
    ) -> FitResult | Diverged:
        """Fit a free-running simulation to the logs.

        ``warm`` gives Jacobian columns (n_residuals,) of nuisance parameters from an earlier fit, by
        parameter index (from 0).
        """
    def evaluate(
        self,
        effects: _Effects,
        parameters: Sequence[ParameterSpec],
        options: OptionSpec,
        *,
        warm: Sequence[tuple[int, Column]] = ...,
        courses: Courses | None = None,
        cancel: CancelToken | None = None,
    ) -> Linearization | Diverged:
        """Compare a free-running simulation with the logs at the initial values of the parameters.

        Columns of parameters in ``warm`` are taken from there.
        """
    def run(
        self,
        effects: _Effects,
        parameters: Sequence[ParameterSpec],
        *,
        cancel: CancelToken | None = None,
    ) -> Courses | Diverged:
        """Run a model over all logs, at the initial values of the parameters.

        Models close to it are then evaluated with the arm linearised along these runs, at a fraction of
        the cost; the result may be used for the same logs only.
        """

@final
class MeasuredMotions:
    """Measured motions that torques are predicted from, transmissions taken as rigid: converted once.

    ``records`` are (position [rad], velocity [rad/s], acceleration [rad/s^2], torque [Nm],
    certainty [1]) of shape (n_samples, n_axes), motor side, one per log; the certainty is a factor on the
    weighted error of its sample. ``weighting`` and ``block_s`` as for `SimulatedLogs`.
    """

    def __new__(
        cls,
        robot: Robot,
        records: Sequence[tuple[_Array, _Array, _Array, _Array, _Array]],
        weighting: Sequence[_Weighting],
        *,
        block_s: float = 1.0,
    ) -> MeasuredMotions: ...
    def part(self, logs: Sequence[int]) -> MeasuredMotions:
        """Return the same of some motions, by their numbers (from 0)."""
    def with_certainty(self, certainty: Sequence[_Array]) -> MeasuredMotions:
        """Return the same motions with another certainty, (n_samples, n_axes) one per log."""
    def fit(
        self,
        effects: _Effects,
        parameters: Sequence[ParameterSpec],
        options: OptionSpec,
        *,
        warm: Sequence[tuple[int, Column]] = ...,
        cancel: CancelToken | None = None,
    ) -> FitResult | Diverged:
        """Fit the predicted torque; ``warm`` as for `SimulatedLogs.fit`.

        ``cancel`` has no effect yet: the fit runs to its end and Ctrl-C is raised then.
        """
    def evaluate(
        self,
        effects: _Effects,
        parameters: Sequence[ParameterSpec],
        options: OptionSpec,
        *,
        warm: Sequence[tuple[int, Column]] = ...,
        cancel: CancelToken | None = None,
    ) -> Linearization | Diverged:
        """Predict the torques at the initial values; the residual is prediction minus measurement."""

@type_check_only
class MonteCarloBlock(TypedDict):
    """Accumulators of a block of runs; elements run over (line, output, input)."""

    # (2, n): responses counted, inverse responses counted.
    count: NDArray[np.uint64]
    # (11, n): statistics in the order of the core's `STATISTICS`.
    moments: NDArray[np.float64]
    # Magnitude histograms: first bucket of each element (n + 1), buckets, counts.
    bucket_start: NDArray[np.uint64]
    bucket: NDArray[np.int32]
    bucket_count: NDArray[np.uint64]
    # (n_failures, 4): run, code in `failure_kinds`, experiment from 0, detail.
    failures: NDArray[np.uint64]
    # (run, line, output, input), NaN where a run failed; when asked for.
    responses: NotRequired[NDArray[np.complex128]]

@final
class MonteCarloStudy:
    """A checked Monte Carlo study; immutable, so threads may share it.

    ``square``: amplitude [rad/s], period [s], smoothing samples. ``direction_matrix``:
    (axis, experiment), row-major, in the place of the named ``directions``. ``spread``:
    parameter, distribution, relative and absolute scale.
    """

    def __new__(
        cls,
        robot: Robot,
        effects: _Effects,
        *,
        model: str,
        integrator: IntegratorSpec,
        start: Sequence[float] | None,
        period_s: float,
        band_hz: tuple[float, float],
        grid: str,
        peak_rad_s: float,
        clipping_iterations: int,
        square: tuple[float, float, int] | None,
        directions: str,
        direction_matrix: Sequence[float] | None,
        waiting_periods: int,
        periods: int,
        noise: bool,
        noise_cutoff_hz: float | None,
        resolution: float,
        output: str,
        spread: Sequence[tuple[str, str, float, float]],
        relative_accuracy: float,
    ) -> MonteCarloStudy: ...
    @property
    def n_axes(self) -> int: ...
    @property
    def frequency_hz(self) -> NDArray[np.float64]: ...
    def reference(self, seed: int, run: int, experiment: int) -> NDArray[np.float64]:
        """Return the velocity references of one experiment, (n_samples, n_axes) [rad/s]."""
    def block(
        self,
        seed: int,
        first: int,
        count: int,
        *,
        keep_responses: bool = False,
        cancel: CancelToken | None = None,
    ) -> MonteCarloBlock | None:
        """Return the accumulators of runs first to first + count - 1; None when cancelled."""

def failure_kinds() -> list[str]:
    """Return the names of the failure codes."""

@final
class MonteCarloEnsemble:
    """Accumulators of a study, merged block by block."""

    def __new__(cls, lines: int, n_axes: int, relative_accuracy: float) -> MonteCarloEnsemble: ...
    def merge(
        self,
        count: NDArray[np.uint64],
        moments: NDArray[np.float64],
        bucket_start: NDArray[np.uint64],
        bucket: NDArray[np.int32],
        bucket_count: NDArray[np.uint64],
    ) -> None:
        """Add the accumulators of a block."""
    def summary(self, quantiles: Sequence[float]) -> dict[str, NDArray[Any]]:
        """Return statistics, arrays (line, output, input); quantiles lead."""

def invert_matrices(
    matrices: NDArray[np.complex128], out: NDArray[np.complex128], *, threads: int = 1
) -> NDArray[np.bool_]:
    """Write the inverses of ``matrices`` (count, n, n) to ``out``; return where singular."""

def right_divide_matrices(
    y: NDArray[np.complex128],
    u: NDArray[np.complex128],
    out: NDArray[np.complex128],
    *,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """Write ``y u^-1`` to ``out``; y, out (count, p, n), u (count, n, n)."""

def record_spectra(
    signal: _Array, lines: Sequence[int], *, remove_drift: bool, threads: int = 1
) -> NDArray[np.complex128]:
    """Return DFT lines (experiment, period, line, channel) of (..., sample, channel)."""

@type_check_only
class MultivariableEstimate(TypedDict):
    """Arrays (line, output, input), condition and flag (line,)."""

    response: NDArray[np.complex128]
    noise_variance: _Array
    noise_freedom: _Array
    residual_variance: _Array
    condition: _Array
    flag: NDArray[np.int8]

def multivariable(
    input: _Array,
    output: _Array,
    reference: _Array | None,
    lines: Sequence[int],
    factor: NDArray[np.complex128],
    *,
    remove_drift: bool,
    threads: int = 1,
) -> MultivariableEstimate:
    """Estimate from records (experiment, period, sample, channel), outputs times ``factor``."""

@type_check_only
class LocalEstimate(TypedDict):
    """Responses by a local model; n_lines leads."""

    # (n_lines, n_outputs, n_inputs); NaN where flagged so.
    response: NDArray[np.complex128]
    variance: NDArray[np.float64]
    # (n_lines,); flags as `axisight.frf.Flag`.
    condition: NDArray[np.float64]
    flag: NDArray[np.int8]
    degrees_of_freedom: int

def frf_local_model(
    input: _Array,
    output: _Array,
    lines: Sequence[int],
    *,
    order: int,
    denominator_order: int,
    half_width: int,
    band: tuple[int, int],
    threads: int = 0,
) -> LocalEstimate:
    """Local rational method at lines of the record; polynomial for denominator order 0.

    ``input`` and ``output`` are (n_experiments, n_samples, n_channels); ``band`` holds the
    first and last line that windows may cover.
    """

def frf_local_periodic(
    input: _Array,
    output: _Array,
    lines: Sequence[int],
    *,
    n_periods: int,
    order: int,
    half_width: int,
    threads: int = 0,
) -> LocalEstimate:
    """Local polynomial method for whole periods, joined, at lines of the period."""

def random_phases(n: int, seed: int, run: int) -> _Array:
    """Phases [rad], shape (n,), uniform over the circle, a function of (seed, run)."""

def multisine_peak(
    lines: Sequence[int], amplitude: Sequence[float], phase: Sequence[float]
) -> float:
    """Largest absolute value of a sum of sines, on 64 samples per cycle of the highest line."""

def square_period(amplitude: float, period_s: float, smoothing: int, sample_time: float) -> _Array:
    """One period of a square wave, smoothed by ``smoothing`` samples on either side."""

def directions(name: str, n: int) -> _Array:
    """Matrix of directions by name, shape (n, n): (axis, experiment)."""

@type_check_only
class CrestOutput(TypedDict):
    """Best of a search; ``phase`` holds the wanted lines, then the snow.

    ``snow`` are amplitudes relative to the root mean square of the wanted ones;
    ``crest_factors`` those of all starts begun.
    """

    start: int
    crest_factor: float
    crest_factors: _Array
    phase: _Array
    snow: _Array
    clipping_iterations: int
    refinement_steps: int
    out_of_time: bool

def optimize_crest_factor(
    lines: Sequence[int],
    amplitude: Sequence[float],
    *,
    snow: Sequence[int],
    snow_limit: float,
    phase: Sequence[float] | None,
    seed: int,
    clipping: tuple[int, float, float, float, int],
    refinement: tuple[int, int, int, int] | None,
    starts: int,
    time_s: float | None,
    threads: int,
    cancel: CancelToken | None = None,
) -> CrestOutput | None:
    """Search phases of a low crest factor from many starts; None when cancelled before the first.

    ``clipping``: iterations, first level, last level, relaxation, oversampling.
    ``refinement``: first exponent, last exponent, iterations, oversampling. ``phase`` [rad]
    is the one start in the place of random ones.
    """

# Signal, coefficient of each joint, coefficient in each row, dead band, smoothing.
_Extra: TypeAlias = tuple[str, Sequence[float], Sequence[float], float, float]

def recursive(above: Sequence[float], below: Sequence[float], signals: _Array) -> _Array: ...
def linear_states(a: _Array, drive: _Array, start: _Array) -> _Array:
    """States (n_samples + 1, n_states, n_columns) of ``x(t + 1) = A x(t) + v(t)``."""

def torque_regressor(
    robot: Robot,
    q: _Array,
    v: _Array,
    a: _Array,
    *,
    rows: _Array,
    extras: Sequence[_Extra],
    threads: int = 0,
) -> _Array:
    """Regressor, shape (n, n_rows, n_parameters), of ``rows`` (n_rows, n_joints) times torques.

    Columns: ten for each link with mass, then one for each extra: a signal (position,
    velocity, acceleration, direction, constant) of a combination of joints, felt in fixed
    proportions by the rows.
    """

def energy_regressor(robot: Robot, q: _Array, v: _Array, *, threads: int = 0) -> _Array:
    """Energy of the links per unit of each link parameter, shape (n, 10 n_links)."""

def regression_factors(
    robot: Robot,
    q: _Array,
    v: _Array,
    a: _Array,
    torque: _Array,
    *,
    rows: _Array,
    extras: Sequence[_Extra],
    columns: Sequence[int],
    known: Sequence[float],
    weight: _Array | None,
    blocks: int,
    threads: int = 0,
) -> tuple[_Array, list[int]]:
    """Upper triangular factors of ``[Phi[:, columns] | torque - Phi known]`` and block lengths.

    Shape (blocks, n_rows, k + 1, k + 1): one for each block of samples and each row.
    """

def inertial_parameters(robot: Robot) -> tuple[list[int], _Array]:
    """Joints (from 0) whose links have mass, and ten parameters of each link.

    Mass, first moments x y z, inertia about the link frame xx yy zz xy xz yz.
    """

@type_check_only
class _AxisModelSpec(Protocol):
    @property
    def masses(self) -> int: ...
    @property
    def output(self) -> str: ...
    @property
    def hold(self) -> str: ...
    @property
    def smoothing(self) -> float: ...
    @property
    def ripple_orders(self) -> list[float]: ...
    @property
    def substeps(self) -> int: ...

def axis_fit(
    model: _AxisModelSpec,
    sets: Sequence[tuple[_Array, _Array, float, float, int]],
    parameters: Sequence[tuple[float, float, float, float, bool]],
    *,
    whitening: Sequence[float],
    predicts: bool,
    max_iterations: int,
    loss_tolerance: float,
    step_tolerance: float,
    cancel: CancelToken | None = None,
) -> tuple[str, _Array, float, float, int, int, _Array, _Array, _Array]:
    """Minimize the prediction error of an axis from one start.

    ``sets``: torque, output, sample time, weight, samples of a block. ``parameters``: initial,
    lower, upper, scale, free. Returns status, parameters, loss, initial loss, iterations,
    evaluations, normal matrix of the free parameters, residuals, gradients of the blocks.
    """

def axis_linearize(
    model: _AxisModelSpec,
    sets: Sequence[tuple[_Array, _Array, float, float, int]],
    theta: Sequence[float],
    free: Sequence[int],
    *,
    whitening: Sequence[float],
    predicts: bool,
    cancel: CancelToken | None = None,
) -> tuple[_Array, _Array]:
    """Residuals, model minus measurement, and derivatives (n_free, n), record after record."""

def axis_simulate(
    model: _AxisModelSpec,
    set: tuple[_Array, _Array, float, float, int],
    theta: Sequence[float],
    *,
    predicts: bool,
    cancel: CancelToken | None = None,
) -> tuple[_Array, _Array]:
    """Output (n,) and states (n, 2 masses) of one record."""

"""Measured responses with their operating points, and responses of the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import one_of, positive
from axisight.display.summary import summarized
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting.loads import OwnValues
from axisight.frf import Flag
from axisight.frf.confidence import median_freedom
from axisight.frf.pooled import neighbours_for, pooled_variance
from axisight.frf.quantity import ORDER, RATES, Quantity, quantity_of
from axisight.logs.load import Load
from axisight.robot import Robot

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Sampling = Literal["zero_order_hold", "continuous"]
PoseTuple = tuple[
    list[float],
    Real,
    Complex,
    Real | None,
    Real | None,
    Complex | None,
    Complex | None,
    int,
    OwnValues,
]

UNITS: dict[str, Quantity] = {f"rad{rate}/Nm": quantity for quantity, rate in RATES.items()}
DIMS = ("frequency_hz", "output", "input")


@summarized
@dataclass(frozen=True)
class MeasuredResponse:
    """A response from motor torques to motor motions at one operating point.

    joint_angle_rad
        Angles of the driven joints [rad; m if prismatic], (n_axes,).
    frequency_hz
        Lines [Hz], (n_freq,), above zero.
    response
        Complex, (n_freq, n_axes, n_axes): output, input [quantity per Nm].
    quantity
        ``position``, ``velocity`` or ``acceleration`` of the motors.
    variance
        ``E|dG|^2`` of every element, shaped as ``response``; infinite leaves an element out.
    covariance
        Instead of the variance: Hermitian covariance of the elements of each line, either
        (n_freq, n_axes^2, n_axes^2) with the elements in the order output, input (row by
        row), or (n_freq, n_inputs, n_outputs, n_outputs) of the outputs for every input.
    degrees_of_freedom
        Complex degrees of freedom of the variance; ``None`` if the variance is known exactly.
    dropped_lines
        Number of lines left out because the estimator flagged them as NaN.
    load
        Load of the arm during the measurement; None if the robot describes it.

    Raises InputError for other shapes, values that are not finite, and a variance with a covariance.
    """

    joint_angle_rad: tuple[float, ...]
    frequency_hz: Real
    response: Complex
    quantity: Quantity
    variance: Real | None = None
    covariance: Complex | None = None
    degrees_of_freedom: float | None = None
    dropped_lines: int = 0
    load: Load | None = None

    def __post_init__(self) -> None:
        """Check shapes and values."""
        one_of("quantity", self.quantity, ORDER)
        _store(self, "joint_angle_rad", tuple(_real("joint_angle_rad", self.joint_angle_rad, 1)))
        _store(self, "frequency_hz", _real("frequency_hz", self.frequency_hz, 1))
        response = _complex("response", self.response)
        n = len(self.joint_angle_rad)
        shape = (len(self.frequency_hz), n, n)
        if response.shape != shape:
            raise InputError(
                f"response: expected shape {shape} (lines, outputs, inputs), got {response.shape}"
            )
        _store(self, "response", response)
        if self.degrees_of_freedom is not None:
            positive("degrees_of_freedom", self.degrees_of_freedom)
        if self.variance is not None and self.covariance is not None:
            raise InputError("variance: expected a variance or a covariance, got both")
        if self.variance is not None:
            _store(self, "variance", _variance(self.variance, shape))
        if self.covariance is not None:
            _store(self, "covariance", _covariance(self.covariance, shape))

    @classmethod
    def of(
        cls,
        joint_angle_rad: ArrayLike,
        data: xr.Dataset | xr.DataArray,
        *,
        covariance: ArrayLike | None = None,
    ) -> MeasuredResponse:
        """Return the response in a Dataset of `axisight.frf`, or in a DataArray.

        ``joint_angle_rad`` is that of the class. The unit of ``data`` (rad/Nm, rad/s/Nm or
        rad/s^2/Nm) or else its attribute ``quantity`` says what is measured. Flagged NaN lines of a
        Dataset are left out and counted. Its ``variance`` is used unless ``covariance``, over all
        lines of the data, is given. Raises InputError for other units or dimensions, and for NaN at
        lines without a flag.
        """
        array = data["response"] if isinstance(data, xr.Dataset) and "response" in data else data
        if not isinstance(array, xr.DataArray) or set(array.dims) != set(DIMS):
            got = tuple(array.dims) if isinstance(array, xr.DataArray) else type(data).__name__
            raise InputError(f"response: expected dimensions {', '.join(DIMS)}, got {got}")
        unit = array.attrs.get("units")
        attrs = data.attrs if isinstance(data, xr.Dataset) else array.attrs
        if unit not in UNITS and (unit or "quantity" not in attrs):
            raise InputError(
                f"response: expected the attribute units to be one of {', '.join(UNITS)}, "
                f"got {unit!r}"
            )
        quantity = quantity_of(xr.Dataset({"response": array}, attrs=attrs))
        response = array.transpose(*DIMS).values
        keep = np.ones(len(response), bool)
        variance = freedom = None
        if isinstance(data, xr.Dataset):
            if "flag" in data:
                lost = (Flag.RANK_DEFICIENT, Flag.NO_EXCITATION)
                keep = ~np.isin(data["flag"].values, lost)
            if "variance" in data and covariance is None:
                known = data["variance"].transpose(*DIMS).values
                variance = None if np.isnan(known).all() else known[keep]
            if variance is not None or covariance is not None:
                freedom = median_freedom(data)
        at = _real("joint_angle_rad", joint_angle_rad, 1)
        return cls(
            tuple(at),
            array["frequency_hz"].values[keep],
            response[keep],
            quantity,
            variance,
            None if covariance is None else np.asarray(covariance)[keep],
            freedom,
            int(np.sum(~keep)),
        )

    def with_load(self, load: Load | None) -> MeasuredResponse:
        """Return the response with the ``load`` that the arm carried."""
        return replace(self, load=load)

    @property
    def elements_weighed_together(self) -> int:
        """Number of elements that one weight matrix couples: 1 for weights from variances."""
        if self.covariance is None:
            return 1
        m = int(self.response.shape[1])
        blocks = self.covariance.reshape(-1, m, m, m, m)
        apart = np.arange(m)[:, None] != np.arange(m)
        # Without covariance between inputs, a weight matrix couples the outputs of one input only.
        return m * m if blocks.transpose(0, 1, 3, 2, 4)[:, :, :, apart].any() else m

    def pooled(self, neighbours: int | None, model: Complex | None) -> Real | None:
        """Return variances pooled from neighbouring lines, or None if each line's own sets its weight.

        The result has the shape of ``variance``. ``neighbours`` is that of `FrequencyFitOptions`.
        ``model`` is the response that gives the magnitude, None for the measured one. See
        `pooled_variance`.
        """
        freedom = self.degrees_of_freedom
        if freedom is None or self.variance is None:
            return None
        count = neighbours_for(freedom, len(self.frequency_hz), neighbours)
        if not count:
            return None
        order = np.argsort(self.frequency_hz)
        out = np.empty_like(self.variance)
        magnitude = np.abs(self.response if model is None else model)
        out[order] = pooled_variance(magnitude[order], self.variance[order], freedom, count)
        return out

    def core(
        self,
        reference: Complex | None = None,
        weighing: Real | None = None,
        own: OwnValues | None = None,
    ) -> PoseTuple:
        """Return the arrays in the form of the compiled core.

        Logarithmic weights are relative to the magnitude of ``reference``. ``weighing``, shaped as
        ``response``, is the variance for the weights, None for each line's own. ``own`` are values of effect
        parameters that hold for this response only.
        """
        variance = None if self.variance is None else np.ascontiguousarray(self.variance.ravel())
        covariance = None if self.covariance is None else self.covariance.ravel()
        return (
            list(self.joint_angle_rad),
            self.frequency_hz,
            self.response.ravel(),
            variance,
            None if weighing is None else np.ascontiguousarray(weighing.ravel()),
            covariance,
            None if reference is None else np.ascontiguousarray(reference.ravel()),
            ORDER[self.quantity],
            own or [],
        )


def measured(data: object, robot: Robot, sampling: Sampling) -> MeasuredResponse:
    """Return a MeasuredResponse from one, or from a pair (angles, data); raises InputError for others."""
    if isinstance(data, tuple | list) and len(data) == 2:
        angles, response = data
        found = MeasuredResponse.of(angles, response)
        step = response.attrs.get("sample_time_s") if hasattr(response, "attrs") else None
        if (
            step is not None
            and sampling == "zero_order_hold"
            and not np.isclose(step, robot.sample_time_s)
        ):
            raise InputError(
                f"response: expected the sample time of the robot, {robot.sample_time_s} s, "
                f"got {step} s"
            )
    elif isinstance(data, MeasuredResponse):
        found = data
    else:
        raise InputError(
            "responses: expected MeasuredResponse or pairs (joint_angle_rad, response), got "
            f"{type(data).__name__}"
        )
    if len(found.joint_angle_rad) != robot.n_axes:
        raise InputError(
            f"joint_angle_rad: expected {robot.n_axes} angles of driven joints, got "
            f"{len(found.joint_angle_rad)}"
        )
    return found


def model_response(
    robot: Robot,
    frequency_hz: ArrayLike,
    joint_angle_rad: Sequence[float] | None = None,
    *,
    quantity: Quantity = "position",
    sampling: Sampling = "zero_order_hold",
    effects: Sequence[Effect] = (),
) -> xr.DataArray:
    """Return the response of the linearized robot from motor torque to motor motion.

    frequency_hz
        Lines [Hz], (n_freq,).
    joint_angle_rad
        Angles of the driven joints [rad], (n_axes,); None for the operating point of the robot.
    quantity
        ``position`` [rad/Nm], ``velocity`` [rad/s/Nm] or ``acceleration`` [rad/s^2/Nm].
    sampling
        ``zero_order_hold`` is the response ``G(e^{i w T})`` of a sampled loop, times ``(i w)^p``
        for the p-th derivative; ``continuous`` is ``G(i w)``.
    effects
        Effects that leave the robot linear: payload, joint_stiffness, joint_damping, motor_inertia.

    The result has dims (frequency_hz, output, input). Without effects it equals
    :meth:`axisight.Robot.zoh_response`, but is faster because it uses poles and residues. Raises
    InputError for other effects.
    """
    f = _real("frequency_hz", frequency_hz, 1)
    check_sampling(sampling)
    one_of("quantity", quantity, ORDER)
    at = robot.operating_point if joint_angle_rad is None else joint_angle_rad
    pairs = _core.frequency_response(
        robot.core,
        core_effects(robot.placed(effects)),
        [float(x) for x in at],
        f.tolist(),
        sampling == "zero_order_hold",
    )
    response = pairs[..., 0::2] + 1j * pairs[..., 1::2]
    factor = (2j * np.pi * f) ** ORDER[quantity]
    axes = robot.axis_numbers()
    unit = next(u for u, q in UNITS.items() if q == quantity)
    return xr.DataArray(
        response * factor[:, None, None],
        dims=DIMS,
        coords={"frequency_hz": f, "output": axes, "input": axes},
        attrs={"units": unit, "sampling": sampling},
        name="response",
    )


def check_sampling(sampling: str) -> None:
    """Raise InputError for an unknown kind of sampling."""
    if sampling not in ("zero_order_hold", "continuous"):
        raise InputError(f"sampling: expected zero_order_hold or continuous, got {sampling!r}")


def _store(target: MeasuredResponse, name: str, value: object) -> None:
    object.__setattr__(target, name, value)


def _real(name: str, value: ArrayLike, ndim: int) -> Real:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected real numbers, got {value!r}") from None
    if array.ndim != ndim or not array.size:
        raise InputError(f"{name}: expected {ndim} dimension with numbers, got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name}: expected finite numbers, got {array[~np.isfinite(array)][0]}")
    return array


def _complex(name: str, value: ArrayLike) -> Complex:
    try:
        array = np.array(value, dtype=np.complex128)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected complex numbers, got {value!r}") from None
    if not np.isfinite(array).all():
        raise InputError(
            f"{name}: expected finite numbers, got {int(np.sum(~np.isfinite(array)))} that are not"
        )
    return np.ascontiguousarray(array)


def _variance(value: ArrayLike, shape: tuple[int, ...]) -> Real:
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise InputError(f"variance: expected shape {shape}, got {array.shape}")
    if np.isnan(array).any():
        raise InputError(
            f"variance: expected numbers, got NaN in {int(np.isnan(array).sum())} elements; "
            "average several periods or realizations, or use a criterion without weights"
        )
    if (array <= 0).any():
        raise InputError(f"variance: expected positive numbers, got {array.min()}")
    return array


def _covariance(value: ArrayLike, shape: tuple[int, ...]) -> Complex:
    array = _complex("covariance", value)
    n, m, _ = shape
    if array.shape == (n, m, m, m):
        # Different inputs have no covariance.
        full = np.zeros((n, m, m, m, m), np.complex128)
        for column in range(m):
            full[:, :, column, :, column] = array[:, column]
        array = full.reshape(n, m * m, m * m)
    if array.shape != (n, m * m, m * m):
        raise InputError(
            f"covariance: expected shape {(n, m * m, m * m)} or {(n, m, m, m)}, got {array.shape}"
        )
    twin = array.conj().transpose(0, 2, 1)
    if not np.allclose(array, twin, rtol=1e-9, atol=1e-12 * np.abs(array).max()):
        raise InputError("covariance: expected Hermitian matrices, got others")
    return np.ascontiguousarray(0.5 * (array + twin))

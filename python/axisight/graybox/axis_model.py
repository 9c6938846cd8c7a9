"""One axis as a chain of masses: its structure, its parameters, its data, its simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import one_of
from axisight.display.summary import summarized
from axisight.errors import InputError

Array = NDArray[np.float64]
Output = Literal["velocity", "velocity_difference", "position"]
Hold = Literal["zero", "first"]

MOST_MASSES = 4
# Torque, output, sample time, weight, samples of a block.
CoreRecord: TypeAlias = tuple[Array, Array, float, float, int]
OUTPUT_UNIT = {"velocity": "rad/s", "velocity_difference": "rad/s", "position": "rad"}


@dataclass(frozen=True)
class AxisParameter:
    """A parameter of an axis model: its name in the thesis, unit, meaning and default bounds.

    ``neutral`` is the value at which the parameter has no effect, or ``None`` if a fit needs a start.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float = np.inf
    neutral: float | None = None


@summarized
@dataclass(frozen=True)
class AxisModel:
    """Structure of the model of one axis, thesis (9.4)-(9.9), for two or more masses.

    The motor, of inertia ``J_m``, drives a chain of ``n_masses - 1`` masses through the gear ratio r
    (joint angle per motor angle) and a spring. The states are the deflections of the springs and the
    speeds of the masses, and the motor angle if the model needs it.

    =========================  ===========================================================
    ``n_masses``               2 to 4, including the motor
    ``gear_ratio``             r, positive; known unless the fit frees ``r``
    ``cubic``                  which springs have a cubic term (one flag each; gear first)
    ``friction_smoothing_rad_s``  0: F_c sgn(speed) with the exact sign; the motor stands while the
                               drive is below F_c. Positive, w: F_c tanh(speed / w)
    ``stribeck``               friction rises by ``F_s`` towards standstill, over ``v_s``
    ``viscous_asymmetry``      ``F_a`` times the size of the speed, for friction that differs
                               between the directions
    ``torque_offset``          constant motor torque ``u_0``; while the motor turns, a difference of
                               Coulomb friction between the directions has the same effect
    ``backlash``               gap of half width ``b`` (joint side) before the gear spring
    ``ripple_orders``          harmonics of the motor angle in the torque, with amplitudes ``a_n``
                               of the cosine and ``b_n`` of the sine
    ``output``                 ``"velocity"`` of the motor at the samples, its
                               ``"velocity_difference"`` (backward difference of positions, as a
                               drive computes it), or its ``"position"``
    ``hold``                   torque between samples: ``"zero"`` (held) or ``"first"``
                               (straight lines)
    ``initial``                ``"rest"``: every data set starts at rest; ``"free"``: the fit
                               estimates initial speeds and deflections with the parameters
    ``substeps``               Runge-Kutta steps (order 4) per sample
    =========================  ===========================================================

    Raises InputError naming the field that no axis can have.
    """

    n_masses: int = 2
    gear_ratio: float = 1.0
    cubic: Sequence[bool] | None = None
    friction_smoothing_rad_s: float = 0.0
    stribeck: bool = False
    viscous_asymmetry: bool = False
    torque_offset: bool = False
    backlash: bool = False
    ripple_orders: Sequence[float] = ()
    output: Output = "velocity"
    hold: Hold = "zero"
    initial: Literal["rest", "free"] = "rest"
    substeps: int = 1

    def __post_init__(self) -> None:
        """Check the structure, and fill in defaults that depend on the number of masses."""
        _whole("n_masses", self.n_masses, 2, MOST_MASSES)
        _whole("substeps", self.substeps, 1, 1000)
        one_of("output", self.output, tuple(OUTPUT_UNIT))
        one_of("hold", self.hold, ("zero", "first"))
        one_of("initial", self.initial, ("rest", "free"))
        if not (np.isfinite(self.gear_ratio) and self.gear_ratio > 0):
            raise InputError(
                "gear_ratio: expected a positive number, joint angle per motor angle (a gear of "
                f"224:1 has 1/224), got {self.gear_ratio}. Motor-side data do not show which way "
                "the joint turns: use the size"
            )
        smoothing = self.friction_smoothing_rad_s
        if not (np.isfinite(smoothing) and smoothing >= 0):
            raise InputError(
                f"friction_smoothing_rad_s: expected a finite number from 0, got {smoothing}"
            )
        springs = self.n_masses - 1
        cubic = (True, *[False] * (springs - 1)) if self.cubic is None else tuple(self.cubic)
        if len(cubic) != springs:
            raise InputError(f"cubic: expected {springs} flags, one per spring, got {len(cubic)}")
        orders = tuple(float(n) for n in self.ripple_orders)
        if not all(np.isfinite(n) and n > 0 for n in orders) or len(set(orders)) != len(orders):
            raise InputError(f"ripple_orders: expected different positive orders, got {orders}")
        object.__setattr__(self, "cubic", cubic)
        object.__setattr__(self, "ripple_orders", orders)

    @property
    def parameters(self) -> tuple[AxisParameter, ...]:
        """The parameters of this structure, in the order of the fit."""
        return tuple(p for p, used in self._table if used)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters of this structure."""
        return tuple(p.name for p in self.parameters)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states: motor angle, deflections of the springs, speeds of the masses."""
        masses = [_mass(i) for i in range(self.n_masses)]
        springs = [f"deflection{_later(i)}" for i in range(self.n_masses - 1)]
        return ("angle_m", *springs, *[f"speed_{m}" for m in masses])

    @cached_property
    def _table(self) -> tuple[tuple[AxisParameter, bool], ...]:
        """All parameters in the core's vector, and whether this structure uses them."""
        n, cubic = self.n_masses, self.cubic or ()
        springs = range(n - 1)
        signed = -np.inf
        out = [
            (AxisParameter(f"J_{_mass(i)}", "kg m^2", f"inertia of mass {i + 1}", 0.0), True)
            for i in range(n)
        ]
        out += [
            (AxisParameter(f"k1{_later(i)}", "Nm/rad", f"stiffness of spring {i + 1}", 0.0), True)
            for i in springs
        ]
        out += [
            (
                AxisParameter(
                    f"k3{_later(i)}", "Nm/rad^3", f"cubic term of spring {i + 1}", signed, neutral=0
                ),
                bool(cubic[i]),
            )
            for i in springs
        ]
        out += [
            (
                AxisParameter(
                    f"d{_later(i)}", "Nm s/rad", f"damping of spring {i + 1}", 0.0, neutral=0
                ),
                True,
            )
            for i in springs
        ]
        out += [
            (AxisParameter("F_v", "Nm s/rad", "viscous friction", 0.0, neutral=0), True),
            (AxisParameter("F_c", "Nm", "Coulomb friction", 0.0, neutral=0), True),
            (AxisParameter("r", "1", "gear ratio", 0.0, neutral=self.gear_ratio), True),
            (
                AxisParameter("b", "rad", "half width of the backlash", 0.0, neutral=0),
                self.backlash,
            ),
            (
                AxisParameter("F_s", "Nm", "excess friction at standstill", 0.0, neutral=0),
                self.stribeck,
            ),
            (
                AxisParameter("v_s", "rad/s", "speed at which F_s has decayed", 0.0, neutral=1),
                self.stribeck,
            ),
            (
                AxisParameter("F_a", "Nm s/rad", "friction by size of speed", signed, neutral=0),
                self.viscous_asymmetry,
            ),
            (AxisParameter("u_0", "Nm", "torque offset", signed, neutral=0), self.torque_offset),
        ]
        for order in self.ripple_orders:
            for letter, wave in (("a", "cosine"), ("b", "sine")):
                meaning = f"{wave} of ripple order {order:g}"
                name = f"{letter}_{order:g}"
                out.append((AxisParameter(name, "Nm", meaning, signed, neutral=0), True))
        return tuple(out)

    def core(self) -> CoreModel:
        """Return the structure in the form of the compiled core."""
        return CoreModel(
            masses=self.n_masses,
            output=self.output,
            hold=self.hold,
            smoothing=self.friction_smoothing_rad_s,
            ripple_orders=list(self.ripple_orders),
            substeps=self.substeps,
        )

    def n_gains(self) -> int:
        """Return the number of innovations gains, one per state other than the motor angle."""
        return 2 * self.n_masses - 1

    def complete(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return all parameters: the given ones, and neutral values for the others.

        Raises InputError for unknown, missing, non-finite or negative parameters.
        """
        unknown = sorted(set(values) - set(self.parameter_names))
        if unknown:
            raise InputError(
                f"parameters: expected names out of {', '.join(self.parameter_names)}, "
                f"got {', '.join(unknown)}"
            )
        out = {}
        for p in self.parameters:
            value = values.get(p.name, p.neutral)
            if value is None:
                raise InputError(
                    f"parameters: expected a value of {p.name} ({p.meaning}), got none"
                )
            value = number(p.name, value)
            if value < p.lower or (p.neutral is None and value <= 0):
                least = "a positive number" if p.neutral is None else f"at least {p.lower:g}"
                raise InputError(f"{p.name} ({p.meaning}): expected {least}, got {value}")
            out[p.name] = value
        return out

    def vector(self, values: Mapping[str, float], gains: Sequence[float] = ()) -> list[float]:
        """Return the core's vector of all shared parameters and innovations gains."""
        unused = {"b": 0.0, "F_s": 0.0, "v_s": 1.0, "F_a": 0.0, "u_0": 0.0}
        theta = [values.get(p.name, unused.get(p.name, 0.0)) for p, _ in self._table]
        return [*theta, *(gains or [0.0] * self.n_gains())]

    def places(self) -> dict[str, int]:
        """Return the index of each parameter of this structure in the core's vector."""
        return {p.name: i for i, (p, used) in enumerate(self._table) if used}

    def simulate(
        self,
        parameters: Mapping[str, float],
        torque_nm: ArrayLike,
        sample_time_s: float,
        *,
        start: ArrayLike | None = None,
    ) -> xr.Dataset:
        """Return the simulated output and states of the axis under a motor torque.

        ``parameters`` are values by name, ``torque_nm`` is (n,), ``sample_time_s`` in s. ``start``
        (2 n_masses,) holds motor angle [rad], deflections [rad] and speeds [rad/s] (`state_names`) at
        the first sample, at rest by default.

        Returns a Dataset over ``time`` [s] with ``output``, the quantity that the model's ``output``
        names, and ``states`` (time, state). Raises InputError for misuse and for a motion that
        diverges.
        """
        torque = samples("torque_nm", torque_nm)
        begin = np.zeros(2 * self.n_masses) if start is None else samples("start", start)
        if begin.shape != (2 * self.n_masses,):
            raise InputError(f"start: expected {2 * self.n_masses} numbers, got {begin.shape}")
        step = sample_time(sample_time_s)
        theta = [*self.vector(self.complete(parameters)), *begin.tolist()]
        data = (torque, np.zeros_like(torque), step, 1.0, 1)
        output, states = _core.axis_simulate(self.core(), data, theta, predicts=False)
        return xr.Dataset(
            {
                "output": ("time", output, {"units": OUTPUT_UNIT[self.output]}),
                "states": (("time", "state"), states, {"units": "rad, rad/s"}),
            },
            coords={
                "time": ("time", step * np.arange(len(torque)), {"units": "s"}),
                "state": list(self.state_names),
            },
            attrs={"output": self.output, "sample_time_s": step},
        )


@dataclass(frozen=True)
class CoreModel:
    """The structure in the form of the compiled core."""

    masses: int
    output: str
    hold: str
    smoothing: float
    ripple_orders: list[float]
    substeps: int


@summarized
@dataclass(frozen=True)
class AxisData:
    """A record of one axis: motor torque and motor velocity or position at uniform samples.

    ``torque_nm`` (n,), ``velocity_rad_s`` (n,) and/or ``position_rad`` (n,) are on the motor side.
    The model's output decides which of them is fitted. The first position is the motor angle at the
    start, which sets the phase of ripple. ``weight`` multiplies the squared residuals of this record.
    Raises InputError for wrong shapes, text, NaN and infinity.
    """

    torque_nm: ArrayLike
    velocity_rad_s: ArrayLike | None = None
    position_rad: ArrayLike | None = None
    sample_time_s: float = field(default=0.0, kw_only=True)
    name: str = field(default="", kw_only=True)
    weight: float = field(default=1.0, kw_only=True)

    def __post_init__(self) -> None:
        """Check the samples and convert them to arrays."""
        label = self.name or "data set"
        torque = samples(f"{label}: torque_nm", self.torque_nm)
        object.__setattr__(self, "torque_nm", torque)
        if self.velocity_rad_s is None and self.position_rad is None:
            raise InputError(f"{label}: expected velocity_rad_s or position_rad, got neither")
        for key in ("velocity_rad_s", "position_rad"):
            value = getattr(self, key)
            if value is None:
                continue
            array = samples(f"{label}: {key}", value)
            if len(array) != len(torque):
                raise InputError(
                    f"{label}: {key}: expected {len(torque)} samples, as many as torque_nm has, "
                    f"got {len(array)}"
                )
            object.__setattr__(self, key, array)
        object.__setattr__(self, "sample_time_s", sample_time(self.sample_time_s, label))
        if not (np.isfinite(self.weight) and self.weight > 0):
            raise InputError(f"{label}: weight: expected a positive number, got {self.weight}")

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(np.asarray(self.torque_nm))

    def measured(self, model: AxisModel) -> Array:
        """Return the measured output (n,) that ``model`` predicts; raises InputError if it is missing."""
        wanted = self.position_rad if model.output == "position" else self.velocity_rad_s
        if wanted is None:
            raise InputError(
                f"{self.name or 'data set'}: expected "
                f"{'position_rad' if model.output == 'position' else 'velocity_rad_s'}, which a "
                f"model with output={model.output!r} is fitted to, got none"
            )
        return np.asarray(wanted, np.float64)

    def start_angle_rad(self) -> float:
        """Return the motor angle at the first sample [rad], zero without position."""
        return 0.0 if self.position_rad is None else float(np.asarray(self.position_rad)[0])

    def core(self, model: AxisModel, block_s: float = 1.0) -> CoreRecord:
        """Return the record in the form of the compiled core."""
        torque = np.asarray(self.torque_nm, np.float64)
        block = max(round(block_s / self.sample_time_s), 1)
        return torque, self.measured(model), self.sample_time_s, float(self.weight), block


def samples(field: str, value: ArrayLike) -> Array:
    """Return a one-dimensional, finite, non-empty float array."""
    try:
        array = np.asarray(value)
        kind = array.dtype.kind
    except ValueError as error:
        raise InputError(f"{field}: expected shape (n,), got ragged rows") from error
    if kind not in "iuf" or array.ndim != 1 or not array.size:
        raise InputError(
            f"{field}: expected real numbers of shape (n,), n > 0, got {array.dtype} of "
            f"shape {array.shape}"
        )
    array = np.ascontiguousarray(array, np.float64)
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"{field}: expected finite numbers, got {array[bad[0]]} at sample {bad[0]}"
        )
    return array


def number(field: str, value: object) -> float:
    """Return a finite number."""
    if isinstance(value, (bool, str)) or not np.isscalar(value) or not np.isreal(value):
        raise InputError(f"{field}: expected a number, got {value!r}")
    out = float(value)  # type: ignore[arg-type]
    if not np.isfinite(out):
        raise InputError(f"{field}: expected a finite number, got {out}")
    return out


def sample_time(value: float, label: str = "") -> float:
    """Return a positive sample time [s]."""
    field = f"{label}: sample_time_s" if label else "sample_time_s"
    out = number(field, value)
    if out <= 0:
        raise InputError(f"{field}: expected a positive number of seconds, got {out}")
    return out


def _mass(i: int) -> str:
    return "m" if i == 0 else "a" + ("" if i == 1 else str(i))


def _later(i: int) -> str:
    """Return the suffix of parameter names of spring ``i``, empty for the gear."""
    return "" if i == 0 else f"_{i + 1}"


def _whole(field: str, value: object, least: int, most: int) -> None:
    good = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not good or not least <= int(value) <= most:  # type: ignore[call-overload]
        raise InputError(f"{field}: expected a whole number from {least} to {most}, got {value!r}")

"""Information on the parameters that the power at each line of a closed-loop experiment brings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import reals, whole
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.fitting import Parameter
from axisight.frequency_fit.measured import MeasuredResponse, model_response
from axisight.frequency_fit.options import FrequencyFitOptions, core_options
from axisight.frequency_fit.parameters import Spec, specs
from axisight.frf.loop import robot_loop
from axisight.robot import Robot

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

Power = Literal["torque", "velocity", "reference"]
UNITS: dict[Power, str] = {"torque": "Nm", "velocity": "rad/s", "reference": "rad/s"}

SMALLEST_NOISE_RAD, LARGEST_NOISE_RAD = 1e-30, 1e30
"""Squares of such noise stay far from overflow."""


@summarized
@dataclass(frozen=True, eq=False)
class LineInformation:
    """What references of amplitude 1 rad/s at single lines would tell, and what they would cost.

    frequency_hz
        Lines [Hz], (n_freq,).
    names, logarithmic
        Free parameters, (n,), and whether the information is per logarithm (else per metre).
    information
        M_k, (n_freq, n, n), from all experiments together.
    power
        Mean squares over axes and experiments, (n_freq,), of motor ``torque`` [Nm^2], motor ``velocity``
        and ``reference`` [(rad/s)^2].
    relative_variance, absolute_variance
        Mean over the elements of the variance of the response, (n_freq,), relative to ``|G|^2``, and in
        (rad/Nm)^2.

    All are for amplitude one: information and power grow with the square of the amplitude, and
    variances fall with it.
    """

    frequency_hz: Real
    names: tuple[str, ...]
    logarithmic: tuple[bool, ...]
    information: Real = field(repr=False)
    power: dict[Power, Real]
    relative_variance: Real
    absolute_variance: Real


def line_information(
    robot: Robot,
    parameters: Sequence[str | Parameter] | Mapping[str, float],
    frequency_hz: ArrayLike,
    *,
    directions: ArrayLike,
    n_samples: int,
    n_periods: int = 1,
    noise_std_rad: ArrayLike | None = None,
    operating_points_rad: ArrayLike | None = None,
) -> LineInformation:
    """Return information and power of references at single lines, for the robot in its loop.

    Source: Wernholt (2004), (5.3), with the input spectrum that the reference causes in the loop:
    ``U = G_u R`` with G_u from (6.11), so ``M_k = 2 Re tr(dG U)^H Phi_v^-1 (dG U)``.

    robot
        The model, with a ``pi_velocity`` or ``p_velocity`` controller.
    parameters to fit
        As for :func:`fit_responses`.
    frequency_hz
        Lines [Hz], (n_freq,).
    directions
        T, (n_axes, n_experiments), of full row rank: experiment e has the references ``T_e r_0(t)``.
    n_samples, n_periods
        Samples of a period, and measured periods; they average the noise.
    noise_std_rad
        Noise of the measured motor angles, as the standard deviation of white noise of the same
        spectral density: a number, (n_freq,) or (n_freq, n_axes) [rad]. None takes the sensor noise of
        the robot. Leakage is left out: estimate with `axisight.frf.local_polynomial`, which removes it.
    operating_points_rad
        Angles of the driven joints [rad], (n_points, n_axes); None for the operating point of the
        robot. Information adds up over points; power is their mean.

    Raises InputError for misuse, and for effects of the robot without a linear model.
    """
    f = reals("frequency_hz", frequency_hz, "frequencies of shape (n_freq,)", 1)
    n = whole("n_samples", n_samples)
    periods = whole("n_periods", n_periods)
    turned = reals("directions", directions, f"shape ({robot.n_axes}, n_experiments)", 2)
    if len(turned) != robot.n_axes or np.linalg.matrix_rank(turned) < robot.n_axes:
        raise InputError(
            f"directions: expected full rank and shape ({robot.n_axes}, n_experiments), got "
            f"{turned.shape}"
        )
    chosen = specs(robot, parameters)
    robot = robot.with_parameters({s.name: s.initial for s in chosen})
    at = [robot.operating_point] if operating_points_rad is None else operating_points_rad
    points = reals("operating_points_rad", at, f"shape (n_points, {robot.n_axes})", 2)
    found = []
    for point in points:
        here = robot.with_operating_point(point)
        noise = _noise_power(here, f, n, periods, noise_std_rad) / (n / 2) ** 2
        found.append(_at_point(here, chosen, f, turned, noise))
    matrices, powers, relative, absolute = zip(*found, strict=True)
    free = [s for s in chosen if not s.frozen]
    return LineInformation(
        frequency_hz=f,
        names=tuple(s.name for s in free),
        logarithmic=tuple(s.logarithmic for s in free),
        information=np.sum(matrices, axis=0),
        power={name: np.mean([p[name] for p in powers], axis=0) for name in UNITS},
        relative_variance=np.mean(relative, axis=0),
        absolute_variance=np.mean(absolute, axis=0),
    )


def _noise_power(
    robot: Robot, f: Real, n_samples: int, n_periods: int, noise_std_rad: ArrayLike | None
) -> Real:
    """Return ``E|V|^2`` [rad^2] of the mean period, (n_freq, n_axes)."""
    shape = (len(f), robot.n_axes)
    if noise_std_rad is None:
        if not robot.position_noise_std > 0:
            raise InputError(
                "noise_std_rad: expected a number, because the robot has no sensor noise, got None"
            )
        noise_std_rad = robot.position_noise_std
    std = reals("noise_std_rad", noise_std_rad, "positive numbers", (0, 1, 2))
    std = std[:, None] if std.ndim == 1 else std
    try:
        std = np.broadcast_to(std, shape)
    except ValueError:
        raise InputError(f"noise_std_rad: expected shape {shape}, got {std.shape}") from None
    if not ((std >= SMALLEST_NOISE_RAD) & (std <= LARGEST_NOISE_RAD)).all():
        raise InputError(
            f"noise_std_rad: expected {SMALLEST_NOISE_RAD:g} to {LARGEST_NOISE_RAD:g} rad, got "
            f"{std.min():g} to {std.max():g}"
        )
    return np.asarray(n_samples * std**2 / n_periods)


def _at_point(
    robot: Robot, chosen: Sequence[Spec], f: Real, directions: Real, noise: Real
) -> tuple[Real, dict[Power, Real], Real, Real]:
    """Return information, powers, relative and absolute variance at an operating point."""
    loop = robot_loop(robot, f)
    g, n = loop.response, robot.n_axes
    to_torque = np.linalg.inv(np.eye(n) + loop.controller @ g) @ loop.controller @ loop.prefilter
    u = to_torque @ directions
    inverse = np.linalg.pinv(u)
    # E dG_im conj(dG_jl) = E V_i conj(V_j) sum_e (U^-1)_em conj((U^-1)_el)
    shared = np.einsum("kem,kel->kml", inverse, inverse.conj())
    covariance = np.einsum("ki,ij,kml->kimjl", noise, np.eye(n), shared).reshape(-1, n * n, n * n)
    own = np.einsum("kmm->km", shared).real
    variance = noise[:, :, None] * own[:, None, :]
    quantity: dict[Power, Complex] = {
        "torque": u,
        "velocity": 2j * np.pi * f[:, None, None] * (g @ u),
        "reference": np.broadcast_to(directions, u.shape),
    }
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(g != 0, variance / np.abs(g) ** 2, np.nan)
    return (
        _information(robot, chosen, f, covariance),
        {name: 0.5 * np.mean(np.abs(x) ** 2, axis=(1, 2)) for name, x in quantity.items()},
        np.nanmean(relative, axis=(1, 2)),
        variance.mean(axis=(1, 2)),
    )


def _information(robot: Robot, chosen: Sequence[Spec], f: Real, covariance: Complex) -> Real:
    """Return the information of each line alone, (n_freq, n, n)."""
    point = tuple(float(x) for x in robot.operating_point)
    response = model_response(robot, f).values
    response = np.where(response == 0, np.finfo(float).tiny, response)
    # A pose of a single line, because the core adds up the lines of a pose.
    lines = [
        MeasuredResponse(
            point, f[k : k + 1], response[k : k + 1], "position", None, covariance[k : k + 1]
        ).core()
        for k in range(len(f))
    ]
    options = FrequencyFitOptions(criterion="weighted_least_squares")
    return _core.frequency_information(robot.core, [], list(chosen), lines, core_options(options))

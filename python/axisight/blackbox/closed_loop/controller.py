"""The controller of a loop u = r - F_y y, and what follows from it for responses and models."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg, signal

from axisight.arguments import Complex, complexes, instance
from axisight.blackbox._data import Real
from axisight.blackbox._model import StateSpaceModel
from axisight.errors import InputError
from axisight.frf.response import DIMS, frequency_response

Controller = StateSpaceModel | signal.dlti
"""F_y: a model here, or a discrete system of SciPy with the sample time ``dt``."""


def controller_model(controller: Controller, n_in: int, n_out: int, step: float) -> StateSpaceModel:
    """Return F_y, from ``n_out`` outputs of the plant to ``n_in`` inputs, as a state-space model.

    ``step`` [s] is the sample time. Raises InputError for another kind, shape or sample time.
    """
    instance("controller", controller, StateSpaceModel, signal.dlti)
    if not isinstance(controller, StateSpaceModel):
        found = controller.to_ss()
        a, b, c, d = (
            np.atleast_2d(np.asarray(x, np.float64)) for x in (found.A, found.B, found.C, found.D)
        )
        n = 0 if a.size == 0 else len(a)
        controller = StateSpaceModel(
            float(controller.dt),
            a.reshape(n, n),
            b.reshape(n, d.shape[1]),
            c.reshape(d.shape[0], n),
            d,
            np.zeros((n, d.shape[0])),
            np.zeros((d.shape[0],) * 2),
        )
    if controller.d.shape != (n_in, n_out):
        raise InputError(
            f"controller: expected {n_out} inputs and {n_in} outputs (from y to u), got "
            f"{controller.d.shape[1]} and {controller.d.shape[0]}"
        )
    if abs(controller.sample_time_s - step) > 1e-9 * step:
        raise InputError(
            f"controller: expected the sample time {step} s of the experiments, got "
            f"{controller.sample_time_s} s"
        )
    return controller


def plant_of_closed_loop(closed: StateSpaceModel, controller: StateSpaceModel) -> StateSpaceModel:
    """Return G with ``closed`` = G (I + F_y G)^-1, the plant of the indirect method.

    The model has the states of ``closed`` and of the controller F_y. Their poles that do not belong to
    the plant nearly cancel: fit the response with `axisight.blackbox.fit_rational` for a low order.
    Raises InputError if the loop is not well posed.
    """
    c, f = closed, controller
    # y = G_c w with w = u + F_y y.
    loop = np.eye(len(c.d)) - c.d @ f.d
    if np.linalg.cond(loop) > 1 / np.finfo(float).eps:
        raise InputError("controller: I - D F_y is singular: the loop has no solution")
    seen = np.asarray(np.linalg.solve(loop, np.hstack([c.c, c.d @ f.c, c.d])), np.float64)
    n, order = c.order, c.order + f.order
    output, direct = seen[:, :order], seen[:, order:]
    into = np.hstack([np.zeros((len(f.c), n)), f.c]) + f.d @ output
    through = np.eye(c.d.shape[1]) + f.d @ direct
    a = linalg.block_diag(c.a, f.a) + np.vstack([c.b @ into, f.b @ output])
    b = np.vstack([c.b @ through, f.b @ direct])
    return _noiseless(closed.sample_time_s, a, b, output, direct)


def plant_of_joint(outputs: StateSpaceModel, inputs: StateSpaceModel) -> StateSpaceModel:
    """Return G = G_yr G_ur^-1 from the models of y and of u, both driven by the reference.

    The model has the states of both. Raises InputError if the reference does not reach u within its
    sample.
    """
    y, u = outputs, inputs
    if np.linalg.cond(u.d) > 1 / np.finfo(float).eps:
        raise InputError("inputs: expected a regular direct term, from reference to input")
    back = np.linalg.inv(u.d)
    drive = np.vstack([y.b, u.b]) @ back
    own = np.hstack([np.zeros((len(u.c), y.order)), u.c])
    seen = np.hstack([y.c, np.zeros((len(y.c), u.order))])
    direct = y.d @ back
    a = linalg.block_diag(y.a, u.a) - drive @ own
    return _noiseless(y.sample_time_s, a, drive, seen - direct @ own, direct)


def _noiseless(step: float, a: Real, b: Real, c: Real, d: Real) -> StateSpaceModel:
    p = len(d)
    return StateSpaceModel(step, a, b, c, d, np.zeros((len(a), p)), np.zeros((p, p)))


def indirect_response(closed: xr.Dataset, controller: ArrayLike) -> xr.Dataset:
    """Return G = G_c (I - F_y G_c)^-1 from the response of output to reference.

    closed
        Response G_c in the format of `axisight.frf.frequency_response`, with the reference as input.
    controller
        F_y at the lines of ``closed``, (n_freq, n_in, n_out), in the loop u = r - F_y y.

    The variance follows from that of G_c to first order: dG = (I + G F_y) dG_c (I + F_y G). It uses the
    ``covariance`` of `axisight.frf.mfrf` if there is one; otherwise the elements count as independent.
    A line where I - F_y G_c is singular is NaN. Raises InputError for shapes that do not fit. Source:
    Wernholt (2004), section 3.6; Forssell and Ljung (1999).
    """
    instance("closed", closed, xr.Dataset)
    if "response" not in closed or set(closed["response"].dims) != set(DIMS):
        raise InputError(f"closed: expected a Dataset with a variable response over {DIMS}")
    gc = np.asarray(closed["response"].transpose(*DIMS).values, np.complex128)
    shape = (gc.shape[0], gc.shape[2], gc.shape[1])
    what = f"numbers of shape {shape} (n_freq, n_in, n_out)"
    f = complexes("controller", controller, what, 3)
    if f.shape != shape:
        raise InputError(f"controller: expected {what}, got shape {f.shape}")
    g = through_controller(gc, f)
    left, right = _sides(g, f)
    variance = _transformed(closed, left, right)
    units = str(closed["response"].attrs.get("units", "rad/Nm")).partition("/")
    return frequency_response(
        np.asarray(closed["frequency_hz"].values, np.float64),
        g,
        estimator="indirect",
        variance=variance,
        input_unit=units[2] or "Nm",
        output_unit=units[0],
        attrs={"closed_loop_estimator": closed.attrs.get("estimator", "")},
    )


def through_controller(closed: Complex, controller: Complex) -> Complex:
    """Return G_c (I - F_y G_c)^-1 for stacks of matrices, NaN where the inverse does not exist."""
    inner = np.eye(closed.shape[2]) - controller @ closed
    out = np.full(closed.shape, np.nan, np.complex128)
    good = np.flatnonzero(np.isfinite(inner).all(axis=(1, 2)))
    good = good[np.linalg.cond(inner[good]) < 1 / np.finfo(float).eps]
    out[good] = closed[good] @ np.linalg.inv(inner[good])
    return out


def _sides(g: Complex, f: Complex) -> tuple[Complex, Complex]:
    """Return I + G F_y and I + F_y G."""
    return np.eye(g.shape[1]) + g @ f, np.eye(g.shape[2]) + f @ g


def _transformed(closed: xr.Dataset, left: Complex, right: Complex) -> Real:
    """Return the variance of left dG_c right from that of G_c."""
    p, m = left.shape[1], right.shape[1]
    if "covariance" in closed:
        between = closed["covariance"].values.reshape(-1, p, m, p, m)
        return np.asarray(
            np.einsum(
                "fok,fli,fklqr,foq,fri->foi", left, right, between, left.conj(), right.conj()
            ).real
        )
    variance = closed["variance"].transpose(*DIMS).values
    return np.asarray(
        np.einsum("fok,fkl,fli->foi", np.abs(left) ** 2, variance, np.abs(right) ** 2)
    )

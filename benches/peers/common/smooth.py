"""Solvers on a smooth problem, without restarts: one call for the whole run.

Each function returns a run that gives the positions (n, motors and joints) at the samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import integrate

from common.loops import Task, returning, returning_jacobian, warm

Array = np.ndarray


def times(task: Task) -> Array:
    """The samples [s]."""
    return np.arange(task.n_samples) * task.sample_time


def lsoda(task: Task, rtol: float) -> Callable[[], Array]:
    """SciPy's LSODA through ``odeint``; several times faster than ``solve_ivp``."""
    function = returning(task.plant)
    u = np.zeros(task.plant.n_axes)
    warm(task, function)

    def run() -> Array:
        out = integrate.odeint(
            function,
            task.start,
            times(task),
            (u,),
            tfirst=True,
            rtol=rtol,
            atol=rtol * task.size,
            mxstep=100_000,
        )
        return out[:, : task.n_positions]

    return run


def scipy_ivp(method: str) -> Callable[[Task, float], Callable[[], Array]]:
    """SciPy's ``solve_ivp``; implicit methods get the compiled Jacobian."""

    def prepare(task: Task, rtol: float) -> Callable[[], Array]:
        function, matrix = returning(task.plant), returning_jacobian(task)
        u = np.zeros(task.plant.n_axes)
        warm(task, function, matrix)
        extra = {"jac": lambda t, x: matrix(t, x, u)} if method in ("Radau", "BDF") else {}

        def run() -> Array:
            t = times(task)
            out = integrate.solve_ivp(
                lambda t, x: function(t, x, u),
                (0.0, t[-1]),
                task.start,
                method,
                t,
                rtol=rtol,
                atol=rtol * task.size,
                **extra,
            )
            if not out.success:
                raise RuntimeError(f"{method}: {out.message}")
            return out.y[: task.n_positions].T

        return run

    return prepare


def cvode(task: Task, rtol: float) -> Callable[[], Array]:
    """SUNDIALS CVODE (BDF) by scikit-sundae with the compiled Jacobian."""
    from sksundae.cvode import CVODE  # noqa: PLC0415

    held, fill = task.plant.held, task.jacobian
    u = np.zeros(task.plant.n_axes)
    warm(task, returning(task.plant), returning_jacobian(task))

    def rhs(t: float, x: Array, dx: Array) -> None:
        held(t, x, u, dx)

    def jac(t: float, x: Array, dx: Array, out: Array) -> None:
        fill(t, x, u, out)

    def run() -> Array:
        solver = CVODE(
            rhs,
            jacfn=jac,
            rtol=rtol,
            atol=rtol * task.size,
            method="BDF",
            max_num_steps=100_000,
        )
        out = solver.solve(times(task), task.start)
        if not out.success:
            raise RuntimeError(f"CVODE: {out.message}")
        return out.y[:, : task.n_positions]

    return run

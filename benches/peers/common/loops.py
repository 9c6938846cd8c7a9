"""The sampled loop around other people's solvers, and the reference runs.

The controller runs at the sample time, so a solver must stop and start again at every
sample. Each solver is driven in the way that costs it least (see the functions); controller
and right-hand side are compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from scipy import integrate

from common.numba_plant import Plant
from common.robot_model import Model

Array = np.ndarray


@dataclass
class Task:
    """A run from rest: plant, controller, references and what the solvers need to know."""

    plant: Plant
    jacobian: Callable
    command: Callable
    start: Array
    reference: Array
    sample_time: float
    size: Array
    n_positions: int

    @property
    def n_samples(self) -> int:
        return len(self.reference)

    def for_seconds(self, seconds: float) -> Task:
        """The first seconds of the run."""
        count = round(seconds / self.sample_time)
        return Task(**{**self.__dict__, "reference": self.reference[:count]})


def controller(model: Model, feed_forward: Array) -> Callable:
    """``command(k, w_ref, x, previous, phi_ref, u)``: the spec's PI velocity loop."""
    kp, ki = (np.array(model.controller[name], dtype=float) for name in ("kp", "ki"))
    period, count = model.sample_time, model.n_axes
    rest = np.array(feed_forward, dtype=float)

    @numba.njit
    def command(k, w_ref, x, previous, phi_ref, u):
        for i in range(count):
            speed = (x[i] - previous[i]) / period if k > 0 else 0.0
            u[i] = rest[i] + kp[i] * (w_ref[k, i] - speed) + ki[i] * (phi_ref[i] - x[i])
            phi_ref[i] += period * w_ref[k, i]
            previous[i] = x[i]

    return command


def sampled(task: Task, advance: Callable[[Array, Array], Array]) -> Array:
    """Positions (n, motors and joints); ``advance(x, u)`` integrates one sample."""
    x = task.start.copy()
    motors = task.plant.n_axes
    previous, phi_ref, u = x[:motors].copy(), x[:motors].copy(), np.zeros(motors)
    log = np.empty((task.n_samples, task.n_positions))
    for k in range(task.n_samples):
        log[k] = x[: task.n_positions]
        task.command(k, task.reference, x, previous, phi_ref, u)
        x = advance(x, u)
    return log


def returning(plant: Plant) -> Callable:
    """``f(t, x, u)`` that returns a new array, as SciPy wants it."""
    held, n = plant.held, plant.n_states

    @numba.njit
    def function(t, x, u):
        dx = np.empty(n)
        held(t, x, u, dx)
        return dx

    return function


def returning_jacobian(task: Task) -> Callable:
    """``jacobian(t, x, u)`` that returns a new matrix."""
    fill, n = task.jacobian, task.plant.n_states

    @numba.njit
    def function(t, x, u):
        out = np.empty((n, n))
        fill(t, x, u, out)
        return out

    return function


def warm(task: Task, *functions: Callable) -> None:
    """Compile before the clock runs."""
    u = np.zeros(task.plant.n_axes)
    for function in functions:
        function(0.0, task.start, u)


def lsoda_sampled(task: Task, rtol: float) -> Callable[[], Array]:
    """SciPy's LSODA through ``ode``, its interface with the least Python per restart.

    ``odeint`` takes 5 to 10 % longer here, the class ``LSODA`` more than twice as long.
    """
    function = returning(task.plant)
    warm(task, function)
    solver = integrate.ode(function)
    solver.set_integrator("lsoda", rtol=rtol, atol=rtol * task.size, nsteps=100_000)

    def advance(x: Array, u: Array) -> Array:
        solver.set_f_params(u)
        solver.set_initial_value(x, 0.0)
        return solver.integrate(task.sample_time)

    return lambda: sampled(task, advance)


def radau_sampled(task: Task, rtol: float) -> Callable[[], Array]:
    """SciPy's Radau stepped by hand: no dense output, compiled Jacobian.

    It is told to try the whole sample in one step, which saves its search for a first step.
    """
    function, matrix = returning(task.plant), returning_jacobian(task)
    warm(task, function, matrix)
    period, atol = task.sample_time, rtol * task.size

    def advance(x: Array, u: Array) -> Array:
        solver = integrate.Radau(
            lambda t, y: function(t, y, u),
            0.0,
            x,
            period,
            rtol=rtol,
            atol=atol,
            jac=lambda t, y: matrix(t, y, u),
            first_step=period,
        )
        while solver.status == "running":
            solver.step()
        if solver.status != "finished":
            raise RuntimeError("Radau gave up")
        return solver.y

    return lambda: sampled(task, advance)


def cvode_sampled(task: Task, rtol: float) -> Callable[[], Array]:
    """SUNDIALS CVODE (BDF) by scikit-sundae, reinitialized at every sample."""
    from sksundae.cvode import CVODE  # noqa: PLC0415

    held, fill = task.plant.held, task.jacobian
    period = task.sample_time
    warm(task, returning(task.plant), returning_jacobian(task))

    u_shared = np.zeros(task.plant.n_axes)

    def rhs(t: float, y: Array, yp: Array) -> None:
        held(t, y, u_shared, yp)

    def jac(t: float, y: Array, yp: Array, out: Array) -> None:
        fill(t, y, u_shared, out)

    solver = CVODE(
        rhs,
        jacfn=jac,
        rtol=rtol,
        atol=rtol * task.size,
        method="BDF",
        max_num_steps=100_000,
    )

    def advance(x: Array, u: Array) -> Array:
        u_shared[:] = u
        solver.init_step(0.0, x)
        return solver.step(period, tstop=period).y

    return lambda: sampled(task, advance)


def rk4_sampled(task: Task, substeps: int) -> Callable[[], Array]:
    """The whole loop in numba with fixed Runge-Kutta steps: what an expert would write."""
    loop = rk4_loop(task)
    loop(task.start, task.reference[:2], 1)
    return lambda: loop(task.start, task.reference, substeps)


def rk4_loop(task: Task) -> Callable:
    """``loop(x, reference, substeps)``, compiled."""
    held, command = task.plant.held, task.command
    n, motors, positions = task.plant.n_states, task.plant.n_axes, task.n_positions
    period = task.sample_time

    @numba.njit
    def loop(start, reference, substeps):
        x, probe = start.copy(), np.empty(n)
        k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
        previous, phi_ref, u = x[:motors].copy(), x[:motors].copy(), np.zeros(motors)
        log = np.empty((len(reference), positions))
        h = period / substeps
        for k in range(len(reference)):
            for i in range(positions):
                log[k, i] = x[i]
            command(k, reference, x, previous, phi_ref, u)
            for s in range(substeps):
                t = k * period + s * h
                held(t, x, u, k1)
                for i in range(n):
                    probe[i] = x[i] + 0.5 * h * k1[i]
                held(t + 0.5 * h, probe, u, k2)
                for i in range(n):
                    probe[i] = x[i] + 0.5 * h * k2[i]
                held(t + 0.5 * h, probe, u, k3)
                for i in range(n):
                    probe[i] = x[i] + h * k3[i]
                held(t + h, probe, u, k4)
                for i in range(n):
                    x[i] += (h / 6) * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i])
        return log

    return loop


def relative_rms(got: Array, want: Array) -> float:
    """RMS error over RMS travel from the start, worst of all positions."""
    travel = want - want[0]
    error = np.sqrt(np.mean((got - want) ** 2, axis=0))
    return float((error / np.sqrt(np.mean(travel**2, axis=0))).max())

"""Physically consistent parameters: a least-squares fit over bodies that can exist.

A link can exist if its pseudo-inertia, the 4 x 4 matrix of second moments of its mass
distribution, is positive definite (Wensing, Kim and Slotine 2018). Least squares over such links,
with non-negative rotor inertias and friction, is a convex problem with semidefinite cones.
Clarabel (Goulart and Chen 2024) solves it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from axisight import _core
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.rigid_body.base import free_columns
from axisight.rigid_body.estimate import numbers, row_weights
from axisight.rigid_body.regressor import TorqueModel, rows

Array = NDArray[np.float64]
Status = Literal["already_consistent", "solved", "inaccurate", "failed"]

LINK_PARAMETERS = 10
"""Link parameters in order: m, m c (x y z), inertia about the link frame xx yy zz xy xz yz."""

_PRIOR_WEIGHT = 1e-6
"""Weight of a prior without standard deviations, relative to the best-determined direction."""
_ON_BOUNDARY = 1e-6
"""A least eigenvalue closer to the margin than this counts as at the margin. It is ten times the
accuracy of the solver, and a thousandth of the eigenvalue of thin-walled links."""
_ADVICE: dict[str, str] = {
    "already_consistent": "",
    "solved": "",
    "inaccurate": (
        "the solver stopped short of its tolerance: give a prior for the links, or check the "
        "scaling of the regressor (units, gear ratios)"
    ),
    "failed": (
        "the solver found no solution: check the target for NaN-like sizes, make `margin` "
        "smaller, give a prior for the links, or hold other values (`known`): perhaps no body has them"
    ),
}


@summarized
@dataclass(frozen=True, eq=False)
class ConsistentParameters:
    """Parameters of bodies that can exist, and the increase of the loss for that.

    theta
        (n_parameters,), NaN if the solver failed.
    status, advice
        ``"already_consistent"``: the unconstrained fit is returned; ``"solved"``;
        ``"inaccurate"``; ``"failed"``.
    loss, loss_unconstrained
        Sum of squares ``|factor theta - target|^2``, and its minimum without constraints. A difference
        far above the noise means that the model lacks something.
    least_eigenvalue
        (n_links,) of the pseudo-inertias, in units of ``mass`` and ``length_m``; at least ``margin``.
    boundary_links
        Positions of the links whose least eigenvalue is at the margin: without constraints they would
        be impossible.
    boundary_parameters
        Positions of the non-negative parameters that ended at zero.
    mass, length_m
        Typical mass [kg] and length [m] that scale the problem.
    iterations
        Iterations of the interior-point method; 0 if it was not needed.
    """

    theta: Array
    status: Status
    advice: str
    loss: float
    loss_unconstrained: float
    least_eigenvalue: Array
    boundary_links: tuple[int, ...]
    boundary_parameters: tuple[int, ...]
    mass: float
    length_m: float
    iterations: int


def pseudo_inertia(link: ArrayLike) -> Array:
    """Return the pseudo-inertia (..., 4, 4) of link parameters (..., 10).

    ``link`` is m [kg], m c [kg m], inertia about the link frame [kg m^2] in the order xx yy zz
    xy xz yz. The matrix is ``[[S, m c], [(m c)^T, m]]`` with ``S = tr(I) / 2 - I``. Raises
    InputError for another shape and values that are not finite.
    """
    x = np.asarray(link, dtype=np.float64)
    if x.ndim < 1 or x.shape[-1] != LINK_PARAMETERS or not np.isfinite(x).all():
        raise InputError(f"link: expected finite numbers of shape (..., 10), got {x.shape}")
    return np.asarray(np.einsum("abk,...k->...ab", _MAP, x), dtype=np.float64)


def _map() -> Array:
    """Return the linear map (4, 4, 10) from link parameters to pseudo-inertia."""
    out = np.zeros((4, 4, LINK_PARAMETERS))
    out[3, 3, 0] = 1.0
    for k in range(3):
        out[k, 3, 1 + k] = out[3, k, 1 + k] = 1.0
        for j in range(3):
            out[j, j, 4 + k] = -0.5 if j == k else 0.5
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        out[i, j, 7 + k] = out[j, i, 7 + k] = -1.0
    return out


_MAP = _map()


def consistent_parameters(
    factor: ArrayLike,
    target: ArrayLike,
    *,
    links: Sequence[Sequence[int]] | NDArray[np.int64],
    nonnegative: Sequence[int] = (),
    known: Mapping[int, float] | None = None,
    prior: ArrayLike | None = None,
    prior_std: ArrayLike | None = None,
    margin: float = 1e-6,
    max_iterations: int = 200,
) -> ConsistentParameters:
    """Return ``argmin |factor theta - target|^2`` over bodies that can exist.

    Parameters
    ----------
    factor, target : (k, p) and (k,), the whitened regression, best as its triangular factor
        ``R`` and ``Q^T y``. It may have unidentifiable directions.
    links : for every link the positions in theta of its ten parameters, in the order of
        :func:`pseudo_inertia`.
    nonnegative : positions of rotor inertias and friction coefficients.
    known : values to hold parameters at, by position.
    prior : (p,), values to stay close to, for example from CAD; zeros by default.
    prior_std : standard deviation of the prior, one number or (p,), infinite for none. By default it
        is so wide that the prior decides only directions that the data do not determine.
    margin : least eigenvalue of the pseudo-inertias, in units of a typical link.
    max_iterations : most iterations of the solver.

    The distance to the prior is Euclidean, for theta over ``prior_std``. If the unconstrained fit is
    consistent, the function returns it. Raises InputError naming the field; a failure of the solver
    is a status.

    """
    r, y = _finite("factor", factor, 2), _finite("target", target, 1)
    p = r.shape[1]
    if len(y) != len(r) or not r.size:
        raise InputError(f"target: expected shape ({len(r)},), got {y.shape}")
    where = _positions("links", links, p, LINK_PARAMETERS)
    signs = _positions("nonnegative", nonnegative, p, 0)
    if not (np.isfinite(margin) and margin > 0):
        raise InputError(f"margin: expected a positive number, got {margin!r}")
    if (
        isinstance(max_iterations, bool)
        or not isinstance(max_iterations, int)
        or max_iterations < 1
    ):
        raise InputError(f"max_iterations: expected a positive integer, got {max_iterations!r}")
    held = _held(known or {}, p, signs)
    before = np.zeros(p) if prior is None else _finite("prior", prior, 1)
    if before.shape != (p,):
        raise InputError(f"prior: expected shape ({p},), got {before.shape}")
    mass, length = _typical(before[where])
    scale = _scales(r, y, where, mass, length)
    weight = _prior_weight(prior_std, r * scale, scale)
    problem = _Problem(r * scale, y, before / scale, weight, where, signs, held, margin, scale)
    return problem.result(mass, length, max_iterations)


def identify_consistent(
    model: TorqueModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    torque_nm: ArrayLike,
    *,
    torque_std_nm: ArrayLike = 1.0,
    known: Mapping[str, float] | None = None,
    sample_weight: ArrayLike | None = None,
    prior: ArrayLike | None = None,
    prior_std: ArrayLike | None = None,
    margin: float = 1e-6,
    max_iterations: int = 200,
    threads: int = 0,
) -> ConsistentParameters:
    """Return estimates of all parameters of a torque model, such that every body can exist.

    Parameters
    ----------
    model : robot, drive terms, side and couplings.
    q, v, a, torque_nm : as for :func:`identify_rigid_body`.
    torque_std_nm : standard deviation of the residual of each row, one number or (n_rows,) [Nm],
        for example ``residual_std_nm`` of an unconstrained estimate.
    known : values to hold parameters at, by name.
    sample_weight : as for :func:`identify_rigid_body`.
    prior : (n_parameters,) values to stay close to; by default those of the robot file.
    prior_std, margin, max_iterations : as for :func:`consistent_parameters`.
    threads : number of threads, 0 for all cores.

    Rotor inertias, friction, stiffness and damping are not negative. Memory does not grow with the
    number of samples. Raises InputError naming the field.

    """
    motion = model.motion(q, v, a)
    torque = rows("torque_nm", torque_nm, model.n_rows)
    if len(torque) != len(motion[0]):
        raise InputError(f"torque_nm: expected {len(motion[0])} rows as q, got {len(torque)}")
    std = np.asarray(torque_std_nm, dtype=np.float64)
    if std.shape not in {(), (model.n_rows,)} or not (np.isfinite(std) & (std > 0)).all():
        raise InputError(
            f"torque_std_nm: expected positive numbers, one or ({model.n_rows},), "
            f"got shape {std.shape}"
        )
    held = numbers("known", known)
    free_columns(model, held)
    p = model.n_parameters
    factors, _ = _core.regression_factors(
        model.robot.core,
        *motion,
        torque,
        rows=model.row_map,
        extras=model.extras,
        columns=list(range(p)),
        known=[0.0] * p,
        weight=row_weights(sample_weight, (len(torque), model.n_rows)),
        blocks=1,
        threads=threads,
    )
    stacked = (factors[0] / np.broadcast_to(std, (model.n_rows,))[:, None, None]).reshape(-1, p + 1)
    both: Array = np.asarray(np.linalg.qr(stacked, mode="r"), dtype=np.float64)
    return consistent_parameters(
        both[:, :p],
        both[:, p],
        links=link_positions(model),
        nonnegative=nonnegative_positions(model),
        known={model.names.index(name): value for name, value in held.items()},
        prior=model.nominal if prior is None else prior,
        prior_std=prior_std,
        margin=margin,
        max_iterations=max_iterations,
    )


def prior_spread(model: TorqueModel, share: float = 1.0) -> Array:
    """Return standard deviations (n_parameters,) for the values of the robot file as a prior.

    They are ``share`` times a size: the mass m of a link for masses, m times its radius of gyration
    about the link frame for first moments, and m times the square of that radius for inertias. For
    rotor inertias the size is the nominal value. Parameters of ``model`` without nominal value, for
    example friction and offsets, have infinite standard deviation. Raises InputError for a share that
    is not positive.
    """
    if not (np.isfinite(share) and share > 0):
        raise InputError(f"share: expected a positive number, got {share!r}")
    nominal = model.nominal
    out = np.full(model.n_parameters, np.inf)
    rotor = np.array([c.extra is not None and c.extra[0] == "acceleration" for c in model.columns])
    known = rotor & (nominal > 0)
    out[known] = share * nominal[known]
    for link in link_positions(model):
        mass, length = _typical(nominal[link][None])
        out[link] = share * _link_scale(mass, length)
    return out


def link_positions(model: TorqueModel) -> NDArray[np.int64]:
    """Return the positions (n_links, 10) of the links' parameters among those of the model."""
    count = sum(column.extra is None for column in model.columns)
    return np.arange(count, dtype=np.int64).reshape(-1, LINK_PARAMETERS)


def nonnegative_positions(model: TorqueModel) -> list[int]:
    """Return the positions of rotors, friction and springs, which cannot be negative."""
    return [
        k
        for k, column in enumerate(model.columns)
        if column.extra is not None and column.extra[0] != "constant"
    ]


class _Problem:
    """The problem in scaled parameters z = theta / scale.

    Links are scaled by a typical mass and length, so that the pseudo-inertia of z is that of theta in
    units of this mass and length.
    """

    def __init__(
        self,
        factor: Array,
        target: Array,
        prior: Array,
        weight: Array,
        links: NDArray[np.int64],
        signs: NDArray[np.int64],
        known: Array,
        margin: float,
        scale: Array,
    ) -> None:
        self.factor, self.target, self.prior, self.weight = factor, target, prior, weight
        self.links, self.signs, self.margin, self.scale = links, signs, margin, scale
        self.known, self.held = known, np.flatnonzero(np.isfinite(known))

    def result(self, mass: float, length: float, iterations: int) -> ConsistentParameters:
        stacked = np.concatenate([self.factor, np.diag(self.weight)])
        free = self.fit(stacked, np.concatenate([self.target, self.weight * self.prior]))
        best = self.fit(self.factor, self.target)
        status: Status = "already_consistent"
        z, count = free, 0
        if not self.feasible(free):
            z, status, count = self.solve(iterations)
        eigenvalue = self.eigenvalues(z)
        on = np.flatnonzero(eigenvalue < self.margin + _ON_BOUNDARY)
        zero = [int(k) for k in self.signs if z[k] < 1e-7 * max(1.0, np.abs(z).max())]
        theta = z * self.scale
        if status != "failed":
            theta[self.held] = self.known[self.held]
        return ConsistentParameters(
            theta=theta,
            status=status,
            advice=_ADVICE[status],
            loss=self.loss(z),
            loss_unconstrained=self.loss(best),
            least_eigenvalue=eigenvalue,
            boundary_links=tuple(int(k) for k in on),
            boundary_parameters=tuple(zero),
            mass=mass,
            length_m=length,
            iterations=count,
        )

    def fit(self, matrix: Array, right: Array) -> Array:
        """Return the least-squares solution without cones, with known parameters held."""
        z = np.zeros(matrix.shape[1])
        z[self.held] = self.known[self.held] / self.scale[self.held]
        left = np.delete(np.arange(len(z)), self.held)
        z[left] = np.linalg.lstsq(matrix[:, left], right - matrix @ z, rcond=None)[0]
        return z

    def loss(self, z: Array) -> float:
        return float(np.sum((self.factor @ z - self.target) ** 2))

    def eigenvalues(self, z: Array) -> Array:
        if not np.isfinite(z).all():
            return np.full(len(self.links), np.nan)
        if not len(self.links):
            return np.empty(0)
        return np.asarray(np.linalg.eigvalsh(pseudo_inertia(z[self.links]))[:, 0])

    def feasible(self, z: Array) -> bool:
        return bool(np.all(self.eigenvalues(z) >= self.margin) and np.all(z[self.signs] >= 0))

    def solve(self, iterations: int) -> tuple[Array, Status, int]:
        """Return the minimum of ``|r|^2 / 2 + |W (z - z0)|^2 / 2`` with ``r = F z - y``.

        The residual r is a separate variable, because F^T F would square the condition.
        """
        import clarabel  # noqa: PLC0415 - only when needed, because it loads half of SciPy

        k, p = self.factor.shape
        # Relative to the target, tolerances mean the same for every robot.
        unit = max(float(np.linalg.norm(self.target)), np.finfo(np.float64).tiny)
        quadratic = sparse.diags(np.concatenate([self.weight**2, np.ones(k)]), format="csc")
        linear = np.concatenate([-(self.weight**2) * self.prior, np.zeros(k)])
        blocks: list[Any] = [sparse.hstack([sparse.csc_matrix(self.factor), -sparse.eye(k)])]
        right = [self.target]
        cones: list[Any] = [clarabel.ZeroConeT(k)]
        if len(self.signs):
            pick = np.zeros((len(self.signs), p + k))
            pick[np.arange(len(self.signs)), self.signs] = -1.0
            blocks.append(sparse.csc_matrix(pick))
            right.append(np.zeros(len(self.signs)))
            cones.append(clarabel.NonnegativeConeT(len(self.signs)))
        for link in self.links:
            cone = np.zeros((10, p + k))
            # s = svec(J - margin 1) = right - cone x.
            cone[:, link] = -_SVEC
            blocks.append(sparse.csc_matrix(cone))
            right.append(-self.margin * _SVEC_UNIT)
            cones.append(clarabel.PSDTriangleConeT(4))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = iterations
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
        # Known parameters go to the right-hand side.
        z = np.zeros(p + k)
        z[self.held] = self.known[self.held] / self.scale[self.held]
        left = np.delete(np.arange(p + k), self.held)
        matrix = sparse.vstack(blocks, format="csc")
        solver = clarabel.DefaultSolver(
            sparse.triu(quadratic[left][:, left] / unit**2, format="csc"),
            linear[left] / unit**2,
            matrix[:, left],
            np.concatenate(right) - matrix @ z,
            cones,
            settings,
        )
        found = solver.solve()
        name = str(found.status).rsplit(".", maxsplit=1)[-1]
        if name == "Solved":
            status: Status = "solved"
        elif name in {"AlmostSolved", "MaxIterations", "InsufficientProgress", "MaxTime"}:
            status = "inaccurate"
        else:
            return np.full(p, np.nan), "failed", int(found.iterations)
        z[left] = found.x
        return z[:p], status, int(found.iterations)


def _svec() -> tuple[Array, Array]:
    """Return svec of J and of 1: upper triangles by column, off-diagonal entries times sqrt(2)."""
    rows, unit = [], []
    for j in range(4):
        for i in range(j + 1):
            rows.append(_MAP[i, j] * (1.0 if i == j else np.sqrt(2.0)))
            unit.append(1.0 if i == j else 0.0)
    return np.array(rows), np.array(unit)


_SVEC, _SVEC_UNIT = _svec()


def _typical(links: Array) -> tuple[float, float]:
    """Return typical mass and radius of gyration of prior links, by default 10 kg and 0.5 m."""
    if len(links):
        moments = np.trace(pseudo_inertia(links)[:, :3, :3], axis1=1, axis2=2)
        masses = links[:, 0]
        good = (masses > 0) & (moments > 0)
        if good.any():
            mass = float(masses[good].mean())
            return mass, float(np.sqrt(moments[good].sum() / masses[good].sum()))
    return 10.0, 0.5


def _scales(r: Array, y: Array, links: NDArray[np.int64], mass: float, length: float) -> Array:
    """Return typical sizes: of links by mass and length, of others that which alone explains the target."""
    size = np.linalg.norm(r, axis=0)
    reach = float(np.linalg.norm(y)) or 1.0
    scale = np.where(size > 0, reach / np.where(size > 0, size, 1.0), 1.0)
    scale[links] = _link_scale(mass, length)
    return scale


def _link_scale(mass: float, length: float) -> Array:
    """Return the sizes of the ten parameters of a link of this mass and length."""
    return mass * np.array([1.0, *[length] * 3, *[length**2] * 6])


def _prior_weight(prior_std: ArrayLike | None, scaled: Array, scale: Array) -> Array:
    p = scaled.shape[1]
    if prior_std is None:
        return np.full(p, _PRIOR_WEIGHT * float(np.linalg.norm(scaled, 2)))
    std = np.asarray(prior_std, dtype=np.float64)
    if std.shape not in {(), (p,)} or np.isnan(std).any() or np.any(std <= 0):
        raise InputError(
            f"prior_std: expected one positive number or ({p},), infinite for none, "
            f"got shape {std.shape}"
        )
    return np.asarray(scale / np.broadcast_to(std, (p,)), dtype=np.float64)


def _held(known: Mapping[int, float], p: int, signs: NDArray[np.int64]) -> Array:
    """Return the values (p,) to hold parameters at, NaN for free ones."""
    out = np.full(p, np.nan)
    places = _positions("known", list(known), p, 0)
    out[places] = _finite("known", list(known.values()), 1) if known else []
    below = [int(k) for k in signs if out[k] < 0]
    if below:
        raise InputError(
            f"known: expected no negative number for a rotor, friction or spring, got {out[below[0]]:g}"
        )
    return out


def _finite(field: str, value: ArrayLike, ndim: int) -> Array:
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.ndim != ndim or not np.isfinite(array).all():
        raise InputError(
            f"{field}: expected finite real numbers in {ndim} dimensions, got {array.dtype} of "
            f"shape {array.shape}"
        )
    return array.astype(np.float64)


def _positions(
    field: str, value: Sequence[Any] | NDArray[np.int64], p: int, width: int
) -> NDArray[np.int64]:
    """Return checked positions from 0 to p - 1, none twice, (n, width), or (n,) for width 0."""
    array = np.asarray(value)
    if not array.size:
        return np.empty((0, width) if width else 0, np.int64)
    shape = (len(array), width) if width else (len(array),)
    if (
        array.dtype.kind not in "iu"
        or array.shape != shape
        or array.min() < 0
        or array.max() >= p
        or len(np.unique(array)) != array.size
    ):
        raise InputError(
            f"{field}: expected positions from 0 to {p - 1}, none twice, of shape "
            f"{('n', width) if width else ('n',)}, got {array.dtype} of shape {array.shape}"
        )
    return array.astype(np.int64)

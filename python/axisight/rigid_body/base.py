"""Base parameters: the fewest combinations of parameters on which the torques depend.

The method is numerical, after Gautier (1990): the regressor at random motions has the structural
rank, and columns that depend on earlier ones are grouped with them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.display.summary import summarized
from axisight.errors import AxisightError, InputError
from axisight.rigid_body.coupling import MotorCoupling
from axisight.rigid_body.friction import DriveTerms, ModelSide
from axisight.rigid_body.grouping import group
from axisight.rigid_body.regressor import TorqueModel, as_model
from axisight.robot import Robot

Array = NDArray[np.float64]

# Threshold for singular values of the scaled random regressor. Those of an arm that is not degenerate
# are above 0.01. Structural zeros are rounding errors, or a few 1e-6 if the file writes angles between
# parallel axes as 1.5708.
TOLERANCE = 1e-5
# Least ratio of the singular values above and below the threshold; an ordinary arm has 1e13.
LEAST_GAP = 100.0


@summarized
@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Base parameters of a torque model, with conversions to and from standard parameters.

    model
        The torque model.
    columns
        (n_base,), index among the model's parameters of the one that names each base parameter.
    matrix
        B, shape (n_base, n_parameters): base parameters are ``B @ parameters``. Columns of
        known parameters are zero.
    no_effect
        Names of parameters that no motion shows.
    known
        Names of parameters left out because they are known.
    singular_values
        Singular values of the regressor at random motions, columns of unit length, largest first.
    rank, rank_qr
        Structural rank by singular values, and by QR with column pivoting.
    gap
        Ratio of the smallest singular value within the rank to the next one; infinite without a next.
    """

    model: TorqueModel
    columns: NDArray[np.intp]
    matrix: Array
    no_effect: tuple[str, ...]
    known: tuple[str, ...]
    singular_values: Array
    rank: int
    rank_qr: int
    gap: float

    @property
    def names(self) -> list[str]:
        """Name of each base parameter: that of its first parameter."""
        return [self.model.names[i] for i in self.columns]

    @property
    def units(self) -> list[str]:
        """Unit of each base parameter."""
        return [self.model.units[i] for i in self.columns]

    @property
    def combinations(self) -> list[str]:
        """Symbolic expression of each base parameter, coefficients to four digits."""
        return [
            combination(self.model.names, row, int(first))
            for row, first in zip(self.matrix, self.columns, strict=True)
        ]

    def __len__(self) -> int:
        """Return the number of base parameters."""
        return len(self.columns)

    def __str__(self) -> str:
        """Return one combination per line, then the parameters without effect."""
        lines = [f"{i + 1:3d}  {text}" for i, text in enumerate(self.combinations)]
        lines.append(f"no effect: {', '.join(self.no_effect) or 'none'}")
        return "\n".join(lines)

    def from_standard(self, parameters: ArrayLike) -> Array:
        """Return the base parameters (n_base,) of standard parameters (n_parameters,)."""
        return self.matrix @ vector("parameters", parameters, self.model.n_parameters)

    def to_standard(self, base: ArrayLike, prior: ArrayLike | None = None) -> Array:
        """Return the standard parameters (n_parameters,) nearest to ``prior`` with base parameters ``base``.

        Infinitely many sets have these base parameters. ``prior`` is by default the robot's nominal
        values. The distance is relative to the sizes of the prior's entries. The size of a link
        parameter is at least the average of the parameters with its unit in that link. If that is
        zero, the size gives the parameter the same share of the torque as the others of its
        combination. The difference between a combination and its prior value is thus spread over all
        its parameters, in the order of their share of the torque.
        Known parameters keep their prior value. The result gives the same torques, but need not
        describe links that can exist.
        """
        base = vector("base", base, len(self))
        start = self.model.nominal if prior is None else prior
        start = vector("prior", start, self.model.n_parameters)
        scaled = self.matrix * (scale := self._scale(start))
        # Rows of one size, because small combinations would be lost beside large ones.
        size = np.linalg.norm(scaled, axis=1)
        missing = (base - self.matrix @ start) / size
        step, *_ = np.linalg.lstsq(scaled / size[:, None], missing, rcond=None)
        return np.asarray(start + scale * step, dtype=np.float64)

    def _scale(self, start: Array) -> Array:
        """Return the size of each parameter (n_parameters,), positive, that scales distances."""
        scale = np.abs(start)
        links = np.array([column.extra is None for column in self.model.columns])
        joints = np.array([name.rpartition(".")[0] for name in self.model.names])
        units = np.array(self.model.units)
        for joint, unit in {
            (j, u) for j, u, link in zip(joints, units, links, strict=True) if link
        }:
            of = links & (joints == joint) & (units == unit)
            scale[of] = np.maximum(scale[of], scale[of].mean())
        weight = np.abs(self.matrix)
        sized = np.where(scale > 0, weight, 0.0)
        count = np.count_nonzero(sized, axis=1)
        share = np.divide(sized @ scale, count, out=np.ones(len(self)), where=count > 0)
        for i in np.flatnonzero(scale == 0):
            rows = weight[:, i] > 0
            scale[i] = (share[rows] / weight[rows, i]).min(initial=np.inf)
        return np.where(np.isfinite(scale), scale, 1.0)

    def regressor(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, threads: int = 0) -> Array:
        """Return the regressor of the base parameters, shape (n, n_rows, n_base).

        Arguments ``q``, ``v``, ``a``, ``threads`` are those of :func:`torque_regressor`.
        """
        return self.model.matrix(q, v, a, threads=threads)[..., self.columns]


def base_parameters(
    robot: Robot | TorqueModel,
    *,
    terms: DriveTerms | None = None,
    side: ModelSide | None = None,
    coupling: MotorCoupling | None = None,
    known: Iterable[str] = (),
    locked: bool = False,
    seed: int = 0,
) -> BaseParameters:
    """Return the base parameters of a robot.

    The function evaluates the regressor at random positions (all of the circle; +-1 m), velocities
    and accelerations. It takes parameters from base to tip, and groups a parameter whose column
    depends on earlier columns with them.

    Parameters
    ----------
    robot : the robot, with the options of :func:`torque_regressor`; or a
        :class:`TorqueModel` that holds them.
    terms, side, coupling : see :func:`torque_regressor`.
    known : names of parameters to leave out, because they need no estimate.
    locked : whether elastic joints stand still at zero, as in motions from motor angles. Each of
        their links then moves with the link before, and fewer parameters show.
    seed : seed of the random motions.

    Raises InputError for unknown names. Raises AxisightError if singular values and pivoted QR
    disagree on the rank or show no gap, that is, if the robot is nearly degenerate.

    """
    model = as_model(robot, terms, side, coupling)
    known = tuple(known)
    free = free_columns(model, known)
    factor = random_factor(model, free, seed, locked)
    silent = without_effect(model, factor, free)
    found = group(factor, TOLERANCE, skip=silent)
    pivots = np.abs(np.diag(scipy.linalg.qr(found.scaled, mode="r", pivoting=True)[0]))
    rank_qr = int((pivots > TOLERANCE * pivots.max(initial=0.0)).sum())
    if not found.rank == rank_qr == len(found.independent) or found.gap < LEAST_GAP:
        raise AxisightError(
            f"structural rank not clear: {found.rank} by singular values, with a gap of "
            f"{found.gap:.2g}, {rank_qr} by QR with pivoting, {len(found.independent)} in order; "
            "a length or an angle of the robot is zero all but for rounding"
        )
    matrix = np.zeros((found.rank, model.n_parameters))
    matrix[:, free] = found.matrix
    return BaseParameters(
        model=model,
        columns=free[found.independent],
        matrix=matrix,
        no_effect=tuple(model.names[free[i]] for i in np.flatnonzero(silent)),
        known=known,
        singular_values=found.singular_values,
        rank=found.rank,
        rank_qr=rank_qr,
        gap=found.gap,
    )


def combination(names: list[str], coefficients: Array, first: int) -> str:
    """Return a linear combination in symbols, ``first`` in front."""
    order = [first, *(int(i) for i in np.flatnonzero(coefficients) if i != first)]
    text = ""
    for i in order:
        c = coefficients[i]
        sign = "-" if c < 0 else "+"
        size = "" if f"{abs(c):.4g}" == "1" else f"{abs(c):.4g} "
        if i == first:
            text = ("-" if c < 0 else "") + size + names[i]
        else:
            text += f" {sign} {size}{names[i]}"
    return text


def free_columns(model: TorqueModel, known: Iterable[str]) -> NDArray[np.intp]:
    """Return the indices of all parameters but the known ones."""
    left_out = set(known)
    unknown = left_out - set(model.names)
    if unknown:
        raise InputError(
            f"known: expected names of parameters, got {', '.join(sorted(unknown))}; "
            f"there are {', '.join(model.names)}"
        )
    free = np.flatnonzero([name not in left_out for name in model.names])
    if len(free) == 0:
        raise InputError("known: expected at least one parameter left to estimate, got all fixed")
    return free


def random_factor(
    model: TorqueModel, columns: NDArray[np.intp], seed: int, locked: bool = False
) -> Array:
    """Return the triangular factor of the regressor at random motions, k columns."""
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InputError(f"seed: expected an integer not below zero, got {seed!r}")
    rng = np.random.default_rng(int(seed))
    n = max(500, 10 * len(columns))
    shape = (n, model.n_coordinates)
    # Prismatic joints get the same numbers in metres.
    q = rng.uniform(-np.pi, np.pi, shape)
    v, a = rng.normal(0.0, 2.0, shape), rng.normal(0.0, 10.0, shape)
    # The coordinates of a base are at zero in every sample.
    q[:, : model.first_joint] = 0.0
    if locked:
        driven = [*range(model.first_joint), *model.axis_coordinates]
        elastic = np.delete(np.arange(model.n_coordinates), driven)
        q[:, elastic] = v[:, elastic] = a[:, elastic] = 0.0
    factors, _ = _core.regression_factors(
        model.robot.core,
        q,
        v,
        a,
        np.zeros((n, model.n_rows)),
        rows=model.row_map,
        extras=model.extras,
        columns=columns.tolist(),
        known=[0.0] * model.n_parameters,
        weight=None,
        blocks=1,
    )
    k = len(columns)
    stacked = factors[0, :, :k, :k].reshape(-1, k)
    return np.asarray(np.linalg.qr(stacked, mode="r"), dtype=np.float64)


def without_effect(
    model: TorqueModel, factor: Array, columns: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Return which columns are rounding only, links compared with links and drives with drives."""
    size = np.linalg.norm(factor, axis=0)
    is_link = np.array([model.columns[i].extra is None for i in columns])
    silent = np.zeros(len(columns), dtype=bool)
    for kind in (is_link, ~is_link):
        if kind.any():
            silent[kind] = size[kind] <= 1e-10 * size[kind].max()
    return silent


def vector(field: str, value: ArrayLike, n: int) -> Array:
    """Return a checked vector of n finite numbers; raises InputError for others."""
    try:
        x = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field}: expected {n} numbers, got {error}") from error
    if x.shape != (n,) or not np.isfinite(x).all():
        got = f"shape {x.shape}" if x.shape != (n,) else "NaN or infinity"
        raise InputError(f"{field}: expected {n} finite numbers, got {got}")
    return x

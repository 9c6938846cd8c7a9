"""Choice of operating points to measure at, before any experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fitting import Parameter
from axisight.frequency_fit.measured import Sampling
from axisight.frequency_fit.parameters import specs
from axisight.frequency_fit.planned import of_search, pose_information
from axisight.frf.quantity import Quantity
from axisight.identifiability import Identifiability, identifiability
from axisight.robot import Robot

Real = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class PoseChoice:
    """Operating points with the most information.

    chosen
        Indices of the candidates, ascending; ``operating_points_rad`` [rad] are the points.
    log_det
        Natural logarithm of the determinant of the information of the choice.
    efficiency
        D-efficiency: ``exp((log_det - bound) / n_parameters)``, at most 1. The bound comes from the
        relaxed problem. No other choice of as many points lowers the mean variance by more than the
        factor ``1 / efficiency``.
    weights, sensitivity
        Of every candidate in the relaxed problem: its share, and ``trace(M^-1 M_i)``.
    gap
        Certificate of the relaxed problem: its ``log det`` is within this of the optimum.
    identifiability
        Identifiability of the parameters from responses at the chosen points.
    """

    chosen: tuple[int, ...]
    operating_points_rad: Real
    log_det: float
    efficiency: float
    weights: Real
    sensitivity: Real
    gap: float
    identifiability: Identifiability

    def to_xarray(self) -> xr.Dataset:
        """Return weights and sensitivities as a Dataset over ``candidate``."""
        return xr.Dataset(
            {
                "weight": ("candidate", self.weights),
                "sensitivity": ("candidate", self.sensitivity),
                "chosen": (
                    "candidate",
                    np.bincount(np.array(self.chosen), minlength=len(self.weights)),
                ),
            },
            attrs={"log_det": self.log_det, "efficiency": self.efficiency, "gap": self.gap},
        )


def choose_poses(
    robot: Robot,
    parameters: Sequence[str | Parameter] | Mapping[str, float],
    candidates_rad: ArrayLike,
    frequency_hz: ArrayLike,
    n_poses: int,
    *,
    relative_std: ArrayLike = 0.1,
    measured_information: ArrayLike | None = None,
    repeats: bool = False,
    quantity: Quantity = "acceleration",
    sampling: Sampling = "zero_order_hold",
    effects: Sequence[Effect] = (),
    gap_tolerance: float = 1e-6,
) -> PoseChoice:
    """Return the candidates with the most information on the parameters, from a nominal model.

    The choice maximizes ``log det`` of the information (D-optimal). That minimizes the volume of the
    confidence ellipsoid of all parameters, in any units. Source: Wernholt and
    Löfberg (2007), Experiment design for identification of nonlinear gray-box models with
    application to industrial robots, CDC; Wernholt and Moberg (2011), Automatica.

    robot, parameters, effects, sampling
        As for :func:`fit_responses`; the choice uses the starts and priors of the parameters.
    candidates_rad
        Angles of the driven joints [rad], (n_candidates, n_axes).
    frequency_hz
        Lines [Hz] to be measured, (n_freq,).
    n_poses
        Number of points to choose; ``repeats`` allows the same point several times.
    relative_std
        Expected standard deviation of the responses relative to their magnitude, a number or
        an array that broadcasts to (n_candidates, n_freq, n_outputs, n_inputs).
    measured_information
        Information of earlier measurements, (n_parameters, n_parameters), for example
        ``fit.information``; the choice adds priors of the parameters.
    quantity
        Output of the responses: ``position``, ``velocity`` or ``acceleration``.
    gap_tolerance
        Tolerance of ``log det`` in the relaxed problem.

    Raises InputError for misuse, and if all candidates together do not determine a combination of
    parameters, which it names.
    """
    chosen = specs(robot, parameters)
    free = [spec for spec in chosen if not spec.frozen]
    points = np.asarray(candidates_rad, float)
    if isinstance(n_poses, bool) or not isinstance(n_poses, int | np.integer) or n_poses < 1:
        raise InputError(f"n_poses: expected a whole number from 1, got {n_poses!r}")
    if not np.isfinite(gap_tolerance) or gap_tolerance <= 0:
        raise InputError(f"gap_tolerance: expected a positive number, got {gap_tolerance}")
    matrices = pose_information(
        robot,
        chosen,
        points,
        frequency_hz,
        relative_std=relative_std,
        quantity=quantity,
        sampling=sampling,
        effects=effects,
    )
    if not repeats and n_poses > len(points):
        raise InputError(
            f"n_poses: expected at most {len(points)}, the number of candidates, got {n_poses}"
        )
    n = len(free)
    prior = np.zeros((n, n)) if measured_information is None else np.array(measured_information)
    if prior.shape != (n, n) or not np.isfinite(prior).all():
        raise InputError(
            f"measured_information: expected finite numbers of shape {(n, n)}, got {prior.shape}"
        )
    for i, spec in enumerate(free):
        if spec.prior is not None:
            mean, std = spec.prior
            prior[i, i] += (mean / std) ** 2 if spec.logarithmic else 1 / std**2
    everything = identifiability(of_search(chosen, matrices.sum(axis=0) + prior))
    singular = [c for c in everything.combinations if c.kind == "unidentifiable"]
    if singular:
        raise InputError(
            "candidates_rad: expected points that together determine all parameters; "
            + "; ".join(str(c) for c in singular)
        )
    found = _core.design_poses(
        matrices,
        prior,
        int(n_poses),
        repeats=repeats,
        gap_tolerance=gap_tolerance,
        max_iterations=20_000,
    )
    places = found["chosen"]
    return PoseChoice(
        chosen=tuple(places),
        operating_points_rad=points[places],
        log_det=found["log_det"],
        efficiency=float(np.exp((found["log_det"] - found["bound"]) / n)),
        weights=found["weights"],
        sensitivity=found["sensitivity"],
        gap=found["gap"],
        identifiability=identifiability(of_search(chosen, matrices[places].sum(axis=0) + prior)),
    )

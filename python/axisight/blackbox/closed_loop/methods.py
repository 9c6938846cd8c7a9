"""Direct, indirect and joint input-output identification side by side, Wernholt (2004), section 3.6.

The loop is y = G u + v, u = r - F_y y. All methods fit models in innovations form
(`axisight.blackbox.state_space_pem`):

- direct: from u to y, as if there were no loop
- indirect: from r to y, then G = G_c (I - F_y G_c)^-1 with the known controller
- joint input-output: from r to y and from r to u, then G = G_yr G_ur^-1
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.arguments import complexes, one_of
from axisight.blackbox._data import Complex, Real, gathered, lines, response_variance, whole
from axisight.blackbox._model import StateSpaceModel
from axisight.blackbox.closed_loop._covariance import joint_covariance
from axisight.blackbox.closed_loop.controller import (
    Controller,
    controller_model,
    plant_of_closed_loop,
    plant_of_joint,
    through_controller,
)
from axisight.blackbox.prediction_error._innovations import InnovationsProblem, Layout, Matrices
from axisight.blackbox.prediction_error.state_space import InnovationsModel, state_space_pem
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment

METHODS = ("direct", "indirect", "joint")

MISMATCH = 0.01
"""Share of the input that r - F_y y may miss before a warning."""


@summarized
@dataclass(frozen=True)
class ClosedLoopEstimate:
    """The plant by one method.

    ``models`` are the fitted models: from u to y (direct), from r to y (indirect), or from r to y and
    from r to u - r (joint). ``plant`` is G as a state-space model, for the indirect and joint methods
    with poles that nearly cancel. ``status`` is that of the worst fit. `response` has the variance.
    """

    method: str
    models: tuple[InnovationsModel, ...]
    plant: StateSpaceModel
    controller: StateSpaceModel | None
    covariance: Real = field(repr=False)
    status: str

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G at e^{iwT} with its variance, as `axisight.frf.frequency_response`.

        ``frequency_hz`` [Hz] ascends, up to Nyquist; ``input_unit`` and ``output_unit`` are labels.
        Raises InputError for other frequencies.
        """
        f = lines(frequency_hz, self.plant.sample_time_s)
        g, slope = self._slopes(f)
        return frequency_response(
            f,
            g,
            estimator=self.method,
            variance=response_variance(slope, self.covariance),
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"status": self.status},
        )

    def _slopes(self, f: Real) -> tuple[Complex, Complex]:
        first, slope = self.models[0].response_slopes(f)
        if self.method == "direct":
            return first, slope
        m = first.shape[2]
        if self.controller is not None:
            z = np.exp(2j * np.pi * f * self.plant.sample_time_s)
            back = _at(self.controller, z)
            g = through_controller(first, back)
            left, right = np.eye(g.shape[1]) + g @ back, np.eye(m) + back @ g
            return g, np.einsum("fok,fklp,fli->foip", left, slope, right)
        second, other = self.models[1].response_slopes(f)
        inverse = np.linalg.inv(second + np.eye(m))
        g = first @ inverse
        both = np.concatenate([slope, -np.einsum("fok,fklp->folp", g, other)], axis=3)
        return g, np.einsum("folp,fli->foip", both, inverse)


@summarized
@dataclass(frozen=True)
class ClosedLoopEstimates:
    """The plant by several methods from the same data, from `identify_closed_loop`.

    ``estimates`` by method. ``controller_mismatch`` (n_in,) is the rms of u - (r - F_y y) over that of
    u; a large one means that the controller is not the given one, not linear, or that r is not the
    recorded reference. ``warnings`` say what to do.
    """

    estimates: dict[str, ClosedLoopEstimate]
    controller_mismatch: Real
    n_samples: int
    warnings: tuple[str, ...]

    def response(self, frequency_hz: ArrayLike) -> xr.Dataset:
        """Return the responses of all methods over a further dimension ``approach``."""
        found = [e.response(frequency_hz).drop_attrs() for e in self.estimates.values()]
        names = xr.DataArray(list(self.estimates), dims="approach", name="approach")
        return xr.concat(found, names)

    def table(self, frequency_hz: ArrayLike, truth: ArrayLike | None = None) -> xr.Dataset:
        """Return one row per approach, with means over frequency and elements.

        frequency_hz
            Lines [Hz] that the means run over.
        truth
            G (n_freq, n_out, n_in) to compare with.

        Variables over ``approach``: ``relative_std``, the root of the mean variance over that of |G|^2,
        ``from_direct``, the distance from the direct estimate likewise, ``from_direct_std`` the same
        in standard errors of the indirect or joint estimate, ``error``, the distance from ``truth``,
        and ``status``. The methods use the same noise, so ``from_direct_std`` well above 1 shows bias
        or a wrong controller.
        """
        f = lines(frequency_hz, next(iter(self.estimates.values())).plant.sample_time_s)
        rows: dict[str, list[float]] = {
            "relative_std": [],
            "from_direct": [],
            "from_direct_std": [],
            "error": [],
        }
        known = None if truth is None else complexes("truth", truth, "G (n_freq, n_out, n_in)", 3)
        base = self.estimates.get("direct")
        direct = None if base is None else base.response(f)["response"].values
        for estimate in self.estimates.values():
            found = estimate.response(f)
            g, v = found["response"].values, found["variance"].values
            size = float(np.linalg.norm(g))
            rows["relative_std"].append(float(np.sqrt(np.sum(v)) / size))
            apart = np.nan if direct is None else float(np.linalg.norm(g - direct))
            rows["from_direct"].append(apart / size)
            rows["from_direct_std"].append(apart / float(np.sqrt(np.sum(v))))
            rows["error"].append(
                np.nan
                if known is None
                else float(np.linalg.norm(g - known) / np.linalg.norm(known))
            )
        return xr.Dataset(
            {
                **{name: ("approach", np.asarray(values)) for name, values in rows.items()},
                "status": ("approach", [e.status for e in self.estimates.values()]),
            },
            coords={"approach": list(self.estimates)},
        )


def identify_closed_loop(
    experiments: Experiment | Sequence[Experiment],
    order: int,
    *,
    controller: Controller | None = None,
    closed_order: int | None = None,
    using: Sequence[str] = METHODS,
    reference_at: str = "input",
    direct_term: bool = False,
    window: int | None = None,
) -> ClosedLoopEstimates:
    """Return the plant by the direct, indirect and joint input-output methods.

    experiments
        `axisight.records.experiment.Experiment` with a reference of one channel per input.
    order
        Number of states of plant and noise together, for the direct method.
    controller
        F_y of the loop u = r - F_y y, as `axisight.blackbox.StateSpaceModel` or
        ``scipy.signal.dlti``; needed by the indirect method.
    closed_order
        Number of states of the closed loop, by default those of plant and controller. Give it if there
        is no controller.
    using
        Methods, of ``"direct"``, ``"indirect"`` and ``"joint"``.
    reference_at
        ``"input"`` if the reference enters u directly; ``"output"`` for the loop u = F_y (r - y),
        whose reference is filtered by F_y first, from rest.
    direct_term
        Whether the plant acts within its sample; only for a controller with a delay.
    window
        Window of the start by `axisight.blackbox.state_space`.

    Raises InputError for misuse; non-convergence is a status. The indirect and joint methods need a
    linear controller; the direct method needs none, but a noise model that fits.
    """
    data = gathered(experiments, "experiments")
    wanted = _wanted(using)
    n = whole("order", order, 1)
    p, m, step = data[0].output.shape[1], data[0].input.shape[1], data[0].sample_time_s
    loop = None if controller is None else controller_model(controller, m, p, step)
    if "indirect" in wanted and loop is None:
        raise InputError("controller: expected F_y for the indirect method, got None")
    references = _references(data, loop, one_of("reference_at", reference_at, ("input", "output")))
    if closed_order is None and loop is None and wanted != ["direct"]:
        raise InputError("closed_order: expected the order of the closed loop, got None")
    added = 0 if loop is None else loop.order
    closed = whole("closed_order", n + added if closed_order is None else closed_order, 1)

    def fitted(part: list[Experiment], states: int) -> InnovationsModel:
        return state_space_pem(part, states, direct=direct_term, window=window)

    estimates: dict[str, ClosedLoopEstimate] = {}
    if "direct" in wanted:
        estimates["direct"] = _direct(fitted(data, n))
    by_reference = [Experiment(step, r, e.output) for e, r in zip(data, references, strict=True)]
    if wanted != ["direct"]:
        through = fitted(by_reference, closed)
        if "indirect" in wanted and loop is not None:
            estimates["indirect"] = _indirect(through, loop)
        if "joint" in wanted:
            feedback = [
                Experiment(step, r, e.input - r) for e, r in zip(data, references, strict=True)
            ]
            back = fitted(feedback, closed)
            estimates["joint"] = _joint(through, back, by_reference, feedback)
    mismatch = np.full(m, np.nan) if loop is None else _mismatch(data, references, loop)
    return ClosedLoopEstimates(
        {name: estimates[name] for name in wanted},
        mismatch,
        sum(e.n_samples for e in data),
        tuple(_warnings(estimates, mismatch)),
    )


def _wanted(using: Sequence[str]) -> list[str]:
    given = [using] if isinstance(using, str) else list(using)
    for name in given:
        one_of("using", name, METHODS)
    if not given:
        raise InputError("using: expected at least one, got none")
    return [name for name in METHODS if name in given]


def _references(
    data: list[Experiment], loop: StateSpaceModel | None, reference_at: str
) -> list[Real]:
    """Return the references as they enter u."""
    out = []
    m, p = data[0].input.shape[1], data[0].output.shape[1]
    channels = m if reference_at == "input" else p
    for k, e in enumerate(data, 1):
        if e.reference is None or e.reference.shape[1] != channels:
            got = "none" if e.reference is None else str(e.reference.shape[1])
            raise InputError(
                f"experiments: expected a reference with {channels} channels in experiment {k}, "
                f"got {got}"
            )
        if reference_at == "input":
            out.append(e.reference)
            continue
        if loop is None:
            raise InputError("controller: expected F_y to filter the reference, got None")
        out.append(loop.simulate(Experiment(e.sample_time_s, e.reference, e.input)))
    return out


def _direct(model: InnovationsModel) -> ClosedLoopEstimate:
    return ClosedLoopEstimate("direct", (model,), model.model, None, model.covariance, model.status)


def _indirect(model: InnovationsModel, loop: StateSpaceModel) -> ClosedLoopEstimate:
    plant = plant_of_closed_loop(model.model, loop)
    return ClosedLoopEstimate("indirect", (model,), plant, loop, model.covariance, model.status)


def _joint(
    outputs: InnovationsModel,
    feedback: InnovationsModel,
    by_output: list[Experiment],
    by_feedback: list[Experiment],
) -> ClosedLoopEstimate:
    inputs = replace(feedback.model, d=feedback.model.d + np.eye(len(feedback.model.d)))
    models = (outputs, feedback)
    ranking = ("rank_deficient", "max_evaluations", "converged")
    return ClosedLoopEstimate(
        "joint",
        models,
        plant_of_joint(outputs.model, inputs),
        None,
        joint_covariance(models, (by_output, by_feedback)),
        min((m.status for m in models), key=ranking.index),
    )


def _at(model: StateSpaceModel, z: Complex) -> Complex:
    inner = z[:, None, None] * np.eye(model.order) - model.a
    return np.asarray(model.c @ np.linalg.solve(inner, model.b[None]) + model.d)


def _mismatch(data: list[Experiment], references: list[Real], loop: StateSpaceModel) -> Real:
    """Return the share of u that r - F_y y misses, with the best first state of the controller."""
    m, p = loop.d.shape
    problem = InnovationsProblem(
        Layout(loop.order, p, m, True, False),
        [e.output for e in data],
        [r - e.input for e, r in zip(data, references, strict=True)],
        np.eye(m),
        True,
    )
    x = Matrices(loop.a, loop.b, loop.c, loop.d, np.zeros((loop.order, m)))
    left = np.concatenate(problem.errors(x))
    size = np.concatenate([e.input for e in data])
    return np.asarray(np.sqrt(np.sum(left**2, axis=0) / np.sum(size**2, axis=0)))


def _warnings(estimates: dict[str, ClosedLoopEstimate], mismatch: Real) -> list[str]:
    out = []
    for j in np.flatnonzero(mismatch > MISMATCH):
        out.append(
            f"input {j + 1} differs from r - F_y y by {mismatch[j]:.0%} of its rms: the controller is "
            "another one or not linear, or another signal enters; do not trust the indirect method"
        )
    for name, estimate in estimates.items():
        out += [f"{name}: {w}" for model in estimate.models for w in model.warnings]
    return out

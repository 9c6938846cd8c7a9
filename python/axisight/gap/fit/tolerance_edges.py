"""Finds own parameters that the re-fit moved to the edge of their tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from axisight.gap.facts.faults import Finding
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.simulator.brought_inertia import BroughtInertia
from axisight.gap.simulator.own_parameters import nominal_values
from axisight.gap.simulator.tolerances import tolerance_of

# Change, in tolerances, from which a parameter is at the edge. By chance this happens to one machine in 400; more
# likely an unmodelled effect pulls at it.
_EDGE = 3.0
BENT = 0.25
"""Share of the own parameters at the edge from which something unmodelled bends the simulator."""


def parameters_at_edge(
    fitted: FittedModel,
    nominal: Mapping[str, float],
    tolerances: Mapping[str, float],
    brought: Mapping[str, BroughtInertia] = MappingProxyType({}),
) -> tuple[Finding, ...]:
    """Return a finding for each re-fitted parameter that is three tolerances off, or at its bound.

    ``nominal``: values of the robot by name; ``tolerances``: relative standard deviations by quantity or name;
    ``brought``: parameters that take over the inertia of a body which a cause adds, by name.
    """
    out = []
    for name, value in fitted.robot_values.items():
        if name not in nominal:  # parameters without a nominal value have a finding of their own
            continue
        tolerance = tolerance_of(tolerances, name) or 0.0
        change = (value - nominal[name]) / (abs(nominal[name]) or 1.0)
        bound = (None, name) in fitted.ended_at_bound
        if bound or abs(change) >= _EDGE * tolerance:
            message = (
                f"the re-fit ended {100 * change:+.3g} % off the simulator's value, "
                f"{abs(change) / tolerance:.1f} times its tolerance of {100 * tolerance:g} %"
                f"{', at the bound of the fit' if bound else ''}. "
                f"{_reason(brought.get(name), value - nominal[name])}"
            )
            out.append(Finding("parameter_at_edge", "flag", message, field=name))
    return tuple(out)


def _reason(body: BroughtInertia | None, change: float) -> str:
    """Return what a parameter at its edge stands for; ``change`` in its own unit."""
    inertia = None if body is None else body.of(change)
    if body is None or inertia is None:
        return "Check value and tolerance in the robot file. If both are right, something unmodelled acts there"
    return (
        f"That is an inertia of {inertia:.2g} kg m^2 about axis {body.axis}, which the body may have that "
        f"{body.effect} adds: it is fitted as a point. Give it this inertia in the simulator; the parameter itself may "
        "be right"
    )


def bent(fitter: ModelFitter, model: FittedModel) -> float:
    """Return the share of the simulator's own parameters that a model moves to the edge of their tolerance [1].

    Zero if errors add up (inverse dynamics): there, masses that a short log hardly determines reach the edge without
    cause.
    """
    if fitter.adds_up:
        return 0.0
    edge = parameters_at_edge(model, nominal_values(fitter.robot), fitter.tolerances)
    return len(edge) / max(len(model.robot_values), 1)

"""The price of effects that are far too large for the robot [nats].

Two effects that cancel each other fit a part of almost any residual, each with many times the torque of the motor.
Before any data, sizes beyond that torque are improbable: each amplitude has a normal prior about what the simulator
states.
"""

from __future__ import annotations

from axisight.gap.fit.fitted_model import FittedModel, Hypothesis


def price_of_size(fitted: FittedModel) -> float:
    """Return half of the chi-square of the amplitudes of all effects of a model [nats].

    The deviation of the prior is the size from which an effect is far-fetched (`Hypothesis.largest`); amplitudes
    without one pay nothing.
    """
    pairs = zip(fitted.free, fitted.effects, strict=True)
    return sum(_chi_square(one, dict(e.parameters or {})) for one, e in pairs) / 2


def _chi_square(one: Hypothesis, values: dict[str, float]) -> float:
    off = (
        (values[name] - one.stated.get(name, 0.0)) / size
        for name, size in one.largest.items()
        if name in values
    )
    return sum(x * x for x in off)

"""Where causes are judged by inverse dynamics: on the axes that they led."""

from types import SimpleNamespace as Stand
from typing import Any

import numpy as np

from axisight import Effect
from axisight.gap.verdict.validated import _axes_alone


def stage(*errors: float) -> Any:
    """Return mean squared errors of one log by axis."""
    return Stand(per_log=lambda: np.array([errors]))


def alone(*causes: tuple[Effect, int]) -> Any:
    """Return the axes of causes that led an axis (from 0): gaps of 9, 1, 1 fall to 0, 1.1, 0.2."""
    named = tuple(Stand(label=effect.label, axis=effect.axis) for effect, _ in causes)
    search = Stand(
        model=Stand(free=[Stand(effect=effect) for effect, _ in causes]),
        accepted=[(None, Stand(axis=axis)) for _, axis in causes],
    )
    stages = Stand(given=stage(9.0, 1.0, 1.0), after=stage(0.0, 1.1, 0.2))
    reach = Stand(stages=stages, change=stage(9.0, 0.2, 0.8))
    view = Stand(fitter=Stand(adds_up=True))
    return _axes_alone(view, Stand(causes=named), search, reach)


def test_a_heavier_link_is_judged_on_the_axis_that_it_led():
    """Its own axis, the second, hardly feels it, and noise decides there whether the gap falls."""
    found = alone((Effect("link_mass", 2), 0))
    assert found.axes == {0: ("link_mass@2",)}
    assert found.not_carried() is None


def test_friction_is_judged_on_its_own_axis():
    found = alone((Effect("coulomb_friction", 2), 1), (Effect("viscous_friction", 3), 2))
    assert found.axes == {1: ("coulomb_friction@2",), 2: ("viscous_friction@3",)}
    assert found.not_carried() == 1


def test_causes_of_one_axis_are_judged_together():
    found = alone((Effect("coulomb_friction", 3), 2), (Effect("viscous_friction", 3), 2))
    assert found.axes == {2: ("coulomb_friction@3", "viscous_friction@3")}

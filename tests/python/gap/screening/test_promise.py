"""Which candidates are fitted in full."""

import numpy as np

from axisight import Effect
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.screening.promise import promising
from axisight.gap.screening.screening import Start

WORTH = np.array([10.0, 10.0])


def start(name: str, axis: int | None, gain: float, at_home: float | None = None) -> Start:
    falls = None if axis else np.array([gain, 0.0])
    return Start(Hypothesis(Effect(name, axis), ()), {}, gain, falls, at_home=at_home)


def chosen(starts: list[Start]) -> list[str]:
    return [s.option.effect.label for s in promising(starts, WORTH)]


STARTS = [
    start("backlash", 1, 1.3),
    start("torque_offset", 1, 1.2),
    start("viscous_friction", 1, 1.1),
    start("coulomb_friction", 1, 1.0),
    start("payload", None, 0.9),
    start("link_mass", 2, 0.0),
]


def test_where_nothing_promises_a_cause_the_best_are_looked_at():
    assert chosen(STARTS) == ["backlash@1", "torque_offset@1", "viscous_friction@1"]


def test_where_one_promises_a_cause_what_comes_nowhere_near_is_not_fitted():
    starts = [start("motor_inertia", 2, 40.0), *STARTS]
    assert chosen(starts) == ["motor_inertia@2"]


def test_what_gains_elsewhere_takes_no_place_from_what_gains_at_home():
    links = ("link_geometry", "link_com", "link_mass", "joint_zero_offset")
    elsewhere = [start(name, 2, 1000.0 - k, at_home=0.1) for k, name in enumerate(links)]
    laws = ("quadratic_drag", "viscous_friction", "load_dependent_friction")
    at_home = [
        start(name, 2, g, at_home=g) for name, g in zip(laws, (50.0, 49.0, 9.0), strict=True)
    ]
    found = chosen([*elsewhere, *at_home])
    assert set(found) == {f"{name}@2" for name in (*links, *laws[:2])}

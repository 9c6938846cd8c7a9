"""Gains and a torque constant that are off by inverse shares are one torque sensor."""

import pytest

from axisight.effects import Effect
from axisight.gap.controller.torque_sensor import either, with_torque_sensors
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval


def cause(name: str, axis: int, **values: float) -> NamedCause:
    found = {k: Interval(v, v - 0.004, v + 0.004) for k, v in values.items()}
    return NamedCause(name, axis, 0.98, found, dict.fromkeys(values, "1"), "any", 0.98)


def effects(causes: list[NamedCause]) -> list[Effect]:
    return [Effect(c.effect, c.axis, {k: v.value for k, v in c.parameters.items()}) for c in causes]


def gains(axis: int, proportional: float, integral: float) -> NamedCause:
    values = {"relative_proportional": proportional, "relative_integral": integral}
    return cause("controller_gain", axis, **values)


def test_three_numbers_that_agree_are_one_cause():
    other = cause("backlash", 1, half_width_rad=1e-4)
    constant = cause("torque_constant", 2, relative_error=1 / 1.08 - 1)
    pair = [gains(2, 0.08, 0.081), other, constant]
    found, acting = with_torque_sensors(pair, effects(pair))
    assert [(c.effect, c.axis) for c in found] == [("torque_sensor_gain", 2), ("backlash", 1)]
    assert [e.label for e in acting] == ["torque_sensor_gain@2", "backlash@1"]
    assert found[0].parameters["relative_error"].value == 0.08
    assert acting[0].values()[0] == 0.08


@pytest.mark.parametrize(
    ("proportional", "integral", "open_"),
    [
        (-0.032, -0.0321, True),
        # Not quite the same; and so large that a torque constant would show beside them.
        (-0.032, -0.034, False),
        (0.08, 0.08, False),
    ],
)
def test_small_gains_that_agree_may_be_either(proportional, integral, open_):
    alone = [gains(2, proportional, integral), cause("backlash", 1, half_width_rad=1e-4)]
    found = either(alone, 0.045)
    assert found == ((("controller_gain@2", "torque_sensor_gain@2"),) if open_ else ())
    assert either(alone, 0.0) == ()


def test_gains_that_were_fitted_to_positions_are_no_sensors():
    """Of a cascade, whose gain of position is fitted beside both."""
    both = {"relative_proportional": -0.032, "relative_integral": -0.0321}
    fitted = cause("controller_gain", 2, **both, relative_position=0.001)
    assert either([fitted], 0.045) == ()
    assert either([gains(2, *both.values())], 0.045) != ()


@pytest.mark.parametrize(
    ("controller", "error", "axis"),
    [
        # Other gains than one another, no inverse, the same sign, another axis.
        (gains(2, 0.08, 0.2), 1 / 1.08 - 1, 2),
        (gains(2, 0.08, 0.08), -0.03, 2),
        (gains(2, 0.08, 0.08), 0.08, 2),
        (gains(1, 0.08, 0.08), 1 / 1.08 - 1, 2),
    ],
)
def test_others_stay_two(controller, error, axis):
    pair = [controller, cause("torque_constant", axis, relative_error=error)]
    found, acting = with_torque_sensors(pair, effects(pair))
    assert list(found) == pair and list(acting) == effects(pair)

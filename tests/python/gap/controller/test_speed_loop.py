"""Controllers of positions along references of speed, as the speed loops that they are."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, Robot, diagnose
from axisight.gap.controller.speed_loop import as_speed_loop
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

LOOP = bare_axis()
DELAY = Effect("input_delay", 1, {"delay_s": 1e-3})


def positions(extra: str = "", tolerances: str = "") -> Robot:
    """The axis with its law written as one of positions."""
    law = 'kind = "pi_velocity"\nkp = [7.0]\nki = [180.0]'
    assert law in LOOP.toml
    new = f'kind = "pd_position"\nkp = [180.0]\nkd = [7.0]\n{extra}'
    text = LOOP.toml.replace(law, new) + tolerances
    return Robot.from_toml(text).with_effects([])


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    return logs_of(scattered(LOOP, 4), [DELAY], PLAN | HELD)


def test_the_law_and_all_else_stay(logs: list[Log]):
    changed = positions().with_parameters(
        {"axis1.stiffness": 1.5e6}
        | {k: v for k, v in LOOP.parameters().items() if k != "axis1.stiffness"}
    )
    loop = as_speed_loop(changed.with_effects([DELAY]), logs)
    assert loop.controller_kind == "pi_velocity"
    assert loop.controller_gains == LOOP.controller_gains
    assert loop.parameters() == changed.parameters()
    assert loop.effects == (DELAY,)


def test_targets_that_are_the_sum_of_their_rates_are_none_of_their_own(logs: list[Log]):
    """Any offset is where an arm begins; a drift of a thousandth of the travel is another motion."""

    def told(drift: float) -> list[Log]:
        out = []
        for log in logs:
            rates = log.velocity_ref_rad_s
            assert rates is not None
            target = 0.3 + (np.cumsum(rates, axis=0) - rates) * log.sample_time_s
            out.append(replace(log, position_ref_rad=target * (1 + drift)))
        return out

    assert as_speed_loop(positions(), told(0.0)).controller_kind == "pi_velocity"
    assert as_speed_loop(positions(), told(1e-3)).controller_kind == "pd_position"


@pytest.mark.parametrize(
    ("extra", "tolerances"),
    [
        ("gravity_compensation = true\n", ""),
        ("velocity_feedforward = false\n", ""),
        ("continuous = true\n", ""),
        ("", "\n[tolerances]\nkp = 0.1\n"),
    ],
)
def test_another_law_stays_what_it_is(logs: list[Log], extra: str, tolerances: str):
    robot = positions(extra, tolerances)
    assert as_speed_loop(robot, logs) is robot


def test_without_references_it_is_a_loop_whose_references_may_be_recovered(logs: list[Log]):
    bare = [replace(log, velocity_ref_rad_s=None) for log in logs]
    assert as_speed_loop(positions(), bare).controller_kind == "pi_velocity"
    targets = [replace(x, position_ref_rad=b.position_rad) for x, b in zip(bare, logs, strict=True)]
    assert as_speed_loop(positions(), targets).controller_kind == "pd_position"


def test_with_other_gains_it_stays_what_it_is(logs: list[Log]):
    robot = positions()
    gains = Effect("controller_gain", 1, {"relative_proportional": 0.3, "relative_integral": -0.2})
    other = logs_of(scattered(LOOP, 4), [gains], PLAN)
    assert as_speed_loop(robot, other) is robot
    assert as_speed_loop(LOOP, logs) is LOOP


def test_its_logs_are_diagnosed_as_those_of_the_speed_loop(logs: list[Log]):
    """The same law has the same verdict; and recovery from known truth."""
    found, same = (
        diagnose(robot=robot, estimation=logs[:3], validation=logs[3:])
        for robot in (positions(), LOOP)
    )
    assert found.mode == same.mode == "closed_loop"
    assert found.causes == same.causes
    assert found.gap == same.gap
    assert found.causes[0].effect == "input_delay"
    assert found.causes[0].parameters["delay_s"].value == pytest.approx(1e-3, rel=0.05)

"""Delays and lags of a drive: which one it is, and that the answer of a loop to noise bends none of them."""

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.ranking import drive_lags
from axisight.gap.views.closed_loop import ClosedLoopView
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

DELAY = Effect("input_delay", 1, {"delay_s": 1.3e-3})
LIKE_A_DELAY = Effect("current_loop", 1, {"time_constant_s": 0.9e-3, "damping": 0.8})
LIVELY = Effect("current_loop", 1, {"time_constant_s": 0.9e-3, "damping": 0.5})
LAG = Effect("actuator_bandwidth", 1, {"time_constant_s": 1.3e-3})


@pytest.mark.parametrize("true", [DELAY, LIKE_A_DELAY, LIVELY, LAG], ids=lambda e: e.name)
def test_a_lag_is_named_and_measured(true: Effect):
    """Recovery: noise of the sensors goes round both loops, and logs tell their answers to it apart.

    A hundredth: standard errors here are a few thousandths, and a bias by noise was a tenth.
    """
    machine = scattered(bare_axis(), 4)
    found = diagnose(
        robot=bare_axis(),
        estimation=logs_of(machine, [true], PLAN),
        validation=logs_of(machine, [true], HELD),
        settings=Settings(bootstrap=20),
    )
    assert found.verdict == "explained", found.headline
    (cause,) = found.causes
    assert cause.effect == true.name
    for name, value in (true.parameters or {}).items():
        assert cause.parameters[name].value == pytest.approx(value, rel=0.01)


@pytest.fixture(scope="module")
def view() -> ClosedLoopView:
    return ClosedLoopView(
        bare_axis(), logs_of(scattered(bare_axis(), 4), [DELAY], PLAN), Settings()
    )


def test_a_current_loop_begins_as_the_delay_it_is_like(view: ClosedLoopView):
    """It leaves hardly more than the delay, which is one up to the third power of frequency."""
    delay = view.fitter.fit([Hypothesis(DELAY, ("delay_s",))], view.fitter.fit([]))
    trial = SimpleNamespace(hypothesis=delay.free[-1], fitted=delay)
    loop = Hypothesis(
        Effect("current_loop", 1, {"time_constant_s": 1e-4, "damping": 0.3}),
        ("time_constant_s", "damping"),
    )
    alone, begun = drive_lags.ended(view.fitter, [trial], [loop])
    assert [e.effects[-1].name for e in (alone, begun)] == ["input_delay", "current_loop"]
    time_constant_s, damping = begun.effects[-1].values()
    assert damping == pytest.approx(np.sqrt(0.5), abs=0.05)
    assert 2 * damping * time_constant_s == pytest.approx(1.3e-3, rel=0.02)
    assert alone.total < begun.total < 1.5 * alone.total
    # Where none is offered none is made.
    assert len(drive_lags.ended(view.fitter, [trial], [])) == 1


def ranked(effect: Effect, score: float):
    return SimpleNamespace(
        trial=SimpleNamespace(hypothesis=SimpleNamespace(effect=effect)), score=score
    )


def test_only_lags_in_reach_of_one_that_leads_its_own_axis_are_fitted_on():
    friction = ranked(Effect("coulomb_friction", 1), 0.99)
    late_sensor = ranked(Effect("sensor_delay", 1), 0.99)
    delay, loop, slow = ranked(DELAY, 0.99), ranked(LIVELY, 0.97), ranked(LAG, 0.9)

    def beside(*rivals, axis=0):
        standing = SimpleNamespace(
            axis=axis, best=rivals[0], ranked=rivals, in_reach=lambda one: one.score > 0.95
        )
        return drive_lags.lags_beside(standing)

    assert beside(delay, friction, late_sensor, loop, slow) == [delay.trial, loop.trial]
    assert beside(friction, delay, loop) == []
    assert beside(delay, loop, axis=1) == []

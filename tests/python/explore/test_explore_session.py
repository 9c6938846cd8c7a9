"""The explorer without its page: its figures are those of a diagnosis."""

import time
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, diagnose, load_robot
from axisight.cli.demo import write_demo_case
from axisight.effects import effect_info, effect_table
from axisight.effects.stated import DEMONSTRATION
from axisight.errors import InputError
from axisight.explore.choices import places, slider_range, usable, usual
from axisight.explore.session import AS_GIVEN, Session, Version
from axisight.logs import read_case


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return read_case(write_demo_case(tmp_path_factory.mktemp("demo") / "case"))


@pytest.fixture(scope="module")
def session(case):
    return Session(case.name, load_robot(case.robot_path), case.estimation, case.validation)


@pytest.fixture(scope="module")
def found(case):
    return diagnose(case)


def test_gap_as_given_is_that_of_a_diagnosis(session, found):
    np.testing.assert_allclose(session.held_gap(), found.gap.before_per_axis, rtol=1e-12)


def test_gap_with_what_was_found_is_that_of_a_diagnosis(session, found):
    causes = [c.as_effect() for c in found.causes]
    refit = session.known_parameters({n: p.value for n, p in found.refit.items()})
    after = session.held_gap(Version.of(causes, refit))
    np.testing.assert_allclose(after, found.gap.after_per_axis, rtol=1e-6)
    assert after[1] < 0.5 * session.held_gap()[1]


def test_one_log_at_a_time_is_what_all_are_together(session):
    held = [i for i, role in enumerate(session.roles) if role == "validation"]
    squares = np.mean([session.see(i).gap ** 2 for i in held], axis=0)
    np.testing.assert_allclose(np.sqrt(squares), session.held_gap(), rtol=1e-12)


def test_bands_sum_to_the_gap(session):
    seen = session.see(0)
    assert seen.bands.shape == (3, len(session.bands))
    total = np.sqrt(np.mean(seen.residual**2, axis=0)) / session.logs[0].torque_nm.std(axis=0)
    np.testing.assert_allclose(np.sqrt((seen.bands**2).sum(axis=1)), total, rtol=1e-9)


def test_missing_cause_lowers_the_gap_of_its_axis(session):
    before, after = (session.see(0, v) for v in (AS_GIVEN, Version.of([DEMONSTRATION])))
    assert after.gap[1] < 0.5 * before.gap[1]
    assert after.position_rad is not None
    np.testing.assert_array_equal(after.simulated - after.measured, after.residual)
    # The machine is the simulator with this cause but for scatter: it moves as the log does.
    off = [np.std(s.position_rad - session.logs[0].position_rad, axis=0) for s in (before, after)]
    assert off[1][1] < 0.5 * off[0][1]


def test_same_again_is_not_simulated_again(session, monkeypatch):
    version = Version.of([Effect("torque_offset", 1, {"offset_nm": 0.123})])
    first = session.see(0, version)
    monkeypatch.setattr(session.view, "run", None)
    np.testing.assert_array_equal(session.see(0, version).simulated, first.simulated)


def test_an_axis_that_is_not_judged_has_no_gap_and_is_not_shown_first(case):
    """The current of axis 2, which lacks a cause, is dead."""

    def dead(log):
        torque = log.torque_nm.copy()
        torque[:, 1] = 0.0
        return replace(log, torque_nm=torque)

    logs = [[dead(log) for log in each] for each in (case.estimation, case.validation)]
    session = Session(case.name, load_robot(case.robot_path), *logs)
    assert session.view.silent == (1,)
    gap = session.see(0).gap
    assert np.isnan(gap[1]) and np.isfinite(np.delete(gap, 1)).all()
    assert session.largest_gap()[1] != 1


def test_unstable_simulator_is_said(session):
    late = Effect("input_delay", 2, {"delay_s": 0.05})
    seen = session.see(0, Version.of([late]))
    assert seen.broken_at_s is not None and 0 < seen.broken_at_s < 5
    assert np.isnan(seen.gap).any() and np.isnan(seen.bands).all()


def test_impossible_causes_are_refused(session):
    with pytest.raises(InputError, match="axis"):
        session.see(0, Version.of([Effect("torque_offset", 9, {"offset_nm": 1.0})]))
    with pytest.raises(InputError, match="no_such"):
        session.known_parameters({"no_such.mass": 0.1})


def test_values_beyond_the_table_are_cut(session):
    (effect,) = Version.of([Effect("input_delay", 1, {"delay_s": 7.0})]).effects
    assert effect.parameters == {"delay_s": effect_info("input_delay").parameters[0].upper}


@pytest.mark.parametrize("name", effect_table())
def test_sliders_hold_usual_values_within_the_bounds(name):
    info = effect_info(name)
    effect = usual(name, places(info, 3)[0])
    assert effect.acts
    for p, value in zip(info.parameters, effect.values(), strict=True):
        low, high = slider_range(p, value)
        assert p.lower <= low < high <= p.upper
        assert low <= value <= high or value == p.neutral


def test_effects_offered_are_those_the_robot_takes(session):
    offered = usable(session.robot)
    assert offered["coulomb_friction"] == [1, 2, 3]
    assert offered["payload"] == [None]
    assert (2, 3) in offered["axis_coupling"]


def test_effects_that_change_no_computed_torque_are_not_offered_by_inverse_dynamics(session):
    offered = usable(session.robot, inverse_dynamics=True)
    assert not [name for name in offered if not effect_info(name).inverse_dynamics]
    assert "sensor_delay" not in offered and "sensor_delay" in usable(session.robot)
    assert "coulomb_friction" in offered


def test_it_opens_where_the_gap_is_largest(session):
    log, axis = session.largest_gap()
    above = session.held_given**2 - session.held_floor**2
    assert axis == np.argmax(above) == 1
    held = [i for i, role in enumerate(session.roles) if role == "validation"]
    assert log == max(held, key=lambda i: session.see(i).gap[axis])


def test_slider_is_answered_in_time(session):
    took = []
    for i in range(10):
        version = Version.of([Effect("coulomb_friction", 2, {"coulomb_nm": 0.01 * i})])
        start = time.perf_counter()
        session.see(0, version)
        took.append(time.perf_counter() - start)
    # 5 s of three axes; generous, for machines that are busy. `benches/explore.py` measures.
    assert np.median(took) < 0.5


def test_floor_is_that_of_a_diagnosis(session, found):
    np.testing.assert_allclose(session.held_floor, found.gap.floor_per_axis, rtol=1e-12)

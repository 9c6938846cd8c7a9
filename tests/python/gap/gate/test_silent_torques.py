"""A torque that carries nothing sets its axis aside; the others are judged."""

import functools
from collections.abc import Callable
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from axisight import Diagnosis, Log, Settings, diagnose
from axisight.gap import check_inputs, verdict_schema
from axisight.gap.fit.time_limit import TimeLimit
from axisight.gap.gate import silent_axes
from axisight.gap.intake.prepared_logs import behind_gate
from axisight.gap.search.search import search
from rigid_arm import arm, log_of
from spoiled_cases import Case, clean_arm, each, every, loop_case

Array = np.ndarray
ROBOT = arm()


def zeros(x: Array) -> Array:
    return np.zeros_like(x)


def held(x: Array) -> Array:
    return np.full_like(x, 5.0)


def few_counts(x: Array) -> Array:
    return 3e-3 * np.round(np.random.default_rng(len(x)).normal(0.0, 0.7, len(x)))


def findings(case: Case) -> set[tuple[str, str, int | None]]:
    found = check_inputs(case.robot, case.estimation, case.validation)
    return {(f.name, f.severity, f.axis) for f in found}


@pytest.mark.parametrize(
    ("change", "name"),
    [(zeros, "channel_constant"), (held, "channel_constant"), (few_counts, "channel_dead")],
)
def test_a_dead_torque_is_flagged_by_name(change: Callable[[Array], Array], name: str) -> None:
    case = every(clean_arm(), "torque_nm", 1, change)
    assert silent_axes(case.robot, case.logs) == (1,)
    assert (name, "flag", 2) in findings(case)
    assert not any(severity == "refuse" for _, severity, _ in findings(case))


def test_other_faults_show_beside_a_dead_torque() -> None:
    case = every(every(clean_arm(), "torque_nm", 1, zeros), "torque_nm", 2, np.negative)
    refused = {(name, axis) for name, severity, axis in findings(case) if severity == "refuse"}
    assert refused == {("sign_flipped", 3)}


def test_a_torque_that_is_constant_in_one_log_refuses_that_log() -> None:
    case = clean_arm()
    torque = case.estimation[0].torque_nm.copy()
    torque[:, 1] = 0.0
    spoiled = replace(case.estimation[0], torque_nm=torque)
    case = replace(case, estimation=(spoiled, *case.estimation[1:]))
    assert ("channel_constant", "refuse", 2) in findings(case)


def test_logs_without_any_torque_are_refused() -> None:
    case = each(clean_arm(), lambda log: replace(log, torque_nm=np.zeros_like(log.torque_nm)))
    assert silent_axes(case.robot, case.logs) == ()
    assert ("channel_constant", "refuse", 1) in findings(case)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_torque_in_another_unit_is_not_dead(factor: float) -> None:
    case = every(clean_arm(), "torque_nm", 1, lambda x: factor * x)
    assert silent_axes(case.robot, case.logs) == ()


def test_closed_loop_needs_all_torques() -> None:
    """Without one of them the others are compared by inverse dynamics."""
    case = every(loop_case(), "torque_nm", 2, zeros)
    found = behind_gate(case.robot, case.estimation, case.validation, ())
    assert found.silent == (2,)
    assert found.view(Settings(threads=1)).mode == "inverse_dynamics"


def parked(case: Case, axis: int) -> Case:
    """Return the case with an axis (from 0) that rests, without torque."""
    for field in ("position_rad", "velocity_ref_rad_s", "torque_nm"):
        if getattr(case.logs[0], field) is not None:
            case = every(case, field, axis, zeros)
    return case


def test_a_parked_axis_is_not_dead() -> None:
    """It is judged in closed loop with the others."""
    case = parked(clean_arm(), 1)
    assert silent_axes(case.robot, case.logs) == ()
    assert ("channel_constant", "flag", 2) in findings(case)
    case = parked(loop_case(), 2)
    found = behind_gate(case.robot, case.estimation, case.validation, ())
    assert found.silent == ()
    assert found.view(Settings(threads=1)).mode == "closed_loop"


def test_a_dead_axis_may_park_in_some_logs() -> None:
    case = every(clean_arm(), "torque_nm", 1, zeros)
    case = replace(case, validation=parked(case, 1).validation)
    assert silent_axes(case.robot, case.logs) == (1,)


def test_a_search_knows_which_axes_are_not_judged() -> None:
    case, settings = every(clean_arm(), "torque_nm", 1, zeros), Settings(threads=1)
    view = behind_gate(case.robot, case.estimation, case.validation, ()).view(settings)
    at_once = TimeLimit(1e-9)
    found = search(
        view.fitter, view.candidates, view.floor.expected, settings, lambda *_: None, at_once
    )
    assert found.layout.silent == (1,)


def test_a_log_that_is_used_all_the_same_has_a_say() -> None:
    """The gate and the comparison then set aside the same axes."""
    clean = clean_arm()
    case = every(clean, "torque_nm", 1, zeros)
    position = clean.estimation[0].position_rad.copy()
    position[500, 0] += 1.0
    case = replace(
        case, estimation=(replace(clean.estimation[0], position_rad=position), *case.estimation[1:])
    )
    found = check_inputs(case.robot, case.estimation, case.validation, despite=["position_spike"])
    assert silent_axes(case.robot, case.logs) == ()
    assert not any("not judged" in f.message for f in found)


@functools.cache
def diagnosed() -> Diagnosis:
    """Return the diagnosis of an arm with friction on axes 1 and 3, and a dead current on axis 2."""

    def log(seed: int) -> Log:
        own = log_of(ROBOT, seed, [8, 11, 7, 0, 0, 0], [0.0] * 6, seconds=20.0)
        torque = own.torque_nm.copy()
        torque[:, 1] = few_counts(torque[:, 1])
        return replace(own, torque_nm=torque)

    return diagnose(ROBOT, [log(0), log(1), log(2)], validation=[log(3)])


def test_the_axis_is_not_judged_and_the_others_are() -> None:
    found = diagnosed()
    assert found.verdict == "explained"
    assert {c.label for c in found.causes} == {"coulomb_friction@1", "coulomb_friction@3"}
    assert [a.verdict for a in found.axes][:3] == ["explained", "not_judged", "explained"]
    assert "Axis 2 is not judged: its torque carries nothing." in found.headline
    assert all(x.axis != 2 for x in found.detection_limits)
    assert not any(f.name == "gap_beyond_torque" for f in found.findings)


def test_its_gap_is_no_number_and_that_of_the_arm_is_of_the_others() -> None:
    found = diagnosed()
    after = np.delete(found.gap.after_per_axis, 1)
    assert np.isnan(found.gap.after_per_axis[1]) and np.isfinite(after).all()
    assert found.gap.after == pytest.approx(np.sqrt(np.mean(after**2)))
    verdict = found.to_verdict()
    jsonschema.validate(verdict, verdict_schema())
    assert verdict["axes"][1]["gap"]["after"] is None

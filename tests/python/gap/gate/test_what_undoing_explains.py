"""By inverse dynamics a mistake is refused only where the logs are explained better without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from axisight import Log, Robot
from axisight.gap import check_inputs
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import motion
from rigid_arm import arm, log_of
from spoiled_cases import Case, clean_arm, each, every


def refusals(case: Case) -> list[tuple[str, int | None]]:
    found = check_inputs(case.robot, case.estimation, case.validation)
    return [(f.name, f.axis) for f in found if f.severity == "refuse"]


def dead(log: Log, axis: int, noise_nm: float) -> Log:
    """Return the log with a torque of a few counts about zero that follow no motion, axis from 0."""
    rng = np.random.default_rng(log.n_samples + axis)
    torque = log.torque_nm.copy()
    torque[:, axis] = noise_nm * np.round(rng.normal(0.0, 0.7, log.n_samples))
    return replace(log, torque_nm=torque)


def one_way(robot: Robot, seed: int, *, down: bool) -> Log:
    """Return a log on which axis 2 alone moves, in one direction, with the torque of a robot."""
    log = log_of(robot, seed, seconds=20.0)
    ends = (-0.2 + 0.05 * seed, 1.2) if down else (1.2, -0.2 + 0.05 * seed)
    position = np.tile(log.position_rad[0], (log.n_samples, 1))
    position[:, 1] = np.linspace(*ends, log.n_samples)
    moved = replace(log, position_rad=position)
    noise = np.random.default_rng(seed).normal(0.0, 0.1, position.shape)
    return replace(moved, torque_nm=predict(robot, motion(moved, 10.0)) + noise)


def case_of(log: Callable[[int], Log]) -> Case:
    return Case(arm(), (log(0), log(1)), (log(2),))


def test_a_dead_current_has_no_wrong_sign() -> None:
    """The work that the bodies would need makes friction seem to drive; no sign of the torque explains it."""
    case = case_of(lambda seed: dead(one_way(arm(), seed, down=False), 1, 3e-3))
    assert refusals(case) == []


def test_a_load_that_is_only_lowered_has_no_wrong_sign() -> None:
    """Masses three times as large as the simulator's drive the axis on the way down."""
    own = arm().parameters()
    heavy = arm().with_parameters({n: 3 * v for n, v in own.items() if n.endswith(".mass")})
    assert refusals(case_of(lambda seed: one_way(heavy, seed, down=True))) == []


def test_a_wrong_sign_shows_on_a_motion_in_one_direction() -> None:
    def turned(seed: int) -> Log:
        log = one_way(arm(), seed, down=True)
        return replace(log, torque_nm=log.torque_nm * np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0]))

    assert set(refusals(case_of(turned))) == {("sign_flipped", 2)}


def test_loads_in_place_of_drive_torques_are_one_fault() -> None:
    """Torques of joint sensors often count as the load on the joint: all signs are turned."""
    case = every(clean_arm(), "torque_nm", None, np.negative)
    found = check_inputs(case.robot, case.estimation, case.validation)
    refused = [f for f in found if f.severity == "refuse"]
    assert {(f.name, f.axis, f.field) for f in refused} == {("sign_flipped", None, "torque_cmd")}
    assert "all torques" in refused[0].message


def test_loads_are_named_beside_axes_that_say_nothing() -> None:
    case = every(clean_arm(), "torque_nm", None, np.negative)
    case = each(case, lambda log: dead(dead(log, 3, 0.3), 5, 0.3))
    assert set(refusals(case)) == {("sign_flipped", None)}

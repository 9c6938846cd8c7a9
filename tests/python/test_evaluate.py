"""Models at given parameters: what a fit would begin with."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, InputError, Robot, _core, load_robot
from axisight.effects import core_effects
from axisight.fitting.simulation_error import (
    FitOptions,
    Parameter,
    Weighting,
    core_spec,
    effect_parameter,
    robot_parameter,
)
from axisight.simulation import simulate

EFFECTS = [Effect("coulomb_friction", 1, {"coulomb_nm": 0.3, "smoothing_rad_s": 0.05})]


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("two_mass_axis").with_effects([])


@pytest.fixture(scope="module")
def record(robot: Robot) -> tuple[np.ndarray, np.ndarray, None, None]:
    time = np.arange(1500) * robot.sample_time_s
    reference = (5.0 * np.sin(2 * np.pi * 3.0 * time))[:, None]
    run = simulate(robot, reference, noise_seed=1)
    return reference, run["torque_cmd_nm"].values, None, None, 0


def parameters(robot: Robot) -> list[Parameter]:
    names = [n for n, _ in robot.core.parameters() if n.endswith(("stiffness", "motor_inertia"))]
    own = [robot_parameter(robot, n, relative_tolerance=0.1) for n in names]
    return [*own, effect_parameter(EFFECTS, 0, "coulomb_nm")]


def test_simulation_is_that_of_a_fit_without_steps(robot, record):
    chosen = parameters(robot)
    arguments = (
        robot.core, core_effects(EFFECTS), [core_spec(p, EFFECTS) for p in chosen], [record],
        Weighting.flat(1).core(),
    )  # fmt: skip
    at = _core.evaluate_simulation(*arguments, FitOptions(block_s=0.1))
    fit = _core.fit_simulation(*arguments, FitOptions(block_s=0.1, max_iterations=0))
    assert fit.status == "max_iterations" and fit.evaluations == 1
    assert (at.free, at.at_bound, at.blocks) == (fit.free, fit.at_bound, fit.blocks)
    assert at.loss == fit.loss
    for name in ("theta", "residual", "jacobian", "block_matrix", "block_gradient", "block_loss"):
        np.testing.assert_array_equal(getattr(at, name), getattr(fit, name))


def test_jacobian_is_the_slope_of_the_residual(robot, record):
    chosen = parameters(robot)

    def at(moved: list[Parameter]) -> _core.Linearization:
        specs = [core_spec(p, EFFECTS) for p in moved]
        effects = core_effects(EFFECTS)
        flat = Weighting.flat(1).core()
        return _core.evaluate_simulation(robot.core, effects, specs, [record], flat, FitOptions())

    jacobian = at(chosen).jacobian
    step = 1e-5 * chosen[0].initial
    ends = [
        at([replace(chosen[0], initial=chosen[0].initial + s), *chosen[1:]]).residual
        for s in (step, -step)
    ]
    slope = (ends[0] - ends[1]) / (2 * step)
    # Truncation of central differences: 1e-10 of third derivatives; friction is smoothed.
    np.testing.assert_allclose(jacobian[0], slope, atol=1e-4 * np.abs(slope).max())


def weighted(robot: Robot, record, weighting: Weighting) -> _core.Linearization:
    chosen = parameters(robot)
    return _core.evaluate_simulation(
        robot.core, core_effects(EFFECTS), [core_spec(p, EFFECTS) for p in chosen], [record],
        weighting.core(), FitOptions(block_s=0.1),
    )  # fmt: skip


# A loop's: low where the torque is large; 1500 is no multiple of the decimation.
LOOP = Weighting(np.array([0.0, 20.0, 80.0]), np.array([[0.5, 2.0, 0.1]]), decimation=7)


def test_certainty_is_a_factor_on_the_weighted_error_and_its_slopes(robot, record):
    certainty = np.linspace(0.0, 1.0, 1500)[:, None]
    whole = weighted(robot, record, LOOP)
    part = weighted(robot, (*record[:2], certainty, None, 0), LOOP)
    kept = certainty[: 1500 // 7 * 7 : 7, 0]
    np.testing.assert_array_equal(part.residual, whole.residual * kept)
    np.testing.assert_array_equal(part.jacobian, whole.jacobian * kept)


def test_certainty_is_a_factor_on_the_weighted_error_of_a_predicted_torque(robot):
    moved = np.zeros((1500, 1))
    noise = np.random.default_rng(0).normal(size=(1500, 1))
    certainty = np.linspace(0.0, 1.0, 1500)[:, None]
    whole, part = (
        _core.evaluate_inverse_dynamics(
            robot.core, [], [], [(moved, moved, moved, noise, factor)], LOOP.core(), FitOptions()
        ).residual
        for factor in (np.ones_like(certainty), certainty)
    )
    np.testing.assert_array_equal(part, whole * certainty[: 1500 // 7 * 7 : 7, 0])


@pytest.mark.parametrize(
    "certainty", [np.full((1500, 1), 1.1), np.full((1500, 1), np.nan), np.ones((1499, 1))]
)
def test_what_is_no_certainty_is_refused(robot, record, certainty):
    with pytest.raises(InputError, match="certainty: expected"):
        weighted(robot, (*record[:2], certainty, None, 0), LOOP)


@pytest.mark.parametrize("weighting", [LOOP, replace(LOOP, decimation=1)])
def test_weighting_of_a_signal_is_that_of_the_core(robot, record, weighting):
    moved = np.zeros((1500, 1))
    noise = np.random.default_rng(0).normal(size=(1500, 1)).cumsum(axis=0)
    core = _core.evaluate_inverse_dynamics(
        robot.core, [], [], [(moved, moved, moved, noise, moved + 1)],
        weighting.core(), FitOptions(),
    )  # fmt: skip
    flat = _core.evaluate_inverse_dynamics(
        robot.core, [], [], [(moved, moved, moved, noise, moved + 1)],
        Weighting.flat(1).core(), FitOptions(),
    )  # fmt: skip
    ours = weighting.of(flat.residual[:, None], robot.sample_time_s)[:, 0]
    # Rounding of two transforms of 3000 points.
    np.testing.assert_allclose(ours, core.residual, atol=1e-11 * np.abs(ours).max())


def test_torque_of_a_motion_is_predicted(robot):
    rng = np.random.default_rng(0)
    moved = [np.ascontiguousarray(rng.normal(size=(300, 1))) for _ in range(3)]
    still = np.zeros((300, 1))
    arguments = (robot.core, [], [])
    flat = Weighting.flat(1).core()
    torque = _core.evaluate_inverse_dynamics(
        *arguments, [(*moved, still, still + 1)], flat, FitOptions()
    ).residual
    # What is predicted, measured: nothing is left.
    exact = _core.evaluate_inverse_dynamics(
        *arguments, [(*moved, torque[:, None], still + 1)], flat, FitOptions()
    )
    assert np.abs(torque).max() > 1e-3
    np.testing.assert_allclose(exact.residual, 0.0, atol=1e-12 * np.abs(torque).max())
    assert exact.jacobian.size == 0 and exact.free == []


def test_advice_is_for_searches_that_did_not_arrive():
    assert dict(_core.status_advice()).keys() == {"max_iterations", "stalled"}

"""Models at given parameters: what a fit would begin with."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, InputError, Robot, _core, load_robot
from axisight.effects import core_effects
from axisight.fitting import FitOptions, Parameter, Weighting, effect_parameter, robot_parameter
from axisight.fitting.parameters import core_spec
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
    logs = _core.SimulatedLogs(robot.core, [record], Weighting.flat(1).core(), block_s=0.1)
    arguments = core_effects(EFFECTS), [core_spec(p, EFFECTS) for p in chosen]
    at = logs.evaluate(*arguments, FitOptions())
    fit = logs.fit(*arguments, FitOptions(max_iterations=0))
    assert fit.status == "max_iterations" and fit.evaluations == 1
    assert (at.free, at.at_bound, at.blocks) == (fit.free, fit.at_bound, fit.blocks)
    assert at.loss == fit.loss
    for name in ("theta", "residual", "jacobian", "block_matrix", "block_gradient", "block_loss"):
        np.testing.assert_array_equal(getattr(at, name), getattr(fit, name))


def test_jacobian_is_the_slope_of_the_residual(robot, record):
    chosen = parameters(robot)
    logs = _core.SimulatedLogs(robot.core, [record], Weighting.flat(1).core())

    def at(moved: list[Parameter]) -> _core.Linearization:
        specs = [core_spec(p, EFFECTS) for p in moved]
        return logs.evaluate(core_effects(EFFECTS), specs, FitOptions())

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
    logs = _core.SimulatedLogs(robot.core, [record], weighting.core(), block_s=0.1)
    specs = [core_spec(p, EFFECTS) for p in chosen]
    return logs.evaluate(core_effects(EFFECTS), specs, FitOptions())


def predicted(robot: Robot, motion, weighting: Weighting) -> _core.Linearization:
    motions = _core.MeasuredMotions(robot.core, [motion], weighting.core())
    return motions.evaluate([], [], FitOptions())


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
        predicted(robot, (moved, moved, moved, noise, factor), LOOP).residual
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
    motion = (moved, moved, moved, noise, moved + 1)
    core, flat = (predicted(robot, motion, w) for w in (weighting, Weighting.flat(1)))
    ours = weighting.of(flat.residual[:, None], robot.sample_time_s)[:, 0]
    # Rounding of two transforms of 3000 points.
    np.testing.assert_allclose(ours, core.residual, atol=1e-11 * np.abs(ours).max())


def test_torque_of_a_motion_is_predicted(robot):
    rng = np.random.default_rng(0)
    moved = [np.ascontiguousarray(rng.normal(size=(300, 1))) for _ in range(3)]
    still = np.zeros((300, 1))
    flat = Weighting.flat(1)
    torque = predicted(robot, (*moved, still, still + 1), flat).residual
    # What is predicted, measured: nothing is left.
    exact = predicted(robot, (*moved, torque[:, None], still + 1), flat)
    assert np.abs(torque).max() > 1e-3
    np.testing.assert_allclose(exact.residual, 0.0, atol=1e-12 * np.abs(torque).max())
    assert exact.jacobian.size == 0 and exact.free == []


@pytest.fixture(scope="module")
def three(robot: Robot, record) -> tuple[list, _core.SimulatedLogs]:
    """Logs of three sizes, as they are and as the core keeps them."""
    certainty = np.linspace(0.2, 1.0, 1500)[:, None]
    records = [(record[0] * size, record[1] * size, certainty, None, 0) for size in (1, 0.5, 2)]
    return records, _core.SimulatedLogs(robot.core, records, LOOP.core())


def same(one: _core.SimulatedLogs, other: _core.SimulatedLogs, robot: Robot) -> None:
    specs = [core_spec(p, EFFECTS) for p in parameters(robot)]
    one_at, other_at = (
        x.evaluate(core_effects(EFFECTS), specs, FitOptions()) for x in (one, other)
    )
    np.testing.assert_array_equal(one_at.residual, other_at.residual)
    np.testing.assert_array_equal(one_at.jacobian, other_at.jacobian)


def test_some_of_the_logs_are_those_made_ready_alone(robot, three):
    records, logs = three
    alone = _core.SimulatedLogs(robot.core, [records[2], records[0]], LOOP.core())
    same(logs.part([2, 0]), alone, robot)
    with pytest.raises(InputError, match="logs: expected numbers below 3, got 3"):
        logs.part([0, 3])
    with pytest.raises(InputError, match="logs: expected at least one, got none"):
        logs.part([])


def test_beginnings_of_logs_are_those_made_ready_cut(robot, three):
    records, logs = three
    sizes = [800, 9, 1500]
    cut = [(r[:n], t[:n], c[:n], *at) for (r, t, c, *at), n in zip(records, sizes, strict=True)]
    same(logs.first(sizes), _core.SimulatedLogs(robot.core, cut, LOOP.core()), robot)
    for samples in ([800, 9], [800, 9, 1501], [800, 0, 9]):
        with pytest.raises(InputError, match=r"samples: expected from 1 to \[1500, 1500, 1500\]"):
            logs.first(samples)


def test_samples_that_lead_to_a_beginning_stay(robot, record):
    led = (*record[:2], None, None, 200)
    cut = (record[0][:700], record[1][:700], None, None, 200)
    logs = _core.SimulatedLogs(robot.core, [led], LOOP.core())
    same(logs.first([500]), _core.SimulatedLogs(robot.core, [cut], LOOP.core()), robot)


def test_motions_keep_what_is_not_said_anew(robot):
    rng = np.random.default_rng(0)
    whole = [[rng.normal(size=(300, 1)) for _ in range(4)] for _ in range(2)]
    one, half = np.ones((300, 1)), np.full((300, 1), 0.5)
    flat = Weighting.flat(1).core()

    def residual(motions: _core.MeasuredMotions) -> np.ndarray:
        return motions.evaluate([], [], FitOptions()).residual

    kept = _core.MeasuredMotions(robot.core, [(*m, one) for m in whole], flat)
    anew = _core.MeasuredMotions(robot.core, [(*m, half) for m in whole], flat)
    np.testing.assert_array_equal(residual(kept.with_certainty([half, half])), residual(anew))
    last = _core.MeasuredMotions(robot.core, [(*whole[1], one)], flat)
    np.testing.assert_array_equal(residual(kept.part([1])), residual(last))
    with pytest.raises(InputError, match="certainty: expected one array for each of 2 motions"):
        kept.with_certainty([half])
    with pytest.raises(InputError, match=r"records\[1\].certainty: expected 300 numbers"):
        kept.with_certainty([half, half[1:]])


def test_advice_is_for_searches_that_did_not_arrive():
    assert dict(_core.status_advice()).keys() == {"max_iterations", "stalled"}

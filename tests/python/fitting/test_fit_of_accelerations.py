"""Fits that compare accelerometers: residuals, derivatives, recovery, and what they are worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, InputError, Log, Robot, simulate
from axisight.effects import core_effects
from axisight.fitting import (
    FitOptions,
    Parameter,
    Weighting,
    effect_parameter,
    fit,
    robot_parameter,
    simulation_residuals,
    spectral_weighting,
)
from axisight.fitting.parameters import core_spec, with_search
from axisight.fitting.simulation_error import simulated_logs
from axisight.logs import Load
from axisight.robot import Accelerometer
from multiaxis_data import POSES, STEP, errors, reference_of, simulated
from multiaxis_data import ROBOT as BARE

ELBOW = Accelerometer("elbow", "axis2_yaw", (0.0, 0.1, 1.0), ((1.0, 0.0, 0.0),))
TIP = Accelerometer("tip", "axis3_yaw", (1.2, 0.1, 0.2))
ROBOT = BARE.with_accelerometers([ELBOW, TIP])
EFFECTS = [
    Effect("gear_hysteresis", 2, {"share": 0.3, "deflection_rad": 3e-4}),
    Effect("transmission_error", 2, {"order": 2.0, "cosine_rad": 1e-4, "sine_rad": 1e-4}),
]


def sensed(
    name: str,
    reference: np.ndarray,
    pose: Sequence[float],
    run: int,
    *,
    effects: Sequence[Effect] = (),
    load: Load | None = None,
) -> Log:
    """A log of the arm with readings that have no noise."""
    log = simulated(name, reference, pose, run, effects=effects, load=load)
    acting = [*effects] if load is None else [*effects, Effect("payload", None, load.parameters)]
    sim = simulate(ROBOT, reference, noise_seed=3, run=run, start_rad=list(pose), effects=acting)
    readings = sim["acceleration_m_s2"]
    return replace(
        log,
        acceleration_m_s2={
            one.name: readings.sel(accelerometer=one.name).values for one in ROBOT.accelerometers
        },
    )


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """Half a period of excitation on all axes at once, at two poses."""
    return [sensed(f"pose{i}", reference_of(0.5, i, None), p, i) for i, p in enumerate(POSES)]


def test_residuals_are_those_of_a_simulation(logs: list[Log]) -> None:
    """The oracle is `simulate` with the same integrator; each reading is without its mean error."""
    log = logs[1]
    found = simulation_residuals(ROBOT, [log], joints=True, accelerometers=True)[0]
    run = simulate(ROBOT, log.velocity_ref_rad_s, start_rad=log.start_rad.tolist(), method="rk4")
    readings = run["acceleration_m_s2"].values
    measured = np.stack(list(log.acceleration_m_s2.values()), axis=1)
    error = (readings - measured).reshape(len(readings), -1)
    error = error[:, np.isfinite(error).all(axis=0)]
    assert found.shape[1] == 3 + 3 + 4
    # Some thousand rounding errors of joint accelerations of 100 rad/s^2.
    np.testing.assert_allclose(found[:, 6:], error - error.mean(axis=0), atol=1e-9)
    alone = simulation_residuals(ROBOT, [log], accelerometers=True)[0]
    np.testing.assert_array_equal(alone[:, 3:], found[:, 6:])


def test_bias_and_missing_readings_do_not_matter(logs: list[Log]) -> None:
    plain = simulation_residuals(ROBOT, logs, accelerometers=True)
    shifted = [
        replace(log, acceleration_m_s2={n: x + 0.3 for n, x in log.acceleration_m_s2.items()})
        for log in logs
    ]
    shifted[1] = replace(shifted[1], acceleration_m_s2={"tip": shifted[1].acceleration_m_s2["tip"]})
    found = simulation_residuals(ROBOT, shifted, accelerometers=True)
    np.testing.assert_allclose(found[0], plain[0], atol=1e-12)
    np.testing.assert_allclose(found[1][:, 4:], plain[1][:, 4:], atol=1e-12)
    assert not found[1][:, 3].any()


def test_a_log_without_accelerometers_is_compared_by_its_motors(logs: list[Log]) -> None:
    some = [logs[0], replace(logs[1], acceleration_m_s2={})]
    found = simulation_residuals(ROBOT, some, accelerometers=True)
    assert found[0][:, 3:].any() and not found[1][:, 3:].any()
    np.testing.assert_array_equal(found[1][:, :3], simulation_residuals(ROBOT, some)[1])


def derivatives(log: Log, wanted: list[Parameter], options: FitOptions) -> tuple[np.ndarray, ...]:
    """Residuals (n,) and derivatives (n_parameters, n) at the initial values."""
    ready, every = simulated_logs(
        ROBOT,
        [log],
        EFFECTS,
        joint_weighting=Weighting.flat(3),
        acceleration_weighting=Weighting.flat(4),
        options=options,
    )
    specs = [core_spec(with_search(p), EFFECTS) for p in wanted]
    at = ready.evaluate(core_effects(every), specs, options)
    return at.residual, at.jacobian


@pytest.mark.parametrize(
    ("options", "tolerance"),
    [
        # Central differences over a thousandth of a parameter are off by about 1e-5.
        (FitOptions(method="dopri5", tolerance=1e-10), 1e-4),
        # On the arm linearised along the run, matrices are interpolated over 8 ms.
        (FitOptions(), 1e-2),
    ],
)
def test_derivatives_are_those_of_the_residuals(options: FitOptions, tolerance: float) -> None:
    log = sensed("a", reference_of(0.5, 0, None), (0.0, 0.3, -0.3), 0, effects=EFFECTS)
    names = ("axis2.stiffness", "axis2.damping", "axis3_yaw.stiffness", "axis1.motor_inertia")
    wanted = [robot_parameter(ROBOT, name) for name in names]
    wanted += [effect_parameter(EFFECTS, 0, "share"), effect_parameter(EFFECTS, 1, "cosine_rad")]
    _, jacobian = derivatives(log, wanted, options)
    for place, one in enumerate(wanted):
        step = 1e-3 * one.initial
        ends = []
        for sign in (1, -1):
            moved = [*wanted]
            moved[place] = replace(one, initial=one.initial + sign * step)
            ends.append(derivatives(log, moved, options)[0])
        expected = ((ends[0] - ends[1]) / (2 * step)).reshape(10, -1)
        error = np.linalg.norm(expected - jacobian[place].reshape(10, -1), axis=1)
        assert (error < tolerance * np.linalg.norm(expected, axis=1)).all(), one.name


def test_recovery_and_what_they_are_worth() -> None:
    """Readings with 0.01 m/s^2 of noise beside torques with 0.3 Nm: intervals shrink by more than three."""
    time = STEP * np.arange(round(3 / STEP))
    reference = np.zeros((len(time), 3))
    reference[:, 1] = np.minimum(1, time) * (
        40 * np.sin(np.pi * time) + 8 * np.sin(6 * np.pi * time)
    )
    log = sensed("turns", reference, (0.0, 0.3, -0.3), 0, effects=EFFECTS)
    rng = np.random.default_rng(10)
    log = replace(
        log,
        torque_nm=log.torque_nm + rng.normal(0, 0.3, reference.shape),
        acceleration_m_s2={
            name: x + 0.2 + rng.normal(0, 0.01, x.shape)
            for name, x in log.acceleration_m_s2.items()
        },
    )
    residual = simulation_residuals(ROBOT, [log], effects=EFFECTS, accelerometers=True)[0]
    motors = spectral_weighting([residual[:, :3]], STEP)
    readings = spectral_weighting([residual[:, 3:]], STEP)
    true = ROBOT.parameters()
    wanted = [
        replace(robot_parameter(ROBOT, f"axis2.{name}"), initial=1.2 * true[f"axis2.{name}"])
        for name in ("stiffness", "damping")
    ]
    for place, name in ((0, "share"), (1, "cosine_rad"), (1, "sine_rad")):
        one = effect_parameter(EFFECTS, place, name)
        wanted.append(replace(one, initial=0.5 * one.initial, scale=0.05 * one.scale))
    truth = np.array([true["axis2.stiffness"], true["axis2.damping"], 0.3, 1e-4, 1e-4])
    options = FitOptions(block_s=0.25)
    without = fit(ROBOT, [log], wanted, effects=EFFECTS, weighting=motors, options=options)
    found = fit(
        ROBOT,
        [log],
        wanted,
        effects=EFFECTS,
        weighting=motors,
        acceleration_weighting=readings,
        options=options,
    )
    for one in (without, found):
        assert one.status in ("loss_converged", "step_converged"), one.warnings
        assert (np.abs(one.values - truth) < 4 * one.std).all()
    assert (without.std / found.std > 3).all()


def test_one_model_over_loads() -> None:
    """Each log has its load; the readings depend on it."""
    loads = (None, Load(80.0, (0.9, 0.1, 0.2), 0.02))
    some = [
        sensed(f"load{i}", reference_of(0.5, i, None), POSES[1], i, load=load)
        for i, load in enumerate(loads)
    ]
    names = ("axis2.stiffness", "axis3.stiffness", "axis3_yaw.stiffness")
    wanted = [
        replace(robot_parameter(ROBOT, name), initial=1.3 * ROBOT.parameters()[name])
        for name in names
    ]
    found = fit(ROBOT, some, wanted, acceleration_weighting=Weighting(np.zeros(1), np.ones((4, 1))))
    # The fit integrates in steps of a sample, the log to 1e-7.
    assert np.abs(errors(found.names, found.values)).max() < 2e-3


def test_misuse(logs: list[Log]) -> None:
    def fitted(robot: Robot, log: Log, rows: int = 4) -> None:
        wanted = [robot_parameter(robot, "axis2.stiffness")]
        fit(robot, [log], wanted, acceleration_weighting=Weighting.flat(rows))

    log = logs[0]
    with pytest.raises(InputError, match="acceleration_weighting: expected logs with acceleration"):
        fitted(ROBOT, replace(log, acceleration_m_s2={}))
    with pytest.raises(
        InputError, match="acceleration_weighting: expected 4 rows of weights, got 3"
    ):
        fitted(ROBOT, log, 3)
    with pytest.raises(
        InputError, match=r"accelerometers of the robot \(it has none\), got 'elbow'"
    ):
        fitted(BARE, log)
    other = replace(log, acceleration_m_s2={"elbw": log.acceleration_m_s2["elbow"]})
    with pytest.raises(InputError, match=r"got 'elbw'. Did you mean 'elbow'"):
        fitted(ROBOT, other)
    more = replace(log, acceleration_m_s2={"elbow": log.acceleration_m_s2["tip"]})
    with pytest.raises(InputError, match="expected 1 directions, as the robot states, got more"):
        fitted(ROBOT, more)

"""Fits of many robot parameters to logs: from far starts, with joint encoders, with several loads."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, InputError, Log, simulate
from axisight.fitting import (
    FitOptions,
    Weighting,
    effect_parameter,
    fit,
    simulation_residuals,
    spectral_weighting,
)
from axisight.logs import Load
from multiaxis_data import (
    POSES,
    ROBOT,
    STEP,
    THIRTEEN,
    errors,
    off_by,
    parameters,
    reference_of,
    simulated,
)

LOADS = (None, Load(80.0, (0.9, 0.1, 0.2), 0.02), Load(150.0, (0.6, 0.3, 0.3)))


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """One period of excitation on all axes at once, at two poses."""
    return [simulated(f"pose{i}", reference_of(1.0, i, None), p, i) for i, p in enumerate(POSES)]


@pytest.fixture(scope="module")
def loaded() -> list[Log]:
    """The same pose with three loads."""
    return [
        simulated(f"load{i}", reference_of(0.5, i, None), POSES[1], i, load=load)
        for i, load in enumerate(LOADS)
    ]


@pytest.mark.parametrize(("factor", "seed"), [(1.5, 4), (3.0, 3)])
def test_thirteen_parameters_from_afar(logs: list[Log], factor: float, seed: int) -> None:
    """Four standard errors: thirteen errors exceed them by chance in one of a thousand cases."""
    found = fit(ROBOT, logs, parameters(off_by(factor, seed)))
    assert found.status in ("loss_converged", "step_converged"), found.warnings
    wrong = errors(found.names, found.values)
    assert np.abs(wrong).max() < 0.01
    assert (np.abs(wrong) < 4 * found.std / found.values + 2e-4).all()


def test_without_logarithms_the_same_start_ends_elsewhere(logs: list[Log]) -> None:
    """What the logarithms are for: two yaw springs stay far off, and the iterations run out."""
    wanted = parameters(off_by(2.0, 4), logarithmic=False)
    found = fit(ROBOT, logs, wanted, options=FitOptions(max_iterations=25))
    assert np.abs(errors(found.names, found.values)).max() > 0.1


def test_a_logarithm_needs_a_positive_bound(logs: list[Log]) -> None:
    wanted = parameters(off_by(1.1, 1), lower=0.0, logarithmic=True)
    with pytest.raises(InputError, match=r"lower: expected above zero, as the logarithm"):
        fit(ROBOT, logs, wanted)


def test_residuals_are_those_of_a_simulation(logs: list[Log]) -> None:
    """The oracle is `simulate` with the same integrator: torques, and joint angles without their mean."""
    log = logs[0]
    found = simulation_residuals(ROBOT, [log], joints=True)[0]
    run = simulate(ROBOT, log.velocity_ref_rad_s, start_rad=log.start_rad.tolist(), method="rk4")
    torque = run.torque_cmd_nm.values - log.torque_nm
    joint = run.joint_position_rad.values[:, ROBOT.axis_joints] - log.joint_position_rad
    # A few hundred rounding errors of a torque of 30 Nm and an angle of 1 rad.
    np.testing.assert_allclose(found[:, :3], torque, atol=1e-9)
    np.testing.assert_allclose(found[:, 3:], joint - joint.mean(axis=0), atol=1e-12)


def test_the_zero_of_a_joint_encoder_and_missing_ones_do_not_matter(logs: list[Log]) -> None:
    shifted = [replace(log, joint_position_rad=log.joint_position_rad + 0.4) for log in logs]
    lost = shifted[1].joint_position_rad.copy()
    lost[:, 2] = np.nan
    shifted[1] = replace(shifted[1], joint_position_rad=lost)
    plain = simulation_residuals(ROBOT, logs, joints=True)
    found = simulation_residuals(ROBOT, shifted, joints=True)
    np.testing.assert_allclose(found[0], plain[0], atol=1e-12)
    np.testing.assert_allclose(found[1][:, :5], plain[1][:, :5], atol=1e-12)
    assert not found[1][:, 5].any()


def test_joint_weighting_needs_an_encoder(logs: list[Log]) -> None:
    bare = [replace(log, joint_position_rad=None) for log in logs]
    with pytest.raises(InputError, match="joint_weighting: expected logs with joint_position_rad"):
        fit(ROBOT, bare, parameters(off_by(1.1, 1)), joint_weighting=Weighting.flat(3))


def test_a_joint_encoder_sharpens_what_the_gear_does() -> None:
    """Torques with 0.3 Nm of noise, encoders with 5e-6 rad: gear parameters gain a factor above three."""
    effects = [
        Effect("gear_hysteresis", 2, {"share": 0.3, "deflection_rad": 3e-4}),
        Effect("transmission_error", 2, {"order": 2.0, "cosine_rad": 1e-4, "sine_rad": 1e-4}),
    ]
    time = STEP * np.arange(round(3 / STEP))
    reference = np.zeros((len(time), 3))
    reference[:, 1] = np.minimum(1, time) * (
        40 * np.sin(np.pi * time) + 8 * np.sin(6 * np.pi * time)
    )
    log = simulated("turns", reference, (0.0, 0.3, -0.3), 0, effects=effects)
    rng = np.random.default_rng(10)
    log = replace(
        log,
        torque_nm=log.torque_nm + rng.normal(0, 0.3, reference.shape),
        joint_position_rad=log.joint_position_rad + rng.normal(0, 5e-6, reference.shape),
    )
    residual = simulation_residuals(ROBOT, [log], effects=effects, joints=True)[0]
    motors = spectral_weighting([residual[:, :3]], STEP)
    joints = spectral_weighting([residual[:, 3:]], STEP)
    wanted = parameters({"axis2.stiffness": 1.2 * ROBOT.parameters()["axis2.stiffness"]})
    for place, name in ((0, "share"), (1, "cosine_rad"), (1, "sine_rad")):
        one = effect_parameter(effects, place, name)
        wanted.append(replace(one, initial=0.5 * one.initial, scale=0.05 * one.scale))
    truth = np.array([ROBOT.parameters()["axis2.stiffness"], 0.3, 1e-4, 1e-4])
    without = fit(ROBOT, [log], wanted, effects=effects, weighting=motors)
    found = fit(ROBOT, [log], wanted, effects=effects, weighting=motors, joint_weighting=joints)
    for one in (without, found):
        assert (np.abs(one.values - truth) < 4 * one.std).all()
    assert (without.std / found.std > 3).all()


def test_each_log_has_its_own_load(loaded: list[Log]) -> None:
    """In one batch, each log gives the residuals that it gives alone with the load as an effect."""
    together = simulation_residuals(ROBOT, loaded)
    for log, found in zip(loaded, together, strict=True):
        effects = [] if log.load is None else [Effect("payload", None, log.load.parameters)]
        alone = simulation_residuals(ROBOT, [replace(log, load=None)], effects=effects)[0]
        np.testing.assert_allclose(found, alone, atol=1e-9)


def test_one_model_over_loads(loaded: list[Log]) -> None:
    start = off_by(1.3, 2, THIRTEEN)
    found = fit(ROBOT, loaded, parameters(start))
    assert found.status in ("loss_converged", "step_converged"), found.warnings
    wrong = errors(found.names, found.values)
    # Half a second at one pose determines springs and rotors; a model without the loads is 10 % off.
    firm = [not name.endswith("damping") for name in found.names]
    assert np.abs(wrong[firm]).max() < 0.01
    assert (np.abs(wrong) < 4 * found.std / found.values + 2e-4).all()


def test_loads_and_a_payload_exclude_each_other(loaded: list[Log]) -> None:
    with pytest.raises(InputError, match="effects: expected no payload beside logs that state"):
        simulation_residuals(ROBOT, loaded, effects=[Effect("payload", None, {"mass_kg": 1.0})])


@pytest.mark.parametrize("pole", [0.0, 0.9, -0.6])
def test_weights_whiten_the_residuals(pole: float) -> None:
    """White noise through one pole has a known spectrum; the weight is one over its root.

    The root of the mean of n periodogram lines scatters by 1 / (2 sqrt(n)), and by a fifth more as the taper
    makes neighbours alike. Bands have at least 16 lines, and a thousand at the highest frequencies. The
    limits are four times the scatter.
    """
    rng = np.random.default_rng(1)
    series = []
    for _ in range(8):
        noise = rng.normal(size=(4000, 2))
        for k in range(1, len(noise)):
            noise[k] += pole * noise[k - 1]
        series.append(2.0 * noise)
    found = spectral_weighting(series, 1e-3)
    turn = np.exp(-2j * np.pi * found.frequency_hz * 1e-3)
    exact = np.abs(1 - pole * turn) / 2.0
    np.testing.assert_allclose(found.weight, np.stack([exact] * 2), rtol=0.6)
    np.testing.assert_allclose(found.weight[:, -4:], np.stack([exact[-4:]] * 2), rtol=0.08)


def test_a_floor_limits_weights() -> None:
    time = np.arange(4000)[:, None]
    series = np.sin(0.5 * time) + 1e-9 * np.random.default_rng(1).normal(size=time.shape)
    found = spectral_weighting([series], 1e-3, floor=0.01)
    assert found.weight.max() / found.weight.min() == pytest.approx(100, rel=1e-9)

"""The energy model: stored energy, work, recovery without accelerations."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import pinocchio_model
from axisight.errors import IdentifiabilityError, IdentificationWarning, InputError
from axisight.rigid_body import (
    USUAL_TERMS,
    DriveTerms,
    FindingKind,
    MotorCoupling,
    TorqueModel,
    base_parameters,
    energy_regression,
    energy_regressor,
    identify_by_energy,
)
from axisight.robot import load_robot
from rigid_body_data import (
    drive_values,
    motion,
    random_chain,
    robot_of,
    smooth_motion,
    three_axes,
    wrist_arm,
)


@pytest.mark.parametrize("seed", range(60, 70))
def test_stored_energy_is_pinocchio_s(seed: int) -> None:
    text = random_chain(seed)
    robot = robot_of(text)
    model = pinocchio_model.build(text)
    data = model.createData()
    q, v, _ = motion(robot, 40, seed)
    torque_model = TorqueModel(robot)
    got = energy_regressor(torque_model, q, v) @ torque_model.nominal
    want = [
        pin.computeKineticEnergy(model, data, *row)
        + pin.computePotentialEnergy(model, data, row[0])
        for row in zip(q, v, strict=True)
    ]
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-12 * np.abs(want).max())
    own = robot.core.energy(q, v).sum(axis=1)
    np.testing.assert_allclose(got, own, rtol=0, atol=1e-12 * np.abs(want).max())


def test_rotors_and_springs_store_energy() -> None:
    robot = load_robot("irb6600_like")
    model = TorqueModel(robot, terms=DriveTerms(inertia=("motor", "joint"), springs=True))
    q, v, _ = motion(robot, 5)
    h = energy_regressor(model, q, v)
    at = {name: h[:, i] for i, name in enumerate(model.names)}
    np.testing.assert_allclose(at["axis3.joint_rotor_inertia"], 0.5 * v[:, 4] ** 2)
    motor = v[:, 4] / robot.gear_ratio[2]
    np.testing.assert_allclose(at["axis3.motor_inertia"], 0.5 * motor**2)
    np.testing.assert_allclose(at["axis2_yaw.stiffness"], 0.5 * q[:, 3] ** 2)


@pytest.mark.parametrize("side", ["motor", "joint"])
def test_energy_balances(side: str) -> None:
    """What goes in is stored or lost, with all terms on both sides and coupled motors."""
    robot = robot_of(wrist_arm())
    gears = np.diag(1 / robot.gear_ratio)
    gears[5, 4] = 32.0
    both = ("motor", "joint")
    terms = DriveTerms(inertia=both, viscous=both, coulomb=both, offset=both, smoothing_rad_s=0.5)
    model = TorqueModel(robot, terms=terms, side=side, coupling=MotorCoupling(gears))
    values = drive_values(model.names, model.nominal) + 0.01
    q, v, a = smooth_motion(robot, 4001, 1e-3)
    torque = model.matrix(q, v, a) @ values
    found = energy_regression(model, q, v, torque, sample_time_s=1e-3, window_s=0.5, overlap=0.5)
    assert len(found.work_j) == 15
    # Simpson's rule on signals below 10 Hz or so at 1 kHz; tanh friction has kinks of 0.5 rad/s.
    error = found.matrix @ values - found.work_j
    assert np.abs(error).max() < 1e-4 * np.abs(found.work_j).max()


def test_recovery_without_accelerations() -> None:
    robot = robot_of(three_axes())
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    values = drive_values(model.names, model.nominal)
    q, v, a = smooth_motion(robot, 60000, 1e-3, 4)
    torque = model.matrix(q, v, a) @ values
    options = {"sample_time_s": 1e-3, "window_s": 0.3, "overlap": 0.5}
    exact = identify_by_energy(energy_regression(model, q, v, torque, **options), model)
    want = exact.base.from_standard(values)
    # Sign changes of Coulomb friction between samples: 1e-3 of a window at most, and less
    # on average.
    scale = np.abs(want) + 1e-2 * np.abs(want).max()
    assert np.abs((exact.values - want) / scale).max() < 5e-3
    assert exact.relative_error < 1e-4
    rng = np.random.default_rng(0)
    noisy = torque + 0.05 * torque.std(axis=0) * rng.normal(size=torque.shape)
    found = identify_by_energy(energy_regression(model, q, v, noisy, **options), model)
    z = (found.values - exact.values) / found.standard_error
    assert np.sqrt((z**2).mean()) < 1.8
    assert np.abs(z).max() < 5


def test_standard_errors_need_more_windows_than_parameters() -> None:
    """Exact equations of windows with white noise: nothing known of as many as parameters."""
    robot = robot_of(three_axes())
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    base = base_parameters(model)
    q, v, a = smooth_motion(robot, 20000, 1e-3, 4)
    values = drive_values(model.names, model.nominal)
    torque = model.matrix(q, v, a) @ values
    every = energy_regression(model, q, v, torque, sample_time_s=1e-3, window_s=0.1)
    want = base.from_standard(values)
    k = len(base)

    def found(n: int, run: int = 0):  # type: ignore[no-untyped-def]
        at = np.linspace(0, len(every.work_j) - 1, n).astype(int)
        noise = np.random.default_rng([3, run]).normal(0, 0.1, n)
        work = every.matrix[at] @ values + noise
        few = replace(every, matrix=every.matrix[at], work_j=work)
        return identify_by_energy(few, model, base=base)

    for n in (k, k + 1):
        with pytest.warns(IdentificationWarning, match=f"{n} windows for {k} parameters"):
            short = found(n)
        assert np.isnan(short.covariance).all() and np.isnan(short.standard_error).all()
        assert np.isnan(short.interval()).all() and (short.degrees_of_freedom < 3).all()
        (finding,) = short.findings
        assert finding.kind is FindingKind.FREEDOM and finding.serious
        assert finding.names == tuple(base.names)
    inside = []
    for run in range(60):
        with warnings.catch_warnings():
            warnings.simplefilter("error", IdentificationWarning)
            fit = found(2 * k, run)
        assert not fit.findings
        lower, upper = fit.interval()
        inside.append((lower <= want) & (want <= upper))
    # 60 runs of 25 parameters from 50 numbers: 95 % within 0.6 % if they were independent, in
    # pairs 0.8 %; three of these, and as much for Satterthwaite's rule.
    assert 0.92 < np.mean(inside) < 0.98
    with pytest.raises(InputError, match="level: expected"):
        fit.interval(1.0)


def test_known_parameters_and_rank() -> None:
    robot = robot_of(three_axes())
    model = TorqueModel(robot)
    q, v, a = smooth_motion(robot, 20000, 1e-3)
    torque = model.matrix(q, v, a) @ model.nominal
    options = {"sample_time_s": 1e-3, "window_s": 0.3}
    known = {"axis1.inertia_zz": model.nominal[model.names.index("axis1.inertia_zz")]}
    regression = energy_regression(model, q, v, torque, **options)
    found = identify_by_energy(regression, model, known=known)
    assert "axis1.inertia_zz" not in found.base.names
    want = found.base.from_standard(model.nominal)
    np.testing.assert_allclose(found.values, want, atol=1e-6 * np.abs(want).max())
    short = energy_regression(model, q[:3000], v[:3000], torque[:3000], **options)
    with pytest.raises(IdentifiabilityError, match="from 9 windows"):
        identify_by_energy(short, model)


def test_misuse_names_the_field() -> None:
    robot = robot_of(three_axes())
    model = TorqueModel(robot, side="motor")
    q, v, _ = motion(robot, 50)
    good = {"sample_time_s": 1e-3, "window_s": 0.01}
    for arguments, options, message in [
        ((q, v[:9], q), {}, "v: expected 50 rows as q"),
        ((q, v, q[:9]), {}, "torque_nm: expected 50 rows"),
        ((q, v, q * np.nan), {}, "torque_nm: expected finite"),
        ((q, v, q), {"sample_time_s": 0.0}, "sample_time_s: expected a positive"),
        ((q, v, q), {"window_s": 0.05}, "window_s: expected 0.001 to 0.049 s"),
        ((q, v, q), {"overlap": 1.0}, "overlap: expected"),
    ]:
        with pytest.raises(InputError, match=message):
            energy_regression(model, *arguments, **{**good, **options})
    lossy = TorqueModel(robot, coupling=MotorCoupling(np.eye(3), 1.1 * np.eye(3)))
    with pytest.raises(InputError, match="coupling: expected"):
        energy_regression(lossy, q, v, q, **good)

"""Rigid bodies from motor logs: all steps in one call, and its values in a robot file."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from axisight import InputError, Log, Robot, load_robot
from axisight.errors import IdentifiabilityError, RobotError
from axisight.rigid_body import (
    USUAL_TERMS,
    DriveTerms,
    TorqueModel,
    base_parameters,
    estimate_motion,
    identify_logs,
    identify_rigid_body,
)
from axisight.robot_file import Provenance, load_identified, write_identified
from rigid_body_data import description, drive_values, parse, robot_of, smooth_motion, three_axes

STEP = 1e-3
SOURCE = Provenance("test", settings={"a": 1})


def truth_of(model: TorqueModel) -> np.ndarray:
    return drive_values(model.names, model.nominal)


def believed() -> Robot:
    """The arm as its file has it: a tenth heavier, with rotors a fifth smaller, than it is."""
    data = parse(three_axes())
    for joint in data["joint"]:
        joint["link"]["mass"] *= 1.1
        joint["link"]["inertia"] = [1.1 * x for x in joint["link"]["inertia"]]
        joint["drive"]["motor_inertia"] *= 0.8
    return robot_of(description(data["joint"], data["gravity"]))


def motor_log(robot: Robot, seed: int, n: int = 8000, noise: float = 0.0) -> Log:
    """A log of a robot with rigid gears and joints, friction and offsets."""
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    q, v, a = smooth_motion(robot, n, STEP, seed)
    elastic = np.delete(np.arange(robot.n_joints), robot.core.axis_joints)
    q[:, elastic] = v[:, elastic] = a[:, elastic] = 0.0
    torque = model.matrix(q, v, a) @ truth_of(model)
    torque += noise * np.random.default_rng(seed).normal(size=torque.shape)
    return Log(
        name=f"run{seed}",
        sample_time_s=STEP,
        time_s=STEP * np.arange(n),
        torque_nm=torque,
        position_rad=model.coupling.motor_motion(q[:, robot.core.axis_joints]),
        source=Path(f"run{seed}"),
    )


@pytest.fixture(scope="module")
def robot() -> Robot:
    return robot_of(three_axes())


@pytest.fixture(scope="module")
def logs(robot) -> list[Log]:
    return [motor_log(robot, seed, noise=0.01) for seed in (1, 2, 3)]


def test_it_is_the_steps_by_hand(robot, logs) -> None:
    """Filter, gears, regression, one after the other."""
    found = identify_logs(robot, logs[:2], held_out=logs[2:], cutoff_hz=8.0, reversal_s=0.0)
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    parts = []
    for log in logs:
        m = estimate_motion(log.position_rad, log.torque_nm, sample_time_s=STEP, cutoff_hz=8.0)
        motor = (m.position_rad, m.velocity_rad_s, m.acceleration_rad_s2)
        parts.append([*(x * robot.core.gear_ratio for x in motor), m.torque_nm])
    both = [np.concatenate(x) for x in zip(*parts[:2], strict=True)]
    want = identify_rigid_body(model, *both)
    np.testing.assert_allclose(found.estimate.values, want.values, rtol=1e-9)
    np.testing.assert_allclose(found.estimate.standard_error, want.standard_error, rtol=1e-7)
    error = want.torque_error(*parts[2])
    got = found.errors.sel(parameters="estimate").isel(log=2)
    np.testing.assert_allclose(got["rms_nm"], error["rms_nm"], rtol=1e-7)
    np.testing.assert_allclose(got["relative_error"], error["relative_error"], rtol=1e-7)
    assert list(found.errors["held_out"]) == [False, False, True]
    assert list(found.errors["log"]) == ["run1", "run2", "run3"]
    assert [m.n_samples for m in found.motions] == [len(p[0]) for p in parts[:2]]


def test_parameters_put_in_come_out(robot, logs) -> None:
    found = identify_logs(robot, logs[:2], held_out=logs[2:], cutoff_hz=20.0, reversal_s=0.075)
    estimate = found.estimate
    want = estimate.base.from_standard(truth_of(estimate.model))
    score = (estimate.values - want) / estimate.standard_error
    # Some 30 parameters: 4.5 standard errors of one are passed in one case of 5000.
    assert np.sqrt(np.mean(score**2)) < 1.6 and np.abs(score).max() < 4.5
    assert found.errors["relative_error"].isel(log=2).max() < 0.02


def test_samples_around_reversals_are_left_out(robot, logs) -> None:
    """What the filter smears of the sign would be taken for viscous friction."""
    friction, possible = {}, {}
    for reversal_s in (None, 0.05, 0.0):
        found = identify_logs(robot, logs[:2], reversal_s=reversal_s, consistent=True)
        chosen = ["coulomb" in name for name in found.estimate.names]
        friction[reversal_s] = found.estimate.values[chosen]
        chosen = ["coulomb" in name for name in found.estimate.model.names]
        possible[reversal_s] = found.consistent.theta[chosen]
    # Half a period of 10 Hz.
    np.testing.assert_array_equal(friction[None], friction[0.05])
    assert np.abs(friction[None] / 0.4 - 1).max() < 0.02
    assert np.abs(friction[0.0] / 0.4 - 1).max() > 0.06
    assert np.abs(possible[None] / 0.4 - 1).max() < 0.02 < np.abs(possible[0.0] / 0.4 - 1).max()


def test_the_prior_share_says_how_near_to_the_file(logs) -> None:
    robot = believed()
    far, near = (
        identify_logs(robot, logs[0], consistent=True, prior_share=share) for share in (1.0, 1e-6)
    )
    links = [c.extra is None for c in far.estimate.model.columns]
    nominal = far.estimate.model.nominal[links]
    size = np.abs(nominal).max()
    assert np.abs(near.consistent.theta[links] - nominal).max() < 1e-3 * size
    assert np.abs(far.consistent.theta[links] - nominal).max() > 1e-2 * size


def test_elastic_joints_count_as_locked() -> None:
    """The oracle is the same robot without them: in the preset they sit on the gears' axes."""
    elastic = load_robot("irb6600_like")
    data = parse(elastic.core.toml)
    joints = []
    for joint in data["joint"]:
        if joint["kind"] == "driven":
            joints.append(joint)
        elif "link" in joint:
            assert joint["origin"] == [0.0, 0.0, 0.0] and "link" not in joints[-1]
            joints[-1]["link"] = joint["link"]
    rigid = robot_of(description(joints, data["gravity"]))
    want = base_parameters(TorqueModel(rigid, terms=USUAL_TERMS, side="motor"))
    got = base_parameters(TorqueModel(elastic, terms=USUAL_TERMS, side="motor"), locked=True)
    assert [n.replace("_yaw", "") for n in got.names] == want.names
    free = base_parameters(TorqueModel(elastic, terms=USUAL_TERMS, side="motor"))
    assert len(free) > len(got)
    runs = [motor_log(elastic, seed, noise=0.01) for seed in (1, 2)]
    found = identify_logs(elastic, runs)
    twin = identify_logs(rigid, runs)
    np.testing.assert_allclose(found.estimate.values, twin.estimate.values, rtol=1e-6)


def test_values_written_give_the_torques_of_the_fit(robot, logs, tmp_path: Path) -> None:
    robot = believed()
    found = identify_logs(robot, logs[:2], consistent=True)
    assert found.consistent is not None
    values = found.identified(SOURCE)
    write_identified(robot, tmp_path / "r.toml", values)
    back = load_identified(tmp_path / "r.toml")
    model = found.estimate.model
    again = TorqueModel(back.robot, terms=USUAL_TERMS, side="motor").nominal
    for i, name in enumerate(model.names):
        for effect in back.effects:
            label = model.names[i].rpartition(".")[0]
            if effect.axis == robot.joint_names.index(label) + 1 and effect.name in name:
                (again[i],) = effect.parameters.values()
    q, v, a = smooth_motion(robot, 50, 0.1, 9)
    matrix = model.matrix(q, v, a)
    want = matrix @ found.consistent.theta
    # What the motions do not show was left as it was.
    np.testing.assert_allclose(matrix @ again, want, rtol=1e-6, atol=1e-6 * np.abs(want).max())
    assert np.abs(want - matrix @ model.nominal).max() > 0.05 * np.abs(want).max()
    settings = back.provenance.settings
    assert settings["a"] == 1 and "bodies that can exist: " in back.provenance.notes
    table = settings["base_parameters"]
    assert [row["combination"] for row in table] == found.estimate.base.combinations
    assert [row["value"] for row in table] == found.estimate.values.tolist()
    assert settings["torque_error"][1]["log"] == "run2" and np.isnan(back.standard_errors).all()


def test_drive_parameters_that_stand_alone_have_their_errors(logs) -> None:
    found = identify_logs(believed(), logs[:2])
    values = found.identified(SOURCE)
    errors = dict(zip(values.names, values.standard_errors, strict=True))
    own = dict(zip(found.estimate.names, found.estimate.standard_error, strict=True))
    assert errors["axis2.viscous_friction"] == own["axis2.viscous_friction"] > 0
    assert errors["coulomb_friction@3.coulomb_nm"] == own["axis3.coulomb_friction"]
    # Centres of mass and inertias about them are made from several.
    assert all(np.isnan(e) for n, e in errors.items() if ".com_" in n or ".inertia_" in n)
    # This one stands for a sum with a motor inertia.
    assert np.isnan(errors["axis1.inertia_zz"]) and np.isnan(errors["axis1.motor_inertia"])
    # The height of a link on a vertical axis moves nothing.
    assert "axis1.com_z" not in errors


def test_misuse_is_named(robot, logs) -> None:
    other = load_robot("two_mass_axis")
    for call, words in (
        (lambda: identify_logs(robot, []), "logs: expected at least one"),
        (lambda: identify_logs(robot, ["run.csv"]), "logs: expected Logs, got str"),
        (lambda: identify_logs(other, logs), "run1: expected 1 axes, got 3"),
        (lambda: identify_logs(robot, logs, cutoff_hz=600.0), "run1: cutoff_hz: expected between"),
        (lambda: identify_logs(robot, logs, reversal_s=-1.0), "reversal_s: expected a number not"),
        (lambda: identify_logs(robot, logs, reversal_s=np.nan), "reversal_s: expected a number"),
        (lambda: identify_logs(robot, logs, reversal_s=5.0), "reversal_s: expected less, got 5"),
        (lambda: identify_logs(robot, logs, held_out=[1]), "logs: expected Logs, got int"),
        (lambda: identify_logs(robot, logs, known={"axis1.colour": 1.0}), "known: expected names"),
        (lambda: identify_logs(robot, logs, prior_share=0.0, consistent=True), "share: expected"),
    ):
        with pytest.raises(InputError, match=words):
            call()
    still = motor_log(robot, 1)
    still.position_rad[:, 2] = 0.0
    with pytest.raises(IdentifiabilityError, match="axis3"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        identify_logs(robot, still)


def test_impossible_bodies_are_refused_when_written(robot, tmp_path: Path) -> None:
    log = motor_log(robot, 5)
    wrong = log.torque_nm.copy()
    wrong[:, 2] *= -1.0
    bad = Log(
        name="bad",
        sample_time_s=STEP,
        time_s=log.time_s,
        torque_nm=wrong,
        position_rad=log.position_rad,
        source=log.source,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = identify_logs(robot, bad, terms=DriveTerms(viscous="motor", coulomb="motor"))
    with pytest.raises(RobotError, match="expected"):
        write_identified(robot, tmp_path / "r.toml", found.identified(SOURCE))
    assert not list(tmp_path.iterdir())

"""Identification with a floating base, and contacts that the model cannot have."""

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

from axisight import BaseMotion, Robot
from axisight.errors import ContactError, InputError, RobotError
from axisight.rigid_body import (
    DriveTerms,
    TorqueModel,
    base_parameters,
    contact_check,
    energy_regressor,
    floating_motion,
    identify_floating,
    identify_logs,
    identify_rigid_body,
    record_of_imu,
    record_of_pose,
)
from floating_robot import floating_text, random_base

Array = NDArray[np.float64]

TREE: list[int | None] = [None, 0, None, 2]
ROBOT = Robot.from_toml(floating_text(TREE, slides=0.0))
STEP_S = 1e-3


def waves(n: int, k: int, seed: int, size: float = 0.5) -> tuple[Array, Array, Array]:
    """Return ``k`` smooth signals (n, k) of zero mean with both derivatives, a sample every STEP_S."""
    rng = np.random.default_rng(seed)
    t = STEP_S * np.arange(n)[:, None]
    out = np.zeros((3, n, k))
    for hertz in (0.5, 1.1, 1.9):
        w = 2.0 * np.pi * hertz
        phase, share = rng.uniform(0.0, 2.0 * np.pi, size=k), rng.uniform(0.3, 1.0, size=k)
        out[0] += size * share * np.sin(w * t + phase)
        out[1] += size * share * w * np.cos(w * t + phase)
        out[2] -= size * share * w**2 * np.sin(w * t + phase)
    return out[0], out[1], out[2]


def flight(
    n: int = 4000, *, seed: int = 0, pushed: Array | None = None
) -> tuple[Array, Array, Array, BaseMotion, Array]:
    """Return joint motion, base motion and joint torques (n, n_joints) of a flight under ``pushed`` (n, 6).

    Joint motions and the angular velocity are given; accelerations of the base follow from the wrench on it.
    """
    q, v, a = waves(n, 4, seed)
    _, rate, _ = waves(n, 3, seed + 1, size=0.2)
    nothing = np.zeros((n, 3))
    still = BaseMotion(rate, nothing, nothing)
    need = ROBOT.inverse_dynamics(q, v, a, base=still)[:, :6]
    outside = np.zeros((n, 6)) if pushed is None else pushed
    inertia = ROBOT.inertia_matrix(q)[:, :6, :6]
    moved = np.linalg.solve(inertia, (outside - need)[..., None])[..., 0]
    base = BaseMotion(rate, moved[:, 3:], moved[:, :3])
    return q, v, a, base, ROBOT.inverse_dynamics(q, v, a, base=base)[:, 6:]


def test_the_regressor_times_nominal_is_inverse_dynamics():
    rng = np.random.default_rng(1)
    q, v, a = rng.normal(size=(3, 30, 4))
    base = random_base(rng, 30)
    wanted = ROBOT.inverse_dynamics(q, v, a, base=base)
    motion = floating_motion(ROBOT, q, v, a, base)
    for side, chosen in (("joint", slice(None)), ("base", slice(6))):
        model = TorqueModel(ROBOT, side=side)
        assert model.names[:2] == ["base.mass", "base.mass_x"]
        found = model.matrix(*motion) @ model.nominal
        # Sums of a few hundred products, rounded at 1.1e-16.
        assert np.abs(found - wanted[:, chosen]).max() < 1e-12 * np.abs(wanted).max()
    motors = TorqueModel(ROBOT, side="motor")
    assert motors.row_names == [*ROBOT.coordinate_names[:6], *ROBOT.axis_names]
    found = motors.matrix(*motion) @ motors.nominal
    by_motor = np.hstack([wanted[:, :6], wanted[:, 6:] * ROBOT.gear_ratio])
    assert np.abs(found - by_motor).max() < 1e-12 * np.abs(wanted).max()


def test_the_base_shows_every_parameter_of_its_own_link():
    # A fixed base hides the first link but for three numbers; nothing holds a floating one.
    fixed = Robot.from_toml(
        ROBOT.toml[: ROBOT.toml.index("[base]")] + ROBOT.toml[ROBOT.toml.index("[[joint]]") :]
    )
    found, held = base_parameters(ROBOT), base_parameters(fixed)
    of_base = [name for name in found.names if name.startswith("base.")]
    assert len(of_base) == 10
    # Ten numbers of the base, seven for each further link on a revolute joint (Khalil and Dombre 2002, chapter 9).
    assert len(found) == 10 + 7 * 4
    assert len(found) > len(held) + 10
    # The six equations of the base alone show the same combinations.
    assert len(base_parameters(ROBOT, side="base")) == len(found)
    # A point mass where the rope is fixed has no moment about this point.
    hung = base_parameters(TorqueModel(ROBOT, hung_at_m=[0.2, -0.1, 0.4]))
    assert len(hung) == len(found) - 1


@pytest.mark.parametrize("side", ["joint", "motor"])
def test_parameters_of_a_flight_come_back(side: str):
    q, v, a, base, torque = flight()
    rng = np.random.default_rng(2)
    if side == "motor":
        torque = torque * ROBOT.gear_ratio
    noise = 1e-3 * np.sqrt((torque**2).mean())
    torque = torque + noise * rng.normal(size=torque.shape)
    # Noise of accelerometer and gyroscope makes residuals of the base equations.
    rate, growth, proper = base.parts()
    shaken = BaseMotion(rate, growth, proper + 1e-3 * rng.normal(size=proper.shape))
    found = identify_floating(ROBOT, q, v, a, shaken, torque, side=side)
    wanted = found.base.from_standard(found.model.nominal)
    off = np.abs(found.values - wanted)
    lower, upper = found.interval(0.9999)
    # With 38 parameters, an interval of 99.99 % misses the truth in 0.4 % of the logs. The noise of the motion
    # also makes a bias of its own square.
    assert (off <= (upper - lower) + 1e-4 * np.abs(wanted).max()).all()
    mass = found.base.columns.tolist().index(found.model.names.index("base.mass"))
    assert found.base.combinations[mass].startswith("base.mass + j0.mass")
    assert abs(found.values[mass] / wanted[mass] - 1.0) < 1e-2


def test_the_base_alone_and_a_scale_give_all_parameters():
    q, v, a, base, _ = flight()
    with pytest.raises(InputError, match="mass_kg: expected the mass of the whole robot"):
        identify_floating(ROBOT, q, v, a, base)
    mass = ROBOT.inertia_matrix(np.zeros(4))[0, 0]
    found = identify_floating(ROBOT, q, v, a, base, mass_kg=2.0 * mass)
    wanted = 2.0 * found.base.from_standard(found.model.nominal)
    # Noise-free: rounding times the condition of the regressor, below 1e5.
    assert np.abs(found.values - wanted).max() < 1e-8 * np.abs(wanted).max()


def test_a_load_cell_in_the_stand_gives_all_parameters():
    rng = np.random.default_rng(4)
    q, v, a = waves(4000, 4, 3)
    turn = scipy.spatial.transform.Rotation.from_rotvec(waves(4000, 3, 5)[0]).as_matrix()
    rate, growth, proper = (waves(4000, 3, seed)[2] for seed in (6, 7, 8))
    base = BaseMotion.from_world(turn, rate, growth, proper)
    wrench = ROBOT.inverse_dynamics(q, v, a, base=base)[:, :6]
    measured = wrench + 1e-3 * np.abs(wrench).max() * rng.normal(size=wrench.shape)
    with pytest.raises(ContactError):
        identify_floating(ROBOT, q, v, a, base, mass_kg=10.0)
    found = identify_floating(ROBOT, q, v, a, base, wrench=measured)
    wanted = found.base.from_standard(found.model.nominal)
    lower, upper = found.interval(0.9999)
    assert (np.abs(found.values - wanted) <= upper - lower).all()


def test_a_robot_on_a_rope_needs_no_load_cell():
    rng = np.random.default_rng(6)
    point = np.array([0.2, -0.1, 0.4])
    # A force through the point, slow enough to be one of a rope.
    rope = np.array([1.0, 2.0, 120.0]) + 20.0 * waves(4000, 3, 13)[0]
    pushed = np.hstack([rope, np.cross(point, rope)])
    q, v, a, base, torque = flight(pushed=pushed)
    with pytest.raises(ContactError):
        identify_floating(ROBOT, q, v, a, base, torque)
    torque = torque + 1e-3 * np.abs(torque).max() * rng.normal(size=torque.shape)
    rate, growth, proper = base.parts()
    shaken = BaseMotion(rate, growth, proper + 1e-3 * rng.normal(size=proper.shape))
    found = identify_floating(ROBOT, q, v, a, shaken, torque, hung_at_m=point)
    assert found.model.row_names == [
        "base.turn_x",
        "base.turn_y",
        "base.turn_z",
        *ROBOT.joint_names,
    ]
    wanted = found.base.from_standard(found.model.nominal)
    lower, upper = found.interval(0.9999)
    bias = 1e-3 * np.abs(wanted).max()
    assert (np.abs(found.values - wanted) <= upper - lower + bias).all()
    with pytest.raises(ContactError, match=r"s \(up to [^N]* Nm\)"):
        identify_floating(ROBOT, q, v, a, base, torque, hung_at_m=point + 0.2)
    with pytest.raises(InputError, match="mass_kg: expected none with hung_at_m"):
        identify_floating(ROBOT, q, v, a, base, hung_at_m=point, mass_kg=3.0)


def test_a_contact_is_refused_with_its_times():
    n = 4000
    weight = 9.81 * ROBOT.inertia_matrix(np.zeros(4))[0, 0]
    pushed = np.zeros((n, 6))
    pushed[1000:1500, 2] = 0.6 * weight
    pushed[3000:3100, :3] = weight * np.array([0.4, 0.0, 0.4])
    q, v, a, base, torque = flight(n, pushed=pushed)
    with pytest.raises(
        ContactError, match="expected no wrench on it but the measured one"
    ) as caught:
        identify_floating(ROBOT, q, v, a, base, torque, sample_time_s=STEP_S)
    wanted = ((1.0, 1.499), (3.0, 3.099))
    assert np.allclose(caught.value.intervals_s, wanted, atol=STEP_S)
    # The wrench is measured: nothing is left.
    assert contact_check(ROBOT, q, v, a, base, wrench=pushed).is_free
    free = pushed.any(axis=1)
    assert contact_check(ROBOT, q[~free], v[~free], a[~free], base[~free]).is_free


@pytest.mark.parametrize("seed", range(5))
def test_free_flight_with_noise_and_wrong_masses_is_no_contact(seed: int):
    q, v, a, base, _ = flight(seed=seed)
    rng = np.random.default_rng(seed)
    rate, growth, proper = base.parts()
    shaken = BaseMotion(
        rate,
        growth + 0.5 * rng.normal(size=growth.shape),
        proper + 0.2 * rng.normal(size=proper.shape),
    )
    assert contact_check(ROBOT, q, v, a, shaken).is_free
    nominal = TorqueModel(ROBOT, side="base").nominal
    wrong = nominal * np.repeat(rng.uniform(0.85, 1.15, size=5), 10)
    assert contact_check(ROBOT, q, v, a, shaken, parameters=wrong).is_free


def test_a_robot_on_the_ground_is_a_contact_throughout():
    # Gentle: the links accelerate by less than gravity.
    q, v, a = waves(2000, 4, 9, size=0.02)
    base = BaseMotion.at_rest(np.broadcast_to(np.eye(3), (2000, 3, 3)))
    found = contact_check(ROBOT, q, v, a, base, sample_time_s=STEP_S)
    assert found.intervals_s == ((0.0, 1.999),)


def test_motion_capture_and_imu_give_the_motion_of_the_base():
    n = 6000
    joints = waves(n, 4, 10)
    place = waves(n, 3, 11)
    vector = waves(n, 3, 12, size=0.3)
    turned = scipy.spatial.transform.Rotation.from_rotvec(vector[0])
    # Exact rates of a rotation vector, by central differences of a hundredth of a sample.
    fine = 1e-5

    def spin(shift: float) -> Array:
        def at(s: float) -> scipy.spatial.transform.Rotation:
            ahead = vector[0] + s * vector[1] + s**2 / 2 * vector[2]
            return scipy.spatial.transform.Rotation.from_rotvec(ahead)

        between = at(shift - fine).inv() * at(shift + fine)
        return np.asarray(between.as_rotvec() / (2 * fine))

    rate, growth = spin(0.0), (spin(1e-4) - spin(-1e-4)) / 2e-4
    proper = turned.inv().apply(place[2] + [0.0, 0.0, 9.81])
    options = {"sample_time_s": STEP_S, "cutoff_hz": 30.0, "decimation": 1}
    quaternion = turned.as_quat()
    quaternion[2000:4000] *= -1.0
    found = record_of_pose(joints[0], place[0], quaternion, joints[2], **options)
    kept = slice(found.filtered.dropped[0], n - found.filtered.dropped[1])
    assert found.torque_nm is not None
    # At 1.9 Hz the filter of 30 Hz and the differences leave less than 1e-4; the third derivatives of the rotation
    # vector that `spin` leaves out are 1e-3 of a second in 1e-4 s.
    for got, wanted in zip(found.base.parts(), (rate, growth, proper), strict=True):
        assert np.abs(got - wanted[kept]).max() < 3e-3 * np.abs(wanted).max()
    assert np.abs(found.a - joints[2][kept]).max() < 1e-3 * np.abs(joints[2]).max()
    p = np.array([0.1, -0.2, 0.3])
    force = proper + np.cross(growth, p) + np.cross(rate, np.cross(rate, p))
    found = record_of_imu(joints[0], rate, force, position_m=p, **options)
    for got, wanted in zip(found.base.parts(), (rate, growth, proper), strict=True):
        assert np.abs(got - wanted[kept]).max() < 3e-3 * np.abs(wanted).max()
    with pytest.raises(InputError, match="unit length"):
        record_of_pose(joints[0], place[0], 2 * quaternion, **options)


def test_friction_and_rotors_are_columns_of_the_joints_only():
    terms = DriveTerms(inertia="joint", viscous="joint", coulomb="joint", offset="joint")
    model = TorqueModel(ROBOT, terms=terms)
    q, v, a, base, torque = flight()
    motion = floating_motion(ROBOT, q, v, a, base)
    friction = 0.3 * v + 0.5 * np.sign(v) + 0.1 + 0.02 * a
    extra = [i for i, column in enumerate(model.columns) if column.extra is not None]
    assert not model.matrix(*motion)[:, :6, extra].any()
    found = identify_rigid_body(
        model, *motion, np.hstack([np.zeros((len(q), 6)), torque + friction])
    )
    by_name = dict(zip(found.names, found.values, strict=True))
    for name, wanted in (
        ("joint_viscous_friction", 0.3),
        ("joint_coulomb_friction", 0.5),
        ("joint_torque_offset", 0.1),
        ("joint_rotor_inertia", 0.02),
    ):
        for joint in ROBOT.joint_names:
            assert abs(by_name[f"{joint}.{name}"] - wanted) < 1e-6


def test_what_has_no_floating_base_says_so():
    q, v, a, base, torque = flight(100)
    with pytest.raises(InputError, match="expected 100 rows as q, got 99"):
        floating_motion(ROBOT, q, v[:99], a, base)
    with pytest.raises(InputError, match='torque_nm: expected torques with side="joint"'):
        identify_floating(TorqueModel(ROBOT), q, v, a, base)
    with pytest.raises(InputError, match='torque_nm: expected none with side="base"'):
        identify_floating(ROBOT, q, v, a, base, torque, side="base")
    with pytest.raises(InputError, match="energy"):
        energy_regressor(TorqueModel(ROBOT), q, v)
    with pytest.raises(
        RobotError, match="identify_logs: expected a fixed base, got a floating one"
    ):
        identify_logs(ROBOT, [object()])  # type: ignore[list-item]
    fixed = Robot.from_toml(
        ROBOT.toml[: ROBOT.toml.index("[base]")] + ROBOT.toml[ROBOT.toml.index("[[joint]]") :]
    )
    with pytest.raises(InputError, match="robot: expected a floating base"):
        floating_motion(fixed, q, v, a, base)
    with pytest.raises(InputError, match='expected "motor" or "joint" for a fixed base'):
        TorqueModel(fixed, side="base")
    with pytest.raises(InputError, match="hung_at_m: expected none for a fixed base"):
        TorqueModel(fixed, hung_at_m=[0.0, 0.0, 0.0])

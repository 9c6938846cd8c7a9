"""The arm let go: our trajectory against MuJoCo and against Pinocchio with SciPy.

Everything that acts is in it: gravity, velocity products, gears, elastic joints, motors. The
robot rests away from its operating point, then its motors give no torque and it falls.

Distances are largest differences over the fall, relative to the largest travel of the motors
or joints compared. Tolerance: each side keeps its local errors below 1e-12 of the states per
sub-step, 600 samples at worst add them up, 6e-10, and states up to ten times as large as
their travel make it 6e-9. MuJoCo's massless links weigh 1e-9 kg, against inertias of 10 kg m^2
and more: less than that. A number wrong by a thousandth misses by at least a hundred
tolerances, in fact by 5e-5 (mass of the upper arm) to 1e-3 (gravity).
"""

import tomllib
from importlib import resources

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import axisight
import pinocchio_model
from axisight import _core

Array = NDArray[np.float64]
N_SAMPLES = 601
START_RAD = (0.4, 0.3, -0.5)
LOCAL_ERROR = 1e-12
TOLERANCE = 10 * N_SAMPLES * LOCAL_ERROR
TEXT = (resources.files("axisight.robot.presets") / "irb6600_like.toml").read_text("utf-8")
# One number of the description off by a thousandth: gravity, or the mass of a link.
WRONG = {
    "gravity": ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -9.81981]"),
    "mass of the upper arm": ("mass = 260.0", "mass = 260.26"),
    "mass of the forearm": ("mass = 680.0", "mass = 680.68"),
}


def changed(name: str) -> str:
    old, new = WRONG[name]
    assert TEXT.count(old) == 1
    return TEXT.replace(old, new)


@pytest.fixture(scope="module")
def fall() -> Array:
    """Our positions (n, motors and joints)."""
    out = axisight.simulate(
        axisight.load_robot("irb6600_like"),
        torque_nm=np.zeros((N_SAMPLES, 3)),
        start_rad=START_RAD,
        tolerance=LOCAL_ERROR,
    )
    assert out.attrs["status"] == "completed"
    return np.hstack([out["motor_position_rad"], out["joint_position_rad"]])


def start() -> Array:
    """Angles at rest under the right gravity, motors then joints."""
    rest = _core.Robot.from_toml(TEXT).equilibrium([], list(START_RAD))
    return np.concatenate([rest["motor_angle"], rest["joint_angle"]])


def distance(got: Array, want: Array, n_motors: int = 3) -> float:
    parts = np.split(got - want, [n_motors], axis=1)
    travels = np.split(want - want[0], [n_motors], axis=1)
    pairs = zip(parts, travels, strict=True)
    return max(float(np.abs(e).max() / np.abs(t).max()) for e, t in pairs)


def by_pinocchio(text: str) -> Array:
    """Articulated-body algorithm, motors and springs by hand, DOP853."""
    model = pinocchio_model.build(text)
    data = model.createData()
    joints = tomllib.loads(text)["joint"]
    driven = [i for i, j in enumerate(joints) if j["kind"] == "driven"]
    stiffness = np.array([j["stiffness"] for j in joints])
    damping = np.array([j["damping"] for j in joints])
    drives = [joints[i]["drive"] for i in driven]
    ratio, inertia, viscous = (
        np.array([d[key] for d in drives])
        for key in ("gear_ratio", "motor_inertia", "viscous_friction")
    )
    m, n = len(driven), len(joints)

    def slope(_: float, x: Array) -> Array:
        phi, q, w, v = np.split(x, [m, m + n, 2 * m + n])
        deflection, rate = -q, -v
        deflection[driven] += ratio * phi
        rate[driven] += ratio * w
        torque = stiffness * deflection + damping * rate
        acceleration = pin.aba(model, data, q, v, torque)
        motor = (-viscous * w - ratio * torque[driven]) / inertia
        return np.concatenate([w, v, motor, acceleration])

    angles = start()
    times = np.arange(N_SAMPLES) * 5e-4
    out = solve_ivp(
        slope,
        (0, times[-1]),
        np.concatenate([angles, np.zeros(m + n)]),
        "DOP853",
        times,
        rtol=LOCAL_ERROR,
        atol=LOCAL_ERROR * 1e-3,
        # Within the steps of the structural modes, so that dense output is as exact.
        max_step=5e-4,
    )
    assert out.success
    return np.asarray(out.y[: m + n].T)


def by_mujoco(text: str, substeps: int = 16) -> Array:
    """Fourth-order Runge-Kutta with an error of 3e-7 at one sub-step, 16^4 times less here."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `blind`")
    import mujoco_model  # noqa: PLC0415

    model = mujoco.MjModel.from_xml_string(mujoco_model.build(text, "RK4", 5e-4 / substeps))
    data = mujoco.MjData(model)
    data.qpos[:] = start()
    out = [data.qpos.copy()]
    for _ in range(N_SAMPLES - 1):
        mujoco.mj_step(model, data, substeps)
        out.append(data.qpos.copy())
    return np.array(out)


ORACLES = {"pinocchio": by_pinocchio, "mujoco": by_mujoco}


@pytest.mark.parametrize("oracle", ORACLES)
def test_arm_falls_as_in(oracle: str, fall: Array) -> None:
    want = ORACLES[oracle](TEXT)
    # A fall worth the name: degrees, and deflections that ring.
    assert np.abs(want[-1] - want[0])[3:].max() > 0.1
    assert distance(fall, want) < TOLERANCE


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("oracle", ORACLES)
def test_a_thousandth_shows(oracle: str, wrong: str, fall: Array) -> None:
    assert distance(fall, ORACLES[oracle](changed(wrong))) > 100 * TOLERANCE

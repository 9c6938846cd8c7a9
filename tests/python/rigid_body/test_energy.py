"""Work and energy of a driven arm: what the motors and the effects put in is what it has.

The arm starts at rest and its motors take constant torques, which accelerate, lift and drop
it; gravity, gears, elastic joints, viscous and dry friction and the torque ripple of thesis
Table 8.1 take part. Energies come from the rigid-body functions, powers from the logged
`torque_disturbance_nm`, rates from the logged positions.

Tolerance: rates by differences of order 4 miss a share `(w h)^4 / 30` of a motion of
frequency `w` at sample time `h`, and Simpson's rule `(w h)^4 / 180` of its work. Were all that
is exchanged in the fastest motion there is, both together would be `(w h)^4 / 25`. The fastest
is either a mode or the highest harmonic at the highest motor speed.
"""

import tomllib
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

import axisight
from axisight import Effect, Robot, _core, load_robot

Array = NDArray[np.float64]
START_RAD = (0.3, 0.4, -0.3)
SAMPLE_TIME_S = 1e-4
DURATION_S = 0.15
# Torque added to the one that holds the arm [Nm].
PUSH_NM = np.array([2.0, -3.0, 1.5])
RIPPLE = {
    "order_1": 3.0, "cosine_1_nm": 0.06 * np.sin(1.45), "sine_1_nm": 0.06 * np.cos(1.45),
    "order_2": 36.0, "cosine_2_nm": 0.11 * np.sin(0.9), "sine_2_nm": 0.11 * np.cos(0.9),
    "order_3": 72.0, "cosine_3_nm": 0.08 * np.sin(0.2), "sine_3_nm": 0.08 * np.cos(0.2),
    "order_u": 18.0, "sine_u": 0.04,
}  # fmt: skip
EFFECTS = [
    effect
    for axis in (1, 2, 3)
    for effect in (
        Effect("torque_ripple", axis, RIPPLE),
        Effect("coulomb_friction", axis, {"coulomb_nm": 0.5, "smoothing_rad_s": 1.0}),
    )
]


def derivative(x: Array, h: float) -> Array:
    """Differences of order 4, one-sided at the ends."""
    out = np.empty_like(x)
    out[2:-2] = (x[:-4] - 8 * x[1:-3] + 8 * x[3:-1] - x[4:]) / (12 * h)
    for i in (0, 1):
        out[i] = _one_sided(x[i : i + 5], h)
        out[-1 - i] = -_one_sided(x[::-1][i : i + 5], h)
    return out


def _one_sided(x: Array, h: float) -> Array:
    return np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) @ x / (12 * h)


@dataclass
class Balance:
    """Energies and works since the start [J], (n,)."""

    kinetic: Array
    stored: Array
    motors: Array
    effects: Array
    losses: Array
    fastest_rad_s: float

    def gap(self, **shares: float) -> float:
        """Largest imbalance over the energy exchanged; a share of a term may be left out."""
        work = self.motors + shares.get("effects", 1) * self.effects
        work = work - shares.get("losses", 1) * self.losses
        energy = shares.get("kinetic", 1) * self.kinetic + shares.get("stored", 1) * self.stored
        return float(np.abs(energy - energy[0] - work).max() / np.abs(self.motors).max())


def balance(sample_time: float) -> Balance:
    text = load_robot("irb6600_like").toml
    assert "sample_time = 5.0e-4" in text
    text = text.replace("sample_time = 5.0e-4", f"sample_time = {sample_time}")
    robot = Robot(_core.Robot.from_toml(text))
    torque = robot.equilibrium(START_RAD, EFFECTS)["motor_torque_nm"].values + PUSH_NM
    n = round(DURATION_S / sample_time) + 1
    out = axisight.simulate(
        robot,
        torque_nm=np.tile(torque, (n, 1)),
        start_rad=START_RAD,
        effects=EFFECTS,
        tolerance=1e-10,
    )
    assert out.attrs["status"] == "completed"
    phi, q = out["motor_position_rad"].values, out["joint_position_rad"].values
    w, v = derivative(phi, sample_time), derivative(q, sample_time)
    joints = tomllib.loads(text)["joint"]
    driven = [i for i, j in enumerate(joints) if j["kind"] == "driven"]
    drives = [joints[i]["drive"] for i in driven]
    ratio, inertia, viscous = (
        np.array([d[key] for d in drives])
        for key in ("gear_ratio", "motor_inertia", "viscous_friction")
    )
    stiffness, damping = (np.array([j[key] for j in joints]) for key in ("stiffness", "damping"))
    deflection, rate = -q, -v
    deflection[:, driven] += ratio * phi
    rate[:, driven] += ratio * w
    links = robot.core.energy(np.ascontiguousarray(q), np.ascontiguousarray(v))
    lost = w**2 @ viscous + rate**2 @ damping
    added = (out["torque_disturbance_nm"].values * w).sum(axis=1)
    modes = np.abs(robot.modes(START_RAD)["eigenvalue_rad_s"].values).max()
    return Balance(
        kinetic=links[:, 0] + 0.5 * w**2 @ inertia,
        stored=links[:, 1] + 0.5 * deflection**2 @ stiffness,
        # The torque is held: its work is exact.
        motors=(phi - phi[0]) @ torque,
        effects=cumulative_simpson(added, dx=sample_time, initial=0),
        losses=cumulative_simpson(lost, dx=sample_time, initial=0),
        fastest_rad_s=max(float(modes), 72 * float(np.abs(w).max())),
    )


@pytest.fixture(scope="module")
def coarse() -> Balance:
    return balance(SAMPLE_TIME_S)


def tolerance(found: Balance, sample_time: float) -> float:
    return (found.fastest_rad_s * sample_time) ** 4 / 25


def test_work_is_energy(coarse: Balance) -> None:
    bound = tolerance(coarse, SAMPLE_TIME_S)
    assert coarse.gap() < bound


def test_what_is_left_falls_with_the_step(coarse: Balance) -> None:
    """By 16 when all of it is of order 4, by 8 where the one-sided ends prevail."""
    fine = balance(SAMPLE_TIME_S / 2)
    assert fine.gap() < coarse.gap() / 8


@pytest.mark.parametrize("term", ["kinetic", "stored", "effects", "losses"])
def test_every_term_counts(coarse: Balance, term: str) -> None:
    """A hundredth of any of them left out shows."""
    assert coarse.gap(**{term: 0.99}) > 10 * tolerance(coarse, SAMPLE_TIME_S)

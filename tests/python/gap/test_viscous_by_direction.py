"""Friction by direction and a constant torque, on a slide whose force is written in closed form."""

from pathlib import Path

import numpy as np
import pytest

from axisight import Diagnosis, Effect, Log, Settings, diagnose, load_robot, simulate
from axisight.fitting import effect_parameter, fit
from gap_data import bare_axis, reference

SLIDE = Path(__file__).resolve().parents[3] / "examples" / "emps" / "robot.toml"
MASS_KG, VISCOUS, COULOMB_N, HALF = 95.1, 203.0, 20.4, -40.0
STEP_S, RAMP_S, TRAVEL_M, PAUSE_S = 2e-3, 0.15, 0.15, 0.2
# Of the sensors of the EMPS.
FORCE_NOISE_N, POSITION_NOISE_M = 0.7, 2e-6
EST, VAL = (0.08, 0.125, 0.05), (0.1, 0.06, 0.125)


def speed_of(speeds: tuple[float, ...], seconds: float) -> np.ndarray:
    """Return trapezoids forth and back at each speed in turn (n,) [m/s], corners rounded over 50 ms."""
    out: list[np.ndarray] = []
    ramp, pause = np.linspace(0, 1, round(RAMP_S / STEP_S)), np.zeros(round(PAUSE_S / STEP_S))
    for k in range(round(seconds)):
        v = speeds[k % len(speeds)]
        way = v * np.concatenate([ramp, np.ones(round(TRAVEL_M / v / STEP_S)), ramp[::-1]])
        out += [way, pause, -way, pause]
    window = np.hanning(round(0.05 / STEP_S))
    speed = np.concatenate(out)[: round(seconds / STEP_S)]
    return np.convolve(speed, window / window.sum(), mode="same")


def slide_log(
    name: str, speeds: tuple[float, ...], seed: int, half: float = 0.0, offset_n: float = 0.0
) -> Log:
    """Return a log of the slide: M a + F_v v + D |v| + F_c sign(v) + offset, and noise."""
    v = speed_of(speeds, 16.0)
    rng, n = np.random.default_rng(seed), len(v)
    force = MASS_KG * np.gradient(v, STEP_S) + VISCOUS * v + half * np.abs(v)
    force += COULOMB_N * np.tanh(v / 1e-3) + offset_n + FORCE_NOISE_N * rng.standard_normal(n)
    position = np.cumsum(v) * STEP_S + POSITION_NOISE_M * rng.standard_normal(n)
    return Log(
        name=name,
        source=Path(name),
        sample_time_s=STEP_S,
        time_s=STEP_S * np.arange(n),
        torque_nm=force[:, None],
        position_rad=position[:, None],
    )


def diagnosed(est: tuple[float, ...] = EST, val: tuple[float, ...] = VAL, **of: float) -> Diagnosis:
    return diagnose(
        robot=load_robot(SLIDE),
        estimation=[slide_log("estimation", est, 1, **of)],
        validation=[slide_log("validation", val, 2, **of)],
        settings=Settings(bootstrap=100),
    )


def names(found: Diagnosis) -> set[str]:
    return {c.effect for c in found.causes}


def test_viscous_friction_by_direction_is_named_and_no_offset():
    found = diagnosed(half=HALF)
    assert names(found) == {"coulomb_friction", "viscous_friction", "viscous_asymmetry"}
    cause = next(c for c in found.causes if c.effect == "viscous_asymmetry")
    assert cause.probability > 0.9
    value = cause.parameters["half_difference_nm_s_rad"]
    assert value.low <= HALF <= value.high
    # Three per cent: noise of 0.7 N on 8000 samples at 0.08 m/s is 0.1 N s/m; the rest is corners of the low-pass.
    assert value.value == pytest.approx(HALF, rel=0.03)
    assert found.gap.after < 1.1 * found.gap.floor


def test_an_offset_stays_an_offset():
    found = diagnosed(offset_n=-3.2)
    assert names(found) == {"coulomb_friction", "viscous_friction", "torque_offset"}


def test_friction_that_is_the_same_in_both_directions_has_no_asymmetry():
    assert names(diagnosed()) == {"coulomb_friction", "viscous_friction"}


def test_a_fit_recovers_it_from_the_closed_loop():
    """From no asymmetry, without noise: what is left is where the search stops."""
    robot, corner = bare_axis(), {"smoothing_rad_s": 0.05}
    truth = Effect("viscous_asymmetry", 1, {"half_difference_nm_s_rad": 0.004, **corner})
    wanted = reference("multisine", 1, 6000, robot.sample_time_s)
    data = simulate(robot, wanted, effects=[truth])
    log = Log(
        name="loop",
        source=Path("loop"),
        sample_time_s=robot.sample_time_s,
        time_s=data.time.values,
        velocity_ref_rad_s=wanted,
        torque_nm=data.torque_cmd_nm.values,
        position_rad=data.position_rad.values,
    )
    placed = robot.placed([Effect("viscous_asymmetry", 1, corner)])
    free = [effect_parameter(placed, 0, "half_difference_nm_s_rad")]
    found = fit(robot, [log], free, effects=placed)
    assert found.status.endswith("converged")
    assert found.values[0] == pytest.approx(0.004, rel=1e-6)

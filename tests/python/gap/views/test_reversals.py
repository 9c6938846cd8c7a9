"""Simulators with dry friction, complete or not, by inverse dynamics: reversals and rests are no causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Robot, Settings, diagnose
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.signals.motion import Filtering
from axisight.gap.signals.standstill import alike
from axisight.gap.verdict.carry_over import open_check
from axisight.gap.views.choice import view_of
from axisight.gap.views.inverse_dynamics import InverseView
from axisight.logs import Log, lowpass
from rigid_arm import MASSES, arm, motor_inertia

Array = NDArray[np.float64]
Motion = tuple[Array, Array, Array]
COULOMB_NM = (5.0, 8.0, 6.0, 2.0, 2.0, 1.0)
STEP_S, SAMPLES = 0.01, 2000
QUICK = Settings(bootstrap=50)


def simulator(without: int | None = None) -> Robot:
    """The arm with Coulomb friction on all axes, but for one."""
    found = [
        Effect("coulomb_friction", axis, {"coulomb_nm": level, "smoothing_rad_s": 0.01})
        for axis, level in enumerate(COULOMB_NM, 1)
        if axis != without
    ]
    return arm().with_effects(found)


def sines(rng: np.random.Generator) -> Motion:
    """Sums of sines: reversals at every acceleration, no rest."""
    t = STEP_S * np.arange(SAMPLES)[:, None, None]
    w = 2 * np.pi * rng.uniform(0.1, 0.8, (6, 4))
    phase = rng.uniform(0, 2 * np.pi, (6, 4))
    waves = 0.2 * np.exp(1j * (w * t + phase))
    return waves.imag.sum(-1), (w * waves).real.sum(-1), -(w**2 * waves.imag).sum(-1)


def moves(rng: np.random.Generator) -> Motion:
    """Quintics from rest to rest, which begin and end more slowly than any noise."""
    q, v, a = np.zeros((3, SAMPLES, 6))
    for axis in range(6):
        first, at = 0, 0.0
        while first < SAMPLES:
            n = int(rng.uniform(80, 200))
            to = rng.uniform(-1, 1)
            s, time, far = np.arange(n) / n, n * STEP_S, to - at
            kept = slice(first, first + n)
            q[kept, axis] = (at + far * (10 * s**3 - 15 * s**4 + 6 * s**5))[: SAMPLES - first]
            v[kept, axis] = (far * 30 * (s - s**2) ** 2 / time)[: SAMPLES - first]
            a[kept, axis] = (far * 60 * (s - 3 * s**2 + 2 * s**3) / time**2)[: SAMPLES - first]
            q[first + n : first + n + 30, axis] = to
            first, at = first + n + 30, to
    return q, v, a


def trapezoids(rng: np.random.Generator) -> Motion:
    """Trapezoids of speed, to and fro, with rests."""
    a = np.zeros((SAMPLES, 6))
    for axis in range(6):
        parts: list[Array] = []
        while sum(map(len, parts)) < SAMPLES:
            ramp, run = int(rng.uniform(15, 40)), int(rng.uniform(20, 80))
            sizes = (
                (ramp, 1),
                (run, 0),
                (ramp, -1),
                (20, 0),
                (ramp, -1),
                (run, 0),
                (ramp, 1),
                (20, 0),
            )
            level = rng.uniform(2, 5)
            parts += [np.full(n, level * sign) for n, sign in sizes]
        a[:, axis] = np.concatenate(parts)[:SAMPLES]
    v = np.zeros_like(a)
    v[1:] = np.cumsum(a[:-1], axis=0) * STEP_S
    q = np.zeros_like(a)
    q[1:] = np.cumsum(v[:-1] * STEP_S + a[:-1] * STEP_S**2 / 2, axis=0)
    # Where it jumps, at a sample, the acceleration is that of neither side.
    a[1:] = (a[1:] + a[:-1]) / 2
    return q, np.where(np.abs(v) < 1e-9, 0.0, v), a


MOTIONS = {"sines": sines, "moves": moves, "trapezoids": trapezoids}


def logs_of(kind: str, noise: float) -> list[Log]:
    """Three logs of a machine whose friction changes its sign abruptly, and is zero at rest."""
    out = []
    for run in range(3):
        rng = np.random.default_rng([run, len(kind)])
        q, v, a = MOTIONS[kind](rng)
        rotors = np.array([motor_inertia(mass) for mass in MASSES])
        torque = arm().inverse_dynamics(q, v, a) + a * rotors + np.sign(v) * COULOMB_NM
        out.append(
            Log(
                name=f"run {run}",
                sample_time_s=STEP_S,
                time_s=STEP_S * np.arange(SAMPLES),
                position_rad=q + 1e-5 * noise * rng.normal(size=q.shape),
                velocity_rad_s=v + 1e-3 * noise * rng.normal(size=q.shape),
                torque_nm=torque + 0.2 * noise * rng.normal(size=q.shape),
                source=Path(f"run{run}"),
            )
        )
    return out


@pytest.mark.parametrize("noise", [1.0, 4.0])
@pytest.mark.parametrize("kind", MOTIONS)
def test_a_complete_simulator_lacks_nothing(kind: str, noise: float) -> None:
    logs = logs_of(kind, noise)
    found = diagnose(robot=simulator(), estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert found.verdict == "none", found.headline
    # Nothing stands above the noise but what a law leaves open, and that is said.
    said = any("friction can hold any torque within its band" in c for c in found.checks)
    assert said or found.gap.after < 1.3 * found.gap.floor + 0.03


@pytest.mark.parametrize("kind", MOTIONS)
def test_friction_of_one_axis_is_found_beside_that_of_the_others(kind: str) -> None:
    logs = logs_of(kind, 1.0)
    found = diagnose(
        robot=simulator(without=2), estimation=logs[:2], validation=logs[2:], settings=QUICK
    )
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 2)]
    level = found.causes[0].parameters["coulomb_nm"]
    # An abrupt sign is fitted by a rounded one, which lacks half a percent at ten times its corner.
    assert level.value == pytest.approx(COULOMB_NM[1], rel=0.03)


def test_both_sides_pass_the_same_filter() -> None:
    """Torque of a motion without noise and friction that jumps: predicted as measured, below the cutoff."""
    (log, *_) = logs_of("sines", 0.0)
    filtering = Filtering(5.0)
    friction = np.sign(log.velocity_rad_s) * COULOMB_NM
    late = np.sign(filtering(log)[1]) * COULOMB_NM
    alike_filtered = filtering.compared(late - friction, STEP_S)
    smeared = np.sign(lowpass(log.velocity_rad_s, STEP_S, 5.0)) * COULOMB_NM - lowpass(
        friction, STEP_S, 5.0
    )
    inner = slice(50, -50)
    # The motion's own low-pass moves a reversal by less than a sample or two; a smeared jump is off by
    # half of it over a tenth of a second.
    assert np.std(alike_filtered[inner]) < 0.3 * np.std(smeared[inner])


def test_the_table_of_weights_is_the_filter() -> None:
    logs = logs_of("sines", 1.0)
    view = view_of(simulator(), logs[:2], logs[2:], QUICK)
    assert isinstance(view, InverseView)
    weighting, filtering = view.fitter.weighting, view.filtering
    rng = np.random.default_rng(0)
    torque = rng.normal(size=(SAMPLES, 6)).cumsum(axis=0)
    low = filtering.compared(torque, STEP_S)
    decimation = weighting.decimation
    kept = low[: SAMPLES // decimation * decimation : decimation]
    weighted = weighting.of(torque, STEP_S) / (weighting.weight[:, 0] * np.sqrt(decimation))
    inner = slice(20, -20)
    # Bilinear warping, what lies above the lower Nyquist frequency, and half a sample of decimation.
    assert np.std((weighted - kept)[inner]) < 0.05 * np.std(kept[inner])


def test_what_is_open_spreads_as_far_as_the_filter_rings() -> None:
    filtering = Filtering(5.0)
    size = np.zeros((800, 1))
    size[400:430] = 1.0
    spread = filtering.spread(size, STEP_S)
    rng = np.random.default_rng(0)
    for _ in range(20):
        signs = rng.choice([-1.0, 1.0], size.shape)
        assert np.all(np.abs(filtering.compared(size * signs, STEP_S)) <= spread + 1e-3)
    assert np.all(spread[:330] < 1e-2) and np.all(spread[500:] < 1e-2)


def test_a_stretch_at_rest_counts_once() -> None:
    still = np.array([[1.0, 0.9, 0.1, 0.0, 0.8, 0.6, 0.7, 0.2]]).T
    np.testing.assert_array_equal(alike(still)[:, 0], [2, 2, 1, 1, 3, 3, 3, 1])
    assert np.all(alike(np.zeros((5, 2))) == 1)


def stage(size: float) -> Stage:
    """A stage of one log and one axis, and so large everywhere."""
    return Stage((np.full((4, 1), size**2),), size)


def test_what_is_open_is_said_where_it_stands_above_the_noise() -> None:
    noise, gap, opened = stage(0.01), stage(0.13), stage(0.4)
    (said,) = open_check(Stages(gap, gap, gap, noise, opened))
    assert "Up to 40 % of the torque cannot be known there" in said
    assert open_check(Stages(gap, gap, noise, noise, opened)) == ()
    assert open_check(Stages(gap, gap, gap, noise)) == ()

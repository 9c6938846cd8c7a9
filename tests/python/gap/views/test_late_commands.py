"""Commands that act late, where only the motion is compared: what is asked for comes before what it does."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, diagnose
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.signals.motion import motion
from axisight.gap.simulator.rigid_torque import predicted_torque
from rigid_arm import RATE_HZ, arm, log_of

ROBOT = arm()
DELAY = Effect("input_delay", 2, {"delay_s": 0.02})
LAG = Effect("actuator_bandwidth", 2, {"time_constant_s": 0.015})
LOOP = Effect("current_loop", 2, {"time_constant_s": 0.01, "damping": 0.7})


def bare(run: int) -> Log:
    """A log without friction."""
    return log_of(ROBOT, run, seconds=40.0, coulomb=np.zeros(6), viscous=np.zeros(6))


def commanded_early(run: int, samples: float) -> Log:
    """A log whose second axis got its torque so late: what was logged came before."""
    log = bare(run)
    torque, place = log.torque_nm.copy(), np.arange(log.n_samples)
    torque[:, 1] = np.interp(place + samples, place, torque[:, 1])
    return replace(log, torque_nm=torque)


@pytest.mark.parametrize("effect", [DELAY, LAG, LOOP], ids=lambda e: e.name)
def test_what_was_commanded_is_what_acts_later(effect: Effect):
    """Filtered by its formula, the predicted command is the torque along the motion: to 1e-3 of it in its middle.

    Harmonics up to 0.5 Hz, 100 samples a second: central differences are off by (w T)^2 / 6, 2e-4.
    """
    at = motion(bare(0), 5.0)
    acts, command = (
        predicted_torque(ROBOT, Variant({}, effects), at)[:, 1] for effects in ((), (effect,))
    )
    frequency = np.fft.rfftfreq(len(command), 1 / RATE_HZ)
    s = 2j * np.pi * frequency
    values = effect.parameters or {}
    time = values.get("time_constant_s", 0.0)
    response = {
        DELAY.name: np.exp(-s * 0.02),
        LAG.name: 1 / (1 + time * s),
        LOOP.name: 1 / (1 + 2 * 0.7 * time * s + (time * s) ** 2),
    }[effect.name]
    # Whole periods: the motion repeats every ten seconds.
    got = np.fft.irfft(response * np.fft.rfft(command), len(command))
    inner = slice(1000, 3000)
    size = acts[inner].std()
    assert np.abs(got - acts)[inner].max() < 1e-3 * size
    # And not by doing nothing.
    assert np.abs(command - acts)[inner].max() > 0.03 * size


def test_a_delay_is_named_and_no_friction():
    """It was viscous friction below zero, for certain."""
    logs = [commanded_early(k, 2) for k in (0, 1, 2, 5)]
    said = diagnose(robot=ROBOT, estimation=logs[:3], validation=logs[3:])
    assert said.mode == "inverse_dynamics"
    (cause,) = said.causes
    assert cause.label == DELAY.label
    # Of a slow motion delays and lags are much the same.
    found = cause.parameters["delay_s"]
    assert found.value == pytest.approx(0.02, rel=0.05)
    timing = {"input_delay@2", "current_loop@2", "actuator_bandwidth@2"}
    assert {x for group in said.equivalent for x in group} <= timing


def test_what_a_drive_holds_for_a_sample_is_no_delay():
    """A command that holds until the next one acts half a sample late."""
    logs = [commanded_early(k, 0.5) for k in (0, 1, 2, 5)]
    said = diagnose(robot=ROBOT, estimation=logs[:3], validation=logs[3:])
    assert said.causes == ()


def test_beside_another_cause_nothing_is_looked_for_that_is_late():
    logs = [log_of(ROBOT, k, seconds=40.0) for k in (0, 1, 2, 5)]
    said = diagnose(robot=ROBOT, estimation=logs[:3], validation=logs[3:])
    assert {c.effect for c in said.causes} == {"coulomb_friction", "viscous_friction"}

"""Pairs of causes that weak logs leave open, and what the designed experiment makes of them.

    python benches/separating.py [NAME ...]

One elastic axis, simulated: two logs to fit and choose on, one to validate, 6 s each, which hardly show
the effect that is withheld. Diagnosed, with the experiment that separates the rivals, or with the one that
shows an effect which such logs would not; run as often as it says, on the same machine; diagnosed again
with those runs beside the logs.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight import Diagnosis, Effect, Log, Robot, diagnose, load_robot, simulate
from axisight.gap import ExperimentLimits

Array = NDArray[np.float64]

SECONDS = 6.0
# Noise of the positions of a motor: of 15 bits in a turn, and of the preset.
COARSE_RAD, FINE_RAD = 2e-4, 1.2e-5


@dataclass(frozen=True)
class Wave:
    """A velocity reference [rad/s]: a multisine of ``peak`` in ``band_hz`` on a square wave or a constant speed.

    Or on a ``sine`` of a peak and a frequency [Hz]. From rest within ``rises_s``.
    """

    peak: float
    band_hz: tuple[float, float]
    square: float = 0.0
    level: float = 0.0
    rises_s: float = 0.1
    sine: tuple[float, float] = (0.0, 0.0)

    def __call__(self, seed: int, step: float) -> Array:
        """Return one of them, (n, 1)."""
        time = np.arange(round(SECONDS / step)) * step
        lines = np.arange(*self.band_hz, 0.25 if self.rises_s > 1 else 0.5)
        phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
        waves = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
        turns = np.tanh(20 * np.sin(2 * np.pi * time / 3.0))
        full = self.peak * waves / np.abs(waves).max() + self.square * turns
        full += self.sine[0] * np.cos(2 * np.pi * self.sine[1] * time + seed)
        full += self.level + 0.1 * seed * (self.level > 0)
        rise = np.minimum(time / self.rises_s, 1.0)
        return ((rise if self.rises_s < 1 else np.sin(0.5 * np.pi * rise) ** 4) * full)[:, None]


@dataclass(frozen=True)
class FadingTurns:
    """A velocity reference [rad/s] to and fro, its acceleration [rad/s^2] falling with speed as Stribeck's excess.

    ``acceleration`` at standstill; to twice ``speed``, over which it falls to 1/e. From rest, without chance: of
    even seeds the other way.
    """

    acceleration: float
    speed: float

    def __call__(self, seed: int, step: float) -> Array:
        """Return one of them, (n, 1)."""
        time = np.arange(round(SECONDS / step)) * step
        speed = np.linspace(0.0, 2.0, 2000)
        # The time to a speed, of v' = a exp(-(v / v_s)^2).
        since_rest = (
            0.5 * np.sqrt(np.pi) * scipy.special.erfi(speed) * self.speed / self.acceleration
        )
        quarter = since_rest[-1]
        to_and_fro = quarter * scipy.signal.sawtooth(0.5 * np.pi * (time / quarter + 1), 0.5)
        size = self.speed * np.interp(np.abs(to_and_fro), since_rest, speed)
        return ((-1.0) ** (seed + 1) * np.sign(to_and_fro) * size)[:, None]


@dataclass(frozen=True)
class Row:
    """What is withheld, and logs that hardly show it.

    ``noise_rad`` of the positions; ``own_nm``: dry friction that simulator and machine have; ``shows``: the
    experiment is to show it; ``within``: what motors may do in the experiment.
    """

    withheld: Effect
    wave: Callable[[int, float], Array]
    noise_rad: float = FINE_RAD
    own_nm: float = 0.0
    shows: bool = False
    within: ExperimentLimits | None = None


def friction(coulomb_nm: float) -> Effect:
    """Return dry friction."""
    return Effect("coulomb_friction", 1, {"coulomb_nm": coulomb_nm, "smoothing_rad_s": 0.1})


def harmonic(effect: str, amplitude: str, size: float) -> Effect:
    """Return a ripple of the second order."""
    return Effect(effect, 1, {"order_1": 2.0, amplitude: size})


SLOW = Wave(2.0, (0.25, 1.0), rises_s=1.5)
LIVELY = Wave(1.0, (1.0, 8.0), square=3.0)
ONE_WAY = Wave(2.0, (1.0, 12.0), level=10.0)
ONE_SPEED = Wave(0.05, (1.0, 5.0), level=9.0)
FREE = ExperimentLimits(velocity_rad_s=30.0, travel_rad=60.0, torque_nm=5.0)
LOAD_FRICTION = Effect("load_dependent_friction", 1, {"coefficient": 0.01, "smoothing_rad_s": 0.1})
STRIBECK = Effect(
    "stribeck_friction",
    1,
    {"excess_nm": 0.02, "stribeck_speed_rad_s": 1.0, "smoothing_rad_s": 0.1},
)
CUBIC = Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 1e12})
PLAY = Effect("backlash", 1, {"half_width_rad": 1e-5})
ROWS = {
    "delay, current loop": Row(Effect("input_delay", 1, {"delay_s": 1e-3}), LIVELY),
    "current loop, delay": Row(
        Effect("current_loop", 1, {"time_constant_s": 6e-4, "damping": 0.7}), LIVELY
    ),
    "lag, delay": Row(Effect("actuator_bandwidth", 1, {"time_constant_s": 6e-4}), LIVELY),
    "torque constant, load": Row(
        Effect("torque_constant", 1, {"relative_error": -0.1}), SLOW, COARSE_RAD
    ),
    "load, torque constant": Row(
        Effect("payload", None, {"mass_kg": 200.0, "x_m": 1.0}), SLOW, COARSE_RAD
    ),
    "Coulomb friction, offset": Row(friction(0.03), ONE_WAY),
    "offset, Coulomb friction": Row(Effect("torque_offset", 1, {"offset_nm": -0.04}), ONE_WAY),
    "torque, resolver ripple": Row(
        harmonic("torque_ripple", "cosine_1_nm", 0.003), ONE_SPEED, within=FREE
    ),
    "resolver, torque ripple": Row(
        harmonic("resolver_ripple", "cosine_1_rad", 4e-5), ONE_SPEED, within=FREE
    ),
    "load-dependent, other friction": Row(
        LOAD_FRICTION, Wave(6.0, (0.5, 1.5), rises_s=1.5), 5e-5, own_nm=0.3
    ),
    "Stribeck, other friction": Row(STRIBECK, Wave(6.0, (0.5, 1.5), rises_s=1.5), 5e-5, own_nm=0.3),
    # The gear carries what accelerates the arm: its load falls with speed as the excess does.
    "Stribeck, load-dependent friction": Row(
        STRIBECK.with_values({"excess_nm": 0.06, "stribeck_speed_rad_s": 14.0}),
        FadingTurns(100.0, 14.0),
        6e-4,
        own_nm=0.3,
    ),
    # In the gear's resonance either makes much the same third harmonic of a sine; noise of 10,000 steps in a turn.
    "cubic stiffness, backlash, one sine": Row(
        CUBIC.with_values({"cubic_nm_rad3": 5e8}),
        Wave(1.57, (6.5, 10.0), rises_s=1.5, sine=(10.0, 3.46)),
        6e-4,
        within=ExperimentLimits(velocity_rad_s=40.0, travel_rad=30.0, torque_nm=60.0),
    ),
    "backlash, cubic stiffness": Row(PLAY, Wave(1.0, (1.0, 6.0), square=2.0)),
    "cubic stiffness, backlash": Row(CUBIC, Wave(1.0, (1.0, 6.0), square=1.0)),
    "inertia, torque constant": Row(
        Effect("motor_inertia", 1, {"relative_change": 0.1}), Wave(6.0, (1.0, 6.0), square=4.0)
    ),
    "cubic stiffness to show": Row(CUBIC, SLOW, shows=True),
    "Stribeck friction to show": Row(
        STRIBECK.with_values({"excess_nm": 0.01}),
        Wave(10.0, (1.0, 8.0), square=10.0),
        own_nm=0.3,
        shows=True,
    ),
    "torque ripple to show": Row(
        harmonic("torque_ripple", "cosine_1_nm", 0.0005), ONE_SPEED, COARSE_RAD, shows=True
    ),
    "load-dependent friction to show": Row(
        LOAD_FRICTION, Wave(4.0, (0.5, 1.0), rises_s=1.5), 5e-5, own_nm=0.3, shows=True
    ),
}


def simulator(row: Row) -> Robot:
    """Return the axis as a simulator without effects but its own friction."""
    text = (resources.files("axisight.robot.presets") / "two_mass_axis.toml").read_text("utf-8")
    stated, wanted = (f"position_noise_std = {x}" for x in ("1.2e-5", row.noise_rad))
    assert stated in text
    text = text.replace(stated, wanted)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(text, "utf-8")
        return load_robot(path).with_effects([friction(row.own_nm)] if row.own_nm else [])


def machine_of(robot: Robot) -> Robot:
    """Return a machine of the type: a per cent off."""
    off = {"axis1.stiffness": 1.007, "axis1.motor_inertia": 0.994, "axis1.damping": 1.03}
    nominal = robot.parameters()
    return robot.with_parameters({name: nominal[name] * f for name, f in off.items()})


def log_of(machine: Robot, effect: Effect, ref: Array, run: int) -> Log:
    """A log of the machine along a reference."""
    out = simulate(machine, ref, effects=[effect], noise_seed=5, run=run)
    assert out.attrs["status"] == "completed"
    name = f"run{run}"
    return Log(
        name=name,
        source=Path(name),
        sample_time_s=machine.sample_time_s,
        time_s=out.time.values,
        velocity_ref_rad_s=ref,
        torque_nm=out.torque_cmd_nm.values,
        position_rad=out.position_rad.values,
    )


def says(found: Diagnosis) -> str:
    """A verdict in a cell of a table."""
    named = ", ".join(f"{c.effect} {c.probability:.2f}" for c in found.causes)
    rivals = ", ".join(
        f"{a.effect} {a.probability:.2f}" for a in found.alternatives if a.probability > 0.05
    )
    return f"{found.verdict}: {named or 'nothing'}" + (f" ({rivals})" if rivals else "")


def run(row: Row) -> tuple[Diagnosis, Diagnosis | None]:
    """Return what the logs say, and what they say with the experiment beside them, if there is one."""
    robot = simulator(row)
    machine = machine_of(robot)
    refs = [row.wave(seed, robot.sample_time_s) for seed in (1, 2, 3)]
    logs = [log_of(machine, row.withheld, r, k) for k, r in enumerate(refs)]
    sought = row.withheld if row.shows else None
    before = diagnose(
        robot=robot,
        estimation=logs[:2],
        validation=logs[2:],
        separate=True,
        to_show=sought,
        within=row.within,
    )
    made = before.experiment
    if made is None or not made.decides:
        return before, None
    again = made.references.period[0]
    new = [log_of(machine, row.withheld, again, 7 + k) for k in range(made.repeats)]
    return before, diagnose(robot=robot, estimation=[*logs[:2], *new], validation=logs[2:])


def main() -> None:
    """Print the table."""
    wanted = set(sys.argv[1:])
    print("| withheld, rival | before | experiment | after |\n|---|---|---|---|")
    for name, row in ROWS.items():
        if not wanted or name in wanted:
            before, after = run(row)
            made = before.experiment or before.next_experiment or "nothing is open"
            print(
                f"| {name} | {says(before)} | {made} | {says(after) if after else ''} |",
                flush=True,
            )


if __name__ == "__main__":
    main()

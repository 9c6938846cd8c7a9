"""Twenty laws that the library does not have: does the modelled remainder name their variable, and carry over?

Run: python benches/remainder_laws.py [--only NAME ...] [--json out.json]

Each machine is the simulator plus one law on one axis, computed along the motion, with noise of torque and position.
The diagnosis fits causes and remainder to three runs of sums of sines. The gap is measured on motions of another kind:
moves from point to point with rests. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path

import numpy as np
import tomlkit
from numpy.typing import NDArray

from axisight import Log, Robot, Settings, diagnose
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.simulator.rigid_torque import predicted_torque

Array = NDArray[np.float64]

RATE_HZ = 250.0
RUN_S = 16.0
N_RUNS = 3
# Size of a law, as a share of the standard deviation of the torque of its axis.
SIZE = 0.35
# Noise of the torque, as a share of its standard deviation, and of the motor angle [rad].
TORQUE_NOISE, ANGLE_NOISE_RAD = 0.01, 1e-4


@dataclass(frozen=True)
class State:
    """What laws depend on, (n, n_axes) each, motor side: angles over their amplitude, all else over round figures."""

    time_s: Array
    angle: Array
    speed: Array
    acceleration: Array
    load: Array
    temperature_c: Array
    angle_rad: Array


@dataclass(frozen=True)
class Law:
    """A law of one axis (from 1), of any size, and the variables (name, axis) that are right to name."""

    name: str
    axis: int
    torque: Callable[[State], Array]
    right: tuple[tuple[str, int], ...]


def sign(speed: Array) -> Array:
    """Return the sign of a speed over its largest, smooth below half a per cent."""
    return np.tanh(speed / 0.005)


def travel(angle: Array) -> tuple[Array, Array]:
    """Return travel since the last reversal, over the amplitude, and the direction (n,)."""
    way = np.sign(np.diff(angle, prepend=angle[:1]))
    moved = way != 0
    last = np.maximum.accumulate(np.where(moved, np.arange(len(way)), 0))
    way = way[last]
    turns = np.flatnonzero(np.diff(way, prepend=way[:1]) != 0)
    start = np.zeros(len(way), dtype=int)
    start[turns] = turns
    return np.abs(angle - angle[np.maximum.accumulate(start)]), way


def saw(phase: Array) -> Array:
    """Return a smooth saw tooth of period one."""
    k = np.arange(1, 4)
    return np.asarray(np.sin(2 * np.pi * np.multiply.outer(phase, k)) @ (1 / k))


def worn_in(s: State, rate: float) -> Array:
    """Return a share that falls with the travel since the last reversal."""
    gone, way = travel(s.angle[:, 1])
    return way * np.exp(-gone / rate)


LAWS = (
    Law(
        "friction that another axis' speed raises",
        2,
        lambda s: sign(s.speed[:, 1]) * np.abs(s.speed[:, 2]),
        (("speed", 3),),
    ),
    Law(
        "friction that depends on another axis' direction",
        2,
        lambda s: sign(s.speed[:, 1]) * (0.3 + sign(s.speed[:, 2])),
        (("speed", 3),),
    ),
    Law("seal that another axis drags", 3, lambda s: sign(s.speed[:, 1]), (("speed", 2),)),
    Law(
        "viscous friction that falls with temperature",
        1,
        lambda s: s.speed[:, 0] * np.exp(-(s.temperature_c[:, 0] - 20) / 8),
        (("temperature", 1),),
    ),
    Law(
        "dry friction that a warm gear loses",
        2,
        lambda s: sign(s.speed[:, 1]) * (35 - s.temperature_c[:, 1]),
        (("temperature", 2),),
    ),
    Law("teeth of a belt", 1, lambda s: saw(s.angle_rad[:, 0] / 17.3), (("angle", 1),)),
    Law(
        "friction of belt teeth",
        3,
        lambda s: sign(s.speed[:, 2]) * saw(s.angle_rad[:, 2] / 23.7),
        (("angle", 3),),
    ),
    Law(
        "cable that another axis bends",
        1,
        lambda s: np.sin(3 * s.angle[:, 1]) + 0.5 * s.angle[:, 1] ** 2,
        (("angle", 2),),
    ),
    Law(
        "hose that is tight beyond an angle",
        3,
        lambda s: np.maximum(s.angle[:, 2] - 0.3, 0) ** 2,
        (("angle", 3),),
    ),
    Law(
        "friction that acceleration raises",
        2,
        lambda s: sign(s.speed[:, 1]) * np.abs(s.acceleration[:, 1]),
        (("acceleration", 2),),
    ),
    Law(
        "friction of loads in one direction only",
        3,
        lambda s: np.maximum(sign(s.speed[:, 2]), 0) * s.load[:, 2] ** 2,
        (("load", 3),),
    ),
    Law(
        "viscous friction that load raises",
        3,
        lambda s: s.speed[:, 2] * s.load[:, 2] ** 2,
        (("load", 3),),
    ),
    Law(
        "friction that a reversal builds up",
        2,
        lambda s: travel(s.angle[:, 1])[1] - worn_in(s, 0.3),
        (("travel", 2),),
    ),
    Law("friction that wears in after a reversal", 2, lambda s: worn_in(s, 0.3), (("travel", 2),)),
    Law(
        "friction with a hump at one speed",
        1,
        lambda s: sign(s.speed[:, 0]) * np.exp(-(((np.abs(s.speed[:, 0]) - 0.4) / 0.12) ** 2)),
        (("speed", 1),),
    ),
    Law(
        "drag of the third power one way",
        2,
        lambda s: np.maximum(s.speed[:, 1], 0) ** 3,
        (("speed", 2),),
    ),
    Law(
        "bearing that another axis' load presses",
        1,
        lambda s: sign(s.speed[:, 0]) * np.abs(s.load[:, 1]),
        (("load", 2),),
    ),
    Law(
        "acceleration of another motor",
        3,
        lambda s: s.acceleration[:, 1] + 0.6 * s.acceleration[:, 1] ** 2,
        (("acceleration", 2),),
    ),
    Law(
        "friction that falls while the machine runs",
        2,
        lambda s: sign(s.speed[:, 1]) * np.exp(-s.time_s / 5.0),
        (("time", 2),),
    ),
    Law(
        "friction with the square of another axis' speed",
        3,
        lambda s: sign(s.speed[:, 2]) * s.speed[:, 0] ** 2,
        (("speed", 1),),
    ),
)


def rigid_robot() -> Robot:
    """Return the large preset with rigid gears, without a controller, at the rate of the logs."""
    text = (resources.files("axisight.robot.presets") / "irb6600_like.toml").read_text("utf-8")
    document = tomlkit.parse(text)
    document.pop("controller", None)
    document["sample_time"] = 1 / RATE_HZ
    for joint in document["joint"]:
        for key in ("stiffness", "damping"):
            joint.get("drive", {}).pop(key, None)
    return Robot.from_toml(tomlkit.dumps(document))


# Amplitudes of the joint angles [rad].
AMPLITUDE = np.array([0.8, 0.5, 0.6])


def sums_of_sines(
    rng: np.random.Generator, rate_hz: float = RATE_HZ, run_s: float = RUN_S
) -> Array:
    """Return joint angles (n, 3) [rad] of five harmonics."""
    t = np.arange(int(run_s * rate_hz)) / rate_hz
    out = np.zeros((len(t), 3))
    for axis in range(3):
        for k in range(1, 6):
            size, phase = rng.uniform(0.3, 1.0) / k, rng.uniform(0, 2 * np.pi)
            out[:, axis] += size * np.sin(2 * np.pi * k * t / RUN_S * 1.0 + phase)
    return np.asarray(AMPLITUDE * out / np.abs(out).max(axis=0))


def point_to_point(
    rng: np.random.Generator, rate_hz: float = RATE_HZ, run_s: float = RUN_S
) -> Array:
    """Return joint angles (n, 3) [rad] of moves between random points: polynomials of the fifth degree, and rests."""
    n = int(run_s * rate_hz)
    out = np.zeros((n, 3))
    for axis in range(3):
        at, now, points = 0, rng.uniform(-0.8, 0.8), []
        while at < n:
            rest, move = int(rate_hz * rng.uniform(0.2, 0.6)), int(rate_hz * rng.uniform(1.2, 2.4))
            to = float(np.clip(now + rng.choice([-1, 1]) * rng.uniform(0.3, 1.0), -0.9, 0.9))
            s = np.arange(move) / move
            path = now + (to - now) * s**3 * (10 - 15 * s + 6 * s**2)
            points += [np.full(rest, now), path]
            at, now = at + rest + move, to
        out[:, axis] = np.concatenate(points)[:n]
    return AMPLITUDE * out


def temperatures(rng: np.random.Generator, n: int) -> Array:
    """Return temperatures of the axes (n, 3) [degC] that rise during a run from a level of its own."""
    start, rise = rng.uniform(20, 40, 3), rng.uniform(4, 12, 3)
    return np.asarray(start + rise * (1 - np.exp(-np.arange(n)[:, None] / (0.5 * n))))


def state_of(robot: Robot, joint_rad: Array, temperature_c: Array) -> tuple[State, Array]:
    """Return what laws see of a motion, and the torque of the simulator (n, 3) [Nm]."""
    angle = joint_rad / robot.gear_ratio
    speed = np.gradient(angle, 1 / RATE_HZ, axis=0)
    acceleration = np.gradient(speed, 1 / RATE_HZ, axis=0)
    at = (angle, speed, acceleration, np.zeros_like(angle))
    drives = [n for n in robot.parameters() if n.endswith(("viscous_friction", "motor_inertia"))]
    bodies = robot.with_parameters(dict.fromkeys(drives, 0.0))
    torque, load = (predicted_torque(r, AS_GIVEN, at) for r in (robot, bodies))
    state = State(
        np.arange(len(angle)) / RATE_HZ,
        joint_rad / AMPLITUDE,
        speed / TOP_RAD_S,
        acceleration / TOP_RAD_S2,
        load / TOP_LOAD_NM,
        temperature_c,
        angle,
    )
    return state, torque


# Round figures that the motions nearly reach: speeds and accelerations of the motors, loads of the gears.
TOP_RAD_S, TOP_RAD_S2 = np.array([150.0, 110.0, 120.0]), np.array([300.0, 250.0, 250.0])
TOP_LOAD_NM = np.array([4.0, 40.0, 25.0])


def logs_of(robot: Robot, law: Law, seed: int) -> tuple[list[Log], list[Log]]:
    """Return the runs of sines and those from point to point of a machine with a law."""
    rng = np.random.default_rng(seed)
    makers = [sums_of_sines] * N_RUNS + [point_to_point] * 2
    motions = [make(rng) for make in makers]
    warm = [temperatures(rng, len(m)) for m in motions]
    states = [state_of(robot, m, c) for m, c in zip(motions, warm, strict=True)]
    axis = law.axis - 1
    raw = np.concatenate([law.torque(s) for s, _ in states[:N_RUNS]])
    std = np.concatenate([t for _, t in states[:N_RUNS]]).std(axis=0)
    scale = SIZE * std[axis] / np.sqrt(np.mean(raw**2))
    out = []
    for number, ((state, torque), celsius) in enumerate(zip(states, warm, strict=True)):
        measured = torque + rng.normal(0, TORQUE_NOISE * std, torque.shape)
        measured[:, axis] += scale * law.torque(state)
        position = state.angle_rad + rng.normal(0, ANGLE_NOISE_RAD, torque.shape)
        out.append(
            Log(
                name=f"run {number + 1}",
                source=Path(f"run {number + 1}"),
                sample_time_s=1 / RATE_HZ,
                time_s=state.time_s,
                torque_nm=measured,
                position_rad=position,
                temperature_c=celsius,
            )
        )
    return out[:N_RUNS], out[N_RUNS:]


@dataclass(frozen=True)
class Row:
    """What came out for a law: causes, term with the largest gain, and the gap of its axis on other motions."""

    law: str
    causes: str
    named: str
    right: bool
    as_given: float
    causes_only: float
    with_remainder: float
    seconds: float

    @property
    def halved(self) -> bool:
        """Whether the remainder halves the gap that the causes leave."""
        return self.with_remainder <= 0.5 * self.causes_only


def row(robot: Robot, law: Law, seed: int) -> Row:
    """Diagnose a machine with a law."""
    fitted, other = logs_of(robot, law, seed)
    began = time.monotonic()
    found = diagnose(
        robot=robot,
        estimation=fitted,
        validation=other,
        settings=Settings(bootstrap=50),
        remainder=True,
    )
    modelled = found.remainder.modelled if found.remainder else None
    assert modelled is not None
    axis = law.axis - 1
    mine = sorted(modelled.model.of_axis(law.axis), key=lambda t: -t.gain)
    first = next((t for t in mine if t.variable != "constant"), None)
    return Row(
        law.name,
        ", ".join(c.label for c in found.causes),
        "-" if first is None else first.words,
        first is not None and (first.variable, first.of_axis) in law.right,
        float(found.gap.before_per_axis[axis]),
        float(modelled.before_per_axis[axis]),
        float(modelled.after_per_axis[axis]),
        time.monotonic() - began,
    )


def report(rows: Sequence[Row]) -> str:
    """Return the table and the counts."""
    lines = [
        "| law | causes | first term of the remainder | right | gap as given | causes | with remainder | halved |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        gaps = " | ".join(f"{100 * x:.3g} %" for x in (r.as_given, r.causes_only, r.with_remainder))
        right, halved = ("yes" if x else "no" for x in (r.right, r.halved))
        lines.append(f"| {r.law} | {r.causes or '-'} | {r.named} | {right} | {gaps} | {halved} |")
    lines.append(f"right variable: {sum(r.right for r in rows)} of {len(rows)}")
    lines.append(f"gap on other motions halved: {sum(r.halved for r in rows)} of {len(rows)}")
    return "\n".join(lines)


def main() -> None:
    """Run the laws and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", help="words of the laws to run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    robot = rigid_robot()
    rows = []
    for number, law in enumerate(LAWS):
        if given.only and not any(word in law.name for word in given.only):
            continue
        rows.append(row(robot, law, 100 * given.seed + number))
        print(rows[-1], flush=True)
    if given.json:
        given.json.write_text(json.dumps([asdict(r) for r in rows], indent=1))
    print(report(rows))


if __name__ == "__main__":
    main()

"""Laws that the library does not have, in closed loop: a written model with its remainder against the machine.

Run: python benches/remainder_closed_loop.py [--only NAME ...] [--json out.json]

The machine is the large preset with elastic gears, controller and sensor noise, plus one law of remainder_laws.py on
one axis, in its simulation. The diagnosis in closed loop fits causes and remainder to two runs of sums of sines. The
model with both is written as a robot file, read back and simulated under the references of moves from point to point.
The gap is the error of its commanded torque on the axis of the law. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tomlkit
from numpy.typing import NDArray
from remainder_laws import (
    AMPLITUDE,
    LAWS,
    SIZE,
    TOP_LOAD_NM,
    TOP_RAD_S,
    Law,
    State,
    point_to_point,
    sums_of_sines,
)

from axisight import Diagnosis, Log, Robot, Settings, diagnose, load_robot, simulate
from axisight.remainder import Remainder, RunningRemainder
from axisight.write_back import write_model

Array = NDArray[np.float64]

RATE_HZ = 500.0
RUN_S = 8.0
N_RUNS = 2
# Speed of the control loop over that of the preset, whose sample time is a quarter.
SPEED = 0.35
# Time in which a run from rest reaches its speed [s].
RAMP_S = 0.5
# Laws of the present state alone, without a temperature, which a simulation has to be told.
CHOSEN = (
    "friction that another axis' speed raises",
    "friction that depends on another axis' direction",
    "seal that another axis drags",
    "teeth of a belt",
    "cable that another axis bends",
    "hose that is tight beyond an angle",
    "friction with a hump at one speed",
    "bearing that another axis' load presses",
    "friction with the square of another axis' speed",
)


def slower_robot() -> Robot:
    """Return the large preset with a loop that the rate of the logs can follow, stated in its text."""
    text = load_robot("irb6600_like").with_sample_time(1 / RATE_HZ).toml
    document = tomlkit.parse(text)
    slower = load_robot("irb6600_like").with_controller_speed(SPEED).controller_gains
    for gain, values in slower.items():
        document["controller"][gain] = values.tolist()  # type: ignore[index]
    return Robot.from_toml(tomlkit.dumps(document))


class LawInLoop(RunningRemainder):
    """A law as a torque that a simulation adds, by the interface of remainders."""

    def __init__(self, robot: Robot, law: Law, scale: float) -> None:
        nothing = np.full(robot.n_axes, np.inf)
        super().__init__(Remainder((), nothing, nothing))
        self.robot, self.law, self.scale = robot, law, scale

    def __call__(  # type: ignore[override]
        self, time_s: float, angle: Array, speed: Array, acceleration: Array, load: Array
    ) -> Array:
        """Return the torque (n_axes,) [Nm] that the machine needs at one moment."""
        out = np.zeros(len(angle))
        state = state_of(self.robot, np.array([time_s]), *(x[None] for x in (angle, speed)))
        state = State(**{**vars(state), "load": load[None] / TOP_LOAD_NM})
        out[self.law.axis - 1] = self.scale * self.law.torque(state)[0]
        return out


def state_of(robot: Robot, time_s: Array, angle: Array, speed: Array) -> State:
    """Return what laws see of motor angles (n, 3) [rad] and speeds [rad/s]; the load is left at zero."""
    zero = np.zeros_like(angle)
    return State(
        time_s, angle * robot.gear_ratio / AMPLITUDE, speed / TOP_RAD_S, zero, zero, zero, angle
    )


@dataclass(frozen=True)
class Run:
    """A run from rest: speed references (n, 3) [rad/s] and the joint angles at its start (3,) [rad]."""

    reference: Array
    start_rad: Array

    @classmethod
    def of(cls, robot: Robot, joint_rad: Array) -> Run:
        """Return the run along joint angles (n, 3) [rad], from rest."""
        speed = np.gradient(joint_rad / robot.gear_ratio, 1 / RATE_HZ, axis=0)
        share = np.minimum(np.arange(len(speed)) / (RAMP_S * RATE_HZ), 1.0)
        return cls(speed * (share**2 * (3 - 2 * share))[:, None], joint_rad[0])


def scale_of(robot: Robot, law: Law, runs: Sequence[Run]) -> float:
    """Return the factor on a law that makes it a share of the torque of its axis along the references."""
    raw, torque = [], []
    for run in runs:
        bare = simulate(robot, run.reference, start_rad=run.start_rad)
        angle = bare["motor_position_rad"].to_numpy()
        speed = np.gradient(angle, 1 / RATE_HZ, axis=0)
        state = state_of(robot, bare["time"].to_numpy(), angle, speed)
        load = bare["torque_cmd_nm"].to_numpy()
        raw.append(law.torque(State(**{**vars(state), "load": load / TOP_LOAD_NM})))
        torque.append(load[:, law.axis - 1])
    return float(SIZE * np.std(np.concatenate(torque)) / np.sqrt(np.mean(np.concatenate(raw) ** 2)))


def logs_of(robot: Robot, law: Law, runs: Sequence[Run], scale: float, seed: int) -> list[Log]:
    """Return the logs of a machine with a law."""
    out = []
    for number, run in enumerate(runs):
        made = simulate(
            robot,
            run.reference,
            start_rad=run.start_rad,
            noise_seed=seed,
            run=number,
            remainder=LawInLoop(robot, law, scale),
        )
        assert made.attrs["status"] == "completed", made.attrs
        name = f"run {number + 1}"
        out.append(
            Log(
                name=name,
                source=Path(name),
                sample_time_s=1 / RATE_HZ,
                time_s=made["time"].to_numpy(),
                torque_nm=made["torque_cmd_nm"].to_numpy(),
                position_rad=made["position_rad"].to_numpy(),
                velocity_ref_rad_s=run.reference,
            )
        )
    return out


def gap_of(robot: Robot, runs: Sequence[Run], logs: Sequence[Log], axis: int) -> float:
    """Return the rms error of the commanded torque of an axis (from 1) over its standard deviation."""
    left, size = [], []
    for run, log in zip(runs, logs, strict=True):
        torque = simulate(robot, run.reference, start_rad=run.start_rad)["torque_cmd_nm"].to_numpy()
        left.append(np.mean((torque - log.torque_nm)[:, axis - 1] ** 2))
        size.append(np.var(log.torque_nm[:, axis - 1]))
    return float(np.sqrt(np.sum(left) / np.sum(size)))


def written(robot: Robot, found: Diagnosis, *, remainder: bool) -> Robot:
    """Return the model with the causes, with or without the remainder, written and read back."""
    left = found.remainder
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.toml"
        modelled = left.modelled if remainder and left is not None else None
        write_model("irb6600_like", robot, found.causes, path, remainder=modelled)
        return load_robot(path)


@dataclass(frozen=True)
class Row:
    """What came out for a law: causes, term with the largest gain, and the gaps of its axis in closed loop."""

    law: str
    mode: str
    causes: str
    named: str
    right: bool
    own_parameters: str
    as_given: float
    causes_only: float
    with_remainder: float
    inverse_before: float
    inverse_after: float
    seconds: float


def row(robot: Robot, law: Law, seed: int) -> Row:
    """Diagnose a machine with a law in closed loop, and simulate the written models."""
    rng = np.random.default_rng(seed)
    makers = [sums_of_sines] * N_RUNS + [point_to_point]
    runs = [Run.of(robot, make(rng, RATE_HZ, RUN_S)) for make in makers]
    scale = scale_of(robot, law, runs[:N_RUNS])
    logs = logs_of(robot, law, runs, scale, seed)
    began = time.monotonic()
    found = diagnose(
        robot=robot,
        estimation=logs[:N_RUNS],
        validation=logs[N_RUNS:],
        settings=Settings(bootstrap=50),
        remainder=True,
    )
    seconds = time.monotonic() - began
    modelled = found.remainder.modelled if found.remainder else None
    assert modelled is not None
    mine = sorted(modelled.model.of_axis(law.axis), key=lambda t: -t.gain)
    first = next((t for t in mine if t.variable != "constant"), None)
    gaps = [
        gap_of(model, runs[N_RUNS:], logs[N_RUNS:], law.axis)
        for model in (
            robot,
            written(robot, found, remainder=False),
            written(robot, found, remainder=True),
        )
    ]
    return Row(
        law.name,
        found.mode,
        ", ".join(c.label for c in found.causes),
        "-" if first is None else first.words,
        first is not None and (first.variable, first.of_axis) in law.right,
        modelled.own_parameters,
        *gaps,
        float(modelled.before_per_axis[law.axis - 1]),
        float(modelled.after_per_axis[law.axis - 1]),
        seconds,
    )


def report(rows: Sequence[Row]) -> str:
    """Return the table and the counts."""
    lines = [
        "| law | causes | first term of the remainder | right | gap as given | causes | with remainder |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        gaps = " | ".join(f"{100 * x:.3g} %" for x in (r.as_given, r.causes_only, r.with_remainder))
        right = "yes" if r.right else "no"
        lines.append(f"| {r.law} | {r.causes or '-'} | {r.named} | {right} | {gaps} |")
    halved = sum(r.with_remainder <= 0.5 * r.causes_only for r in rows)
    lines.append(f"right variable: {sum(r.right for r in rows)} of {len(rows)}")
    lines.append(f"gap in closed loop on other motions halved: {halved} of {len(rows)}")
    return "\n".join(lines)


def main() -> None:
    """Run the laws and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", help="words of the laws to run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    robot = slower_robot()
    rows = []
    for number, law in enumerate(law for law in LAWS if law.name in CHOSEN):
        if given.only and not any(word in law.name for word in given.only):
            continue
        rows.append(row(robot, law, 100 * given.seed + number))
        print(rows[-1], flush=True)
    if given.json:
        given.json.write_text(json.dumps([asdict(r) for r in rows], indent=1))
    print(report(rows))


if __name__ == "__main__":
    main()

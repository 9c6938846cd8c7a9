"""Write a draw: cases in one folder, their truth in another."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd

from .arms import Arm, robot_file
from .draw import arm_and_axes, kind, plan, scattered
from .loop import Law, Loop
from .models import ARMS, arms_of
from .motions import plan as motion_plan
from .withheld import Place, Withheld

# An effect below it is drawn again at twice the size, this often; one case in ten stays as it is.
SMALLEST_SEVERITY, TIMES, LEFT_SMALL = 3.0, 4, 0.1
# A torque that grows beyond this many times the nominal peak is an unstable loop.
RUNAWAY = 30.0


class NoMachineError(ValueError):
    """The loop of a machine did not stay bounded, or its effect does not show."""


@dataclass(frozen=True)
class Runs:
    """Torques and measured positions of some logs without noise, samples first."""

    torques: list[np.ndarray]
    positions: list[np.ndarray]


def run(arm: Arm, laws: list[Law], w_ref: np.ndarray, noise: np.random.Generator | None) -> Loop:
    """Simulate a log by the engine of the arm.

    Raises NoMachineError if a torque is not finite.
    """
    engine = import_module(f".{arm.engine}_engine", __package__)
    loop = Loop(arm, laws, w_ref, noise)
    try:
        engine.run(loop)
    except (RuntimeError, OverflowError) as error:
        raise NoMachineError(str(error)) from error
    if len(loop.torques) != len(w_ref) or not np.isfinite(loop.torques).all():
        raise NoMachineError(f"{len(loop.torques)} of {len(w_ref)} finite samples")
    return loop


def runs(arm: Arm, laws: list[Law], references: list[np.ndarray], noise=None) -> Runs:
    """Simulate several logs."""
    loops = [run(arm, laws, w_ref, noise) for w_ref in references]
    return Runs([np.array(k.torques) for k in loops], [np.array(k.positions) for k in loops])


def place(arm: Arm, axis: int, nominal: Runs, size: float, rng: np.random.Generator) -> Place:
    """Return an axis with what its motor does in nominal runs."""
    rest = nominal.torques[0][0, axis]
    about = np.concatenate([u[:, axis] - rest for u in nominal.torques])
    speeds = [np.diff(y[:, axis]) / arm.sample_time_s for y in nominal.positions]
    angles = np.concatenate([y[:, axis] for y in nominal.positions]) * arm.ratios[axis]
    return Place(
        arm=arm,
        axis=axis,
        torque_nm=float(about.std()),
        peak_nm=float(np.abs(about).max()),
        rest_nm=float(rest),
        speed_rad_s=float(np.concatenate(speeds).std()),
        travel_rad=float(np.ptp(angles)),
        middle_rad=float((angles.max() + angles.min()) / 2),
        size=size,
        rng=rng,
    )


def noise_nm(arm: Arm) -> np.ndarray:
    """Return the rms torque that white noise of the encoders causes at the controller [Nm]."""
    proportional = np.sqrt(2) * arm.kp * arm.noise_std_rad / arm.sample_time_s
    return np.hypot(proportional, arm.noise_std_rad * (arm.ki + arm.kp * arm.kv))


def severity(arm: Arm, without: Runs, with_it: Runs) -> list[list[float]]:
    """Return rms changes of torque over the noise: logs, axes."""
    noise = noise_nm(arm)
    return [
        [round(float(x), 3) for x in np.sqrt(np.mean((b - a) ** 2, axis=0)) / noise]
        for a, b in zip(without.torques, with_it.torques, strict=True)
    ]


def changed(arm: Arm, effects: list[Withheld]) -> tuple[Arm, list[Law]]:
    """Return the machine with all effects: its parameters and the laws that act in the loop."""
    laws = [law for effect in effects for law in effect.laws]
    for law in laws:
        arm = law.change(arm)
    return arm, laws


def effects_of(
    seed: list[int], names: tuple[str, ...], arm: Arm, axes: list[int], references, nominal: Runs
) -> tuple[list[Withheld], list[list[float]]]:
    """Return drawn effects and their severity, each large enough by itself unless it is left small.

    Raises NoMachineError if no size gives a stable machine that shows the effect.
    """
    found: list[Withheld] = []
    for number, (name, axis) in enumerate(zip(names, axes, strict=True)):
        size, stay = 1.0, np.random.default_rng([*seed, 7, number]).random() < LEFT_SMALL
        for turn in range(TIMES + 1):
            rng = np.random.default_rng([*seed, 5, number])
            effect = kind(name).draw(place(arm, axis, nominal, size, rng))
            try:
                change = severity(arm, nominal, runs(*changed(arm, [effect]), references))
            except NoMachineError:
                if turn == TIMES:
                    raise
                size /= 3
                continue
            if effect.simulator is not None or stay or np.max(change) >= SMALLEST_SEVERITY:
                break
            size *= 2
        else:
            raise NoMachineError(f"{name} on axis {axis + 1} does not show: {np.max(change)}")
        found.append(effect)
    whole = runs(*changed(arm, found), references) if len(found) > 1 else None
    return found, severity(arm, nominal, whole) if whole else change


def make_case(
    folder: Path, key: list[int], case_kind: str, names: tuple[str, ...], arms: tuple[str, ...]
) -> dict:
    """Write a case of one of these arms; return its truth. ``key`` seeds what is drawn."""
    rng = np.random.default_rng(key)
    name, axes = arm_and_axes(rng, names, arms)
    stated = ARMS[name]()
    machine = scattered(rng, stated)
    logs = motion_plan(rng, stated)
    held_out = [w_ref for _, role, w_ref in logs if role == "validation"]
    nominal = runs(machine, [], held_out)
    effects: list[Withheld] = []
    change: list[list[float]] = []
    if names:
        effects, change = effects_of(key, names, machine, axes, held_out, nominal)
    for effect in effects:
        if effect.simulator is not None:
            stated = effect.simulator(stated)
            change = severity(machine, runs(effect.simulator(machine), [], held_out), nominal)
    arm, laws = changed(machine, effects)
    noisy = runs(arm, laws, [w_ref for _, _, w_ref in logs], rng)
    peak = max(np.abs(u).max() for u in nominal.torques)
    if max(np.abs(u).max() for u in noisy.torques) > RUNAWAY * peak:
        raise NoMachineError("the torque ran away")
    write(folder, stated, logs, noisy)
    what = {"nothing": "none", "outside": "outside the library"}
    return {
        "effects": what.get(case_kind, " + ".join(e.effect for e in effects)),
        "engine": machine.engine,
        "arm": name,
        "truth": [effect.truth() for effect in effects],
        "severity": change,
    }


def write(folder: Path, stated: Arm, logs, found: Runs) -> None:
    """Write the simulator and the logs of a case."""
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    (folder / "robot.toml").write_text(robot_file(stated))
    lines = ['schema = "axisight.case/1"', f'name = "{folder.name}"', 'robot = "robot.toml"']
    for (name, role, w_ref), u, y in zip(logs, found.torques, found.positions, strict=True):
        columns = {"time_s": np.arange(len(w_ref)) * stated.sample_time_s}
        for unit, values in (("velocity_ref", w_ref), ("torque_cmd", u), ("position", y)):
            columns |= {f"{unit}_{i + 1}": values[:, i] for i in range(values.shape[1])}
        pd.DataFrame(columns).to_parquet(folder / "logs" / f"{name}.parquet")
        lines += ["", "[[log]]", f'file = "logs/{name}.parquet"', f'role = "{role}"']
        lines += [f'excitation = "{name}"']
    (folder / "case.toml").write_text("\n".join(lines) + "\n")


def make(cases: Path, truth: Path, seed: int, count: int, engines: list[str]) -> None:
    """Write a whole draw of the arms of these engines; cases that are there already stay.

    A machine that is unstable or does not show its effect is drawn again on another arm or axis.
    """
    truth.mkdir(parents=True, exist_ok=True)
    labels = truth / "labels.json"
    known = json.loads(labels.read_text()) if labels.exists() else {}
    arms = arms_of(engines)
    for number, (case_kind, names) in enumerate(plan(seed, count)):
        name = f"outside_{seed:04}_{number:03}"
        if name in known:
            continue
        for again in range(10):
            try:
                key = [seed, number + 100_000 * again]
                known[name] = make_case(cases / name, key, case_kind, names, arms)
            except NoMachineError:
                continue
            break
        else:
            raise NoMachineError(f"{name}: {names} has no machine")
        labels.write_text(json.dumps(known, indent=1) + "\n")
        print(f"{name}: {known[name]['effects']} on {known[name]['arm']}", flush=True)

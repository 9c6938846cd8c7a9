"""Cases of a benchmark with their truth apart from them, sealed by a hash in the case."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.blind.drawing import Draw, draw, machine_of
from axisight.blind.engine import run
from axisight.blind.processes import Progress, shared_out
from axisight.blind.sealed import SEAL, TRUTH_SCHEMA, seal_of
from axisight.errors import InputError
from axisight.robot import Robot, load_robot
from axisight.storage import write_bytes, write_whole

Array = NDArray[np.float64]

_PRESET = "irb6600_like"


def make_cases(
    cases: Path,
    truths: Path,
    numbers: Sequence[int],
    seed: int,
    workers: int,
    progress: Progress,
) -> None:
    """Write the cases of ``numbers`` to a folder, and their truths to another.

    A case is a function of (seed, number). Cases that are there already stay as they are. Raises
    InputError where the folders are one.
    """
    if cases.resolve() == truths.resolve():
        raise InputError("truth: expected another folder than that of the cases")
    make = partial(_make, cases, truths, seed)
    shared_out(make, numbers, workers, "simulating machines", progress)


def _make(cases: Path, truths: Path, seed: int, number: int) -> None:
    name = f"case_{seed:04d}_{number:04d}"
    if not (cases / name / SEAL).is_file():
        robot = load_robot(_PRESET).with_effects([])
        _write(cases / name, truths / f"{name}.json", draw(seed, number, robot), seed, robot)


def _write(folder: Path, truth: Path, drawn: Draw, seed: int, robot: Robot) -> None:
    rng = np.random.default_rng([seed, drawn.number, 1])
    toml = ['schema = "axisight.case/1"', f'name = "{folder.name}"', 'robot = "robot.toml"', ""]
    for name, (role, reference) in drawn.references.items():
        noise = robot.position_noise_std * rng.standard_normal(reference.shape)
        torque, angle = run(drawn.machine, reference, noise)
        path = folder / "logs" / f"{name}.parquet"
        write_bytes(path, _table(robot.sample_time_s, reference, torque, angle))
        toml += ["[[log]]", f'file = "logs/{name}.parquet"', f'role = "{role}"', ""]
    preset = resources.files("axisight.robot.presets") / f"{_PRESET}.toml"
    write_whole(folder / "robot.toml", preset.read_text("utf-8"))
    write_whole(folder / "case.toml", "\n".join(toml))
    text = json.dumps(_truth(drawn, seed), indent=1)
    write_whole(truth, text)
    # Last: a case with its seal is whole.
    write_whole(folder / SEAL, seal_of(text) + "\n")


def _table(sample_time_s: float, reference: Array, torque: Array, angle: Array) -> bytes:
    data = {"time_s": np.arange(len(reference)) * sample_time_s}
    for i in range(reference.shape[1]):
        data[f"velocity_ref_{i + 1}"] = reference[:, i]
        data[f"torque_cmd_{i + 1}"] = torque[:, i]
        data[f"position_{i + 1}"] = angle[:, i]
    out: bytes = pd.DataFrame(data).to_parquet(index=False)
    return out


def _truth(drawn: Draw, seed: int) -> dict[str, Any]:
    return {
        "schema": TRUTH_SCHEMA,
        "engine": "mujoco",
        "seed": seed,
        "number": drawn.number,
        "effects": [
            {"effect": e.effect, "axis": e.axis, "parameters": dict(e.parameters)}
            for e in drawn.effects
        ],
        "severity": _severity(drawn),
    }


def _severity(drawn: Draw) -> list[float]:
    """Return rms torque change by all effects over rms torque noise, largest validation log, by axis."""
    if not drawn.effects:
        return [0.0] * drawn.machine.robot.n_axes
    bare = machine_of(drawn.machine.robot, ())
    rng = np.random.default_rng(0)
    out = np.zeros(drawn.machine.robot.n_axes)
    for role, reference in drawn.references.values():
        if role != "validation":
            continue
        quiet = np.zeros_like(reference)
        noise = drawn.machine.robot.position_noise_std * rng.standard_normal(reference.shape)
        with_it, without, noisy = (
            run(machine, reference, added)[0]
            for machine, added in ((drawn.machine, quiet), (bare, quiet), (bare, noise))
        )
        change, floor = (np.sqrt(np.mean((x - without) ** 2, axis=0)) for x in (with_it, noisy))
        out = np.maximum(out, change / floor)
    return [float(x) for x in out]

"""Cases of a benchmark with their truth apart from them, sealed by a hash in the case."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from axisight.blind.case_files import CaseFolder
from axisight.blind.drawing import Draw, draw
from axisight.blind.engine import run
from axisight.blind.processes import Progress, shared_out
from axisight.blind.sealed import SEAL, TRUTH_SCHEMA, seal_of
from axisight.errors import InputError
from axisight.robot import Robot, load_robot
from axisight.storage import write_whole

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
    case = CaseFolder(folder, folder.name)
    for name, (role, reference) in drawn.references.items():
        noise = robot.position_noise_std * rng.standard_normal(reference.shape)
        time_s = np.arange(len(reference), dtype=np.float64) * robot.sample_time_s
        case.add(name, role, time_s, reference, *run(drawn.machine, reference, noise))
    case.finish(_PRESET)
    text = json.dumps(_truth(drawn, seed), indent=1)
    write_whole(truth, text)
    # Last: a case with its seal is whole.
    write_whole(folder / SEAL, seal_of(text) + "\n")


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
    rng = np.random.default_rng(0)
    out = np.zeros(drawn.machine.robot.n_axes)
    for role, reference in drawn.references.values():
        if role != "validation":
            continue
        quiet = np.zeros_like(reference)
        noise = drawn.machine.robot.position_noise_std * rng.standard_normal(reference.shape)
        with_it, without, noisy = (
            run(machine, reference, added)[0]
            for machine, added in ((drawn.machine, quiet), (drawn.bare, quiet), (drawn.bare, noise))
        )
        change, floor = (np.sqrt(np.mean((x - without) ** 2, axis=0)) for x in (with_it, noisy))
        out = np.maximum(out, change / floor)
    return [float(x) for x in out]

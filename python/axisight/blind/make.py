"""Cases of a benchmark with their truth apart from them, sealed by a hash in the case."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.blind.case_files import CaseFolder
from axisight.blind.drawing import DRAWN, Choice, Draw, draw
from axisight.blind.machine import Machine
from axisight.blind.processes import Progress, shared_out
from axisight.blind.scene import Scene
from axisight.blind.sealed import SEAL, TRUTH_SCHEMA, seal_of
from axisight.errors import InputError
from axisight.storage import write_whole

Array = NDArray[np.float64]
# Torque and angle along references.
Logs = list[tuple[Array, Array]]
# Of an engine: machine, references and noises of its runs to torques and angles.
Run = Callable[[Machine, Sequence[Array], Sequence[Array]], Logs]


# Draws until a machine works.
_ATTEMPTS = 20
# Times the largest torque of the simulator, from which a machine does not.
_RUNAWAY = 5.0


def make_cases(
    cases: Path,
    truths: Path,
    numbers: Sequence[int],
    seed: int,
    workers: int,
    progress: Progress,
    choice: Choice = DRAWN,
) -> None:
    """Write the cases of ``numbers`` to a folder, and their truths to another.

    A case is a function of (seed, number, choice). Cases that are there already stay as they are. Raises
    InputError where the folders are one.
    """
    if cases.resolve() == truths.resolve():
        raise InputError("truth: expected another folder than that of the cases")
    make = partial(_make, cases, truths, seed, choice)
    shared_out(make, numbers, workers, "simulating machines", progress)


def _make(cases: Path, truths: Path, seed: int, choice: Choice, number: int) -> None:
    name = f"case_{seed:04d}_{number:04d}"
    if (cases / name / SEAL).is_file():
        return
    for attempt in range(_ATTEMPTS):
        drawn = draw(seed, number, choice, attempt)
        runs = _runs(drawn, seed)
        if runs is not None:
            _write(cases / name, truths / f"{name}.json", drawn, runs, seed)
            return
    raise InputError(f"{name}: expected a machine that works within {_ATTEMPTS} draws")


def _engine(name: str) -> Run:
    """Return what makes machines move, and load only its library."""
    return import_module(f"axisight.blind.{name}_engine").run  # type: ignore[no-any-return]


def _runs(drawn: Draw, seed: int) -> tuple[Logs, Logs] | None:
    """Return the logs, and the validation ones without noise; None of a machine that nobody would run.

    An effect may take the loop beyond its margin: it swings without end.
    """
    rng = np.random.default_rng([seed, drawn.number, 1])
    references = [reference for _, reference in drawn.references.values()]
    noises = [_noise(rng, drawn, x.shape) for x in references]
    validation = _validation(drawn)
    quiet = [np.zeros_like(x) for x in validation]
    try:
        # An engine moves all runs of a machine at once where it can.
        logs = _engine(drawn.engine)(drawn.machine, references + validation, noises + quiet)
    except InputError:
        return None
    largest = np.max([np.abs(torque).max(axis=0) for torque, _ in logs], axis=0)
    usual = Scene(drawn.robot, references).largest_nm
    count = len(references)
    return (logs[:count], logs[count:]) if np.all(largest < _RUNAWAY * usual) else None


def _noise(rng: np.random.Generator, drawn: Draw, shape: tuple[int, ...]) -> Array:
    """Return noise of the sensors (n, n_axes) [rad], of the deviation that the robot states."""
    white = drawn.robot.position_noise_std * rng.standard_normal(shape)
    if drawn.corner_hz is None:
        return np.asarray(white)
    keep = np.exp(-2 * np.pi * drawn.corner_hz * drawn.robot.sample_time_s)
    return np.asarray(scipy.signal.lfilter([np.sqrt(1 - keep**2)], [1.0, -keep], white, axis=0))


def _validation(drawn: Draw) -> list[Array]:
    return [x for role, x in drawn.references.values() if role == "validation"]


def _write(folder: Path, truth: Path, drawn: Draw, runs: tuple[Logs, Logs], seed: int) -> None:
    case = CaseFolder(folder, folder.name)
    logs, quiet = runs
    largest = np.max([np.abs(torque).max(axis=0) for torque, _ in logs], axis=0)
    for (name, (role, reference)), (torque, angle) in zip(
        drawn.references.items(), logs, strict=True
    ):
        time_s = np.arange(len(reference), dtype=np.float64) * drawn.robot.sample_time_s
        known = reference if drawn.referenced else None
        case.add(name, role, time_s, known, _in_steps(torque, largest, drawn.bits), angle)
    case.finish(drawn.arm)
    text = json.dumps(_truth(drawn, seed, _severity(drawn, quiet)), indent=1)
    write_whole(truth, text)
    # Last: a case with its seal is whole.
    write_whole(folder / SEAL, seal_of(text) + "\n")


def _in_steps(torque: Array, largest: Array, bits: int | None) -> Array:
    """Return torques (n, n_axes) as a converter over twice the ``largest``, either way, has them."""
    if bits is None:
        return torque
    step = 4 * np.maximum(largest, 1e-300) / 2**bits
    return np.asarray(np.round(torque / step) * step)


def _truth(drawn: Draw, seed: int, severity: list[float]) -> dict[str, Any]:
    return {
        "schema": TRUTH_SCHEMA,
        "engine": drawn.engine,
        "arm": drawn.arm,
        "motions": drawn.motions,
        "noise_corner_hz": drawn.corner_hz,
        "references": "logged" if drawn.referenced else "missing",
        "torque_bits": drawn.bits,
        "seed": seed,
        "number": drawn.number,
        "effects": [
            {"effect": e.effect, "axis": e.axis, "parameters": dict(e.parameters)}
            for e in drawn.effects
        ],
        "severity": severity,
    }


def _severity(drawn: Draw, with_it: Logs) -> list[float]:
    """Return rms torque change by all effects over rms torque noise, largest validation log, by axis."""
    robot = drawn.robot
    if not drawn.effects:
        return [0.0] * robot.n_axes
    rng = np.random.default_rng(0)
    references = _validation(drawn)
    quiet = [np.zeros_like(x) for x in references]
    noise = [_noise(rng, drawn, x.shape) for x in references]
    count = len(references)
    bare = _engine(drawn.engine)(drawn.bare, references * 2, quiet + noise)
    without, noisy = bare[:count], bare[count:]
    shares = [
        np.sqrt(np.mean((a - b) ** 2, axis=0) / np.mean((c - b) ** 2, axis=0))
        for (a, _), (b, _), (c, _) in zip(with_it, without, noisy, strict=True)
    ]
    return [float(x) for x in np.max(shares, axis=0)]

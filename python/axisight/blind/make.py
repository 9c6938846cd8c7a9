"""Cases of a benchmark, with the truths in another folder; each case holds the hash of its truth."""

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
# Torque [Nm] and angle [rad] along each reference.
Logs = list[tuple[Array, Array]]
# An engine: machine, references and noises of all runs to torques and angles.
Run = Callable[[Machine, Sequence[Array], Sequence[Array]], Logs]


# Most draws until a machine works.
_ATTEMPTS = 20
# A machine that needs more than this multiple of the simulator's largest torque does not work.
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
    """Write the cases of ``numbers`` to one folder, and their truths to another.

    A case is a function of (seed, number, choice). Existing cases stay. Raises InputError if both folders are
    the same, and if no draw of a case gives a machine that works.
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
    """Return the ``run`` function of an engine; only its library is loaded."""
    return import_module(f"axisight.blind.{name}_engine").run  # type: ignore[no-any-return]


def _runs(drawn: Draw, seed: int) -> tuple[Logs, Logs] | None:
    """Return all logs, and the validation logs without noise; None if the machine does not work.

    An effect may make the loop unstable.
    """
    rng = np.random.default_rng([seed, drawn.number, 1])
    references = [reference for _, reference in drawn.references.values()]
    noises = [_noise(rng, drawn, x.shape) for x in references]
    validation = _validation(drawn)
    quiet = [np.zeros_like(x) for x in validation]
    try:
        # One call per machine: some engines run all references at once.
        logs = _engine(drawn.engine)(drawn.machine, references + validation, noises + quiet)
    except InputError:
        return None
    largest = np.max([np.abs(torque).max(axis=0) for torque, _ in logs], axis=0)
    usual = Scene(drawn.robot, references).largest_nm
    count = len(references)
    return (logs[:count], logs[count:]) if np.all(largest < _RUNAWAY * usual) else None


def _noise(rng: np.random.Generator, drawn: Draw, shape: tuple[int, ...]) -> Array:
    """Return sensor noise (n, n_axes) [rad] with the standard deviation that the robot states."""
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
    # Last, so that a case with a seal is complete.
    write_whole(folder / SEAL, seal_of(text) + "\n")


def _in_steps(torque: Array, largest: Array, bits: int | None) -> Array:
    """Return torques (n, n_axes) [Nm] quantized by a converter of so many bits over twice ``largest``."""
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
    """Return per axis the rms torque change by all effects over rms noise, in the log with most change."""
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

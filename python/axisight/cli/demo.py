"""The command ``axisight demo``: make and diagnose a small case whose simulator lacks an effect."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from axisight.blind.case_files import CaseFolder, moves
from axisight.cli.common import bars, errors, say, write_each
from axisight.cli.outcomes import diagnosis_writes
from axisight.cli.show import show_diagnosis
from axisight.effects import Effect
from axisight.effects.stated import DEMONSTRATION
from axisight.errors import InputError
from axisight.gap import diagnose
from axisight.robot import Robot, load_robot
from axisight.simulation import simulate
from axisight.storage import check_targets

Array = NDArray[np.float64]

_SECONDS = 5.0


def write_demo_case(folder: Path, *, seed: int = 1, effect: Effect = DEMONSTRATION) -> Path:
    """Write a case of three estimation and two validation logs of 5 s to ``folder``; return ``folder``.

    The machine differs from the preset ``irb6600_like`` by a standard deviation of 1 % in masses, stiffness
    and motor inertia, 2 % in viscous friction and 5 % in damping. It also has sensor noise and ``effect``.
    The logs depend on ``seed`` and ``effect`` only. Raises InputError if the machine is unstable with
    ``effect``.
    """
    nominal = load_robot("irb6600_like")
    machine = _scattered(nominal, seed)
    rng = np.random.default_rng([seed, 2])
    n = int(_SECONDS / nominal.sample_time_s)
    time_s = np.arange(n, dtype=np.float64) * nominal.sample_time_s
    runs = {
        "multisine": ("estimation", _multisine(n, nominal, rng, 9.0)),
        "multisine_half": ("estimation", _multisine(n, nominal, rng, 4.5)),
        "moves": ("estimation", moves(time_s, _SECONDS, np.array([50.0, 40.0, -45.0]))),
        "multisine_fresh": ("validation", _multisine(n, nominal, rng, 7.0)),
        "moves_fresh": ("validation", moves(time_s, _SECONDS, np.array([-40.0, 30.0, 50.0]))),
    }
    case = CaseFolder(folder, "demo")
    for run, (name, (role, reference)) in enumerate(runs.items()):
        out = simulate(machine, reference, effects=[effect], noise_seed=seed, run=run)
        if out.attrs["status"] != "completed":
            raise InputError(f"demo: the simulated machine is unstable with {effect.label}")
        torque, angle = out["torque_cmd_nm"].values, out["position_rad"].values
        case.add(name, role, out["time"].values, reference, torque, angle)
    case.finish("irb6600_like")
    return folder


def _scattered(robot: Robot, seed: int) -> Robot:
    """Return the robot with production scatter in its parameters."""
    scatter = {
        "mass": 0.01,
        "stiffness": 0.01,
        "motor_inertia": 0.01,
        "viscous_friction": 0.02,
        "damping": 0.05,
    }
    rng = np.random.default_rng([seed, 1])
    changed = {}
    for name, value in robot.parameters().items():
        spread = scatter.get(name.rsplit(".", 1)[1])
        if spread is not None:
            changed[name] = value * (1 + spread * float(np.clip(rng.normal(), -2, 2)))
    return robot.with_parameters(changed)


def _multisine(n: int, robot: Robot, rng: np.random.Generator, peak_rad_s: float) -> Array:
    """Return references (n, n_axes) [rad/s]: a random-phase multisine of 1 to 40 Hz plus a square wave."""
    time = np.arange(n) * robot.sample_time_s
    lines = np.arange(1.0, 40.0, 1.0 / _SECONDS)
    out = np.empty((n, robot.n_axes))
    for i in range(robot.n_axes):
        phases = rng.uniform(0, 2 * np.pi, len(lines))
        wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
        # The square wave keeps the motor away from standstill most of the time.
        square = np.tanh(20 * np.sin(2 * np.pi * time / _SECONDS))
        ramp = np.minimum(time / 0.1, 1.0)
        out[:, i] = ramp * peak_rad_s * (0.7 * wave / np.abs(wave).max() + square)
    return out


def demo_command(
    out: Annotated[
        Path, typer.Option(help="Folder for the case, the verdict and the report.")
    ] = Path("demo"),
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print all tables of the diagnosis.")
    ] = False,
) -> None:
    """Make a small case, a simulated machine with an effect that its simulator lacks, and diagnose it."""
    with errors():
        verdict, page = out / "verdict.json", out / "report.html"
        check_targets({"--out, verdict": verdict, "--out, report": page})
        case = write_demo_case(out / "case")
        say(f"case: {case} (a simulated machine with an effect its simulator lacks)")
        with bars() as progress:
            found = diagnose(case, progress=progress)
        again = f"axisight diagnose {case}"
        show_diagnosis(found, verbose=verbose, given=("--json", "--report"), command=again)
        write_each(diagnosis_writes(found, verdict, page))

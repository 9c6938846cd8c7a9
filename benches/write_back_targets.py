"""Does what a verdict promises of positions hold in MuJoCo? Machines with position actuators, told the same targets.

A machine in MuJoCo logs positions and targets at 50 Hz, without torque. Its logs and the nominal MJCF are
diagnosed, causes and re-fitted gains are written back, and MuJoCo runs the nominal and the new model under the
targets of the held-out log. Prints the largest error of position of an axis, rms below a fifth of the rate, as
the verdict states it before and after, and as MuJoCo has it.

    python benches/write_back_targets.py [CASE ...]
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "python"))

import mujoco
import numpy as np
from numpy.typing import NDArray
from printed import table

from axisight import Diagnosis, Log, Settings, diagnose
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.logs import lowpass
from axisight.write_back import Written, write_model
from servo_arm import MACHINES, NOMINAL, RATE_HZ, ServoArm, moved, simulator

Array = NDArray[np.float64]

# Of the rate of the logs, as positions are compared.
BAND = 0.2
UNKNOWN = {**DEFAULT_TOLERANCES, "kp": 0.5, "kd": 0.5}
# By the cause that is looked for; none where gains alone differ, which are fitted.
CASES: Mapping[str, ServoArm] = {
    **{k: MACHINES[k] for k in ("coulomb_friction@2", "input_delay", "torque_constant@2")},
    "torque_saturation@2": NOMINAL.with_changed("limit", 2, 45.0),
    "gains": replace(NOMINAL, kp=(2700.0, 1260.0, 950.0), kd=(96.0, 176.0, 15.0)),
    "gains and friction": replace(
        MACHINES["coulomb_friction@2"], kp=(2700.0, 1260.0, 950.0), kd=(96.0, 176.0, 15.0)
    ),
}


@dataclass(frozen=True)
class Outcome:
    """A verdict, the model that was written, and errors of position (n_axes,) [rad] before and after.

    ``promised``: of the verdict; ``run``: of both models in MuJoCo.
    """

    found: Diagnosis
    made: Written
    promised: tuple[Array, Array]
    run: tuple[Array, Array]


def error_of(path: Path, log: Log) -> Array:
    """Return the error of position (n_axes,) [rad] of a model under the targets of a log, as it is compared."""
    assert log.position_ref_rad is not None  # logged
    model = mujoco.MjModel.from_xml_path(str(path))
    position, _ = moved(model, log.position_ref_rad, RATE_HZ)
    off = position - log.position_rad
    off = lowpass(np.ascontiguousarray(off - off.mean(axis=0)), 1 / RATE_HZ, BAND * RATE_HZ)
    return np.asarray(np.sqrt((off**2).mean(axis=0)))


def settings_of(*, wide: bool) -> Settings:
    """Return the settings of a diagnosis; ``wide``: nobody knows the gains."""
    return Settings(tolerances=UNKNOWN) if wide else Settings()


def outcome(name: str, folder: Path) -> Outcome:
    """Diagnose a machine by its nominal model, write back what was found, and measure in MuJoCo."""
    arm = CASES[name]
    robot = simulator(folder)
    logs = [arm.log(run) for run in (1, 2, 3)]
    settings = settings_of(wide=name.startswith("gains"))
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings)
    made = write_model(
        folder / "arm.xml", robot, found.causes, folder / "new.xml", refit=found.refit
    )
    motion = found.gap.motion
    assert motion is not None  # positions are compared
    run = [error_of(path, logs[2]) for path in (folder / "arm.xml", made.path)]
    promised = motion.position_rad.before, motion.position_rad.after
    return Outcome(found, made, promised, (run[0], run[1]))


def row(name: str, folder: Path) -> tuple[list[str], str]:
    """Return the cells of a machine, what no file has a place for, and its headline."""
    out = outcome(name, folder)
    errors = [
        f"{1e3 * before.max():.2f} → {1e3 * after.max():.2f} mrad"
        for before, after in (out.promised, out.run)
    ]
    left_out = ", ".join(out.made.left_out) or "nothing"
    return (
        [", ".join(out.made.placed) or "–", *errors],
        f"left out {left_out}, {out.found.headline}",
    )


def main(names: list[str]) -> None:
    """Print the table."""
    table(("machine", "written", "verdict", "run"), names or CASES, row)


if __name__ == "__main__":
    main(sys.argv[1:])

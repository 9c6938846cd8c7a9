"""Three real machines as simulators and logs: EMPS, KUKA KR300, Staubli TX40.

Where the data comes from is in examples/emps and examples/rigid_body; a folder with emps/,
kuka_kr300/ and staubli_tx40/ is expected. Public arms come from the folders that the scripts in arms/ write.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat

import axisight
from axisight import Log, Robot
from axisight.errors import IdentificationWarning
from axisight.logs import decimate_zero_phase
from axisight.rigid_body import USUAL_TERMS, DriveTerms, identify_logs
from axisight.robot_file import Provenance, write_identified

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@dataclass(frozen=True)
class Machine:
    """A machine identified from its own logs: the complete rigid simulator, and the logs.

    ``standard_errors``: of the friction and offsets identified, by labels as of effects.
    """

    name: str
    complete: Robot
    standard_errors: dict[str, float]
    estimation: list[Log]
    validation: list[Log]

    def without_friction(self) -> Robot:
        """Return the simulator without dry and viscous friction and without offsets."""
        viscous = [k for k in self.complete.parameters() if k.endswith(".viscous_friction")]
        return self.complete.with_effects([]).with_parameters(dict.fromkeys(viscous, 0.0))


def _log(
    name: str,
    rate_hz: float,
    position: np.ndarray,
    torque: np.ndarray,
    velocity: np.ndarray | None = None,
) -> Log:
    return Log(
        name=name,
        source=Path(name),
        sample_time_s=1 / rate_hz,
        time_s=np.arange(len(position)) / rate_hz,
        velocity_ref_rad_s=None,
        torque_nm=np.ascontiguousarray(torque),
        position_rad=np.ascontiguousarray(position),
        velocity_rad_s=None if velocity is None else np.ascontiguousarray(velocity),
    )


def _identified(
    robot: Robot | Path,
    logs: list[Log],
    cutoff_hz: float,
    terms: DriveTerms = USUAL_TERMS,
    known: dict[str, float] | None = None,
    *,
    consistent: bool = True,
) -> tuple[Robot, dict[str, float]]:
    """Return the robot as identified, and the standard errors of its friction and offsets."""
    with warnings.catch_warnings():
        # Ten seconds determine some combinations only; bodies that can exist need no more.
        warnings.simplefilter("ignore", IdentificationWarning)
        found = identify_logs(
            robot if isinstance(robot, Robot) else axisight.load_robot(robot),
            logs,
            cutoff_hz=cutoff_hz,
            terms=terms,
            known=known,
            torque_held=False,
            deficient="group",
            consistent=consistent,
        )
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "robot.toml"
        write_identified(robot, out, found.identified(Provenance("least squares")))
        complete = axisight.load_robot(out)
    errors = {}
    for name, error in zip(found.estimate.names, found.estimate.standard_error, strict=True):
        joint, _, quantity = name.rpartition(".")
        if quantity in ("viscous_friction", "coulomb_friction", "torque_offset"):
            errors[f"{quantity}@{complete.axis_names.index(joint) + 1}"] = float(error)
    return complete, errors


def emps(data: Path) -> Machine:
    """Return the slide: identified on its first run, held out the one with pulses."""
    columns = EXAMPLES / "emps" / "columns.toml"
    first, second = (
        axisight.read_log(data / "emps" / f"{name}.mat", columns)
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    known = {"carriage.motor_inertia": 0.0}
    identified = _identified(
        EXAMPLES / "emps" / "robot.toml", [first], 50.0, known=known, consistent=False
    )
    return Machine("EMPS", *identified, [first], [second])


def kr300(data: Path) -> Machine:
    """Return the large arm: identified on runs A and B, held out C."""
    file = EXAMPLES / "rigid_body" / "kuka_kr300.toml"
    ratio = axisight.load_robot(file).gear_ratio
    logs = []
    for run in "ABC":
        path = data / "kuka_kr300" / run / "data.mat"
        rec = loadmat(path, struct_as_record=False, squeeze_me=True)["rec"]
        # Motor angles are written as those of the joints, in degrees.
        motor, speed = (
            np.deg2rad(x.T) / ratio for x in (rec.act_pos_mot_deg, rec.act_vel_mot_deg_per_s)
        )
        logs.append(_log(f"run {run}", 250.0, motor, rec.act_torque_abs_nm.T, speed))
    return Machine("KR300", *_identified(file, logs[:2], 8.0), logs[:2], logs[2:])


def tx40(data: Path) -> Machine:
    """Return the small arm: identified on the first five seconds, held out the rest of the motion.

    Motor 6 turns with joint 5 too, which a robot file cannot hold. The logs are those of the motors,
    where friction acts; what joint 6 turns with joint 5 is taken for its own motion, which the
    light wrist hardly shows.
    """
    folder = data / "staubli_tx40"
    text = (EXAMPLES / "rigid_body" / "staubli_tx40.toml").read_text()
    robot = Robot.from_toml(text.replace("sample_time = 2.0e-4", "sample_time = 2.0e-3"))
    motor, torque = (
        decimate_zero_phase(np.loadtxt(folder / f"{name}.csv", delimiter=",", skiprows=1), 10)
        for name in ("pos_read_data", "curr_data")
    )
    # The counters start at these angles of joints 2 and 3.
    start = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    whole = _log("motion", 500.0, motor + start / robot.gear_ratio, torque)
    parts = [whole.part(0.0, 2.5), whole.part(2.5, 5.0), whole.part(5.0, 7.5)]
    return Machine("TX40", *_identified(robot, parts[:2], 20.0), parts[:2], parts[2:])


def public(folder: Path, names: Sequence[str], cutoff_hz: float = 10.0) -> Machine:
    """Return a public arm from the folder that a script of ``arms`` wrote, identified on all logs but the last.

    ``names``: the logs, without their ending; the last is held out.
    """
    bare = axisight.load_robot(folder / "robot.toml")
    logs = [
        axisight.read_log(folder / f"{x}.csv", folder / "columns.toml", robot=bare) for x in names
    ]
    robot = bare.with_sample_time(logs[0].sample_time_s)
    return Machine(folder.name, *_identified(robot, logs[:-1], cutoff_hz), logs[:-1], logs[-1:])


MACHINES: dict[str, Callable[[Path], Machine]] = {"emps": emps, "kr300": kr300, "tx40": tx40}

"""Two real robots: rigid-body parameters from logs, judged on motions that were held out.

Run: python run.py [--data FOLDER] [--out FOLDER]. The data is not part of this repository; see
README.md for where it comes from. FOLDER holds staubli_tx40/ and kuka_kr300/; the default is
AXISIGHT_DATA.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.io import loadmat

import axisight
from axisight.errors import IdentificationWarning
from axisight.palette import MEASURED, SERIES
from axisight.rigid_body import (
    ConsistentParameters,
    DriveTerms,
    MotionEstimate,
    MotorCoupling,
    RigidBodyEstimate,
    TorqueModel,
    estimate_motion,
    identify_consistent,
    identify_rigid_body,
    prior_spread,
)

HERE = Path(__file__).resolve().parent
TITLES = {"tx40": "Staubli TX40", "kr300": "KUKA KR300 R2500 ultra SE"}
CUTOFF_HZ = {"tx40": 20.0, "kr300": 8.0}
# Motor side. The TX40 stops for a while at the ends of its moves; the KR300 never does.
DEAD_BAND_RAD_S = {"tx40": 1.0, "kr300": 0.0}
STANDSTILL_RAD_S = 0.02  # joint side: the TX40 ends with a second at rest
TRAIN_S = 5.0  # of the 7.5 s in which the TX40 moves
ELIMINATE = 0.2
NO_FRICTION = DriveTerms(inertia="motor", offset="motor")


@dataclass(frozen=True)
class Record:
    """A log on the joint side with motor torques.

    name, robot, sample_time_s, coupling
        What it is of; ``coupling`` None for gears alone.
    position_rad, torque_nm
        (n, 6) joint angles and motor torques.
    model_nm
        (n, 6) torques that the controller's own model predicted, if the data has them.
    """

    name: str
    robot: axisight.Robot
    sample_time_s: float
    coupling: MotorCoupling | None
    position_rad: np.ndarray
    torque_nm: np.ndarray
    model_nm: np.ndarray | None = None


@dataclass(frozen=True)
class Part:
    """A filtered motion, of one record or some of it; ``model_nm`` through the same filter."""

    name: str
    time_s: np.ndarray
    position_rad: np.ndarray
    velocity_rad_s: np.ndarray
    acceleration_rad_s2: np.ndarray
    torque_nm: np.ndarray
    model_nm: np.ndarray | None = None

    @property
    def motion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles, velocities, accelerations."""
        return self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2


@dataclass(frozen=True)
class Findings:
    """What one robot says.

    errors
        {(model, part): relative error by axis}, rms(model - measured) / rms(measured).
    estimate, consistent
        Fits with friction to the training part: least squares and bodies that can exist.
    """

    robot: str
    motions: tuple[MotionEstimate, ...]
    train: Part
    held_out: tuple[Part, ...]
    errors: dict[tuple[str, str], np.ndarray]
    estimate: RigidBodyEstimate
    consistent: ConsistentParameters
    predicted: dict[str, np.ndarray]


def default_data() -> Path:
    """Return where the data is expected."""
    root = os.environ.get("AXISIGHT_DATA")
    return Path(root) if root else HERE.parents[2] / "shared" / "data"


def read_tx40(folder: Path) -> Record:
    """Return the one record: 5 kHz, motor angles and motor torques."""
    motor = np.loadtxt(folder / "pos_read_data.csv", delimiter=",", skiprows=1)
    torque = np.loadtxt(folder / "curr_data.csv", delimiter=",", skiprows=1)
    gears = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    gears[5, 4] = 32.0  # motor 6 turns with joint 5 too
    coupling = MotorCoupling(gears)
    # The counters start at these angles of joints 2 and 3.
    start = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    joint = coupling.joint_motion(motor) + start
    robot = axisight.load_robot(HERE / "staubli_tx40.toml")
    return Record("tx40", robot, 2e-4, coupling, joint, torque)


def read_kr300(folder: Path, run: str) -> Record:
    """Return a run: 250 Hz, motor angles in joint degrees and motor torques."""
    file = loadmat(folder / run / "data.mat", struct_as_record=False, squeeze_me=True)
    log = file["rec"]
    return Record(
        run,
        axisight.load_robot(HERE / "kuka_kr300.toml"),
        4e-3,
        None,
        np.deg2rad(log.act_pos_mot_deg.T),
        log.act_torque_abs_nm.T,
        file["tau_ff_all"].T,
    )


def filtered(record: Record, cutoff_hz: float) -> tuple[MotionEstimate, Part]:
    """Filter and differentiate a record; the controller's prediction through the same filter."""
    found = estimate_motion(
        record.position_rad,
        record.torque_nm,
        sample_time_s=record.sample_time_s,
        cutoff_hz=cutoff_hz,
    )
    model = None
    if record.model_nm is not None:
        model = estimate_motion(
            record.position_rad,
            record.model_nm,
            sample_time_s=record.sample_time_s,
            cutoff_hz=cutoff_hz,
        ).torque_nm
    assert found.torque_nm is not None
    part = Part(
        record.name,
        found.time_s,
        found.position_rad,
        found.velocity_rad_s,
        found.acceleration_rad_s2,
        found.torque_nm,
        model,
    )
    return found, part


def between(part: Part, name: str, start_s: float, stop_s: float) -> Part:
    """Return the samples in a stretch of time."""
    keep = (part.time_s >= start_s) & (part.time_s < stop_s)
    return Part(name, part.time_s[keep], *(x[keep] for x in (*part.motion, part.torque_nm)))


def relative_error(predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return rms(predicted - measured) / rms(measured) by axis."""
    return np.sqrt(np.mean((predicted - measured) ** 2, axis=0) / np.mean(measured**2, axis=0))


def analyse(
    name: str,
    robot: axisight.Robot,
    coupling: MotorCoupling | None,
    motions: tuple[MotionEstimate, ...],
    train: Part,
    held_out: tuple[Part, ...],
) -> Findings:
    """Fit to the training part, predict all of them."""
    errors: dict[tuple[str, str], np.ndarray] = {}
    terms = DriveTerms(
        inertia="motor",
        viscous="motor",
        coulomb="motor",
        offset="motor",
        dead_band_rad_s=DEAD_BAND_RAD_S[name],
    )
    with_friction = TorqueModel(robot, terms=terms, side="motor", coupling=coupling)
    without = TorqueModel(robot, terms=NO_FRICTION, side="motor", coupling=coupling)
    with warnings.catch_warnings():
        # What they warn of is in the tables: ten seconds determine some parameters only.
        warnings.simplefilter("ignore", IdentificationWarning)
        fits = {
            label: identify_rigid_body(
                model, *train.motion, train.torque_nm, deficient="group", eliminate=limit
            )
            for label, model, limit in (
                ("without friction", without, None),
                ("least squares", with_friction, None),
                ("well-determined only", with_friction, ELIMINATE),
            )
        }
    estimate = fits["least squares"]
    consistent = identify_consistent(
        with_friction,
        *train.motion,
        train.torque_nm,
        torque_std_nm=estimate.residual_std_nm,
        prior_std=prior_spread(with_friction),
    )
    predicted = {}
    for part in (train, *held_out):
        for label, fit in fits.items():
            errors[label, part.name] = relative_error(fit.predict(*part.motion), part.torque_nm)
        torque = with_friction.matrix(*part.motion) @ consistent.theta
        predicted[part.name] = torque
        errors["bodies that can exist", part.name] = relative_error(torque, part.torque_nm)
        if part.model_nm is not None:
            # The prediction starts at zero: it gets the constant that suits it best.
            shifted = part.model_nm + np.mean(part.torque_nm - part.model_nm, axis=0)
            errors["controller's model", part.name] = relative_error(shifted, part.torque_nm)
    return Findings(TITLES[name], motions, train, held_out, errors, estimate, consistent, predicted)


def analyse_tx40(data: Path) -> Findings:
    """Train on the first five seconds, hold out the rest of the motion."""
    record = read_tx40(data / "staubli_tx40")
    motion, part = filtered(record, CUTOFF_HZ["tx40"])
    moving = np.abs(part.velocity_rad_s).max(axis=1) > STANDSTILL_RAD_S
    end = float(part.time_s[np.flatnonzero(moving)[-1]])
    return analyse(
        "tx40",
        record.robot,
        record.coupling,
        (motion,),
        between(part, f"0-{TRAIN_S:g} s", 0.0, TRAIN_S),
        (between(part, f"{TRAIN_S:g}-{end:.1f} s", TRAIN_S, end),),
    )


def analyse_kr300(data: Path) -> Findings:
    """Train on run A, hold out runs B and C."""
    both = [filtered(read_kr300(data / "kuka_kr300", run), CUTOFF_HZ["kr300"]) for run in "ABC"]
    motions = tuple(motion for motion, _ in both)
    train, *others = (part for _, part in both)
    robot = axisight.load_robot(HERE / "kuka_kr300.toml")
    return analyse("kr300", robot, None, motions, train, tuple(others))


def report(found: Findings) -> str:
    """Return the findings as text."""
    lines = [found.robot, *(f"  {motion}" for motion in found.motions)]
    lines.append(f"  trained on {found.train.name}; relative torque error [%], axes 1 to 6")
    for part in (found.train, *found.held_out):
        kind = "trained" if part is found.train else "held out"
        for (label, name), error in found.errors.items():
            if name == part.name:
                figures = "".join(f"{100 * e:7.1f}" for e in error)
                lines.append(f"  {kind:8} {name:10} {label:22}{figures}")
    table = found.estimate.table()
    sure = int((table["relative_standard_error"] < 0.3).sum())
    lines.append(
        f"  {len(found.estimate.names)} base parameters, {sure} with a standard error below 30 %; "
        f"condition number {found.estimate.condition_number_scaled:.0f}"
    )
    c = found.consistent
    lines.append(
        f"  bodies that can exist: {c.status}, loss {c.loss / c.loss_unconstrained - 1:+.1%}, "
        f"at the boundary: links {', '.join(str(k + 1) for k in c.boundary_links) or 'none'}"
    )
    return "\n".join(lines)


def draw(found: Findings) -> Figure:
    """Draw the held-out torques, measured and predicted, by axis."""
    parts = found.held_out
    figure = Figure(figsize=(9.0, 9.5), layout="constrained")
    grid = figure.subplots(6, len(parts), sharex="col", sharey="row", squeeze=False)
    for column, part in enumerate(parts):
        predicted = found.predicted[part.name]
        for axis, axes in enumerate(grid[:, column]):
            axes.plot(
                part.time_s, part.torque_nm[:, axis], color=MEASURED, lw=1.4, label="measured"
            )
            axes.plot(
                part.time_s, predicted[:, axis], "--", color=SERIES[1], lw=1.2, label="predicted"
            )
            axes.plot(
                part.time_s,
                part.torque_nm[:, axis] - predicted[:, axis],
                color=SERIES[0],
                lw=0.8,
                label="difference",
            )
            axes.grid(True, lw=0.4, color="0.85")
            axes.spines[["top", "right"]].set_visible(False)
            if column == 0:
                axes.set_ylabel(f"axis {axis + 1} [Nm]")
        what = part.name if part.name.endswith("s") else f"run {part.name}"
        grid[0, column].set_title(f"held out: {what}", fontsize=10)
        grid[-1, column].set_xlabel("time [s]")
        grid[0, column].margins(x=0.01)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.align_ylabels()
    trained = found.train.name if found.train.name.endswith("s") else f"run {found.train.name}"
    figure.suptitle(f"{found.robot}: motor torque, trained on {trained}", fontsize=11)
    return figure


def write_tables(found: Findings, stem: Path) -> None:
    """Write errors by axis, and base parameters with standard errors, as CSV."""
    with stem.with_name(f"{stem.name}_errors.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("model", "part", *(f"axis_{k}" for k in range(1, 7))))
        for (label, name), error in found.errors.items():
            writer.writerow((label, name, *error))
    with stem.with_name(f"{stem.name}_base.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("parameter", "unit", "value", "standard_error", "combination"))
        estimate = found.estimate
        writer.writerows(
            zip(
                estimate.names,
                estimate.base.units,
                estimate.values,
                estimate.standard_error,
                estimate.base.combinations,
                strict=True,
            )
        )


def main() -> int:
    """Analyse both robots; write figures and tables, print the findings."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--out", type=Path, default=Path("rigid_body"))
    arguments = parser.parse_args()
    ran = False
    for name, folder, run in (
        ("tx40", "staubli_tx40", analyse_tx40),
        ("kr300", "kuka_kr300", analyse_kr300),
    ):
        if not (arguments.data / folder).is_dir():
            print(f"not run: no {folder} in {arguments.data}; see {HERE / 'README.md'}")
            continue
        found = run(arguments.data)
        print(report(found))
        arguments.out.mkdir(parents=True, exist_ok=True)
        write_tables(found, arguments.out / name)
        draw(found).savefig(arguments.out / f"{name}.png", dpi=150)
        ran = True
    if ran:
        print(f"figures and tables in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""A real machine: why does a bare mass not predict the force of the EMPS?

Run: python run.py [--data FOLDER] [--out FOLDER]. The data is not part of this
repository; see README.md for where it comes from. FOLDER holds DATA_EMPS.mat
and DATA_EMPS_PULSES.mat; the default is emps/ under AXISIGHT_DATA.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import axisight
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.signals.motion import motion
from axisight.gap.views.inverse_dynamics import predicted_torque

HERE = Path(__file__).resolve().parent
# Janot, Gautier, Brunot (2019): least squares on the inverse dynamics of the first run.
PUBLISHED = {"mass": 95.1089, "viscous": 203.5034, "coulomb": 20.3935, "offset": -3.1648}


def default_data() -> Path:
    """Return where the data is expected."""
    root = os.environ.get("AXISIGHT_DATA")
    return Path(root) / "emps" if root else HERE.parents[2] / "shared" / "data" / "emps"


# Terms of the force, by the effect and the parameter that state them. An offset that helps the motor lowers the force
# it must be asked for.
TERMS = {
    "viscous": ("viscous_friction", "viscous_nm_s_rad", 1.0),
    "coulomb": ("coulomb_friction", "coulomb_nm", 1.0),
    "offset": ("torque_offset", "offset_nm", -1.0),
    "asymmetry": ("viscous_asymmetry", "half_difference_nm_s_rad", 1.0),
}


def found_parameters(robot: axisight.Robot, found: axisight.Diagnosis) -> dict[str, float]:
    """Return the terms that are named: force = M a + Fv v + D |v| + Fc sign v + offset, signs of the publication."""
    values = {c.effect: c.parameters for c in found.causes}
    nominal = axisight.robot_parameters(robot)["carriage.mass"]
    named = {
        term: sign * values[effect][parameter].value
        for term, (effect, parameter, sign) in TERMS.items()
        if effect in values
    }
    return {"mass": nominal * (1 + found.refit["carriage.mass"].value), **named}


def story(
    robot: axisight.Robot, found: axisight.Diagnosis, estimation: axisight.Log, held: axisight.Log
) -> Figure:
    """Return the figure: what is missing (force over velocity), and the held-out run before and after."""
    cutoff_hz = 60.0
    effects = tuple(
        axisight.Effect(c.effect, c.axis, {k: v.value for k, v in c.parameters.items()})
        for c in found.causes
    )
    nominal = axisight.robot_parameters(robot)["carriage.mass"]
    mass = nominal * (1 + found.refit["carriage.mass"].value)
    after = Variant({"carriage.mass": mass}, effects)
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(2, 3))

    at = motion(estimation, cutoff_hz)
    missing = at[3][:, 0] - predicted_torque(robot, AS_GIVEN, at)[:, 0]
    explained = (
        predicted_torque(robot, after, at)[:, 0] - predicted_torque(robot, AS_GIVEN, at)[:, 0]
    )
    order = np.argsort(at[1][:, 0])
    left.plot(at[1][::10, 0], missing[::10], ".", ms=2, color="0.7", label="measured - simulator")
    left.plot(at[1][order, 0], explained[order], color="#d55e00", lw=2, label="named effects")
    left.set(
        xlabel="velocity [m/s]",
        ylabel="missing force [N]",
        title="What the simulator lacks",
        ylim=(-90, 90),
    )
    left.legend(loc="upper left", fontsize=8)

    at = motion(held, cutoff_hz)
    time = held.time_s
    window = (time >= 5.0) & (time <= 12.0)
    before_force = predicted_torque(robot, AS_GIVEN, at)[:, 0]
    after_force = predicted_torque(robot, after, at)[:, 0]
    right.plot(time[window], at[3][window, 0], color="0.2", lw=1, label="measured")
    right.plot(
        time[window],
        before_force[window],
        color="#0072b2",
        lw=1,
        label=f"simulator as given: {100 * found.gap.before:.0f} % unexplained",
    )
    right.plot(
        time[window],
        after_force[window],
        color="#d55e00",
        lw=1,
        ls="--",
        label=f"with the named effects: {100 * found.gap.after:.1f} %",
    )
    right.set(
        xlabel="time [s]",
        ylabel="force [N]",
        title="A run it has not seen (with 5 V pulses)",
        ylim=(-230, 310),
    )
    right.legend(loc="upper center", fontsize=8, ncols=2, handlelength=1.5, columnspacing=1.2)
    return figure


def main() -> int:
    """Diagnose the EMPS and write figure, verdict and report."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, default=default_data())
    parser.add_argument("--out", type=Path, default=Path("emps"))
    arguments = parser.parse_args()
    if not (arguments.data / "DATA_EMPS.mat").exists():
        print(f"not run: no EMPS data in {arguments.data}; see {HERE / 'README.md'}")
        return 0
    robot = axisight.load_robot(HERE / "robot.toml")
    columns = HERE / "columns.toml"
    estimation = axisight.read_log(arguments.data / "DATA_EMPS.mat", columns)
    held = axisight.read_log(arguments.data / "DATA_EMPS_PULSES.mat", columns)
    found = axisight.diagnose(robot=robot, estimation=[estimation], validation=[held], name="EMPS")
    print(found.headline)
    ours = found_parameters(robot, found)
    for name in (*PUBLISHED, *(n for n in ours if n not in PUBLISHED)):
        value, published = ours.get(name), PUBLISHED.get(name)
        told = "not named" if value is None else f"{value:9.4f}"
        beside = "not published" if published is None else f"published {published:9.4f}"
        if value is not None and published is not None:
            beside += f"  off {100 * abs(value / published - 1):.2f} %"
        print(f"{name:9s} found {told}  {beside}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    story(robot, found, estimation, held).savefig(arguments.out / "emps.png", dpi=120)
    found.save_verdict(arguments.out / "verdict.json")
    print(f"figure and verdict in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""One-axis cases for the tests of fleets and for the crash trial."""

import re
from pathlib import Path

from axisight.blind.case_files import CaseFolder
from axisight.effects import Effect
from axisight.robot import load_robot
from gap_data import bare_axis, logs_of, scattered

PLAN = {"multisine": ("multisine", 1), "moves": ("moves", 0)}
HELD = {"fresh": ("multisine", 9)}


def write_case(folder: Path, effects: list[Effect], seed: int) -> None:
    """Write a case of the two-mass axis; the machine has production scatter and these effects."""
    machine = scattered(bare_axis(), seed)
    case = CaseFolder(folder, folder.name)
    for role, plan in (("estimation", PLAN), ("validation", HELD)):
        for log in logs_of(machine, effects, plan, seconds=4.0):
            data = log.velocity_ref_rad_s, log.torque_nm, log.position_rad
            case.add(log.name, role, log.time_s, *data)
    case.finish("two_mass_axis")
    # The preset has effects that these machines lack.
    path = folder / "robot.toml"
    path.write_text(re.sub(r"\[\[effect\]\][^\[]*", "", path.read_text("utf-8")), "utf-8")
    assert load_robot(path).effects == ()

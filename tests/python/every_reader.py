"""All readers of the package by name; each takes a path."""

import shutil

from axisight.blind.entries import read_stated
from axisight.blind.score import _parsed
from axisight.excitation import load_design, read_design, read_references
from axisight.logs import load_column_map, parse_column_map, read_case, read_log
from axisight.montecarlo import read_study
from axisight.montecarlo.store import Store
from axisight.robot import load_robot
from axisight.robot_file.sidecar import read_sidecar
from axisight.robot_import import import_robot
from axisight.robot_import.drives import read_drives

STATES = """
time = { name = "joint_states.time_s", resample_hz = "mean" }
[[axis]]
position = { name = "joint_states.position.a", unit = "rad" }
"""


def case(path):
    """Read a case from a copy of its file, in a folder of its own."""
    folder = path.parent.parent / f"case_{path.stem}"
    folder.mkdir()
    read_case(shutil.copy(path, folder / "case.toml").parent)


READERS = {
    "logs": read_log,
    "recordings": lambda path: read_log(
        f"{path}#0" if path.name.startswith("lerobot") else path, parse_column_map(STATES)
    ),
    "columns": load_column_map,
    "case": case,
    "folder": read_case,
    "robot": load_robot,
    "study": read_study,
    "design": lambda path: read_design(load_design(path), str(path)),
    "drives": read_drives,
    "verdict": lambda path: _parsed(path, read_stated(path, "a verdict")),
    "sidecar": read_sidecar,
    "store": lambda path: Store(path).begun_with(),
    "models": import_robot,
    "references": read_references,
}

"""What the server says about itself, and the next steps after a diagnosis in terms of its tools."""

from __future__ import annotations

from importlib import resources

from axisight.cli.assistants.folder import Folder
from axisight.cli.summary import can_be_designed, motions
from axisight.gap import Diagnosis

INSTRUCTIONS = """\
Axisight finds why the simulator of a robot differs from measured logs: which causes, of what size, how sure.
Order of work: list_files, check_log with a model, guess_columns if the columns are unknown, diagnose, explain,
next_experiment. All paths are relative to the server's folder. Units are SI: rad, rad/s, Nm on the motor side, s,
Hz. Gaps are shares of the torque. Axes count from 1. An effect on an axis is written effect@axis.
A verdict is one of none (no gap above noise), explained, explained_in_part, undecidable (several causes fit alike)
and unknown. Report the verdict as it is: do not turn undecidable or unknown into a cause. Give each value with its
interval.
Texts may name options of the command line: --verbose is explain with tables=true, --explain is explain."""


def skill() -> str:
    """Return the skill file, which says how to use the command line."""
    return (resources.files("axisight.cli.assistants") / "SKILL.md").read_text("utf-8")


def next_calls(found: Diagnosis, number: str, folder: Folder) -> list[str]:
    """Return the next steps after a diagnosis as sentences that name tools."""
    out = [] if found.next_experiment is None else [found.next_experiment]
    if found.verdict == "none":
        limits = (
            f"explain {number} with tables=true lists the smallest effects these logs would show."
        )
        return [*out, "Nothing to correct.", *([limits] if found.detection_limits else [])]
    if can_be_designed(found):
        out.append(f"next_experiment {number} designs {motions(found)}.")
    elif found.causes and folder.may_write:
        out.append("diagnose with write_model writes the simulator with the causes.")
    out.append(f"explain {number} says how the verdict came about.")
    return out

"""Arguments of the tools, each with the sentence that an assistant reads."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field


def _text(said: str) -> object:
    return Field(description=said)


Log = Annotated[
    str, _text("Log, relative to the server's folder, such as 'case/logs/run1.parquet'.")
]
Model = Annotated[
    str | None,
    _text(
        "Simulator: a robot.toml, URDF or MJCF relative to the server's folder, or a preset such as "
        "'irb6600_like'. A case brings its own."
    ),
]
Base = Annotated[str | None, _text("Link of a URDF or MJCF that stands still. Default: the root.")]
Tip = Annotated[str | None, _text("Last link of the chain of a URDF or MJCF.")]
Payload = Annotated[
    str | None,
    _text("Load on the last link of a URDF or MJCF: 'KG' or 'KG,X,Y,Z', mass in kg, centre in m."),
]
Columns = Annotated[
    str | None,
    _text(
        "Column map for logs with other column names or units: a TOML file relative to the server's folder, "
        "or a shipped map such as 'ur-rtde'."
    ),
]
ColumnsText = Annotated[
    str | None,
    _text("The column map itself as TOML, as guess_columns returns it, in place of a file."),
]
Case = Annotated[
    str | None, _text("Case folder with a case.toml, relative to the server's folder.")
]
Logs = Annotated[
    list[str] | None,
    _text(
        "Estimation logs in place of a case. Of several logs without validation the last is held out."
    ),
]
Validation = Annotated[list[str] | None, _text("Validation logs, which only the figures see.")]
Effects = Annotated[
    list[str] | None,
    _text(
        "Effects that the simulator has, such as 'coulomb_friction@2 coulomb_nm=0.4' (Nm, axis 2)."
    ),
]
Despite = Annotated[
    list[str] | None,
    _text(
        "Faults of the logs to accept although they are refused, by name, such as 'rows_missing'."
    ),
]
StartS = Annotated[float, _text("Leave out what comes before this time of each log, in s.")]
StopS = Annotated[float | None, _text("Leave out what comes after this time of each log, in s.")]
Moving = Annotated[bool, _text("Use each log from its first to its last motion only.")]
CutoffHz = Annotated[
    float | None,
    _text(
        "Low-pass on motion and torque in inverse dynamics, in Hz. Default: chosen from the data."
    ),
]
MaxCauses = Annotated[int, Field(ge=0, description="Stop after this many causes.")]
Seed = Annotated[int, Field(ge=0, description="Seed of every random choice.")]
TimeLimit = Annotated[
    float,
    Field(
        gt=0,
        description="Stop the search after this time, in s, and report what was found by then.",
    ),
]
Full = Annotated[
    bool,
    _text("Also return the large tables of the verdict: detection limits, ranking and trace."),
]
WriteMap = Annotated[
    str | None, _text("Write the map to this .toml file. Needs a server with --allow-write.")
]
WriteVerdict = Annotated[
    str | None, _text("Write the verdict to this .json file. Needs a server with --allow-write.")
]
WriteReport = Annotated[
    str | None, _text("Write the report to this .html file. Needs a server with --allow-write.")
]
WriteModel = Annotated[
    str | None,
    _text(
        "Write the simulator with the causes found to this file (.toml, or .urdf, .xml or .usda where "
        "that was diagnosed). Needs a server with --allow-write."
    ),
]
WriteExperiment = Annotated[
    str | None,
    _text(
        "Write references.parquet and experiment.txt into this folder. Needs a server with --allow-write."
    ),
]
Number = Annotated[str, _text("Number of a diagnosis, as diagnose returned it, such as 'd1'.")]
NumberOrNone = Annotated[
    str | None,
    _text("Number of a diagnosis, as diagnose returned it, such as 'd1'; without it, verdict."),
]
VerdictFile = Annotated[
    str | None, _text("A verdict in the folder, a .json file of diagnose, in place of the number.")
]
Tables = Annotated[
    bool,
    _text(
        "Also return all tables as text: pooled gap, re-fit, ranking, detection limits. "
        "Only with the number of a diagnosis: a verdict file is data already."
    ),
]
ToShow = Annotated[
    str | None,
    _text(
        "Design a motion that shows this effect of this size if the machine has it, such as "
        "'coulomb_friction@2 coulomb_nm=0.4'. With 'limits': a record that lowers all detection limits. "
        "Default: tell the open causes apart."
    ),
]
VelocityLimits = Annotated[
    list[float] | None,
    _text("Velocity limit in rad/s of the motors: one number for all, or one for each axis."),
]
TravelLimits = Annotated[
    list[float] | None,
    _text("Travel in rad of the motors, either way: one number for all, or one for each axis."),
]
AccelerationLimits = Annotated[
    list[float] | None,
    _text("Acceleration limit in rad/s^2 of the motors: one number for all, or one for each axis."),
]
Room = Annotated[
    list[float] | None,
    _text(
        "Box in which the origin of the last link stays, in m in the base frame: lowest x, y, z, highest x, y, z."
    ),
]
TorqueLimits = Annotated[
    list[float] | None,
    _text("Torque limit in Nm of the motors: one number for all, or one for each axis."),
]

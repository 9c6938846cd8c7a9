"""The command ``axisight plan``."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from axisight.arguments import short, usable_path
from axisight.cli.common import Force, errors, numbers, one_or_each, say
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.panels import LIMITS
from axisight.documents import read_text
from axisight.errors import InputError
from axisight.excitation import Limits, write_references
from axisight.excitation.files import reference_files
from axisight.paths import joint_path, motion_references, plan, tool_path
from axisight.storage import check_targets


def plan_command(
    robot: Annotated[str, typer.Argument(help="robot.toml, URDF, MJCF, DH table or a preset.")],
    waypoints: Annotated[
        Path,
        typer.Argument(
            help="CSV, one point a row: positions of the joints (rad), or x,y,z (m) with --tool. A first row may "
            "name the joints."
        ),
    ],
    velocity_limit: Annotated[
        str,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Velocity limit of each motor, or of all (rad/s).",
        ),
    ],
    acceleration_limit: Annotated[
        str,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Acceleration limit of each motor, or of all (rad/s^2).",
        ),
    ],
    torque_limit: Annotated[
        str | None,
        typer.Option(
            metavar="VALUE,...",
            rich_help_panel=LIMITS,
            help="Torque limit of each motor, or of all (Nm).",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="File to write: .csv (with .design.json), .mat or .parquet.")
    ] = Path("motion.parquet"),
    tool: Annotated[
        str | None,
        typer.Option(
            metavar="KIND", help="Move the tool from --start through the points: line or curve."
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLE,...",
            help="With --tool: joint positions at the start (rad). Default: the operating point.",
        ),
    ] = None,
    point: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="With --tool: its point in the last link (m).")
    ] = "0,0,0",
    keep_orientation: Annotated[
        bool, typer.Option("--keep-orientation", help="With --tool: the tool does not turn.")
    ] = False,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    force: Force = False,
) -> None:
    """Plan the fastest motion along a path within limits, and write its velocity references."""
    with errors():
        targets = {f"--out, {path.name}": path for path in reference_files(out)}
        check_targets(targets, inputs=[Path(robot), waypoints], force=force)
        limits = Limits(
            one_or_each("--velocity-limit", velocity_limit),
            one_or_each("--acceleration-limit", acceleration_limit),
            one_or_each("--torque-limit", torque_limit),
        )
        machine = ModelOptions(base, tip, payload).load(robot)
        points = _rows(waypoints, ["x", "y", "z"] if tool else machine.axis_names)
        if tool is None:
            path = joint_path(machine, points)
        else:
            at = machine.operating_point if start is None else numbers("--start", start)
            path = tool_path(
                machine,
                points,
                at,
                kind=tool,
                keep_orientation=keep_orientation,
                point_m=numbers("--point", point),
            )
        motion = plan(machine, path, limits)
        begin = ", ".join(f"{x:.4g}" for x in motion["joint_position_rad"].values[0])
        say(
            f"{motion.attrs['duration_s']:.4g} s from rest to rest, starts at joint positions {begin}; "
            f"takes up to {motion.attrs['largest_share']:.1%} of {motion.attrs['reached']}"
        )
        for written in write_references(motion_references(motion), out):
            say(f"written: {written}")


def _rows(path: Path, names: list[str]) -> list[list[float]]:
    """Return the numbers of a CSV file by row, in the order of ``names``.

    A first row of names may say another order; without it, the columns are in this order.
    """
    try:
        lines = read_text(usable_path(path, InputError)).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a CSV file of numbers: {error}") from None
    cells = [(k, [x.strip() for x in line.split(",")]) for k, line in enumerate(lines, 1)]
    cells = [(k, row) for k, row in cells if any(row)]
    order = list(range(len(names)))
    if cells and not any(map(_is_number, cells[0][1])):
        header = cells.pop(0)[1]
        if sorted(header) != sorted(names):
            raise InputError(
                f"{path}: expected the columns {', '.join(names)}, got {short(', '.join(header))}"
            )
        order = [header.index(name) for name in names]
    rows: list[list[float]] = []
    for k, row in cells:
        if len(row) != len(names) or not all(map(_is_number, row)):
            raise InputError(
                f"{path}: line {k}: expected {len(names)} numbers ({', '.join(names)}), got {short(','.join(row))}"
            )
        rows.append([float(row[i]) for i in order])
    if not rows:
        raise InputError(f"{path}: expected rows of numbers, got none")
    return rows


def _is_number(cell: str) -> bool:
    try:
        return isfinite(float(cell))
    except ValueError:
        return False

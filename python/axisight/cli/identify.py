"""The commands ``axisight identify``."""

from __future__ import annotations

import typer

from axisight.cli.identify_axis import axis_command
from axisight.cli.identify_elastic import elastic_command
from axisight.cli.identify_multiaxis import multiaxis_command
from axisight.cli.identify_rigid import rigid_body_command

identify_app = typer.Typer(
    add_completion=False,
    help="Identify a robot from logs or frequency responses, and write it back as a robot file.",
    no_args_is_help=True,
)
identify_app.command("rigid-body")(rigid_body_command)
identify_app.command("axis")(axis_command)
identify_app.command("elastic")(elastic_command)
identify_app.command("multiaxis")(multiaxis_command)

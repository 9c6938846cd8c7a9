"""Options of the command line for a model file: first and last link of the chain, and a load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.panels import SIMULATOR
from axisight.errors import InputError
from axisight.robot import Robot, load_robot
from axisight.robot_import import import_robot, is_model_file
from axisight.robot_import.drives import DriveData, Payload
from axisight.robot_import.load import drive_data

Base = Annotated[
    str | None,
    typer.Option(
        rich_help_panel=SIMULATOR,
        help="Link of a model file that stands still. Default: the root.",
    ),
]
Tip = Annotated[
    list[str] | None,
    typer.Option(
        rich_help_panel=SIMULATOR,
        help="Last link of a branch of a model file (repeatable); other branches are locked at zero. Default: the "
        "end of the only moving branch.",
    ),
]
Load = Annotated[
    str | None,
    typer.Option(
        "--payload",
        metavar="KG[,X,Y,Z]",
        rich_help_panel=SIMULATOR,
        help="Load on the last link of a model file: mass, and its centre in the frame of that link (m).",
    ),
]


@dataclass(frozen=True)
class ModelOptions:
    """Options ``--base``, ``--tip`` and ``--payload`` as they were given."""

    base: str | None = None
    tip: str | Sequence[str] | None = None
    payload: str | None = None

    @property
    def tips(self) -> tuple[str, ...]:
        """The last links of the branches to take; empty if none was given."""
        return (self.tip,) if isinstance(self.tip, str) else tuple(self.tip or ())

    def given(self) -> list[str]:
        """Return the options that were given."""
        return [f"--{name}" for name, value in vars(self).items() if value not in (None, [], ())]

    def drives(self, source: Path | str, file: Path | None = None) -> DriveData:
        """Return the drive data of a model, from ``file`` or beside the model, updated by the given options.

        Raises InputError for a payload that is not KG or KG,X,Y,Z.
        """
        tip = self.tips[0] if len(self.tips) == 1 else list(self.tips) or None
        said: dict[str, object] = {"base": self.base, "tip": tip}
        if self.payload is not None:
            said["payload"] = _payload(self.payload)
        stated = {name: value for name, value in said.items() if value is not None}
        return drive_data(source, file).model_copy(update=stated)

    def load(self, source: Path | str, *, sample_time_s: float | None = None) -> Robot:
        """Return the robot of a source; raise InputError for options with a source that is no model file."""
        if not self.given():
            return load_robot(source, sample_time_s=sample_time_s)
        if not is_model_file(source):
            raise InputError(
                f"{', '.join(self.given())}: expected a model file (URDF, MJCF, DH table), got {source}; "
                f"a robot file states its chain, and takes loads by --effect 'payload mass_kg=1'"
            )
        return import_robot(source, drives=self.drives(source), sample_time_s=sample_time_s)


AS_IT_IS = ModelOptions()
"""No option was given."""


def _payload(text: str) -> Payload:
    try:
        mass, *com = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--payload: expected KG or KG,X,Y,Z, got {text!r}") from None
    if len(com) not in (0, 3) or not mass > 0:
        raise InputError(f"--payload: expected KG or KG,X,Y,Z with a positive mass, got {text!r}")
    x, y, z = com or (0.0, 0.0, 0.0)
    return Payload(mass=mass, com=(x, y, z))

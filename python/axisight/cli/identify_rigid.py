"""The command ``axisight identify rigid-body``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import numpy as np
import typer
import xarray as xr
from rich.markup import escape
from rich.table import Table

import axisight
from axisight.cli.common import Columns, Force, From, Moving, To, TorqueMeasured, errors, say
from axisight.cli.identify_common import (
    Out,
    Unchecked,
    as_options,
    check_out,
    load_source,
    options,
    pairs,
    provenance,
    read_logs,
    write_robot,
)
from axisight.cli.panels import COMPARED, MODEL, OUTPUT, SEARCH
from axisight.cli.screen import OUT
from axisight.effects.stated import RIGID_BODY_TERMS
from axisight.errors import IdentificationWarning, InputError, RobotError
from axisight.fitting import robot_parameters
from axisight.gap.prepare.used_part import Used

if TYPE_CHECKING:
    from axisight.rigid_body import DriveTerms, LogIdentification
    from axisight.rigid_body.estimate import Method
    from axisight.robot import Robot
    from axisight.robot_file import Provenance

_FRICTION = ("viscous", "coulomb", "offset")
# Effects with the opposite sign: the fit has the torque that an axis needs, the effect adds to the command.
_TURNED = frozenset(effect for effect, _, sign in RIGID_BODY_TERMS.values() if sign < 0)
# Share of the torque that is left where parameters explain next to nothing. Regressions of arms leave 2 to 20 %.
_HARDLY = 0.7
_PARAMETERS = {"estimate": "least squares", "consistent": "bodies that can exist"}


def rigid_body_command(
    ctx: typer.Context,
    robot: Annotated[
        str,
        typer.Argument(
            help="robot.toml or a preset: chain, gears, and values that the motions do not show."
        ),
    ],
    logs: Annotated[list[Path], typer.Argument(help="Motor logs to fit to.")],
    held_out: Annotated[
        list[Path] | None,
        typer.Option(help="Log that is left out of the fit, for the torque errors (repeatable)."),
    ] = None,
    out: Out = None,
    columns: Columns = None,
    cutoff_hz: Annotated[
        float,
        typer.Option(help="Low-pass (Hz): well above the motion, well below the first resonance."),
    ] = 10.0,
    friction: Annotated[
        str,
        typer.Option(
            metavar="TERM,...",
            rich_help_panel=MODEL,
            help="Friction of every motor: some of viscous, coulomb, offset; or none.",
        ),
    ] = "viscous,coulomb,offset",
    rotors: Annotated[
        bool,
        typer.Option(
            "--rotors/--no-rotors",
            rich_help_panel=MODEL,
            help="Estimate motor inertias, or keep those of the file.",
        ),
    ] = True,
    dead_band_rad_s: Annotated[
        float,
        typer.Option(
            rich_help_panel=MODEL, help="Motor speed below which Coulomb friction is zero (rad/s)."
        ),
    ] = 0.0,
    reversal_s: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=COMPARED,
            help="Time around each reversal that is left out, because the low-pass smears Coulomb friction "
            "there (s). Default: two periods of --cutoff-hz.",
        ),
    ] = None,
    torque_measured: TorqueMeasured = False,
    method: Annotated[
        str,
        typer.Option(
            rich_help_panel=SEARCH,
            help="Least squares: ls, wls (axes weighted by their residuals) or tls (total).",
        ),
    ] = "wls",
    known: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            rich_help_panel=MODEL,
            help="Parameter held at a value (repeatable).",
        ),
    ] = None,
    eliminate: Annotated[
        float | None,
        typer.Option(
            rich_help_panel=SEARCH,
            help="Set parameters to zero whose relative standard error is larger than this, e.g. 0.3.",
        ),
    ] = None,
    group: Annotated[
        bool,
        typer.Option(
            "--group",
            rich_help_panel=SEARCH,
            help="Where motions do not separate all parameters, estimate combinations of them.",
        ),
    ] = False,
    consistent: Annotated[
        bool,
        typer.Option(
            "--consistent",
            help="Only bodies that can exist, near those of the robot file. --out most often needs it.",
        ),
    ] = False,
    combinations: Annotated[
        bool,
        typer.Option(
            "--combinations",
            rich_help_panel=OUTPUT,
            help="Print what each base parameter is made of.",
        ),
    ] = False,
    prior_share: Annotated[
        float,
        typer.Option(
            rich_help_panel=SEARCH,
            help="With --consistent: how far bodies may be from those of the file, as a share of the link's size.",
        ),
    ] = 1.0,
    unchecked: Unchecked = False,
    force: Force = False,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
) -> None:
    """Masses, inertias and friction from logs of motor angles and torques, by regression.

    Prints base parameters with standard errors, and torque errors on every log. --out writes a
    robot file. It most often needs --consistent: a plain fit may have bodies that cannot exist.
    The exit status is 1 if such bodies were not found to full accuracy, or if nothing is written.
    """
    with errors(), as_options(ctx):
        check_out(out, [*logs, *(held_out or [])], columns, force=force)
        machine = load_source(robot)
        paths = [*logs, *(held_out or [])]
        used = Used(start_s, stop_s, moving)
        read = read_logs(paths, columns, machine, unchecked=unchecked, used=used)
        held = ({} if rotors else _rotors(machine)) | pairs("--known", known)
        with warnings.catch_warnings():
            # The printed notes contain these warnings already.
            warnings.simplefilter("ignore", IdentificationWarning)
            found = axisight.rigid_body.identify_logs(
                machine,
                read[: len(logs)],
                held_out=read[len(logs) :],
                cutoff_hz=cutoff_hz,
                reversal_s=reversal_s,
                torque_held=not torque_measured,
                terms=_terms(friction, dead_band_rad_s),
                method=cast("Method", method),
                known=held,
                eliminate=eliminate,
                deficient="group" if group else "raise",
                consistent=consistent,
                prior_share=prior_share,
            )
        if combinations:
            say(str(found.estimate.base))
        _show(found)
        unexplained = "" if unchecked else _unexplained(found)
        if unexplained:
            say(f"{'' if out is None else f'not written: {out}: '}{unexplained}")
        if unexplained and out is not None:
            raise typer.Exit(1)
        if out is not None:
            source = provenance("rigid-body", paths, options(ctx), columns)
            _write(found, machine, out, source, force=force)
        if found.consistent is not None and found.consistent.status in ("inaccurate", "failed"):
            raise typer.Exit(1)


def _unexplained(found: LogIdentification) -> str:
    """Return which fitted log the parameters hardly explain, by the rms of its axes' shares; empty without one."""
    last = found.errors.isel(parameters=-1)
    for i in np.flatnonzero(~last["held_out"].values):
        one = last.isel(log=int(i))
        shares = one["relative_error"].values
        moved = shares[np.isfinite(shares)]
        left = float(np.sqrt(np.mean(moved**2))) if moved.size else 0.0
        if left >= _HARDLY:
            return (
                f"the parameters leave {100 * left:.3g} % of the torque of {one['log'].item()}. Look for a wrong sign, "
                "unit or column with `axisight check LOG --robot ROBOT`, or write it all the same by --unchecked"
            )
    return ""


def _write(
    found: LogIdentification, machine: Robot, out: Path, source: Provenance, *, force: bool
) -> None:
    """Write the robot, or print why not if no physically possible bodies were found."""
    if found.consistent is not None and found.consistent.status == "failed":
        say(
            f"not written: {out}: no bodies that can exist fit these logs; try more motions, or values of the "
            "robot file by --known"
        )
        return
    try:
        values = found.identified(source)
        write_robot(machine, out, values, force=force)
        turned = sorted({effect.name for effect in values.effects} & _TURNED)
        if turned:
            say(
                f"{', '.join(turned)}: the fit above is the torque that an axis needs; the effect in the robot file "
                "adds to the command, so that it has the other sign"
            )
    except RobotError as error:
        if found.consistent is not None:
            raise
        raise InputError(f"{error}; --consistent finds bodies that can exist") from None


def _rotors(machine: Robot) -> dict[str, float]:
    """Return the motor inertias to hold; without them, the fit would add them to the links."""
    return {n: v for n, v in robot_parameters(machine).items() if n.endswith(".motor_inertia")}


def _terms(friction: str, dead_band_rad_s: float) -> DriveTerms:
    chosen = [] if friction == "none" else friction.split(",")
    for term in chosen:
        if term not in _FRICTION:
            raise InputError(
                f"--friction: expected some of {', '.join(_FRICTION)}, or none, got {term!r}"
            )
    return axisight.rigid_body.DriveTerms(
        inertia="motor",
        viscous="motor" if "viscous" in chosen else None,
        coulomb="motor" if "coulomb" in chosen else None,
        offset="motor" if "offset" in chosen else None,
        dead_band_rad_s=dead_band_rad_s,
    )


def _show(found: LogIdentification) -> None:
    fitted = found.errors["log"].values[~found.errors["held_out"].values]
    for name, motion in zip(fitted, found.motions, strict=True):
        say(f"{name}: {motion}")
    say(str(found.estimate))
    if found.consistent is not None:
        say(f"bodies that can exist: {found.consistent.status} {found.consistent.advice}".rstrip())
    for which in found.errors["parameters"].values:
        OUT.print(_error_table(found.errors.sel(parameters=which), _PARAMETERS[str(which)]))


def _error_table(of: xr.Dataset, title: str) -> Table:
    table = Table("log", title=f"torque error, {title}")
    for axis in of["axis"].values:
        table.add_column(f"axis {axis}", justify="right")
    for i in range(of.sizes["log"]):
        one = of.isel(log=i)
        name = str(one["log"].item()) + (" (held out)" if one["held_out"].item() else "")
        cells = [
            f"{rms:.3g} Nm, {100 * share:.3g} %"
            for rms, share in zip(one["rms_nm"].values, one["relative_error"].values, strict=True)
        ]
        table.add_row(escape(name), *cells)
    return table

"""Shared parts of all commands: options, printing, writing, and errors as messages with an exit status."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from axisight.cli.panels import ADVANCED, COMPARED, OUTPUT, SIMULATOR
from axisight.cli.screen import BARS, ERR, OUT, is_output
from axisight.cli.stopping import exit_status
from axisight.cli.suggest import suggestion
from axisight.display.bars import terminal_bars
from axisight.errors import AxisightError, InputError, OutputError
from axisight.storage import write_whole

From = Annotated[
    float,
    typer.Option(
        "--from",
        metavar="SECONDS",
        rich_help_panel=COMPARED,
        help="Leave out what comes before in each log.",
    ),
]
To = Annotated[
    float | None,
    typer.Option(
        "--to",
        metavar="SECONDS",
        rich_help_panel=COMPARED,
        help="Leave out what comes after in each log. Default: its end.",
    ),
]
TorqueMeasured = Annotated[
    bool,
    typer.Option(
        "--torque-measured",
        rich_help_panel=COMPARED,
        help="The torque is a measurement, not a command that is held from sample to sample.",
    ),
]
Moving = Annotated[
    bool,
    typer.Option(
        "--moving",
        rich_help_panel=COMPARED,
        help="Use each log from its first to its last motion, with 0.2 s of rest around.",
    ),
]
AtRests = Annotated[
    bool,
    typer.Option(
        "--cut-at-rests",
        rich_help_panel=COMPARED,
        help="Cut each log where all axes rest for more than 0.5 s; each motion becomes a run.",
    ),
]
Columns = Annotated[
    Path | None,
    typer.Option(
        metavar="MAP",
        help="Column map for logs with other columns or units: a TOML file, or a name out of "
        "'axisight columns list'.",
    ),
]


Model = Annotated[
    str | None,
    typer.Option(help="Simulator: robot.toml, URDF, MJCF or a preset. A case brings its own."),
]


Simulated = Annotated[
    list[Path] | None,
    typer.Option(
        rich_help_panel=SIMULATOR,
        help="Log of your own simulator (repeatable): one for each estimation log, then one for each "
        "validation log, with the references or the motion of that log.",
    ),
]


Validation = Annotated[
    list[Path] | None,
    typer.Option(help="Validation log, for the figures only (repeatable). Default: the last log."),
]


CutoffHz = Annotated[
    float | None,
    typer.Option(
        rich_help_panel=COMPARED,
        help="Low-pass on motion and torque in inverse dynamics (Hz). Default: chosen from the data.",
    ),
]


Despite = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FAULT",
        rich_help_panel=COMPARED,
        help="Go on despite a fault of the logs that is refused, by its name: rows_missing (repeatable).",
    ),
]


MaxBytes = Annotated[
    int | None,
    typer.Option(
        rich_help_panel=ADVANCED,
        help="Most memory that reading one log may take (bytes). Default: by the size of its files.",
    ),
]


Force = Annotated[
    bool,
    typer.Option(
        "--force",
        rich_help_panel=OUTPUT,
        help="Replace existing files of any kind. Without it only earlier results are replaced.",
    ),
]


Untrusted = Annotated[
    bool,
    typer.Option(
        "--untrusted",
        rich_help_panel=ADVANCED,
        help="The input comes from somebody else: refuse links and names that leave its folder.",
    ),
]


@contextmanager
def errors(stopped: str = "stopped; nothing was written") -> Iterator[None]:
    """Turn every AxisightError into a message and exit status 2, and Ctrl-C and SIGTERM into ``stopped``."""
    try:
        with warnings.catch_warnings():
            # Warnings of NumPy on intermediate values say nothing about the result, which has findings.
            # `numpy.errstate` would act on this thread only.
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    except AxisightError as error:
        ERR.print(f"[red]error:[/] {escape(str(error))}", highlight=False, soft_wrap=True)
        near = suggestion(str(error))
        if near is not None:
            complain(f"Did you mean {near}?")
        raise typer.Exit(2) from None
    except KeyboardInterrupt as stop:
        complain(stopped)
        raise typer.Exit(exit_status(stop)) from None


def bars() -> AbstractContextManager[Callable[[str, int, int], None]]:
    """Return a context that shows one progress bar per stage of the work."""
    return terminal_bars(BARS)


def say(text: str) -> None:
    """Print a text without markup, because names of files and users may look like markup."""
    OUT.print(text, markup=False, highlight=False, soft_wrap=True)


def complain(text: str) -> None:
    """Print on standard error, without markup, why a command fails, even with ``--quiet``."""
    ERR.print(text, markup=False, highlight=False, soft_wrap=True)


def write_text(path: Path, text: str) -> None:
    """Write a text to a file, or to standard output for ``-``; raise OutputError as `write_whole`."""
    if is_output(path):
        typer.echo(text, nl=False)
    else:
        write_whole(path, text)


def write_each(writes: Sequence[Callable[[], object]]) -> None:
    """Write every output even if others fail; then raise OutputError for those that failed."""
    failed = []
    for write in writes:
        try:
            write()
        except (AxisightError, OSError) as error:
            failed.append(str(error))
    if failed:
        raise OutputError("; ".join(failed))


def numbers(option: str, text: str) -> list[float]:
    """Return the comma-separated numbers in a text; raise InputError naming the option."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option}: expected numbers separated by commas, got {text!r}") from None


def one_or_each(option: str, text: str | None) -> float | list[float] | None:
    """Return one number for all axes, or a list with one each, from ``VALUE,...``; None for None.

    Raises InputError naming the option.
    """
    found = None if text is None else numbers(option, text)
    return found[0] if found is not None and len(found) == 1 else found

"""The command line ``axisight``, whose commands load when they are called."""

from __future__ import annotations

import gc
import inspect
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer
from typer.core import TyperGroup

from axisight.cli.screen import OUT
from axisight.cli.stopping import exit_status

# Command -> (module and attribute, group in `axisight --help`, first line of its help). The line stands here,
# because otherwise `axisight --help` would have to load all commands with all their libraries.
_COMMANDS = {
    "diagnose": (
        "diagnose:diagnose_command",
        "Diagnose",
        "Find why the simulator differs from the logs: which causes, of what size, how sure.",
    ),
    "demo": (
        "demo:demo_command",
        "Diagnose",
        "Make a small case, a simulated machine with an effect that its simulator lacks, and diagnose it.",
    ),
    "randomize": (
        "randomize:randomize_command",
        "Diagnose",
        "Turn the posterior of a diagnosis into ranges and joint draws for training.",
    ),
    "check": (
        "check:check_command",
        "Diagnose",
        "Check a log: rate, gaps, NaN, saturation, quantization, units, constant channels.",
    ),
    "repeat": (
        "repeat:repeat_command",
        "Diagnose",
        "Compare runs of one motion over days: which parameter moved, and what is chance.",
    ),
    "explore": (
        "explore:explore_command",
        "Diagnose",
        "Look at logs beside the simulator on a local page, and try causes by hand.",
    ),
    "identify": (
        "identify:identify_app",
        "Identify",
        "Identify a robot from logs or frequency responses, and write it back as a robot file.",
    ),
    "frf": (
        "frf.command:frf_command",
        "Identify",
        "Estimate the frequency response of a robot from the logs of one operating point.",
    ),
    "excite": (
        "excite:excite_command",
        "Identify",
        "Make references for a robot, check them against its limits in simulation, and write them.",
    ),
    "plan": (
        "plan:plan_command",
        "Simulate",
        "Plan the fastest motion along a path within limits, and write its velocity references.",
    ),
    "simulate": (
        "simulate:simulate_command",
        "Simulate",
        "Simulate a robot along the references or torques of a log and write the result as a log.",
    ),
    "montecarlo": (
        "montecarlo:montecarlo_command",
        "Simulate",
        "Run a Monte Carlo study; the same study and seed give the same bits, however it is run.",
    ),
    "columns": (
        "columns:columns_app",
        "Files",
        "List, show and guess column maps: where a log keeps its signals, in which unit.",
    ),
    "robot": (
        "robot_files:robot_app",
        "Files",
        "Make robot files of URDF, MJCF and tables of Denavit and Hartenberg.",
    ),
    "effects": (
        "about:effects_command",
        "Reference",
        "List the effects that can be simulated, fitted and named as causes.",
    ),
    "schema": (
        "about:schema_command",
        "Reference",
        "Print the JSON Schema of the verdict that `diagnose --json` writes.",
    ),
    "completion": (
        "completion:completion_command",
        "Reference",
        "Print the script by which bash, zsh or fish complete commands and options.",
    ),
    "mcp": (
        "assistants.command:mcp_command",
        "Assistants",
        "Serve check, columns, diagnosis and next experiment to an assistant, for the files of one folder.",
    ),
    "blind": (
        "blind:blind_app",
        "Benchmarks",
        "The withheld-effect benchmark: cases of other engines, diagnoses, a score.",
    ),
    "reproduce": (
        "reproduce:reproduce_command",
        "Benchmarks",
        "Reproduce the tables and figures of Wernholt's thesis on the preset robot.",
    ),
}


# Commands with many threads and small matrices, in which the threads of the linear algebra would only spin.
_THREADED = ("blind", "demo", "diagnose", "explore", "mcp")

# Commands that only print, so that --quiet would be pointless.
_ONLY_PRINT = ("schema", "effects", "completion", "list", "show")

# The suggestion of click if several commands resemble an unknown one.
_FURTHER = re.compile(r"(Did you mean '[^']*')(?:, '[^']*')+\?")

_NEXT_STEPS = """\
Axisight finds why a robot's simulator differs from measured logs.

  axisight demo                       make a small case and diagnose it
  axisight check LOG --robot MODEL    check that a log and a robot fit together
  axisight diagnose LOG LOG --model MODEL --report report.html
                                      diagnose your own logs; MODEL: URDF, MJCF or robot.toml

axisight --help lists all commands."""


def load_command(name: str) -> Any:
    """Return the click command of a name, importing its module."""
    if name in _THREADED:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    module, attribute = _COMMANDS[name][0].split(":")
    # Imported objects stay alive, so the garbage collector need not scan them, now or later.
    gc.disable()
    found = getattr(import_module(f"axisight.cli.{module}"), attribute)
    gc.freeze()
    gc.enable()
    if not isinstance(found, typer.Typer):
        alone = typer.Typer(add_completion=False)
        alone.command(name)(found)
        found = alone
    command = typer.main.get_command(found)
    _add_quiet(command, name)
    _name_values(command)
    return command


# Placeholder for the value of an option in the help, by type.
_VALUES = {int: "N", float: "X", str: "TEXT", Path: "PATH"}


def _name_values(command: Any) -> None:
    """Set the placeholders of options in the help: PATH, N, X or TEXT, and none for a switch."""
    for part in getattr(command, "commands", {}).values():
        _name_values(part)
    if command.callback is None:
        return
    hints = get_type_hints(inspect.unwrap(command.callback))
    for option in command.params:
        kind = hints.get(option.name)
        held = {kind, *get_args(kind)}
        held |= {inner for part in held for inner in get_args(part)}
        named = [word for one, word in _VALUES.items() if one in held]
        if option.metavar is None and option.param_type_name == "option":
            option.metavar = " " if kind is bool else next(iter(named), None)


def _add_quiet(command: Any, name: str) -> None:
    """Add the option ``--quiet`` to a command, or to all of a group, except those that only print."""
    for own, part in getattr(command, "commands", {}).items():
        _add_quiet(part, own)
    if not hasattr(command, "commands") and name not in _ONLY_PRINT:
        command.params.append(_quiet_option())


def _quiet_option() -> Any:
    """Return the click option ``--quiet``, via a dummy command, as typer makes options for functions only."""
    made = typer.Typer(add_completion=False)

    @made.command()
    def _(
        _quiet: Annotated[
            bool,
            typer.Option(
                "--quiet",
                "-q",
                callback=_be_quiet,
                expose_value=False,
                metavar=" ",
                help="Print errors only; files are written as asked.",
            ),
        ] = False,
    ) -> None: ...

    return typer.main.get_command(made).params[0]


def _be_quiet(wanted: bool) -> None:
    if wanted:
        OUT.be_quiet()


@contextmanager
def _one_suggestion() -> Iterator[None]:
    """Reduce the suggestions of click for an unknown option or command to the nearest one."""
    try:
        yield
    except Exception as error:
        said = vars(error)
        if said.get("possibilities"):
            said["possibilities"] = said["possibilities"][:1]
        if "message" in said:
            said["message"] = _FURTHER.sub(r"\1?", str(said["message"]))
        raise


class _LoadedWhenCalled(TyperGroup):
    """A group whose commands load when they are called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        return name, command if name is None else load_command(name), rest

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        OUT.begin()
        with _one_suggestion():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            with _one_suggestion():
                return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            # Stopped while a command was loading, before its own handler was in place.
            raise typer.Exit(exit_status(stop)) from None


app = typer.Typer(
    cls=_LoadedWhenCalled,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for _name, (_, _group, _help) in _COMMANDS.items():
    app.command(_name, help=_help, rich_help_panel=_group)(lambda: None)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(import_module("axisight._core").__version__)
        raise typer.Exit


@app.callback()
def _options(
    ctx: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            metavar=" ",
            help="Show the version.",
        ),
    ] = False,
    quiet: Annotated[
        bool,
        typer.Option(
            "--quiet",
            "-q",
            metavar=" ",
            help="Print errors only; also after the name of a command.",
        ),
    ] = False,
) -> None:
    """Find why a robot's simulator differs from measured logs, and correct it.

    `axisight demo` shows a diagnosis; `axisight diagnose CASE` does yours.
    """
    # A command that only prints would print nothing.
    _be_quiet(quiet and ctx.invoked_subcommand not in _ONLY_PRINT)
    if ctx.invoked_subcommand is None:
        typer.echo(_NEXT_STEPS)

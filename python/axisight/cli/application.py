"""The command line ``axisight``: its commands, each loaded when it is called."""

from __future__ import annotations

import gc
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from axisight.cli.screen import OUT
from axisight.cli.stopping import exit_status

# Commands, where each lives, and the first line of its help: without it the list of commands would
# have to load them all, with the libraries of all.
_COMMANDS = {
    "excite": (
        "excite:excite_command",
        "Make references for a robot, check them against its limits in simulation, and write them.",
    ),
    "identify": (
        "identify:identify_app",
        "Identify a robot from logs or frequency responses, and write it back as a robot file.",
    ),
    "blind": (
        "blind:blind_app",
        "The withheld-effect benchmark: cases of other engines, diagnoses, a score.",
    ),
    "montecarlo": (
        "montecarlo:montecarlo_command",
        "Run a Monte Carlo study; the same study and seed give the same bits, however it is run.",
    ),
    "reproduce": (
        "reproduce:reproduce_command",
        "Reproduce the tables and figures of Wernholt's thesis on the preset robot.",
    ),
    "robot": (
        "robot_files:robot_app",
        "Make robot files of URDF, MJCF and tables of Denavit and Hartenberg.",
    ),
    "simulate": (
        "simulate:simulate_command",
        "Simulate a robot along the references or torques of a log and write the result as a log.",
    ),
    "diagnose": (
        "diagnose:diagnose_command",
        "Say where a simulator disagrees with measured logs, which effect causes it, and how far it "
        "shrinks.",
    ),
    "explore": (
        "explore:explore_command",
        "Look at logs beside the simulator on a local page, and try causes by hand.",
    ),
    "check": (
        "check:check_command",
        "Report rate, gaps, NaN, saturation, quantization, suspicious units and constant channels.",
    ),
    "columns": (
        "columns:columns_app",
        "List, show and guess column maps: where a log keeps its signals, in which unit.",
    ),
    "schema": (
        "about:schema_command",
        "Print the JSON Schema of the verdict that `diagnose --json` writes.",
    ),
    "effects": (
        "about:effects_command",
        "List the effects that can be simulated, fitted and named as causes.",
    ),
    "demo": (
        "demo:demo_command",
        "Make a small case (a simulated machine with a withheld effect) and diagnose it.",
    ),
    "completion": (
        "completion:completion_command",
        "Print the script by which bash, zsh or fish complete commands and options.",
    ),
}


# Their matrices are small and their threads many: those of the linear algebra would spin beside them.
_THREADED = ("blind", "demo", "diagnose", "explore")

# All that these do is print.
_ONLY_PRINT = ("schema", "effects", "completion", "list", "show")

# What click says of several commands with names like the one that is not there.
_FURTHER = re.compile(r"(Did you mean '[^']*')(?:, '[^']*')+\?")

_NEXT_STEPS = """\
Axisight says where a robot's simulator and its logs disagree, and which effect causes it.

  axisight demo                       diagnose a small case that it makes
  axisight check LOG --robot MODEL    see whether a log and a robot go together
  axisight diagnose LOG LOG --model MODEL --report report.html
                                      diagnose your own; MODEL: URDF, MJCF or robot.toml

axisight --help lists all commands."""


def load_command(name: str) -> Any:
    """Return the command of a name as click knows it."""
    if name in _THREADED:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    module, attribute = _COMMANDS[name][0].split(":")
    # What is imported stays: it need not be looked through for what can go, now or later.
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
    return command


def _add_quiet(command: Any, name: str) -> None:
    """Give a command, or all of a group, the option ``--quiet`` where more is done than printed."""
    for own, part in getattr(command, "commands", {}).items():
        _add_quiet(part, own)
    if not hasattr(command, "commands") and name not in _ONLY_PRINT:
        command.params.append(_quiet_option())


def _quiet_option() -> Any:
    """Return ``--quiet`` as click knows it: typer makes options for functions only."""
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
    """Of the options or commands that resemble one that is not there, suggest the nearest alone."""
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
    """A group whose commands are only names until one is called."""

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
            # While a command was loaded, where none of its own handlers is yet at work.
            raise typer.Exit(exit_status(stop)) from None


app = typer.Typer(
    cls=_LoadedWhenCalled,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for _name, (_, _help) in _COMMANDS.items():
    app.command(_name, help=_help)(lambda: None)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(import_module("axisight._core").__version__)
        raise typer.Exit


@app.callback()
def _options(
    ctx: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
    quiet: Annotated[
        bool,
        typer.Option("--quiet", "-q", help="Print errors only, as after the name of a command."),
    ] = False,
) -> None:
    """Identify industrial robots, simulate them, and explain the sim-to-real gap."""
    # Of what only prints there would be nothing.
    _be_quiet(quiet and ctx.invoked_subcommand not in _ONLY_PRINT)
    if ctx.invoked_subcommand is None:
        typer.echo(_NEXT_STEPS)

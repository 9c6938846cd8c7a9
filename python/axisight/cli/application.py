"""The command line ``axisight``: its commands, each loaded when it is called."""

from __future__ import annotations

import gc
import os
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

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
}


# Their matrices are small and their threads many: those of the linear algebra would spin beside them.
_THREADED = ("blind", "demo", "diagnose")


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
    return typer.main.get_command(found)


class _LoadedWhenCalled(TyperGroup):
    """A group whose commands are only names until one is called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        return name, command if name is None else load_command(name), rest

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            # While a command was loaded, where none of its own handlers is yet at work.
            raise typer.Exit(exit_status(stop)) from None


app = typer.Typer(
    cls=_LoadedWhenCalled,
    no_args_is_help=True,
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
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Identify industrial robots, simulate them, and explain the sim-to-real gap."""

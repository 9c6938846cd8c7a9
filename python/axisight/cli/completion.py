"""The command ``axisight completion``, and the answers to the scripts that it prints."""

from __future__ import annotations

from enum import StrEnum
from importlib import import_module
from typing import Annotated, Any

import typer


class Shell(StrEnum):
    """Shells with completion."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion_command(
    shell: Annotated[Shell, typer.Argument(help="The shell that is to complete.")],
) -> None:
    """Print the script by which bash, zsh or fish complete commands and options.

    bash, in ~/.bashrc: eval "$(axisight completion bash)"

    zsh, in ~/.zshrc after compinit: eval "$(axisight completion zsh)"

    fish: axisight completion fish > ~/.config/fish/completions/axisight.fish
    """
    script = _typer().get_completion_script(
        prog_name="axisight", complete_var="_AXISIGHT_COMPLETE", shell=shell.value
    )
    typer.echo(script)


def prepare() -> None:
    """Make the command line answer the requests of the completion scripts."""
    _typer().completion_init()


def _typer() -> Any:
    # Not typer's `add_completion`, whose options guess the shell and write into its start files.
    return import_module("typer.completion")

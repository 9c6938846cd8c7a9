"""The command line ``axisight``."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from axisight.cli import stopping

__all__ = ["app", "main"]

COMPLETE = "_AXISIGHT_COMPLETE"
"""Environment variable that the scripts of ``axisight completion`` set to ask for completions."""


def main() -> None:
    """Run the command line; Ctrl-C and SIGTERM end it without a traceback at any point."""
    try:
        stopping.listen()
        # Inside `try`, because a short command spends half of its time on imports.
        application = import_module("axisight.cli.application")
        if COMPLETE in os.environ:
            import_module("axisight.cli.completion").prepare()
        application.app(prog_name="axisight")
    except BaseException:
        # BaseException, because libraries turn KeyboardInterrupt into errors and exits of their own.
        status = stopping.asked()
        if status is None:
            raise
        sys.exit(status)


def __getattr__(name: str) -> Any:
    if name == "app":
        return import_module("axisight.cli.application").app
    raise AttributeError(f"module 'axisight.cli' has no attribute {name!r}")

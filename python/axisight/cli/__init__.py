"""The command line ``axisight``."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from axisight.cli import stopping

__all__ = ["app", "main"]

COMPLETE = "_AXISIGHT_COMPLETE"
"""Set by the scripts of ``axisight completion`` where they ask for what may come next."""


def main() -> None:
    """Run the command line; asked to stop, it ends without a traceback wherever it is."""
    try:
        stopping.listen()
        # In here, for half of the time of a short command is that of its imports.
        application = import_module("axisight.cli.application")
        if COMPLETE in os.environ:
            import_module("axisight.cli.completion").prepare()
        application.app(prog_name="axisight")
    except BaseException:
        # Of any kind: libraries turn what stops them into errors and exits of their own.
        status = stopping.asked()
        if status is None:
            raise
        sys.exit(status)


def __getattr__(name: str) -> Any:
    if name == "app":
        return import_module("axisight.cli.application").app
    raise AttributeError(f"module 'axisight.cli' has no attribute {name!r}")

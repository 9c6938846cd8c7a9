"""The command line ``axisight``."""

from axisight.cli.application import app, main

__all__ = ["app", "main"]

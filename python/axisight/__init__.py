"""Axisight: identify industrial robots, simulate them, and explain the sim-to-real gap."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import lazy_loader

# `__init__.pyi` lists the public names; they load on first use, as some import slowly.
_loaded, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("axisight._core").__version__
    if name == "reproduce":  # a separate distribution, see thesis/
        return import_module("axisight_thesis")
    return _loaded(name)

"""Axisight: identify industrial robots, simulate them, and explain the sim-to-real gap."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import lazy_loader

# What there is stands in `__init__.pyi`; some of it has slow imports of its own.
_loaded, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("axisight._core").__version__
    if name == "reproduce":  # an installation of its own, see thesis/
        return import_module("axisight_thesis")
    return _loaded(name)

"""A diagnosis in words, figures and one page.

`render_report` and `save_report` import jinja2 when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from axisight.report.page import render_report, save_report

__all__ = ["render_report", "save_report"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        return getattr(import_module("axisight.report.page"), name)
    raise AttributeError(f"module 'axisight.report' has no attribute {name!r}")

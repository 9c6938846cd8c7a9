"""A local page to look at logs beside a simulator, and to try causes by hand."""

from axisight.explore.session import Session

__all__ = ["Session"]

"""A local web page that shows logs beside a simulator and lets a user try causes by hand."""

from axisight.explore.session import Session

__all__ = ["Session"]

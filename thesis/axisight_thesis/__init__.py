"""Wernholt (2004), chapters 3, 5 and 7 to 9 and appendix A, on a preset robot and stand-ins.

The thesis is "On Multivariable and Nonlinear Identification of Industrial Robots".
Every table and figure is an item: a function from a :class:`Context` to an :class:`Item`,
registered by name (``"table-8.2"``, ``"figure-8.9"``). :func:`run` computes items. It writes tables
as CSV, figures as PDF and PNG, and a computed verdict with evidence for each claim of the text.
"""

from axisight_thesis.claims_file import read_claims, record_claims
from axisight_thesis.context import Context, context
from axisight_thesis.item import Claim, Item, item, item_names, registered
from axisight_thesis.write import run, write_item

__all__ = [
    "Claim",
    "Context",
    "Item",
    "context",
    "item",
    "item_names",
    "read_claims",
    "record_claims",
    "registered",
    "run",
    "write_item",
]

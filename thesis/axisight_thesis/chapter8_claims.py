"""The claims of chapter 8, section by section."""

from __future__ import annotations

from axisight_thesis import (
    chapter8_claims_averages,
    chapter8_claims_conclusions,
    chapter8_claims_designs,
    chapter8_claims_sinusoid,
)
from axisight_thesis.context import Context
from axisight_thesis.item import Item, item

_SECTIONS = (
    chapter8_claims_designs.CLAIMS,
    chapter8_claims_sinusoid.CLAIMS,
    chapter8_claims_averages.CLAIMS,
    chapter8_claims_conclusions.CLAIMS,
)


@item("claims-8")
def claims_8(context: Context) -> Item:
    """Return the claims of chapter 8."""
    claims = tuple(claim for section in _SECTIONS for claim in section.computed(context))
    return Item("claims-8", "Claims of chapter 8", claims=claims)

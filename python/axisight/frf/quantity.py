"""The output of a frequency response: a position, a velocity or an acceleration."""

from __future__ import annotations

import xarray as xr

from axisight.arguments import one_of
from axisight.errors import InputError
from axisight.frf._lines import ORDER, RATES, Quantity

__all__ = ["ORDER", "RATES", "Quantity", "quantity_of"]

_OUTPUTS: dict[str, Quantity] = {
    unit + rate: quantity for unit in ("rad", "m") for quantity, rate in RATES.items()
}


def quantity_of(response: xr.Dataset, quantity: str | None = None) -> Quantity:
    """Return the quantity of the output of ``response``: position, velocity or acceleration.

    response
        Dataset of `axisight.frf.frequency_response`.
    quantity
        The quantity, if the caller knows it; it has priority.

    Otherwise the unit of the response decides, ``rad``, ``rad/s`` or ``rad/s^2`` (or m) over the unit
    of the input, or else the attribute ``quantity`` of the Dataset. Raises InputError if neither
    decides, if both contradict each other, and for another ``quantity``.
    """
    if quantity is not None:
        return _known("quantity", quantity)
    unit = response["response"].attrs.get("units")
    by_unit = _OUTPUTS.get(str(unit).rpartition("/")[0])
    stated = response.attrs.get("quantity")
    by_name = None if stated is None else _known("response: attribute quantity", stated)
    found = by_unit or by_name
    if found is None:
        raise InputError(
            "quantity: expected position, velocity or acceleration, for the response does not say "
            "what its output is: it has no attribute quantity, and its units are "
            f"{unit!r} where {', '.join(_OUTPUTS)} over the unit of the input would tell"
        )
    if by_name not in (None, found):
        raise InputError(
            f"response: expected units and attribute quantity that agree, got {unit!r} and "
            f"{stated!r}; say with quantity= which is right"
        )
    return found


def _known(field: str, value: object) -> Quantity:
    name = one_of(field, value, ORDER)
    return next(q for q in RATES if q == name)
